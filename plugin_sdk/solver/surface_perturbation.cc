// Philox as published, and the tilt of a normal.
#include "plugin_sdk/solver/surface_perturbation.h"

namespace gravitas {
namespace {

constexpr std::uint32_t kMultiplier0 = 0xD2511F53U;
constexpr std::uint32_t kMultiplier1 = 0xCD9E8D57U;
constexpr std::uint32_t kWeyl0 = 0x9E3779B9U;
constexpr std::uint32_t kWeyl1 = 0xBB67AE85U;
// "surface " read as two little-endian words: a stream of its own
constexpr std::array<std::uint32_t, 2> kSurfaceStream = {0x66727573U, 0x20656361U};

// In (-1, 1), symmetric, never zero.
double signed_unit(std::uint32_t word) { return (static_cast<double>(word) + 0.5) * (1.0 / 2147483648.0) - 1.0; }

}  // namespace

std::array<std::uint32_t, 4> philox4x32(std::array<std::uint32_t, 4> counter, std::array<std::uint32_t, 2> key) {
  for (int round = 0; round < 10; ++round) {
    const std::uint64_t product0 = std::uint64_t{kMultiplier0} * counter[0];
    const std::uint64_t product1 = std::uint64_t{kMultiplier1} * counter[2];
    counter = {static_cast<std::uint32_t>(product1 >> 32) ^ counter[1] ^ key[0], static_cast<std::uint32_t>(product1),
               static_cast<std::uint32_t>(product0 >> 32) ^ counter[3] ^ key[1], static_cast<std::uint32_t>(product0)};
    key[0] += kWeyl0;
    key[1] += kWeyl1;
  }
  return counter;
}

Vector3 perturbed_normal(const Vector3& normal, double epsilon, std::uint64_t contact_key) {
  const std::array<std::uint32_t, 4> words = philox4x32(
      {static_cast<std::uint32_t>(contact_key), static_cast<std::uint32_t>(contact_key >> 32), 0U, 0U}, kSurfaceStream);
  const Vector3 offset(signed_unit(words[0]), signed_unit(words[1]), signed_unit(words[2]));
  const Vector3 tilted = normal + epsilon * offset;
  const double length = tilted.norm();
  return length < 1e-3 ? normal : Vector3(tilted / length);
}

}  // namespace gravitas
