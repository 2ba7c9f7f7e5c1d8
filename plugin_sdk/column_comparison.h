// How the answers of two plugins to the same requests differ, column by column.
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "schemas/stage_frames.h"

namespace gravitas {

// How the two answers differ in one column, over all calls.
struct Disagreement {
  stage::Method method;
  const stage::ColumnInfo* column;
  double largest = 0.0;            // |difference| of a number, in the column's unit; integers count 1
  double relative = 0.0;           // the same, of the largest magnitude in the column so far; integers have none
  std::uint64_t largest_row = 0;   // where `largest` was
  std::uint64_t rows = 0;          // that differed in any bit
  std::uint64_t other_counts = 0;  // answers with another number of rows, which are not compared further
};

// The first number of an answer that differs. No number: the column has another number of rows.
struct FirstDifference {
  const stage::ColumnInfo* column;
  std::optional<std::uint64_t> number;
};

class Comparison {
 public:
  // Real numbers that are no further apart are alike, relative to the largest magnitude of their column: in all calls
  // so far and what count_in() was told, so that what rests is held against how it moved. Integers are to be the same.
  // What an answer says of the work, its scalars (iterations, a residual), makes no difference then. 0: bit for bit.
  double tolerance = 0.0;

  std::uint64_t calls = 0;
  std::uint64_t differing_calls = 0;          // whose answers were not alike
  std::uint64_t refused_calls = 0;            // of these: by the second alone
  std::string first_refusal;                  // why
  std::uint64_t first_ns = 0, second_ns = 0;  // in which each of the two worked, where that is known
  std::vector<Disagreement> disagreements;    // of columns that were not the same bytes

  using Columns = std::span<const std::span<const std::byte>>;

  // Magnitudes that differences are relative to. Of a request or a reply, whichever `infos` describes.
  void count_in(std::span<const stage::ColumnInfo> infos, Columns columns);

  // Counts a call in: `first` and `second` are the bytes of the columns of the two replies. Where they differ first.
  std::optional<FirstDifference> add(stage::Method method, Columns first, Columns second);

  // Counts in a call that the second refused.
  void add_refusal(const std::string& why);

  // Whether two columns are alike; no call is counted.
  bool is_alike(const stage::ColumnInfo& column, std::span<const std::byte> first, std::span<const std::byte> second);

 private:
  Disagreement& of(stage::Method method, const stage::ColumnInfo* column);
  double& magnitude_of(const stage::ColumnInfo* column);
  // Notes in `disagreement` how the two differ; the first number that is too far apart.
  std::optional<std::uint64_t> compare(std::span<const std::byte> first, std::span<const std::byte> second,
                                       Disagreement* disagreement);

  std::vector<std::pair<const stage::ColumnInfo*, double>> magnitudes_;  // of columns with real numbers
};

}  // namespace gravitas
