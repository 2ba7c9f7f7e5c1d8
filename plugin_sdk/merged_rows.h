// Two lists of rows, each in order of a key, as one: what is new, and what goes on of the old.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <utility>
#include <vector>

namespace gravitas {

struct MergedRow {
  bool is_old;
  std::uint32_t row;
};

// Of `fresh` rows with the keys fresh_key(i), and those of `old` rows that goes_on(i), all in the order of the keys.
template <typename FreshKey, typename OldKey, typename GoesOn>
void merge_rows(std::size_t fresh, FreshKey&& fresh_key, std::size_t old, OldKey&& old_key, GoesOn&& goes_on,
                std::vector<MergedRow>* merged) {
  merged->clear();
  std::size_t next = 0;
  for (std::size_t i = 0; i <= fresh; ++i) {
    for (; next < old && (i == fresh || old_key(next) < fresh_key(i)); ++next)
      if (goes_on(next)) merged->push_back({true, static_cast<std::uint32_t>(next)});
    if (i < fresh) merged->push_back({false, static_cast<std::uint32_t>(i)});
  }
}

// The numbers of merged rows, `components` each, into `to`.
template <typename Numbers>
void copy_rows(const std::vector<MergedRow>& rows, std::size_t components, const Numbers& fresh, const Numbers& old,
               const Numbers& to) {
  to.resize(components * rows.size());
  auto* out = to.data();
  for (const MergedRow& row : rows) {
    const auto* from = (row.is_old ? old : fresh).data() + components * row.row;
    for (std::size_t k = 0; k < components; ++k) *out++ = from[k];
  }
}

// visit(is_new, a, b) for every pair (2 numbers, in ascending order) that only one of two lists has, in their order.
template <typename Visit>
void visit_changes(std::span<const std::uint32_t> before, std::span<const std::uint32_t> now, Visit&& visit) {
  const auto pair_at = [](std::span<const std::uint32_t> pairs, std::size_t i) {
    return std::pair{pairs[i], pairs[i + 1]};
  };
  for (std::size_t n = 0, b = 0; n < now.size() || b < before.size();) {
    const bool starts = b >= before.size() || (n < now.size() && pair_at(now, n) < pair_at(before, b));
    const bool ends = n >= now.size() || (b < before.size() && pair_at(before, b) < pair_at(now, n));
    if (starts) visit(true, now[n], now[n + 1]);
    if (ends) visit(false, before[b], before[b + 1]);
    n += ends ? 0 : 2;
    b += starts ? 0 : 2;
  }
}

}  // namespace gravitas
