// The touching feature of a box or cylinder seen from a direction: a face, a cap, or a line (an
// edge of a box, a side line of a cylinder). All coordinates are in the frame of the first shape of
// a pair.
#pragma once

#include <array>

#include "plugin_sdk/math/types.h"
#include "workers/collision/standard/cylinder_rim.h"
#include "workers/collision/standard/features.h"
#include "workers/collision/standard/shapes.h"

namespace gravitas::collision {

// A shape with its place, and the unit direction in which it meets the other one.
struct FacingShape {
  const Shape& shape;
  Matrix3 R;
  Vector3 centre;
  Vector3 outward;

  bool is_box() const { return shape.type == ShapeType::kBox; }
  Vector3 outward_local() const { return R.transpose() * outward; }
  // A surface point farthest along the outward direction.
  Vector3 support() const { return centre + R * support_point(shape, outward_local()); }
};

// A plane through `point` with unit `normal`.
struct Plane {
  Vector3 point;
  Vector3 normal;

  // Where the line through x along the unit vector n meets the plane, as its coordinate along n
  // (m). Precondition: n is not parallel to the plane.
  double height_along(const Vector3& n, const Vector3& x) const {
    return n.dot(x) + normal.dot(point - x) / normal.dot(n);
  }
};

// A face of a box: |x| <= half_u, |y| <= half_v in the coordinates along u and v from the centre.
// Vertex i and edge i (from vertex i to vertex i + 1) run round it.
struct BoxFace {
  Plane plane;
  Vector3 u;
  Vector3 v;
  double half_u;
  double half_v;
  FeatureCode code;
  std::array<Vector3, 4> vertices;
  std::array<FeatureCode, 4> vertex_codes;
  std::array<FeatureCode, 4> edge_codes;
};

// The face of the box normal to its axis `axis`, on the outward side. The vertices are
// (+,+), (-,+), (-,-), (+,-) in (u, v), so the edges lie at v = +, u = -, v = -, u = +.
BoxFace box_face(const FacingShape& box, int axis);

// The face turned most towards the outward direction.
BoxFace facing_box_face(const FacingShape& box);

struct Cap {
  Plane plane;
  Rim rim;
  bool bottom;

  FeatureCode code() const { return cylinder_cap_code(bottom); }
};

// The cap on the outward side; its rim points are laid out from `reference` (see make_rim).
Cap facing_cap(const FacingShape& cylinder, const Vector3& reference);

// Whether the cap rather than a side line faces outward.
bool cap_faces(const FacingShape& cylinder);

struct Line {
  std::array<Vector3, 2> ends;
  std::array<FeatureCode, 2> end_codes;
  FeatureCode code;
  Vector3 direction;  // unit, from end 1 to end 0
  double radius;      // m, of the cylinder that the line lies on; 0 for an edge
};

// The side line of the cylinder, or the edge of the box, farthest outward.
Line facing_line(const FacingShape& shape);

// The part of a shape that lies within `sine` of the supporting plane, and its name.
struct Contour {
  enum class Kind { kPoint, kLine, kFace };
  Kind kind;
  FeatureCode code;
};

Contour contour(const FacingShape& shape, double sine);

}  // namespace gravitas::collision
