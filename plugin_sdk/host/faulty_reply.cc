#include "plugin_sdk/host/faulty_reply.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstring>
#include <limits>
#include <string_view>

#include "plugin_sdk/counted.h"

namespace gravitas::host {
namespace {

using stage::ColumnInfo;
using stage::ElementType;

constexpr std::size_t kNoColumn = ~std::size_t{0};

std::uint64_t rows_of(const ColumnInfo& info, const gravitas_reply_column& column) {
  return column.count / info.components;
}

std::byte* row_at(const ColumnInfo& info, const gravitas_reply_column& column, std::uint64_t row) {
  return static_cast<std::byte*>(column.data) + row * info.components * stage::element_size(info.type);
}

// The column that the order names, or the first that is `usable`.
template <typename Usable>
std::size_t choose_column(const FaultOrder& order, std::span<const ColumnInfo> infos, Usable&& usable) {
  const std::string_view name = order.word("column");
  for (std::size_t i = 0; i < infos.size(); ++i)
    if (name.empty() ? usable(i) : name == infos[i].name) return i;
  return kNoColumn;
}

std::string no_such_column(const FaultOrder& order, const stage::MethodInfo& method, const char* wanted) {
  const std::string_view name = order.word("column");
  if (name.empty()) return std::string("the reply of ") + method.name + " has no column " + wanted;
  std::string text = std::string("the reply of ") + method.name + " has no column '" + std::string(name) + "'; it has ";
  for (std::size_t i = 0; i < method.reply.size(); ++i) text += (i > 0 ? ", " : "") + std::string(method.reply[i].name);
  return text;
}

double changed(const FaultOrder& order, double number) {
  switch (order.fault()) {
    case InjectedFault::kNan:
      return std::numeric_limits<double>::quiet_NaN();
    case InjectedFault::kInf:
      return std::numeric_limits<double>::infinity();
    case InjectedFault::kDenormal:
      return std::copysign(std::numeric_limits<double>::min() / 1024.0, number);
    case InjectedFault::kSign:
      return -number;
    case InjectedFault::kScale:
      return order.number("factor") * number;
    case InjectedFault::kUlp:
      return std::bit_cast<double>(std::bit_cast<std::uint64_t>(number) + 1);
    default:
      return 0.0;
  }
}

std::string change_numbers(const FaultOrder& order, const stage::MethodInfo& method, gravitas_reply_column* reply) {
  const std::size_t index = choose_column(order, method.reply, [&](std::size_t i) {
    return method.reply[i].type == ElementType::kF64 && reply[i].count > 0;
  });
  if (index == kNoColumn) return no_such_column(order, method, "of f64 with elements");
  const ColumnInfo& info = method.reply[index];
  const std::string name = std::string("column ") + info.name;
  if (info.type != ElementType::kF64) return name + " has whole numbers, not f64";
  const std::uint64_t rows = rows_of(info, reply[index]);
  const bool all = order.word("all") == "1";
  const std::uint64_t first = all ? 0 : order.gives("row") ? static_cast<std::uint64_t>(order.number("row")) : rows / 2;
  if (first >= rows) return name + " has " + counted(rows, "row") + ", and none with number " + std::to_string(first);
  const std::uint64_t end = all ? rows : first + 1;
  double* numbers = static_cast<double*>(reply[index].data);
  for (std::uint64_t i = first * info.components; i < end * info.components; ++i)
    numbers[i] = changed(order, numbers[i]);
  return {};
}

void reverse_rows(const ColumnInfo& info, const gravitas_reply_column& column) {
  const std::size_t size = info.components * stage::element_size(info.type);
  for (std::uint64_t low = 0, high = rows_of(info, column); low + 1 < high; ++low)
    std::swap_ranges(row_at(info, column, low), row_at(info, column, low) + size, row_at(info, column, --high));
}

// Another row like the last, or of zeros where there is none.
void append_row(const ColumnInfo& info, gravitas_reply_column* column) {
  const std::uint64_t rows = rows_of(info, *column);
  const std::size_t size = info.components * stage::element_size(info.type);
  column->count += info.components;
  if (column->count > column->capacity) return;
  std::byte* added = row_at(info, *column, rows);
  if (rows == 0) {
    std::memset(added, 0, size);
  } else {
    std::memcpy(added, row_at(info, *column, rows - 1), size);
  }
}

std::uint64_t body_count(const stage::MethodInfo& method, const gravitas_column* request) {
  for (std::size_t i = 0; i < method.request.size(); ++i)
    if (std::string_view(method.request[i].rows) == "body") return request[i].count / method.request[i].components;
  return 0;
}

// The last row of a column of ids becomes another: a pair that of the first and the last body, a single id the next.
void change_id(const ColumnInfo& info, const gravitas_reply_column& column, std::uint64_t bodies) {
  if (column.count > column.capacity) return;
  std::byte* row = row_at(info, column, rows_of(info, column) - 1);
  std::uint32_t ids[2] = {};
  std::memcpy(ids, row, info.components * sizeof ids[0]);
  ++ids[0];
  if (info.components == 2) {
    ids[0] = 0;
    ids[1] = static_cast<std::uint32_t>(bodies) - 1;
  }
  std::memcpy(row, ids, info.components * sizeof ids[0]);
}

// Which column of those with this row word has ids: one of features before one of rows.
std::size_t id_column(std::span<const ColumnInfo> infos, std::uint8_t word) {
  std::size_t found = kNoColumn;
  for (std::size_t i = 0; i < infos.size(); ++i) {
    const std::string_view unit = infos[i].unit;
    if (infos[i].rows_index != word || infos[i].type != ElementType::kU32 || infos[i].components > 2) continue;
    if (unit == "id" || (unit == "index" && found == kNoColumn)) found = i;
  }
  return found;
}

std::string change_rows(const FaultOrder& order, const stage::MethodInfo& method, const gravitas_column* request,
                        gravitas_reply_column* reply) {
  const std::span<const ColumnInfo> infos = method.reply;
  const std::uint64_t needed = order.fault() == InjectedFault::kPhantom   ? 0
                               : order.fault() == InjectedFault::kPermute ? 2
                                                                          : 1;
  const std::size_t chosen = choose_column(order, infos, [&](std::size_t i) {
    return infos[i].rows_index != stage::kScalar && rows_of(infos[i], reply[i]) >= needed;
  });
  const char* const wanted = needed == 2 ? "of two rows or more" : "with rows";
  if (chosen == kNoColumn) return no_such_column(order, method, wanted);
  const std::uint8_t word = infos[chosen].rows_index;
  if (word == stage::kScalar || rows_of(infos[chosen], reply[chosen]) < needed)
    return std::string("column ") + infos[chosen].name + " is none " + wanted;
  for (std::size_t i = 0; i < infos.size(); ++i) {
    if (infos[i].rows_index != word) continue;
    if (order.fault() == InjectedFault::kPermute) {
      reverse_rows(infos[i], reply[i]);
    } else if (order.fault() == InjectedFault::kMissing) {
      reply[i].count -= std::min<std::uint64_t>(reply[i].count, infos[i].components);
    } else {
      append_row(infos[i], &reply[i]);
    }
  }
  if (order.fault() != InjectedFault::kPhantom) return {};
  if (const std::size_t ids = id_column(infos, word); ids != kNoColumn)
    change_id(infos[ids], reply[ids], body_count(method, request));
  return {};
}

}  // namespace

bool changes_reply(InjectedFault fault) { return fault >= InjectedFault::kNan && fault <= InjectedFault::kPhantom; }

std::string change_reply(const FaultOrder& order, const stage::MethodInfo& method, const gravitas_column* request,
                         gravitas_reply_column* reply) {
  return order.fault() < InjectedFault::kPermute ? change_numbers(order, method, reply)
                                                 : change_rows(order, method, request, reply);
}

std::uint64_t payload_bits(std::span<const ColumnInfo> infos, const gravitas_reply_column* reply) {
  std::uint64_t bits = 0;
  for (std::size_t i = 0; i < infos.size(); ++i) bits += 8 * reply[i].count * stage::element_size(infos[i].type);
  return bits;
}

void flip_payload(std::uint64_t bit, std::span<const ColumnInfo> infos, const gravitas_reply_column* reply) {
  for (std::size_t i = 0; i < infos.size(); ++i) {
    const std::uint64_t bits = 8 * reply[i].count * stage::element_size(infos[i].type);
    if (bit < bits) return flip_bit(reply[i].data, bit);
    bit -= bits;
  }
}

void flip_bit(void* bytes, std::uint64_t bit) {
  static_cast<std::uint8_t*>(bytes)[bit / 8] ^= static_cast<std::uint8_t>(1U << (bit % 8));
}

std::uint64_t RandomNumbers::next() {
  std::uint64_t mixed = state_ += 0x9E3779B97F4A7C15ULL;
  mixed = (mixed ^ (mixed >> 30)) * 0xBF58476D1CE4E5B9ULL;
  mixed = (mixed ^ (mixed >> 27)) * 0x94D049BB133111EBULL;
  return mixed ^ (mixed >> 31);
}

}  // namespace gravitas::host
