// Contact points of features laid over each other: none is lost, however many corners they have.
#include "plugin_sdk/geometry/contour_contacts.h"

#include <gtest/gtest.h>

#include <cmath>
#include <memory>

#include "plugin_sdk/geometry/scene_shape.h"

namespace gravitas::collision {
namespace {

SceneShape prism(int sides, double half_height) {
  std::vector<Vector3> corners;
  for (int i = 0; i < sides; ++i)
    for (const double y : {-half_height, half_height})
      corners.emplace_back(std::cos(2.0 * M_PI * i / sides), y, std::sin(2.0 * M_PI * i / sides));
  std::string why;
  SceneShape shape;
  shape.kind = SceneShape::Kind::kConvexPolyhedron;
  shape.polyhedron = std::make_shared<ConvexPolyhedron>(*convex_hull(corners, &why));
  return shape;
}

// Turned by half a step the borders cross in 80 points and no corner lies over the other face.
TEST(ContourContacts, OfTwoFacesOfFortyCornersAreAllKept) {
  constexpr int kSides = 40;
  const SceneShape shape = prism(kSides, 0.5);
  const auto map = make_support_map(shape);
  const double angle = M_PI / kSides;
  const Matrix3 turned = Eigen::AngleAxisd(angle, Vector3::UnitY()).toRotationMatrix();
  const Vector3 up(0.0, 0.999, 0.0);
  Contour a, b;
  map->contour(Vector3::UnitY(), 0.03, &a);
  map->contour(-Vector3::UnitY(), 0.03, &b);
  ASSERT_EQ(a.count, 40U);
  place_contour(turned, up, &b);
  ContactCandidates candidates(0.0, 1e-9, 1e-6);
  add_contour_contacts(a, 0.0, b, 0.0, Vector3::UnitY(), 1e-9, &candidates);
  EXPECT_EQ(candidates.count(), 2 * kSides);

  // what is kept of them spans the face in both directions
  Manifold manifold;
  collide_support_maps({*map, *map, turned, up}, 0.0, &manifold);
  ASSERT_EQ(manifold.count, 4);
  Vector3 low = manifold.contacts[0].point, high = low;
  for (const ContactPoint& contact : manifold.contacts) {
    EXPECT_NEAR(contact.depth, 0.001, 1e-12);
    low = low.cwiseMin(contact.point), high = high.cwiseMax(contact.point);
  }
  EXPECT_GT((high - low).x(), 1.3);
  EXPECT_GT((high - low).z(), 1.3);
}

}  // namespace
}  // namespace gravitas::collision
