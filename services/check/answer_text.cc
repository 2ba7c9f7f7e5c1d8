#include "services/check/answer_text.h"

#include <fmt/format.h>

#include <algorithm>
#include <cstring>

#include "plugin_sdk/property_value.h"

namespace gravitas::check {
namespace {

std::string element_text(const stage::ColumnInfo& info, const void* data, std::uint64_t i) {
  if (info.type == stage::ElementType::kF64) return number_text(static_cast<const double*>(data)[i]);
  if (info.type == stage::ElementType::kU32) return std::to_string(static_cast<const std::uint32_t*>(data)[i]);
  return std::to_string(static_cast<const std::uint64_t*>(data)[i]);
}

}  // namespace

std::string call_text(stage::Method method, const MessageColumns& request) {
  const stage::MethodInfo& info = stage::method_info(method);
  const std::vector<std::uint64_t> counts = request.counts();
  std::string text = info.name, rows;
  std::uint64_t named = 0;
  for (std::size_t i = 0; i < counts.size(); ++i) {
    const stage::ColumnInfo& column = info.request[i];
    if (column.rows_index == stage::kScalar || column.extra != 0 || (named >> column.rows_index & 1) != 0) continue;
    named |= std::uint64_t{1} << column.rows_index;
    rows += fmt::format("{}{} {}", rows.empty() ? "" : ", ", counts[i] / column.components, column.rows);
  }
  return rows.empty() ? text : text + " with " + rows;
}

std::string outcome_text(const conformance::Answer& answer) {
  if (!answer.fault.empty()) return answer.fault;
  static constexpr const char* kNames[] = {"OK",     "NEEDS_CAPACITY", "REFUSED",
                                           "FAILED", "UNKNOWN_METHOD", "CALLBACK_FAILED"};
  const bool is_known = answer.status >= 0 && static_cast<std::size_t>(answer.status) < std::size(kNames);
  const std::string name = is_known ? kNames[answer.status] : fmt::format("status {}", answer.status);
  return answer.text.empty() ? name : fmt::format("{} ({})", name, answer.text);
}

std::string difference(stage::Method method, const conformance::Answer& first, const conformance::Answer& second) {
  if (first.fault != second.fault || first.status != second.status)
    return fmt::format("first {}, then {}", outcome_text(first), outcome_text(second));
  if (!first.ok()) return {};
  const std::span<const stage::ColumnInfo> infos = stage::method_info(method).reply;
  const std::vector<gravitas_column> a = first.columns.plain(), b = second.columns.plain();
  for (std::size_t i = 0; i < infos.size(); ++i) {
    if (a[i].count != b[i].count)
      return fmt::format("column {} had {} numbers, then {}", infos[i].name, a[i].count, b[i].count);
    const std::size_t size = stage::element_size(infos[i].type);
    for (std::uint64_t k = 0; k < a[i].count; ++k) {
      if (std::memcmp(static_cast<const char*>(a[i].data) + k * size, static_cast<const char*>(b[i].data) + k * size,
                      size) == 0)
        continue;
      return fmt::format("number {} of column {} was {}, then {}", k, infos[i].name,
                         element_text(infos[i], a[i].data, k), element_text(infos[i], b[i].data, k));
    }
  }
  return {};
}

}  // namespace gravitas::check
