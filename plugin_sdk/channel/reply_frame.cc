#include "plugin_sdk/channel/reply_frame.h"

#include <array>
#include <cstring>

#include "plugin_sdk/answer_checks.h"
#include "plugin_sdk/channel/mailbox.h"

namespace gravitas::channel {

std::string read_reply_frame(const gravitas_frame_header& header, std::span<const gravitas_frame_column> columns,
                             std::span<const stage::ColumnInfo> infos, std::span<const Room> rooms,
                             const std::byte* response, std::span<std::byte* const> targets, bool check_digest) {
  if (header.column_count != infos.size()) return "the wrong number of columns";
  const bool complete = header.status == GRAVITAS_OK;
  std::array<const void*, GRAVITAS_MAX_COLUMNS> data{};
  for (std::size_t i = 0; i < infos.size(); ++i) {
    if (columns[i].offset != rooms[i].offset || columns[i].capacity != rooms[i].capacity)
      return std::string("column ") + infos[i].name + " lies outside its room";
    if (!complete) continue;
    if (columns[i].count > rooms[i].capacity) return too_long(infos[i], columns[i].count, rooms[i].capacity);
    std::memcpy(targets[i], response + rooms[i].offset, columns[i].count * stage::element_size(infos[i].type));
    data[i] = targets[i];
  }
  if (check_digest &&
      frame_digest(header, columns.first(infos.size()), infos, complete ? data.data() : nullptr) != header.digest)
    return "a digest that does not fit its content";
  return {};
}

}  // namespace gravitas::channel
