#include "plugin_sdk/column_comparison.h"

#include <algorithm>
#include <cmath>
#include <cstring>
#include <limits>

namespace gravitas {
namespace {

double real_at(std::span<const std::byte> column, std::uint64_t k) {
  double number = 0.0;
  std::memcpy(&number, column.data() + sizeof number * k, sizeof number);
  return number;
}

// Of those that are finite.
double largest_magnitude(std::span<const std::byte> column) {
  double largest = 0.0;
  for (std::uint64_t k = 0; k < column.size() / 8; ++k)
    if (const double size = std::abs(real_at(column, k)); std::isfinite(size)) largest = std::max(largest, size);
  return largest;
}

}  // namespace

Disagreement& Comparison::of(stage::Method method, const stage::ColumnInfo* column) {
  const auto found = std::ranges::find_if(
      disagreements, [&](const Disagreement& one) { return one.method == method && one.column == column; });
  if (found != disagreements.end()) return *found;
  return disagreements.emplace_back(Disagreement{method, column});
}

double& Comparison::magnitude_of(const stage::ColumnInfo* column) {
  const auto found = std::ranges::find(magnitudes_, column, [](const auto& one) { return one.first; });
  return found != magnitudes_.end() ? found->second : magnitudes_.emplace_back(column, 0.0).second;
}

void Comparison::count_in(std::span<const stage::ColumnInfo> infos, Columns columns) {
  for (std::size_t i = 0; i < infos.size(); ++i) {
    if (infos[i].type != stage::ElementType::kF64) continue;
    double& magnitude = magnitude_of(&infos[i]);
    magnitude = std::max(magnitude, largest_magnitude(columns[i]));
  }
}

std::optional<std::uint64_t> Comparison::compare(std::span<const std::byte> first, std::span<const std::byte> second,
                                                 Disagreement* disagreement) {
  const stage::ColumnInfo& info = *disagreement->column;
  const bool is_real = info.type == stage::ElementType::kF64;
  const std::size_t size = stage::element_size(info.type);
  double magnitude = 0.0;
  if (is_real) {
    double& known = magnitude_of(&info);
    magnitude = known = std::max({known, largest_magnitude(first), largest_magnitude(second)});
  }
  std::optional<std::uint64_t> too_far;
  std::uint64_t last_row = ~std::uint64_t{0};
  for (std::uint64_t k = 0; k < first.size() / size; ++k) {
    if (std::ranges::equal(first.subspan(k * size, size), second.subspan(k * size, size))) continue;
    const std::uint64_t row = k / info.components;
    if (std::exchange(last_row, row) != row) ++disagreement->rows;
    double difference = is_real ? std::abs(real_at(second, k) - real_at(first, k)) : 1.0;
    // of what is no number, too
    if (!std::isfinite(difference)) difference = std::numeric_limits<double>::infinity();
    if (!too_far && (tolerance == 0.0 || !is_real || difference > tolerance * magnitude)) too_far = k;
    if (is_real && difference > 0.0) disagreement->relative = std::max(disagreement->relative, difference / magnitude);
    if (difference <= disagreement->largest) continue;
    disagreement->largest = difference;
    disagreement->largest_row = row;
  }
  return too_far;
}

std::optional<FirstDifference> Comparison::add(stage::Method method, Columns first, Columns second) {
  ++calls;
  std::optional<FirstDifference> found;
  for (std::size_t i = 0; i < first.size(); ++i) {
    if (std::ranges::equal(first[i], second[i])) continue;
    const stage::ColumnInfo& info = stage::method_info(method).reply[i];
    Disagreement& disagreement = of(method, &info);
    std::optional<FirstDifference> here;
    if (first[i].size() != second[i].size()) {
      ++disagreement.other_counts;
      here = FirstDifference{&info, std::nullopt};
    } else if (const auto number = compare(first[i], second[i], &disagreement)) {
      here = FirstDifference{&info, number};
    }
    const bool tells_of_work = tolerance > 0.0 && info.rows_index == stage::kScalar;
    if (!found && !tells_of_work) found = here;
  }
  if (found) ++differing_calls;
  return found;
}

void Comparison::add_refusal(const std::string& why) {
  ++calls, ++differing_calls;
  if (refused_calls++ == 0) first_refusal = why;
}

bool Comparison::is_alike(const stage::ColumnInfo& column, std::span<const std::byte> first,
                          std::span<const std::byte> second) {
  Disagreement unused{{}, &column};
  return first.size() == second.size() && !compare(first, second, &unused);
}

}  // namespace gravitas
