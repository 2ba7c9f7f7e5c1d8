#include "plugin_sdk/trajectory_hash.h"

#include <array>
#include <cstdio>

namespace gravitas {
namespace {

Hash from(const XXH128_hash_t& hash) { return {hash.low64, hash.high64}; }

}  // namespace

std::string Hash::text() const {
  std::array<char, 33> digits;
  std::snprintf(digits.data(), digits.size(), "%016llx%016llx", static_cast<unsigned long long>(high),
                static_cast<unsigned long long>(low));
  return digits.data();
}

Hash state_hash(const std::array<std::span<const double>, 4>& columns) {
  // the columns are hashed one by one and then together, so the gaps between them do not count
  std::array<XXH128_hash_t, 4> parts;
  for (std::size_t i = 0; i < parts.size(); ++i) parts[i] = XXH3_128bits(columns[i].data(), columns[i].size_bytes());
  return from(XXH3_128bits(parts.data(), sizeof parts));
}

Hash chain_hash(const Hash& chain, const Hash& state) {
  const std::array<Hash, 2> both = {chain, state};
  return from(XXH3_128bits(both.data(), sizeof both));
}

}  // namespace gravitas
