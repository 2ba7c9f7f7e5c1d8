#include "services/scene/filter_bits.h"

#include <bit>
#include <optional>

namespace gravitas::scene {
namespace {

constexpr std::size_t kBits = 64;

using Kinds = std::vector<std::uint64_t>;  // a set of kinds, as a row of a relation

std::size_t common(const std::uint64_t* a, const Kinds& b) {
  std::size_t count = 0;
  for (std::size_t w = 0; w < b.size(); ++w) count += static_cast<std::size_t>(std::popcount(a[w] & b[w]));
  return count;
}

bool contains(const Kinds& set, std::size_t kind) { return (set[kind / 64] >> kind % 64 & 1) != 0; }

std::optional<std::size_t> first_of(const Kinds& set) {
  for (std::size_t w = 0; w < set.size(); ++w)
    if (set[w] != 0) return 64 * w + static_cast<std::size_t>(std::countr_zero(set[w]));
  return std::nullopt;
}

struct Rectangle {
  std::vector<std::size_t> group;
  Kinds mask;
};

// Starts from the pairs of one kind and takes in others while that covers more of what is left to cover.
Rectangle grow(std::size_t seed, const KindRelation& harmless, const KindRelation& left) {
  Rectangle rectangle = {{seed}, Kinds(harmless.row(seed), harmless.row(seed) + harmless.words())};
  std::size_t covered = common(left.row(seed), rectangle.mask);
  Kinds narrower(harmless.words());
  for (std::size_t kind = 0; kind < harmless.kinds(); ++kind) {
    if (kind == seed) continue;
    for (std::size_t w = 0; w < narrower.size(); ++w) narrower[w] = rectangle.mask[w] & harmless.row(kind)[w];
    std::size_t would_cover = common(left.row(kind), narrower);
    for (const std::size_t member : rectangle.group) would_cover += common(left.row(member), narrower);
    if (would_cover <= covered) continue;
    rectangle.group.push_back(kind);
    rectangle.mask = narrower;
    covered = would_cover;
  }
  return rectangle;
}

}  // namespace

std::vector<FilterBits> find_filter_bits(const KindRelation& needed, const KindRelation& harmless) {
  std::vector<FilterBits> bits(needed.kinds());
  if (needed.kinds() <= kBits) {
    for (std::size_t i = 0; i < needed.kinds(); ++i) {
      bits[i].group = std::uint64_t{1} << i;
      for (std::size_t k = 0; k < needed.kinds(); ++k)
        if (needed.holds(i, k)) bits[i].mask |= std::uint64_t{1} << k;
    }
    return bits;
  }
  KindRelation left = needed;
  std::size_t seed = 0;
  for (std::size_t bit = 0;; ++bit) {
    while (seed < left.kinds() && !first_of(Kinds(left.row(seed), left.row(seed) + left.words()))) ++seed;
    if (seed == left.kinds()) return bits;
    if (bit == kBits) return {};
    const Rectangle rectangle = grow(seed, harmless, left);
    for (const std::size_t member : rectangle.group) {
      bits[member].group |= std::uint64_t{1} << bit;
      for (std::size_t kind = 0; kind < left.kinds(); ++kind)
        if (contains(rectangle.mask, kind)) left.set(member, kind, false);
    }
    for (std::size_t kind = 0; kind < left.kinds(); ++kind)
      if (contains(rectangle.mask, kind)) bits[kind].mask |= std::uint64_t{1} << bit;
  }
}

}  // namespace gravitas::scene
