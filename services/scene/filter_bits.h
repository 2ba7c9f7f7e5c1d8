// Which pairs of kinds of bodies are allowed, as a relation, and as the bits of a group and a mask.
//
// A bit that the kinds G have in their groups and the kinds M in their masks allows all pairs of G x M. So bits are
// found whose rectangles cover what is allowed and nothing else. Up to 64 kinds a bit for each kind will do; for more
// they are chosen greedily, the rectangle that covers most first: n pairs of which each is forbidden within itself need
// about 2 log2 n bits.
#pragma once

#include <cstdint>
#include <vector>

namespace gravitas::scene {

// A symmetric relation over kinds: row i holds a bit for every kind.
class KindRelation {
 public:
  explicit KindRelation(std::size_t kinds) : kinds_(kinds), words_((kinds + 63) / 64), bits_(kinds * words_, 0) {}

  std::size_t kinds() const { return kinds_; }
  std::size_t words() const { return words_; }
  const std::uint64_t* row(std::size_t i) const { return &bits_[i * words_]; }
  bool holds(std::size_t i, std::size_t k) const { return (row(i)[k / 64] >> k % 64 & 1) != 0; }
  // Of (i, k) alone: the caller keeps it symmetric.
  void set(std::size_t i, std::size_t k, bool value) {
    std::uint64_t& word = bits_[i * words_ + k / 64];
    const std::uint64_t bit = std::uint64_t{1} << k % 64;
    word = value ? word | bit : word & ~bit;
  }

 private:
  std::size_t kinds_, words_;
  std::vector<std::uint64_t> bits_;
};

struct FilterBits {
  std::uint64_t group = 0, mask = 0;
};

// Bits by kind that allow every pair in `needed` and none outside `harmless`, which holds `needed`; empty if 64 bits were
// not enough. (i, i) is the pair of two bodies of kind i.
std::vector<FilterBits> find_filter_bits(const KindRelation& needed, const KindRelation& harmless);

}  // namespace gravitas::scene
