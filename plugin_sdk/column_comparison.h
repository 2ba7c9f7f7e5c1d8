// How the answers of two plugins to the same requests differ, column by column.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "schemas/stage_frames.h"

namespace gravitas {

// How the two answers differ in one column, over all calls.
struct Disagreement {
  stage::Method method;
  const stage::ColumnInfo* column;
  double largest = 0.0;            // |difference| of a number, in the column's unit; integers count 1
  std::uint64_t largest_row = 0;   // where that was
  std::uint64_t rows = 0;          // that differed in any bit
  std::uint64_t other_counts = 0;  // answers with another number of rows, which are not compared further
};

class Comparison {
 public:
  std::uint64_t calls = 0;
  std::uint64_t differing_calls = 0;          // whose answers were not the same bytes
  std::uint64_t first_ns = 0, second_ns = 0;  // in which each of the two worked, where that is known
  std::vector<Disagreement> disagreements;

  // Counts a call in: `first` and `second` are the bytes of the columns of the two replies. Whether they differ.
  bool add(stage::Method method, std::span<const std::span<const std::byte>> first,
           std::span<const std::span<const std::byte>> second);

 private:
  Disagreement& of(stage::Method method, const stage::ColumnInfo* column);
};

}  // namespace gravitas
