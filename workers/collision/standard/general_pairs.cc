// Any two convex shapes by their support maps, and any against a half-space.
#include "plugin_sdk/geometry/contour_contacts.h"
#include "plugin_sdk/geometry/support_map_buffer.h"
#include "workers/collision/standard/pair_functions.h"

namespace gravitas::collision {

SceneShape::Kind kind_of(ShapeType type) {
  switch (type) {
    case ShapeType::kSphere:
      return SceneShape::Kind::kSphere;
    case ShapeType::kBox:
      return SceneShape::Kind::kBox;
    case ShapeType::kCylinder:
      return SceneShape::Kind::kCylinder;
    case ShapeType::kCapsule:
      return SceneShape::Kind::kCapsule;
    default:
      return SceneShape::Kind::kCone;
  }
}

const SupportMap& support_map_of(const Shape& shape, SupportMapBuffer* buffer) {
  return shape.map != nullptr ? *shape.map : buffer->emplace(kind_of(shape.type), shape.size);
}

void collide_general(const Shape& a, const Shape& b, const Placement& placement, double margin, Manifold* out) {
  SupportMapBuffer buffer_a, buffer_b;
  const Matrix3 R_AW = placement.R_WA.transpose();
  const PlacedPair pair{support_map_of(a, &buffer_a), support_map_of(b, &buffer_b), R_AW * placement.R_WB,
                        R_AW * placement.p_AB_W};
  collide_support_maps(pair, margin, out);
  for (int i = 0; i < out->count; ++i) {
    ContactPoint& contact = out->contacts[static_cast<std::size_t>(i)];
    contact.point = placement.R_WA * contact.point;
    contact.normal = placement.R_WA * contact.normal;
  }
}

void collide_halfspace_general(const Shape&, const Shape& b, const Placement& placement, double margin, Manifold* out) {
  SupportMapBuffer buffer;
  collide_halfspace_support_map(placement.R_WA.col(1), support_map_of(b, &buffer), placement.R_WB, placement.p_AB_W,
                                margin, out);
}

}  // namespace gravitas::collision
