// Walking along pairs of bodies, two ids a pair, that ascend.
#pragma once

#include <algorithm>
#include <cstdint>
#include <span>

namespace gravitas::kernel {

// Is the pair the next one of these? It ascends from question to question, so that those before it are dropped.
inline bool starts_with(std::span<const std::uint32_t> pair, std::span<const std::uint32_t>* pairs) {
  while (!pairs->empty() && std::ranges::lexicographical_compare(pairs->first(2), pair)) *pairs = pairs->subspan(2);
  return !pairs->empty() && std::ranges::equal(pairs->first(2), pair);
}

}  // namespace gravitas::kernel
