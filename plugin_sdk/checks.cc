#include "plugin_sdk/checks.h"

#include <Eigen/Core>
#include <algorithm>
#include <array>
#include <cmath>
#include <cstring>

#include "plugin_sdk/counted.h"

namespace gravitas {
namespace {

constexpr std::uint64_t kUnknownRows = ~0ULL;
constexpr std::size_t kMaxRowWords = 64;
constexpr std::size_t kFewNumbers = 8;  // in a plain loop sooner than by vectors

// Rows of each word of a method, as the columns looked at so far have them.
using RowCounts = std::array<std::uint64_t, kMaxRowWords>;

// The rows of a column that are its word's, or kUnknownRows if there is no whole number of them.
std::uint64_t rows_found(const stage::ColumnInfo& column, std::uint64_t count) {
  const std::uint64_t rows = count / column.components;
  return rows * column.components == count && rows >= column.extra ? rows - column.extra : kUnknownRows;
}

bool fits(const stage::ColumnInfo& column, std::uint64_t count, RowCounts* rows) {
  if (column.rows_index == stage::kScalar) return count == 1;
  std::uint64_t& expected = (*rows)[column.rows_index];
  if (expected == kUnknownRows) return (expected = rows_found(column, count)) != kUnknownRows;
  std::uint64_t wanted = 0;
  return !__builtin_mul_overflow(expected + column.extra, std::uint64_t{column.components}, &wanted) && count == wanted;
}

// Of a column that does not fit.
std::string misfit(const stage::ColumnInfo& column, std::uint64_t count, const RowCounts& rows) {
  const std::string name = std::string("column ") + column.name;
  if (column.rows_index == stage::kScalar) return name + " must be one value, has " + std::to_string(count);
  const std::uint64_t found = rows_found(column, count);
  if (found == kUnknownRows) return name + " has " + counted(count, "element") + ", not a whole number of rows";
  return name + " has " + counted(found + column.extra, "row") + ", expected " +
         std::to_string(rows[column.rows_index] + column.extra) + " (one per " + column.rows + ")";
}

}  // namespace

std::size_t first_not_finite(std::span<const double> numbers) {
  // zero times a finite number is zero, times any other NaN: one look at the sum, several numbers at a time
  if (numbers.size() <= kFewNumbers) {
    double sum = 0.0;
    for (const double number : numbers) sum += 0.0 * number;
    if (sum == 0.0) return kNoRow;
  }
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
  RowCounts rows;
  std::fill_n(rows.begin(), method.row_words, kUnknownRows);
  for (std::size_t i = 0; i < request.size(); ++i)
    if (!fits(method.request[i], request[i], &rows)) return misfit(method.request[i], request[i], rows);
  for (std::size_t i = 0; i < reply.size(); ++i)
    if (!fits(method.reply[i], reply[i], &rows)) return misfit(method.reply[i], reply[i], rows);
  return {};
}

RowCheck::RowCheck() {
  for (Counts& passed : passed_) passed.request.fill(kUnknownRows), passed.reply.fill(kUnknownRows);
}

std::string RowCheck::check(stage::Method method, ColumnCounts request, ColumnCounts reply) {
  Counts& passed = passed_[static_cast<std::size_t>(method)];
  const auto is_known = [](ColumnCounts counts, const auto& known) {
    return std::equal(counts.begin(), counts.end(), known.begin());
  };
  if (is_known(request, passed.request) && is_known(reply, passed.reply)) return {};
  std::string problem = check_rows(stage::method_info(method), request, reply);
  if (!problem.empty()) return problem;
  std::ranges::copy(request, passed.request.begin());
  std::ranges::copy(reply, passed.reply.begin());
  return problem;
}

bool is_changed(std::size_t row, std::size_t rows, std::span<const ColumnPair> columns) {
  return std::ranges::any_of(columns, [&](const ColumnPair& pair) {
    const std::size_t components = pair.a.size() / rows;
    return std::memcmp(&pair.a[row * components], &pair.b[row * components], components * sizeof(double)) != 0;
  });
}

}  // namespace gravitas
