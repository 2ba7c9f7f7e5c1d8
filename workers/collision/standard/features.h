// Names for the features of boxes and cylinders, and the feature id of a contact made from two
// names.
//
// The names are geometric (which vertex, which edge), not the history of a clipping, so the same
// touch keeps its id whichever body was the reference of the computation.
#pragma once

#include <cmath>
#include <cstdint>

#include "plugin_sdk/math/types.h"
#include "workers/collision/standard/shapes.h"

namespace gravitas::collision {

using FeatureCode = std::uint8_t;

// 0..5: the faces of a box, +x -x +y -y +z -z
inline FeatureCode box_face_code(int axis, bool negative) {
  return static_cast<FeatureCode>(2 * axis + (negative ? 1 : 0));
}

// 8..15: the vertices of a box by the signs of the coordinates of `vertex`
inline FeatureCode box_vertex_code(const Vector3& vertex) {
  const int bits =
      (std::signbit(vertex.x()) ? 1 : 0) + (std::signbit(vertex.y()) ? 2 : 0) + (std::signbit(vertex.z()) ? 4 : 0);
  return static_cast<FeatureCode>(8 + bits);
}

// 16..39: the edges of a box by their axis and the signs of the other two coordinates of a point on
// it
inline FeatureCode box_edge_code(int axis, const Vector3& on_edge) {
  int bits = 0;
  for (int i = 0; i < 3; ++i) {
    if (i != axis && std::signbit(on_edge[i])) bits += 1 << i;
  }
  return static_cast<FeatureCode>(16 + 8 * axis + bits);
}

// 0 top cap, 1 bottom cap
inline FeatureCode cylinder_cap_code(bool bottom) { return bottom ? 1 : 0; }

inline constexpr FeatureCode kCylinderSide = 2;

// 4..7 and 8..11: the rim of a cap in four quadrants; the contact's reference frame says which is
// the first
inline FeatureCode cylinder_rim_quadrant_code(bool bottom, int quadrant) {
  return static_cast<FeatureCode>((bottom ? 8 : 4) + quadrant);
}

// 12, 13: the point of a rim where a side line ends, or which is farthest along a direction
inline FeatureCode cylinder_rim_point_code(bool bottom) { return bottom ? 13 : 12; }

// The id of a contact of feature `a` of the first shape with feature `b` of the second; `repeat`
// tells apart the places where the same two features meet more than once (an edge and a rim).
inline std::uint32_t contact_feature(FeatureCode a, FeatureCode b, std::uint32_t repeat = 0) {
  return repeat << 16 | static_cast<std::uint32_t>(a) << 8 | b;
}

}  // namespace gravitas::collision
