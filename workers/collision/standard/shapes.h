// The shapes that the standard collision plugin knows, with the two functions of a box or cylinder that the exact search
// of its narrow phase is built on: the support point and the support value.
//
// Spheres, boxes and cylinders are centred on the origin of their own frame and symmetric under reflection in
// that origin. Their part of the narrow phase uses the symmetry: for such a pair the two signs of an axis differ
// only in the sign of the distance between the centres. Other convex shapes bring a support map.
#pragma once

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <limits>

#include "plugin_sdk/geometry/support_map.h"
#include "plugin_sdk/math/types.h"

namespace gravitas::collision {

// The order of the values is the order in which a pair is computed (see narrow_phase.h). Types that register
// themselves (detector_table.h) count on from kRegistered.
enum class ShapeType : std::uint32_t {
  kSphere,
  kBox,
  kCylinder,
  kHalfspace,
  kCapsule,
  kCone,
  kConvexPolyhedron,
  kTriangleMesh,
  kCompound,
  kRegistered
};

struct CompoundShape;

// A solid in its own frame S. `size` (m) means:
//   sphere     x: radius
//   box        x, y, z: half extents along the axes of S
//   cylinder   x: radius, y: half height; the axis is the y axis of S
//   half-space nothing; the solid is y <= 0
//   capsule    x: radius, y: half the distance of the cap centres; axis y
//   cone       x: radius, y: half height; axis y, apex at +y
//   others     x: radius of a ball about the origin that holds it; y: least half extent, of a mesh the greatest half
//              extent of its box, of a compound the least of its children
// Precondition of every function on shapes: the sizes used are finite and > 0.
struct Shape {
  ShapeType type = ShapeType::kSphere;
  Vector3 size = Vector3::Zero();
  // Of a polyhedron or a registered type; null for primitives, whose map is made where one is needed
  // (support_map_of() of pair_functions.h).
  const SupportMap* map = nullptr;
  // What it was made of; null for primitives and registered types.
  const SceneShape* scene = nullptr;
  const TriangleMesh* mesh = nullptr;
  const SupportMap* hull = nullptr;  // of a closed mesh that is convex, the same solid
  const CompoundShape* compound = nullptr;

  bool is_composite() const { return mesh != nullptr || compound != nullptr; }
};

// Radius (m) of the smallest sphere about the origin of S that contains the shape; infinite for a
// half-space.
inline double bounding_radius(const Shape& shape) {
  switch (shape.type) {
    case ShapeType::kSphere:
      return shape.size.x();
    case ShapeType::kBox:
      return std::sqrt(shape.size.squaredNorm());
    case ShapeType::kCylinder:
      return std::sqrt(shape.size.x() * shape.size.x() + shape.size.y() * shape.size.y());
    case ShapeType::kCapsule:
      return shape.size.x() + shape.size.y();
    case ShapeType::kCone:
      return std::sqrt(shape.size.x() * shape.size.x() + shape.size.y() * shape.size.y());
    case ShapeType::kHalfspace:
      return std::numeric_limits<double>::infinity();
    default:
      return shape.size.x();
  }
}

// Smallest half extent (m) of a bounded shape.
inline double smallest_half_extent(const Shape& shape) {
  switch (shape.type) {
    case ShapeType::kBox:
      return shape.size.minCoeff();
    case ShapeType::kCylinder:
    case ShapeType::kCone:
      return std::min(shape.size.x(), shape.size.y());
    case ShapeType::kSphere:
    case ShapeType::kCapsule:
    case ShapeType::kHalfspace:
      return shape.size.x();
    default:
      return shape.size.y();
  }
}

// A point (m, in S) of the box or cylinder that is farthest along d_S, which need not be a unit
// vector. Where a whole edge or face is farthest, the point is one of its vertices (box), an end of
// the side line, or the centre of the cap (cylinder).
inline Vector3 support_point(const Shape& shape, const Vector3& d_S) {
  if (shape.type == ShapeType::kBox) {
    return Vector3(std::copysign(shape.size.x(), d_S.x()), std::copysign(shape.size.y(), d_S.y()),
                   std::copysign(shape.size.z(), d_S.z()));
  }
  const double radial = std::sqrt(d_S.x() * d_S.x() + d_S.z() * d_S.z());
  const double scale = radial > 0.0 ? shape.size.x() / radial : 0.0;
  return Vector3(scale * d_S.x(), std::copysign(shape.size.y(), d_S.y()), scale * d_S.z());
}

// The distance (m) from the origin of S to the supporting plane of the box or cylinder with the
// outward unit normal n_S: the maximum of n_S . x over the solid.
inline double support_value(const Shape& shape, const Vector3& n_S) {
  if (shape.type == ShapeType::kBox) {
    return shape.size.x() * std::fabs(n_S.x()) + shape.size.y() * std::fabs(n_S.y()) +
           shape.size.z() * std::fabs(n_S.z());
  }
  return shape.size.x() * std::sqrt(n_S.x() * n_S.x() + n_S.z() * n_S.z()) + shape.size.y() * std::fabs(n_S.y());
}

}  // namespace gravitas::collision
