#include "plugin_sdk/column_comparison.h"

#include <algorithm>
#include <cmath>
#include <cstring>

namespace gravitas {
namespace {

double number_at(const std::byte* data, stage::ElementType type, std::uint64_t index) {
  double number = 0.0;
  std::uint32_t narrow = 0;
  std::uint64_t wide = 0;
  switch (type) {
    case stage::ElementType::kF64:
      std::memcpy(&number, data + 8 * index, 8);
      return number;
    case stage::ElementType::kU32:
      std::memcpy(&narrow, data + 4 * index, 4);
      return narrow;
    case stage::ElementType::kU64:
      std::memcpy(&wide, data + 8 * index, 8);
      break;
  }
  return static_cast<double>(wide);
}

}  // namespace

Disagreement& Comparison::of(stage::Method method, const stage::ColumnInfo* column) {
  const auto found = std::ranges::find_if(
      disagreements, [&](const Disagreement& one) { return one.method == method && one.column == column; });
  if (found != disagreements.end()) return *found;
  return disagreements.emplace_back(Disagreement{method, column});
}

bool Comparison::add(stage::Method method, std::span<const std::span<const std::byte>> first,
                     std::span<const std::span<const std::byte>> second) {
  ++calls;
  bool differs = false;
  for (std::size_t i = 0; i < first.size(); ++i) {
    if (std::ranges::equal(first[i], second[i])) continue;
    differs = true;
    const stage::ColumnInfo& info = stage::method_info(method).reply[i];
    Disagreement& disagreement = of(method, &info);
    if (first[i].size() != second[i].size()) {
      ++disagreement.other_counts;
      continue;
    }
    const std::size_t row_size = info.components * stage::element_size(info.type);
    for (std::uint64_t row = 0; row < first[i].size() / row_size; ++row) {
      if (std::ranges::equal(first[i].subspan(row * row_size, row_size), second[i].subspan(row * row_size, row_size)))
        continue;
      ++disagreement.rows;
      for (std::uint64_t k = row * info.components; k < (row + 1) * info.components; ++k) {
        const double difference =
            std::abs(number_at(second[i].data(), info.type, k) - number_at(first[i].data(), info.type, k));
        const double counted = info.type == stage::ElementType::kF64 ? difference : std::min(difference, 1.0);
        if (counted <= disagreement.largest) continue;
        disagreement.largest = counted;
        disagreement.largest_row = row;
      }
    }
  }
  if (differs) ++differing_calls;
  return differs;
}

}  // namespace gravitas
