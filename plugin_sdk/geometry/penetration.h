// How far two convex solids are apart, or how deeply they overlap, by their support points alone.
//
//   h(n) = max over a of n . x  -  min over b of n . x
//
// is the translation of b along the unit vector n that just separates the pair in that direction; the depth is the least
// h over all n (negative: -h is the distance). Apart, the least is found by the method of Gilbert, Johnson and Keerthi
// ("A fast procedure for computing the distance between complex objects in three-dimensional space", 1988); overlapping,
// by a polytope that grows inside a - b where its boundary is nearest (S. Cameron's and G. van den Bergen's expanding
// polytope). Both start from the same directions every time: the answer depends on the arguments alone.
//
// Exact to rounding for flat faces. For curved ones the depth is at most 1e-12 of `reach` above the least, the normal off
// by the square root of that over the radius of curvature; solids whose every direction is the least (a ball is not among
// them, being rounded, but two equal cylinders end on end inside each other come near) end at 96 points: 1e-4.
#pragma once

#include <optional>

#include "plugin_sdk/geometry/support_map.h"
#include "plugin_sdk/math/types.h"

namespace gravitas {

// Two solids in the frame of the first.
struct PlacedPair {
  const SupportMap& a;
  const SupportMap& b;
  Matrix3 R_AB;
  Vector3 p_AB;

  // m, the size of the coordinates that appear: rounding errors are a few 1e-16 of it.
  double reach() const;
  double thinnest() const;
  double rounding() const { return a.rounding() + b.rounding(); }
  // Of the cores.
  Vector3 support_a(const Vector3& n) const { return a.support(n); }
  Vector3 support_b(const Vector3& n) const { return p_AB + R_AB * b.support(R_AB.transpose() * -n); }
  // h(n).
  double depth_along(const Vector3& n) const { return n.dot(support_a(n) - support_b(n)) + rounding(); }
};

struct Separation {
  Vector3 normal = Vector3::UnitY();  // unit, from a to b, in a's frame
  double depth = 0.0;                 // m
  Vector3 point_a = Vector3::Zero();  // the points of the two surfaces that touch along the normal
  Vector3 point_b = Vector3::Zero();
};

// If the pair is further apart than `margin` (m, >= 0) the search may end early: then depth is only known to be below
// -margin, and nothing else is.
Separation find_separation(const PlacedPair& pair, double margin);
// The same if the cores are apart; nothing if they overlap, or are nearer than 1e-11 of `reach`.
std::optional<Separation> find_distance(const PlacedPair& pair, double margin);

}  // namespace gravitas
