#include "plugin_sdk/near_miss.h"

#include <algorithm>
#include <cstddef>
#include <limits>
#include <vector>

namespace gravitas {
namespace {

constexpr std::size_t kLongestName = 128;
constexpr std::size_t kListedNames = 12;

char lower(char c) { return c >= 'A' && c <= 'Z' ? static_cast<char>(c - 'A' + 'a') : c; }

// Optimal string alignment distance by three rows of its table.
std::size_t distance(std::string_view a, std::string_view b) {
  std::vector<std::size_t> before(b.size() + 1), above(b.size() + 1), row(b.size() + 1);
  for (std::size_t j = 0; j <= b.size(); ++j) above[j] = j;
  for (std::size_t i = 1; i <= a.size(); ++i) {
    row[0] = i;
    for (std::size_t j = 1; j <= b.size(); ++j) {
      const bool equal = lower(a[i - 1]) == lower(b[j - 1]);
      row[j] = std::min({above[j] + 1, row[j - 1] + 1, above[j - 1] + (equal ? 0 : 1)});
      const bool exchanged = i > 1 && j > 1 && lower(a[i - 1]) == lower(b[j - 2]) && lower(a[i - 2]) == lower(b[j - 1]);
      if (exchanged) row[j] = std::min(row[j], before[j - 2] + 1);
    }
    before.swap(above);
    above.swap(row);
  }
  return above[b.size()];
}

}  // namespace

std::string nearest_name(std::string_view given, std::span<const std::string> candidates) {
  const std::string* nearest = nullptr;
  std::size_t least = std::numeric_limits<std::size_t>::max();
  if (given.empty() || given.size() > kLongestName) return "";
  for (const std::string& candidate : candidates) {
    if (candidate.empty() || candidate.size() > kLongestName) continue;
    const std::size_t bound = std::max<std::size_t>(1, std::max(given.size(), candidate.size()) / 3);
    const std::size_t gap =
        given.size() > candidate.size() ? given.size() - candidate.size() : candidate.size() - given.size();
    if (gap > bound || gap >= least) continue;
    const std::size_t slips = distance(given, candidate);
    if (slips > bound || slips >= least) continue;
    // a single character has nothing in common with its replacement
    if (slips >= std::max(given.size(), candidate.size())) continue;
    nearest = &candidate;
    least = slips;
  }
  return nearest == nullptr ? "" : *nearest;
}

std::string quoted_names(std::span<const std::string> names) {
  std::string list;
  for (std::size_t i = 0; i < std::min(names.size(), kListedNames); ++i) {
    if (i > 0) list += ", ";
    list += '"' + names[i] + '"';
  }
  if (names.size() > kListedNames) list += ", … (" + std::to_string(names.size()) + " in all)";
  return list;
}

std::string allowed_names(std::string_view given, std::span<const std::string> candidates) {
  if (candidates.empty()) return "none is allowed here";
  const std::string nearest = nearest_name(given, candidates);
  const std::string question = nearest.empty() ? "allowed: " : "did you mean \"" + nearest + "\"? Allowed: ";
  return question + quoted_names(candidates);
}

}  // namespace gravitas
