// Normalisation that survives every finite vector. The plain quotient by the norm loses a vector
// whose squares underflow or overflow, and such vectors are legal here: two centres may lie 1e-200
// m apart.
#pragma once

#include <cmath>

#include "plugin_sdk/math/types.h"

namespace gravitas::collision {

// The unit vector along `v` and the length of `v`. For a zero or non-finite `v` the direction is
// `fallback` and the length 0.
struct Direction {
  Vector3 unit;
  double length;
};

inline Direction direction_of(const Vector3& v, const Vector3& fallback) {
  const double scale = v.cwiseAbs().maxCoeff();
  if (!(scale > 0.0) || !std::isfinite(scale)) return {fallback, 0.0};
  const Vector3 scaled = v / scale;
  const double norm = std::sqrt(scaled.squaredNorm());
  return {scaled / norm, scale * norm};
}

}  // namespace gravitas::collision
