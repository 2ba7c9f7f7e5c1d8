#include "plugin_sdk/checks.h"

#include <Eigen/Core>
#include <array>
#include <cmath>

namespace gravitas {
namespace {

constexpr std::uint64_t kUnknown = ~0ULL;
constexpr std::size_t kMaxRowWords = 64;

std::string check_column(const stage::ColumnInfo& column, std::uint64_t count,
                         std::array<std::uint64_t, kMaxRowWords>* rows) {
  const auto name = [&] { return std::string("column ") + column.name; };
  if (column.rows_index == stage::kScalar)
    return count == 1 ? "" : name() + " must be one value, has " + std::to_string(count);
  if (count % column.components != 0 || count / column.components < column.extra)
    return name() + " has " + std::to_string(count) + " elements, not a whole number of rows";
  const std::uint64_t found = count / column.components - column.extra;
  std::uint64_t& expected = (*rows)[column.rows_index];
  if (expected == kUnknown) expected = found;
  return found == expected ? ""
                           : name() + " has " + std::to_string(found + column.extra) + " rows, expected " +
                                 std::to_string(expected + column.extra) + " (one per " + column.rows + ")";
}

}  // namespace

std::size_t first_not_finite(std::span<const double> numbers) {
  // zero times a finite number is zero, times any other NaN: one look at the sum, several numbers at a time
  const Eigen::Map<const Eigen::ArrayXd> column(numbers.data(), static_cast<Eigen::Index>(numbers.size()));
  if ((0.0 * column).sum() == 0.0) return kNoRow;
  for (std::size_t i = 0; i < numbers.size(); ++i)
    if (!std::isfinite(numbers[i])) return i;
  return kNoRow;
}

std::size_t first_not_unit(std::span<const double> numbers, std::size_t components) {
  for (std::size_t row = 0; row < numbers.size() / components; ++row) {
    double norm = 0.0;
    for (std::size_t k = 0; k < components; ++k) norm += numbers[row * components + k] * numbers[row * components + k];
    if (!(std::fabs(norm - 1.0) <= kUnitTolerance)) return row;
  }
  return kNoRow;
}

std::string check_rows(const stage::MethodInfo& method, ColumnCounts request, ColumnCounts reply) {
  std::array<std::uint64_t, kMaxRowWords> rows;
  rows.fill(kUnknown);
  for (std::size_t i = 0; i < request.size(); ++i) {
    std::string problem = check_column(method.request[i], request[i], &rows);
    if (!problem.empty()) return problem;
  }
  for (std::size_t i = 0; i < reply.size(); ++i) {
    std::string problem = check_column(method.reply[i], reply[i], &rows);
    if (!problem.empty()) return problem;
  }
  return {};
}

}  // namespace gravitas
