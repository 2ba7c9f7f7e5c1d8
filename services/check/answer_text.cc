#include "services/check/answer_text.h"

#include <fmt/format.h>

#include <algorithm>

#include "plugin_sdk/counted.h"
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
  Comparison comparison;
  return difference(method, first, second, &comparison);
}

std::string difference(stage::Method method, const conformance::Answer& first, const conformance::Answer& second,
                       Comparison* comparison) {
  if (first.fault != second.fault || first.status != second.status)
    return fmt::format("first {}, then {}", outcome_text(first), outcome_text(second));
  if (!first.ok()) return {};
  const auto found = comparison->add(method, first.columns.column_bytes(), second.columns.column_bytes());
  if (!found) return {};
  const stage::ColumnInfo& info = *found->column;
  const std::size_t i = found->column - stage::method_info(method).reply.data();
  const gravitas_column a = first.columns.plain()[i], b = second.columns.plain()[i];
  if (!found->number) return fmt::format("column {} had {}, then {}", info.name, counted(a.count, "number"), b.count);
  return fmt::format("number {} of column {} was {}, then {}", *found->number, info.name,
                     element_text(info, a.data, *found->number), element_text(info, b.data, *found->number));
}

}  // namespace gravitas::check
