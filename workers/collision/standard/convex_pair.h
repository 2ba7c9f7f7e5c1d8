// A pair of bounded convex shapes (boxes, cylinders) in the frame of the first, and the one
// function that every method on such pairs minimises: the depth along a direction.
//
//   h(n) = s_A(n) + s_B(-n) - n . p        s: support values, p: centre of B in A
//
// h(n) is the translation of b along the unit vector n that just separates the pair in that
// direction; where negative, -h(n) is a gap that n proves. The penetration depth is min h over the
// unit sphere if the solids overlap, and -min h is their distance if they do not, so one signed
// number serves both and is continuous through touching. h is the support function of A - B, so the
// difference x(n) of the two support points is its gradient and h(n) = n . x(n).
#pragma once

#include <algorithm>
#include <cmath>

#include "plugin_sdk/math/types.h"
#include "workers/collision/standard/shapes.h"

namespace gravitas::collision {

struct ConvexPair {
  const Shape& a;
  const Shape& b;
  Matrix3 R_AB;
  Vector3 p_AB;
  // m, the size of the coordinates that appear: extents and offset together. Rounding errors of points and depths are a
  // few units of 1e-16 times this.
  double reach;
  // m, smallest half extent of both shapes.
  double thinnest;

  ConvexPair(const Shape& first, const Shape& second, const Matrix3& rotation, const Vector3& offset)
      : a(first),
        b(second),
        R_AB(rotation),
        p_AB(offset),
        reach(first.size.sum() + second.size.sum() + offset.cwiseAbs().sum()),
        thinnest(std::min(smallest_half_extent(first), smallest_half_extent(second))) {}

  // h(n), m; n in A, unit. The shapes are symmetric, so s_B(-n) = s_B(n).
  double depth_along(const Vector3& n) const {
    return support_value(a, n) + support_value(b, R_AB.transpose() * n) - n.dot(p_AB);
  }

  Vector3 support_a(const Vector3& n) const { return support_point(a, n); }
  Vector3 support_b(const Vector3& n) const { return p_AB + R_AB * support_point(b, -(R_AB.transpose() * n)); }
  // x(n), m: the point of A - B farthest along n.
  Vector3 support_difference(const Vector3& n) const { return support_a(n) - support_b(n); }
};

// m; places and depths that differ by less count as the same.
inline double rounding_length(const ConvexPair& pair) { return std::max(1e-9 * pair.thinnest, 1e-14 * pair.reach); }

// m; of two directions that differ by no more in depth, the one that comes first in order is taken.
inline double tie_length(const ConvexPair& pair) { return std::max(1e-7 * pair.thinnest, 1e-14 * pair.reach); }

// m; depths closer than this do not decide which points of a large patch are kept. A body at rest trembles by less, so
// its manifold keeps its features.
inline double depth_tie(const ConvexPair& pair) { return std::max(1e-6 * pair.thinnest, rounding_length(pair)); }

}  // namespace gravitas::collision
