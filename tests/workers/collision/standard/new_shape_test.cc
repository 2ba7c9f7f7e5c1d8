// A shape that joins from one file: this one. (It exists in the test program alone; the plugin's library knows nothing
// of it.)
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "tests/workers/collision/standard/shape_fixture.h"
#include "workers/collision/standard/detector_table.h"

namespace gravitas::collision {
namespace {

using namespace test;  // NOLINT(google-build-using-namespace): the fixture of these tests

class EllipsoidMap final : public SupportMap {
 public:
  explicit EllipsoidMap(const Vector3& half_axes) : half_axes_(half_axes) {
    radius_ = half_axes.maxCoeff(), thinnest_ = half_axes.minCoeff();
  }
  Vector3 support(const Vector3& d) const override {
    const Vector3 scaled = half_axes_.cwiseProduct(d);
    return half_axes_.cwiseProduct(scaled / std::sqrt(scaled.squaredNorm()));
  }

 private:
  Vector3 half_axes_;
};

int closed_form_calls = 0;

void collide_halfspace_ellipsoid(const Shape& a, const Shape& b, const Placement& placement, double margin,
                                 Manifold* out) {
  ++closed_form_calls;
  collide_halfspace_general(a, b, placement, margin, out);
}

TypeDeclaration declare_ellipsoid() {
  return {
      "Ellipsoid", "Half axes along x, y, z.", {Property::vector("HalfAxes", "m", "geometry").above(0.0).required()}};
}
std::unique_ptr<SupportMap> read_ellipsoid(PropertyCursor parameters) {
  return std::make_unique<EllipsoidMap>(parameters.vector());
}

const ShapeRegistration kEllipsoid(&declare_ellipsoid, &read_ellipsoid);
const DetectorRegistration kOnPlane(ShapeType::kHalfspace, kEllipsoid.type(), &collide_halfspace_ellipsoid);

TEST(NewShape, IsDeclaredAndMeetsEveryOther) {
  const auto types = declared_shapes();
  EXPECT_NE(std::find_if(types.begin(), types.end(), [](const auto& type) { return type.name == "Ellipsoid"; }),
            types.end());
  const double half_axes[] = {0.5, 1.0, 2.0};
  const StoredShape stored = read_shape(type_id("Ellipsoid"), half_axes, 0);
  const Shape& egg = stored.shape;

  const ContactList on_plane = all_contacts(halfspace(), at(0, 0, 0), egg, at(0, 0.9, 0));
  ASSERT_EQ(on_plane.size(), 1U);
  EXPECT_NEAR(on_plane[0].depth, 0.1, 1e-15);
  EXPECT_EQ(closed_form_calls, 1);

  Shapes shapes;
  gravitas::test::RandomShapes random(61);
  for (const SceneShape::Kind kind : gravitas::test::kConvexKinds) {
    const Shape& other = shapes.random(kind, &random);
    EXPECT_GT(all_contacts(egg, at(0, 0, 0), other, at(0.3, 0.2, 0.1)).size(), 0U);
    EXPECT_EQ(all_contacts(egg, at(0, 0, 0), other, at(9, 0, 0)).size(), 0U);
  }
  // beside a ball, along an axis
  EXPECT_NEAR(all_contacts(egg, at(0, 0, 0), sphere(1.0), at(0, 0, 2.9)).deepest(), 0.1, 1e-9);
  EXPECT_NEAR(all_contacts(shapes.field(4), at(0, 0, 0), egg, at(0.2, 0.95, 0.1)).deepest(), 0.05, 1e-9);
}

}  // namespace
}  // namespace gravitas::collision
