// Where balls and half-spaces touch, free of the plugin interface, so that my_name_test.cc can call it.
#pragma once

#include "plugin_sdk/geometry/manifold.h"
#include "plugin_sdk/math/types.h"

namespace plain {

using gravitas::Vector3;
using gravitas::collision::ContactPoint;

// A contact names the point midway between the two surface points, the unit normal from a to b, and the depth, which is
// above 0 where the two overlap and below 0 for a gap (plugin_sdk/geometry/manifold.h).

// Two balls:
//
//   n = (c_b - c_a)/|c_b - c_a|,   depth = r_a + r_b - |c_b - c_a|,   point = c_a + (r_a - depth/2) n
//
// Where the centres meet, b is taken to be above a.
inline ContactPoint touch_of_balls(const Vector3& centre_a, double radius_a, const Vector3& centre_b, double radius_b) {
  const Vector3 way = centre_b - centre_a;
  const double distance = way.stableNorm();
  const Vector3 normal = distance > 0.0 ? Vector3(way.stableNormalized()) : Vector3::UnitY();
  const double depth = radius_a + radius_b - distance;
  return {.point = centre_a + (radius_a - 0.5 * depth) * normal, .normal = normal, .depth = depth};
}

// A half-space a with its surface at o and its outward unit normal n, and a ball b:
//
//   depth = r - n.(c - o),   point = c - (r - depth/2) n
inline ContactPoint touch_of_halfspace(const Vector3& surface, const Vector3& normal, const Vector3& centre,
                                       double radius) {
  const double depth = radius - normal.dot(centre - surface);
  return {.point = centre - (radius - 0.5 * depth) * normal, .normal = normal, .depth = depth};
}

}  // namespace plain
