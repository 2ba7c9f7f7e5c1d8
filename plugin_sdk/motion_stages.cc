#include "plugin_sdk/motion_stages.h"

#include <cmath>

#include "plugin_sdk/math/transcendental.h"

namespace gravitas {

Vector3 rotation_vector_rate(const Vector3& rotation_vector, const Vector3& angular_velocity) {
  // below this squared angle the series of the factor ends within 2^-53
  constexpr double kSeriesAngleSquared = 4e-3;
  const Vector3 &r = rotation_vector, &w = angular_velocity;
  const Vector3 turned = r.cross(w);
  if (turned.isZero(0.0)) return w;
  const double square = r.squaredNorm();
  double factor = 1.0 / 12.0 + square * (1.0 / 720.0 + square * (1.0 / 30240.0 + square / 1209600.0));
  if (square > kSeriesAngleSquared) {
    const double half = 0.5 * std::sqrt(square);
    const math::SinCos angle = math::sincos(half);
    factor = (1.0 - half * angle.cos / angle.sin) / square;
  }
  return w - 0.5 * turned + factor * r.cross(turned);
}

}  // namespace gravitas
