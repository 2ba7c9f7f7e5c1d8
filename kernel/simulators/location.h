// What the searches for impacts share (located.cc, halving.cc), and who keeps the pairs that touch (gaps.cc).
#pragma once

#include <algorithm>
#include <cstdint>
#include <span>

#include "plugin_sdk/local_bound.h"

namespace gravitas::kernel {

inline constexpr double kTargetShare = 1e-8;  // of the margin: gap at which a pair has met, overlap that is none
inline constexpr double kFinest = 1e-13;      // of the step: its shortest part

// Is the pair the next one of these (two ids each)? Both ascend from question to question, so that those before it are dropped.
inline bool starts_with(std::span<const std::uint32_t> pair, std::span<const std::uint32_t>* pairs) {
  while (!pairs->empty() && std::ranges::lexicographical_compare(pairs->first(2), pair)) *pairs = pairs->subspan(2);
  return !pairs->empty() && std::ranges::equal(pairs->first(2), pair);
}

// turns.cc: what two bodies overlap by no more than this is pushed out on the side where it came in, m.
double harmless_depth(const LocalBound& one, const LocalBound& two);

}  // namespace gravitas::kernel
