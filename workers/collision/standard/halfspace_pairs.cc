// Box and cylinder against a half-space, y <= 0 of its frame (§§ 4.3.2.16 and 4.3.2.17, but a body
// sunk below the surface still touches, and the contact points are midpoints).
//
// Every candidate is a point x of the bounded body's surface at the signed distance s above the
// plane: its depth is -s, and the touching point of the half-space is its foot on the plane.
#include <cmath>

#include "plugin_sdk/geometry/contact_candidates.h"
#include "workers/collision/standard/cylinder_rim.h"
#include "workers/collision/standard/features.h"
#include "workers/collision/standard/pair_functions.h"
#include "workers/collision/standard/unit_vector.h"

namespace gravitas::collision {
namespace {

// The boundary plane in world axes, relative to the origin of the bounded body.
struct Ground {
  Vector3 normal;
  Vector3 origin;

  double height(const Vector3& x) const { return normal.dot(x - origin); }
};

void add_point(const Ground& plane, const Vector3& x, FeatureCode code, ContactCandidates* out) {
  const double depth = -plane.height(x);
  out->add({x + (0.5 * depth) * plane.normal, -plane.normal, depth, contact_feature(code, 0)});
}

ContactCandidates candidates_for(const Shape& bounded, double margin) {
  const double size = smallest_half_extent(bounded);
  return ContactCandidates(margin, 1e-9 * size, 1e-9 * size);
}

// the four rim points of a cap
void add_cap(const Ground& plane, const Rim& rim, bool bottom, ContactCandidates* out) {
  const auto depth_towards = [&](const Vector3& direction) {
    return -plane.height(rim.centre + rim.radius * direction);
  };
  const RimPoints points = spread_rim_points(rim, depth_towards);
  for (int i = 0; i < kRimPointCount; ++i) {
    add_point(plane, points[static_cast<std::size_t>(i)], cylinder_rim_quadrant_code(bottom, i), out);
  }
}

}  // namespace

void collide_box_halfspace(const Shape& a, const Shape&, const Placement& placement, double margin, Manifold* out) {
  const Ground plane{placement.R_WB.col(1), placement.p_AB_W};
  const Vector3 down_A = -(placement.R_WA.transpose() * plane.normal);
  int facing = 0;
  down_A.cwiseAbs().maxCoeff(&facing);
  const int j = (facing + 1) % 3;
  const int k = (facing + 2) % 3;

  // the vertices of the face turned most towards the plane: the deepest vertex is one of them
  ContactCandidates candidates = candidates_for(a, margin);
  for (int i = 0; i < 4; ++i) {
    Vector3 vertex = a.size;
    vertex[facing] = std::copysign(vertex[facing], down_A[facing]);
    if (i & 1) vertex[j] = -vertex[j];
    if (i & 2) vertex[k] = -vertex[k];
    add_point(plane, placement.R_WA * vertex, box_vertex_code(vertex), &candidates);
  }
  candidates.reduce_to(out);
}

void collide_cylinder_halfspace(const Shape& a, const Shape&, const Placement& placement, double margin,
                                Manifold* out) {
  const Ground plane{placement.R_WB.col(1), placement.p_AB_W};
  const Vector3 axis = placement.R_WA.col(1);
  const double axis_rise = axis.dot(plane.normal);
  const bool bottom = axis_rise >= 0.0;
  ContactCandidates candidates = candidates_for(a, margin);

  if (std::fabs(axis_rise) > kCapAlignment) {
    // the plane's own axes fix the four directions, so that a cylinder spinning about its axis
    // keeps its contact points
    const Rim rim = make_rim((bottom ? -a.size.y() : a.size.y()) * axis, axis, a.size.x(), placement.R_WB.col(0));
    add_cap(plane, rim, bottom, &candidates);
  } else {
    const Vector3 down = axis_rise * axis - plane.normal;
    const Vector3 line = a.size.x() * direction_of(down, placement.R_WA.col(0)).unit;
    add_point(plane, line + a.size.y() * axis, cylinder_rim_point_code(false), &candidates);
    add_point(plane, line - a.size.y() * axis, cylinder_rim_point_code(true), &candidates);
  }
  candidates.reduce_to(out);
}

}  // namespace gravitas::collision
