// Reproducible draws for questions and cases: SplitMix64 (Steele, Lea and Flood, "Fast splittable pseudorandom number
// generators", OOPSLA 2014), and nothing of <random>, whose distributions differ between libraries.
#pragma once

#include <cmath>
#include <cstdint>
#include <numeric>
#include <utility>
#include <vector>

#include "plugin_sdk/math/pose.h"
#include "plugin_sdk/math/types.h"

namespace gravitas::conformance {

class Draw {
 public:
  explicit Draw(std::uint64_t seed) : state_(seed) {}

  std::uint64_t bits() {
    std::uint64_t z = state_ += 0x9E3779B97F4A7C15ULL;
    z = (z ^ (z >> 30)) * 0xBF58476D1CE4E5B9ULL;
    z = (z ^ (z >> 27)) * 0x94D049BB133111EBULL;
    return z ^ (z >> 31);
  }
  // 0 … bound - 1.
  std::uint32_t below(std::uint32_t bound) { return static_cast<std::uint32_t>(bits() % bound); }
  double uniform(double low, double high) { return low + (high - low) * (static_cast<double>(bits() >> 11) * 0x1p-53); }
  // Each component within -reach … reach.
  Vector3 vector(double reach) {
    const double x = uniform(-reach, reach), y = uniform(-reach, reach);
    return {x, y, uniform(-reach, reach)};
  }
  Vector3 direction() {
    for (;;) {
      const Vector3 v = vector(1.0);
      if (v.norm() > 0.1 && v.norm() <= 1.0) return v.normalized();
    }
  }
  // Uniform over all rotations.
  Quaternion rotation() {
    for (;;) {
      const double w = uniform(-1, 1), x = uniform(-1, 1), y = uniform(-1, 1);
      const Quaternion q(w, x, y, uniform(-1, 1));
      if (q.norm() > 0.1 && q.norm() <= 1.0) return q.normalized();
    }
  }
  // The new place of each of `count` rows, all orders alike.
  std::vector<std::uint32_t> order(std::size_t count) {
    std::vector<std::uint32_t> place(count);
    std::iota(place.begin(), place.end(), 0U);
    for (std::size_t i = count; i > 1; --i) std::swap(place[i - 1], place[below(static_cast<std::uint32_t>(i))]);
    return place;
  }
  Pose pose(double reach) {
    const Vector3 position = vector(reach);
    return {position, rotation()};
  }

 private:
  std::uint64_t state_;
};

}  // namespace gravitas::conformance
