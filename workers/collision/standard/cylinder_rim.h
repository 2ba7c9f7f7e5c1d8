// The circle that bounds the cap of a cylinder, and the four points by which a manifold represents
// it.
#pragma once

#include <array>
#include <cmath>

#include "plugin_sdk/math/types.h"
#include "workers/collision/standard/unit_vector.h"

namespace gravitas::collision {

// A direction closer to the axis than 45 degrees sees the cap of a cylinder as the touching
// feature, any other the side line. (At 45 degrees both contain the deepest point of the rim.)
inline constexpr double kCapAlignment = 0.70710678118654752;

// u, v, axis: orthonormal; u and v span the plane of the circle.
struct Rim {
  Vector3 centre;
  Vector3 axis;
  Vector3 u;
  Vector3 v;
  double radius;
};

// The circle with u as close to `reference` as the plane allows; any perpendicular if `reference`
// is along the axis. `axis` is a unit vector.
inline Rim make_rim(const Vector3& centre, const Vector3& axis, double radius, const Vector3& reference) {
  Vector3 u = reference - axis * axis.dot(reference);
  if (!(u.squaredNorm() > 1e-12)) {
    int smallest = 0;
    axis.cwiseAbs().minCoeff(&smallest);
    u = Vector3::Unit(smallest) - axis * axis[smallest];
  }
  u = direction_of(u, Vector3::UnitX()).unit;
  return {centre, axis, u, axis.cross(u), radius};
}

inline constexpr int kRimPointCount = 4;
using RimPoints = std::array<Vector3, kRimPointCount>;

// The points of the rim along u, v, -u, -v, spread over the whole circle and fixed in the frame of
// u, v; but if the rim is tilted against the other surface, its deepest point replaces the nearest
// of them. depth_towards(direction) is the depth (m) of the rim point in that unit direction, an
// affine function of the point. A tilt that lowers it by less than 3e-8 of the radius counts as
// none, since its direction would be noise.
template <typename DepthTowards>
RimPoints spread_rim_points(const Rim& rim, const DepthTowards& depth_towards) {
  const std::array<Vector3, kRimPointCount> fixed = {rim.u, rim.v, -rim.u, -rim.v};
  RimPoints points;
  for (std::size_t i = 0; i < kRimPointCount; ++i) points[i] = rim.centre + rim.radius * fixed[i];

  const double along_u = 0.5 * (depth_towards(fixed[0]) - depth_towards(fixed[2]));
  const double along_v = 0.5 * (depth_towards(fixed[1]) - depth_towards(fixed[3]));
  const double slope = std::sqrt(along_u * along_u + along_v * along_v);
  if (!(slope > 3e-8 * rim.radius)) return points;

  const bool nearer_u = std::fabs(along_u) >= std::fabs(along_v);
  const std::size_t slot = nearer_u ? (along_u > 0.0 ? 0 : 2) : (along_v > 0.0 ? 1 : 3);
  points[slot] = rim.centre + rim.radius * ((along_u / slope) * rim.u + (along_v / slope) * rim.v);
  return points;
}

}  // namespace gravitas::collision
