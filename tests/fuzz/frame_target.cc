// What a worker may write into its mailbox and its response segment, read as the kernel reads it. The bytes are: method,
// header, columns, response.
#include <algorithm>
#include <array>
#include <cstring>
#include <vector>

#include "plugin_sdk/channel/mailbox.h"
#include "plugin_sdk/channel/reply_frame.h"
#include "schemas/stage_frames.h"
#include "tests/fuzz/fuzz_target.h"

namespace gravitas::fuzz {
namespace {

constexpr std::uint64_t kRoomElements = 24;

// Takes the next bytes as a value; zeros where there are none.
template <typename T>
T take(std::span<const std::byte>* bytes) {
  T value{};
  const std::size_t size = std::min(sizeof value, bytes->size());
  std::memcpy(&value, bytes->data(), size);
  *bytes = bytes->subspan(size);
  return value;
}

}  // namespace

void frame(std::span<const std::byte> bytes) {
  const stage::MethodInfo& method = stage::kMethods[take<std::uint8_t>(&bytes) % stage::kMethodCount];
  const bool is_signed = take<std::uint8_t>(&bytes) % 2 == 0;
  auto header = take<gravitas_frame_header>(&bytes);
  std::array<gravitas_frame_column, GRAVITAS_MAX_COLUMNS> columns{};
  std::array<channel::Room, GRAVITAS_MAX_COLUMNS> rooms{};
  std::vector<std::vector<std::byte>> targets;
  std::array<std::byte*, GRAVITAS_MAX_COLUMNS> pointers{};
  std::uint64_t offset = 0;
  for (std::size_t i = 0; i < method.reply.size(); ++i) {
    rooms[i] = {offset, kRoomElements};
    offset += kRoomElements * 8;
    // mostly right: else hardly any frame gets beyond the first check
    columns[i] = {rooms[i].offset, take<std::uint8_t>(&bytes), kRoomElements};
    if (columns[i].count == 0xFF) columns[i] = take<gravitas_frame_column>(&bytes);
    targets.emplace_back(kRoomElements * stage::element_size(method.reply[i].type));
    pointers[i] = targets.back().data();
  }
  std::vector<std::byte> response(offset);
  std::copy_n(bytes.begin(), std::min(bytes.size(), response.size()), response.begin());
  if (is_signed) {
    header.column_count = static_cast<std::uint32_t>(method.reply.size());
    std::array<const void*, GRAVITAS_MAX_COLUMNS> data{};
    bool fits = true;
    for (std::size_t i = 0; i < method.reply.size(); ++i) {
      data[i] = response.data() + rooms[i].offset;
      fits = fits && columns[i].count <= kRoomElements;
    }
    if (fits)
      header.digest = channel::frame_digest(header, std::span(columns).first(method.reply.size()), method.reply,
                                            header.status == GRAVITAS_OK ? data.data() : nullptr);
  }
  const std::string problem = channel::read_reply_frame(header, columns, method.reply, rooms, response.data(),
                                                        std::span(pointers).first(method.reply.size()));
  if (!problem.empty() || header.status != GRAVITAS_OK) return;
  for (std::size_t i = 0; i < method.reply.size(); ++i) {
    require(columns[i].count <= kRoomElements, "a frame that is accepted fits its rooms");
    require(std::memcmp(pointers[i], response.data() + rooms[i].offset,
                        columns[i].count * stage::element_size(method.reply[i].type)) == 0,
            "what is copied is what was answered");
  }
}

}  // namespace gravitas::fuzz
