// Any two convex shapes by their support maps, and any against a half-space.
#include <algorithm>

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

void contacts_along(const PlacedPair& pair, const Vector3& n, double margin, const Separation* least, Manifold* out,
                    const FeatureTest& is_dropped) {
  constexpr double kFlat = 0.2;
  const double tie = std::max(1e-9 * pair.thinnest(), 1e-13 * pair.reach());
  ContactCandidates candidates(margin, tie, std::max(1e-6 * pair.thinnest(), tie));
  Contour a, b;
  pair.a.contour(n, kFlat, &a);
  pair.b.contour(pair.R_AB.transpose() * -n, kFlat, &b);
  place_contour(pair.R_AB, pair.p_AB, &b);
  add_contour_contacts(a, pair.a.rounding(), b, pair.b.rounding(), n, tie, &candidates);
  if (candidates.count() == 0 && least != nullptr)
    candidates.add(
        {0.5 * (least->point_a + least->point_b), n, least->depth, (a.code & 0x7FFFU) << 15 | (b.code & 0x7FFFU)});
  if (is_dropped && a.is_face()) candidates.drop(is_dropped);
  candidates.reduce_to(out);
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
