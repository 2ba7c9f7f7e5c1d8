// Any two convex shapes by their support maps, and any against a half-space.
#include <cmath>

#include "plugin_sdk/geometry/contour_contacts.h"
#include "plugin_sdk/geometry/support_map_buffer.h"
#include "workers/collision/standard/pair_functions.h"

namespace gravitas::collision {
namespace {

// Features within this angle (its sine) of the plane touch as such: at the far end of a tilted face the gap decides. Of a
// rounded core the point below its far end lies under the surface by half the square of the angle, times the radius.
constexpr double kFacing = 0.2;
constexpr double kFacingRounded = 0.03;

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

}  // namespace

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
  const SupportMap& map = support_map_of(b, &buffer);
  const Vector3 up = placement.R_WA.col(1);
  const Vector3 down_B = -(placement.R_WB.transpose() * up);
  const double tie = 1e-9 * map.thinnest();
  ContactCandidates candidates(margin, tie, tie);
  const auto add = [&](const Vector3& point, std::uint32_t code) {
    const Vector3 x = placement.p_AB_W + placement.R_WB * point - map.rounding() * up;
    const double depth = -up.dot(x);
    candidates.add({x + (0.5 * depth) * up, up, depth, code});
  };
  Contour contour;
  map.contour(down_B, map.rounding() > 0.0 ? kFacingRounded : kFacing, &contour);
  // of a feature that does not lie flat the deepest point may be another
  double deepest = -std::numeric_limits<double>::infinity();
  for (std::size_t i = 0; i < contour.count; ++i) deepest = std::fmax(deepest, down_B.dot(contour.points[i]));
  const Vector3 support = map.support(down_B);
  if (down_B.dot(support) > deepest + tie) {
    Contour point;
    map.contour(down_B, 0.0, &point);
    add(support, point.count == 1 ? point.codes[0] : 0x7FFFU);
  }
  for (std::size_t i = 0; i < contour.count; ++i) add(contour.points[i], contour.codes[i]);
  candidates.reduce_to(out);
}

}  // namespace gravitas::collision
