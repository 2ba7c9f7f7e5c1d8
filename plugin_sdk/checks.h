// Checks of answers: what the kernel demands of every reply, and what a plugin's author can test against.
#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <string>

#include "schemas/frame/column.h"
#include "schemas/stage_frames.h"

namespace gravitas {

// Largest deviation of a squared norm from 1 that passes as unit: some roundings of a renormalised quaternion.
inline constexpr double kUnitTolerance = 1e-9;

// How often a plugin is asked again because it wants more room: more rounds than any honest one needs, since each at least
// doubles it.
inline constexpr int kCapacityRounds = 64;

inline constexpr std::size_t kNoRow = ~std::size_t{0};

// Index of the first number that is not finite, or kNoRow.
std::size_t first_not_finite(std::span<const double> numbers);

// First row of `components` numbers whose norm is not 1, or kNoRow.
std::size_t first_not_unit(std::span<const double> numbers, std::size_t components);

// Number of elements of each column of a message, in order.
using ColumnCounts = std::span<const std::uint64_t>;

// Structure of a reply: every column a whole number of rows; single values present; columns that name the same
// rows equally long, and as long as the request's where it has such rows. Empty, or a sentence naming the column.
std::string check_rows(const stage::MethodInfo& method, ColumnCounts request, ColumnCounts reply);

// The same for many replies: counts that passed when the method was last asked pass at a glance.
class RowCheck {
 public:
  RowCheck();
  std::string check(stage::Method method, ColumnCounts request, ColumnCounts reply);

 private:
  struct Counts {
    std::array<std::uint64_t, GRAVITAS_MAX_COLUMNS> request, reply;
  };
  std::array<Counts, stage::kMethodCount> passed_;
};

// Two columns of `rows` rows. True if a row's numbers are not the same in both, bit for bit, of any pair.
struct ColumnPair {
  std::span<const double> a, b;
};
bool is_changed(std::size_t row, std::size_t rows, std::span<const ColumnPair> columns);

// First body (kNoRow: none) that has none of these flags and whose numbers are changed; columns() gives an array of pairs.
template <typename Columns>
std::size_t first_changed_body(std::span<const std::uint32_t> flags, std::uint32_t movers, Columns&& columns) {
  for (std::size_t i = 0; i < flags.size(); ++i)
    if ((flags[i] & movers) == 0 && is_changed(i, flags.size(), columns())) return i;
  return kNoRow;
}

}  // namespace gravitas
