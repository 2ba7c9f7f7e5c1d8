// Stage messages as they come on a gRPC stream. The first byte chooses the method and the direction. What is accepted
// must come out the same when it is written and read again.
#include <array>
#include <vector>

#include "gravitas/stage/v1/call.pb.h"
#include "schemas/stage_frames.h"
#include "schemas/wire/columns.h"
#include "tests/fuzz/fuzz_target.h"

namespace gravitas::fuzz {
namespace {

using Elements = std::vector<std::vector<std::byte>>;

Elements elements_of(const wire::ColumnsReader& reader, std::span<const stage::ColumnInfo> infos) {
  Elements all;
  for (std::size_t i = 0; i < infos.size(); ++i) {
    all.emplace_back(reader.count(i) * stage::element_size(infos[i].type));
    reader.copy(i, all.back().data());
  }
  return all;
}

}  // namespace

void columns(std::span<const std::byte> bytes) {
  if (bytes.empty()) return;
  const auto choice = static_cast<std::uint32_t>(bytes[0]);
  const stage::MethodInfo& method = stage::kMethods[choice / 2 % stage::kMethodCount];
  const std::span<const stage::ColumnInfo> infos = choice % 2 == 0 ? method.request : method.reply;
  wire::ColumnsReader reader(infos);
  if (!reader.parse(bytes.subspan(1)).empty()) return;

  const auto message = [](const wire::ColumnsReader::Submessage& part, google::protobuf::MessageLite&& into) {
    if (part.has) static_cast<void>(into.ParseFromArray(part.bytes.data(), static_cast<int>(part.bytes.size())));
  };
  message(reader.header(), stage::v1::Call());
  message(reader.header(), stage::v1::Outcome());
  message(reader.asset(), stage::v1::AssetChunk());
  const Elements first = elements_of(reader, infos);

  std::array<gravitas_column, GRAVITAS_MAX_COLUMNS> columns{};
  for (std::size_t i = 0; i < infos.size(); ++i) columns[i] = {first[i].data(), reader.count(i)};
  const std::span<const gravitas_column> all = std::span(columns).first(infos.size());
  std::vector<std::uint8_t> written(wire::columns_size(infos, all));
  require(wire::write_columns(infos, all, written.data()) == written.data() + written.size(), "the size is right");
  wire::ColumnsReader again(infos);
  require(again.parse(std::as_bytes(std::span(written))).empty(), "what was written can be read");
  require(elements_of(again, infos) == first, "what was read can be written");
}

}  // namespace gravitas::fuzz
