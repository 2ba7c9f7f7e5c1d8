// The nearest points of points, segments, triangles and tetrahedra to the origin (§ 3.8.3): the step of every
// distance method, and, with corners shifted, the distance of any point from them. Lengths in m, one frame.
#pragma once

#include <array>
#include <optional>
#include <span>

#include "plugin_sdk/math/types.h"

namespace gravitas {

// The point of a simplex nearest to the origin, as sum of weight[i] times corner i. Weights are >= 0 with sum 1; a
// weight of exactly 0 means that the corner is not needed.
struct SimplexPoint {
  Vector3 point = Vector3::Zero();
  std::array<double, 4> weight{};
};

SimplexPoint closest_on_segment(const Vector3& a, const Vector3& b);
// By regions (C. Ericson, Real-Time Collision Detection, § 5.1); a triangle without area by its edges.
SimplexPoint closest_on_triangle(const Vector3& a, const Vector3& b, const Vector3& c);
// With the origin inside, the point is the origin. A flat tetrahedron counts as its four faces.
SimplexPoint closest_on_tetrahedron(const Vector3& a, const Vector3& b, const Vector3& c, const Vector3& d);

// One to four corners.
SimplexPoint closest_on_simplex(std::span<const Vector3> corners);

// Where origin + t direction, t >= 0, meets a triangle from either side, its borders included within rounding (T.
// Moeller and B. Trumbore, 1997). Nothing if it runs along the plane.
std::optional<double> ray_on_triangle(const Vector3& origin, const Vector3& direction,
                                      const std::array<Vector3, 3>& corners);

}  // namespace gravitas
