// The identity of a trajectory: 128-bit hashes of states, and of the chain of all states.
#pragma once

#define XXH_INLINE_ALL
#include <xxhash.h>

#include <array>
#include <cstdint>
#include <span>
#include <string>

namespace gravitas {

struct Hash {
  std::uint64_t low = 0, high = 0;
  bool operator==(const Hash&) const = default;
  // 32 hexadecimal digits.
  std::string text() const;
};

// Hash of every body's pose and velocity, bit for bit: of its position, orientation, linear and angular velocity.
Hash state_hash(const std::array<std::span<const double>, 4>& columns);

// Hash of the chain so far and the next state.
Hash chain_hash(const Hash& chain, const Hash& state);

}  // namespace gravitas
