#include "plugin_sdk/local_bound.h"

#include <algorithm>
#include <cmath>
#include <limits>

namespace gravitas {

void measure(const Vector3& half_extents, LocalBound* bound) {
  constexpr double kThinnest = 1e-3, kFlat = 1e-9;
  const double least = half_extents.minCoeff();
  bound->least_half_extent = std::max(least, kThinnest * half_extents.maxCoeff());
  bound->reach = half_extents.norm();
  bound->half_thickness = least > kFlat * bound->reach ? least : bound->least_half_extent;
}

double contact_margin(std::span<const LocalBound> bounds) {
  double smallest = std::numeric_limits<double>::infinity();
  for (const LocalBound& bound : bounds)
    if (bound.least_half_extent > 0.0) smallest = std::min(smallest, bound.least_half_extent);
  return std::isinf(smallest) ? 0.0 : kMarginOfHalfExtent * smallest;
}

Bounds bounds_of(const LocalBound& bound, const Pose& body) {
  if (bound.kind == BoundKind::kSphere) return sphere_bounds(body, bound.centre, bound.half_extents.x());
  if (bound.kind == BoundKind::kBox) return box_bounds(body, bound.centre, bound.orientation, bound.half_extents);
  return {Vector3::Constant(-std::numeric_limits<double>::infinity()),
          Vector3::Constant(std::numeric_limits<double>::infinity())};
}

Bounds swept_bounds(const LocalBound& bound, const Pose& from, const Pose& to, const Vector3& rotation) {
  // a point at the distance r from the centre of mass leaves the chord between its two places by no more than
  // r angle^2 / 8, and never by more than 2 r
  const Bounds before = bounds_of(bound, from), after = bounds_of(bound, to);
  const double radius = bound.centre.norm() + bound.half_extents.norm();
  return widened({before.lower.cwiseMin(after.lower), before.upper.cwiseMax(after.upper)},
                 radius * std::min(2.0, 0.125 * rotation.squaredNorm()));
}

}  // namespace gravitas
