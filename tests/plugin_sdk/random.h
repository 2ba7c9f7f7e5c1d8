// Reproducible random numbers for tests: from the raw generator, so that they are the same on every
// standard library.
#pragma once

#include <cmath>
#include <cstdint>
#include <random>

#include "plugin_sdk/math/pose.h"
#include "plugin_sdk/math/types.h"

namespace gravitas::test {

class Random {
 public:
  explicit Random(std::uint64_t seed) : generator_(seed) {}

  std::uint64_t bits() { return generator_(); }
  // 0 … below - 1.
  std::uint32_t below(std::uint32_t bound) { return static_cast<std::uint32_t>(generator_() % bound); }
  double uniform(double low, double high) {
    return low + (high - low) * (static_cast<double>(generator_() >> 11) * 0x1p-53);
  }
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
  Pose pose(double reach) {
    const Vector3 position = vector(reach);
    return {position, rotation()};
  }

 private:
  std::mt19937_64 generator_;
};

}  // namespace gravitas::test
