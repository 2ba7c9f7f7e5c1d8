// The narrow phase against answers known beforehand: closed forms for every pair of shapes, and the
// degenerate placements, each with the direction that is promised for it.
//
// Tolerance: lengths here are of order 1 m and the answer is a short chain of sums and products, so
// 1e-12 m leaves a few thousand roundings; tests that need more say why.
#include "workers/collision/standard/narrow_phase.h"

#include <gtest/gtest.h>

#include <cmath>
#include <set>
#include <vector>

#include "tests/turn_between.h"
#include "tests/workers/collision/standard/narrow_phase_fixture.h"

namespace gravitas::collision {
namespace {

using namespace test;  // NOLINT(google-build-using-namespace): the fixture of these tests

constexpr double kTolerance = 1e-12;
const double kHalfPi = std::acos(0.0);

void expect_near(const Vector3& actual, const Vector3& expected, double tolerance = kTolerance) {
  EXPECT_LE((actual - expected).cwiseAbs().maxCoeff(), tolerance)
      << actual.transpose() << " instead of " << expected.transpose();
}

// one contact with exactly these values
void expect_single(const Manifold& manifold, const Vector3& point, const Vector3& normal, double depth,
                   double tolerance = kTolerance) {
  ASSERT_EQ(manifold.count, 1);
  expect_near(contact(manifold, 0).point, point, tolerance);
  expect_near(contact(manifold, 0).normal, normal, tolerance);
  EXPECT_NEAR(contact(manifold, 0).depth, depth, tolerance);
}

// every contact has this normal and depth; the points are the expected ones in any order
void expect_patch(const Manifold& manifold, const Vector3& normal, double depth, const std::vector<Vector3>& points,
                  double tolerance = kTolerance) {
  ASSERT_EQ(manifold.count, static_cast<int>(points.size()));
  for (int i = 0; i < manifold.count; ++i) {
    expect_near(contact(manifold, i).normal, normal, tolerance);
    EXPECT_NEAR(contact(manifold, i).depth, depth, tolerance);
  }
  for (const Vector3& point : points) {
    double nearest = 1e300;
    for (int i = 0; i < manifold.count; ++i) {
      nearest = std::min(nearest, (contact(manifold, i).point - point).norm());
    }
    EXPECT_LE(nearest, tolerance) << "no contact at " << point.transpose();
  }
}

std::set<std::uint32_t> features_of(const Manifold& manifold) {
  std::set<std::uint32_t> features;
  for (int i = 0; i < manifold.count; ++i) features.insert(contact(manifold, i).feature);
  return features;
}

// ---- spheres ----

TEST(SphereSphere, OverlapOfUnequalRadiiPutsThePointMidway) {
  // radii 2 and 1, centres 2.5 apart: surfaces at 2 and 1.5, so the point lies at 1.75
  const Manifold m = contacts_of(sphere(2), at(1, 0, 0), sphere(1), at(3.5, 0, 0));
  expect_single(m, Vector3(2.75, 0, 0), Vector3::UnitX(), 0.5);
}

TEST(SphereSphere, GapIsReportedWithinTheMarginOnly) {
  const Manifold m = contacts_of(sphere(1), at(0, 0, 0), sphere(1), at(0, 0, 2.25), 0.25);
  expect_single(m, Vector3(0, 0, 1.125), Vector3::UnitZ(), -0.25);
  EXPECT_EQ(contacts_of(sphere(1), at(0, 0, 0), sphere(1), at(0, 0, 2.25), 0.249).count, 0);
}

TEST(SphereSphere, CoincidentCentresUseTheFixedNormal) {
  expect_single(contacts_of(sphere(1), at(1, 2, 3), sphere(0.5), at(1, 2, 3)), Vector3(1, 2.25, 3), Vector3::UnitY(),
                1.5);
}

TEST(SphereSphere, CentresApartByLessThanASquareRootUnderflowKeepTheirDirection) {
  const Manifold m = contacts_of(sphere(1), at(0, 0, 0), sphere(0.5), at(0, 0, 1e-200));
  expect_single(m, Vector3(0, 0, 0.25), Vector3::UnitZ(), 1.5);
}

TEST(SphereHalfspace, DepthAndMidpoint) {
  expect_single(contacts_of(sphere(1), at(3, 0.5, 4), halfspace(), at(7, 0, -2)), Vector3(3, -0.25, 4),
                -Vector3::UnitY(), 0.5);
  // a centre below the plane: still pushed up
  expect_single(contacts_of(sphere(1), at(0, -2, 0), halfspace(), at(0, 0, 0)), Vector3(0, -1.5, 0), -Vector3::UnitY(),
                3.0);
  // the plane x = 0 with the solid on x <= 0
  expect_single(contacts_of(sphere(1), at(0.75, 5, 5), halfspace(), at(Vector3::Zero(), Vector3::UnitZ(), -kHalfPi)),
                Vector3(-0.125, 5, 5), -Vector3::UnitX(), 0.25);
}

TEST(SphereBox, FaceEdgeAndVertex) {
  expect_single(contacts_of(sphere(1), at(0, 1.75, 0.5), box(2, 1, 2), at(0, 0, 0)), Vector3(0, 0.875, 0.5),
                -Vector3::UnitY(), 0.25);
  // centre beyond the edge by (0.3, 0.4)
  expect_single(contacts_of(sphere(1), at(2.3, 1.4, 0), box(2, 1, 2), at(0, 0, 0)),
                Vector3(2, 1, 0) - 0.25 * Vector3(0.6, 0.8, 0), Vector3(-0.6, -0.8, 0), 0.5);
  // beyond the vertex by (2, 3, 6) / 7
  const Vector3 out = Vector3(2, 3, 6) / 7.0;
  const Vector3 vertex(2, 1, 2);
  const Pose X{vertex + 0.75 * out, Quaternion::Identity()};
  expect_single(contacts_of(sphere(1), X, box(2, 1, 2), at(0, 0, 0)), vertex - 0.125 * out, -out, 0.25);
}

TEST(SphereBox, CentreInsideLeavesThroughTheNearestFace) {
  // 0.25 below the top: depth = radius + 0.25, surfaces at -0.25 and 1
  expect_single(contacts_of(sphere(1), at(0, 0.75, 0), box(2, 1, 2), at(0, 0, 0)), Vector3(0, 0.375, 0),
                -Vector3::UnitY(), 1.25);
}

TEST(SphereBox, TiesInsideFollowTheOrderOfTheAxes) {
  expect_single(contacts_of(sphere(0.5), at(0, 0, 0), box(1, 1, 1), at(0, 0, 0)), Vector3(0.25, 0, 0),
                -Vector3::UnitX(), 1.5);
  expect_single(contacts_of(sphere(0.5), at(0, -0.5, 0.5), box(1, 1, 1), at(0, 0, 0)), Vector3(0, -0.5, 0.5),
                Vector3::UnitY(), 1.0);
}

TEST(SphereBox, CentreOnTheSurfaceUsesTheFaceNormal) {
  expect_single(contacts_of(sphere(0.5), at(2, 0.25, 0), box(2, 1, 2), at(0, 0, 0)), Vector3(1.75, 0.25, 0),
                -Vector3::UnitX(), 0.5);
}

TEST(SphereCylinder, SideCapAndRim) {
  expect_single(contacts_of(sphere(1), at(1.2, 0.5, 1.6), cylinder(1.5, 2), at(0, 0, 0)),
                Vector3(0.6, 0, 0.8) * 1.25 + Vector3(0, 0.5, 0), Vector3(-0.6, 0, -0.8), 0.5);
  expect_single(contacts_of(sphere(1), at(0.5, -2.75, 0), cylinder(1.5, 2), at(0, 0, 0)), Vector3(0.5, -1.875, 0),
                Vector3::UnitY(), 0.25);
  expect_single(contacts_of(sphere(1), at(1.8, 2.4, 0), cylinder(1.5, 2), at(0, 0, 0)),
                Vector3(1.5, 2, 0) - 0.25 * Vector3(0.6, 0.8, 0), Vector3(-0.6, -0.8, 0), 0.5);
}

TEST(SphereCylinder, CentreInside) {
  // nearest is the side, 0.25 away
  expect_single(contacts_of(sphere(0.5), at(1.25, 0, 0), cylinder(1.5, 2), at(0, 0, 0)), Vector3(1.125, 0, 0),
                -Vector3::UnitX(), 0.75);
  // nearest is the bottom cap
  expect_single(contacts_of(sphere(0.5), at(0.5, -1.75, 0), cylinder(1.5, 2), at(0, 0, 0)), Vector3(0.5, -1.625, 0),
                Vector3::UnitY(), 0.75);
  // on the axis with the side nearest: the fixed direction +x
  expect_single(contacts_of(sphere(0.5), at(0, 0, 0), cylinder(1, 2), at(0, 0, 0)), Vector3(0.25, 0, 0),
                -Vector3::UnitX(), 1.5);
  // on the axis with a cap nearest
  expect_single(contacts_of(sphere(0.5), at(0, 1, 0), cylinder(3, 2), at(0, 0, 0)), Vector3(0, 1.25, 0),
                -Vector3::UnitY(), 1.5);
}

// ---- half-space ----

TEST(BoxHalfspace, FaceOnGivesItsFourVertices) {
  const Manifold m = contacts_of(box(1, 2, 3), at(10, 1.875, 20), halfspace(), at(0, 0, 0));
  expect_patch(m, -Vector3::UnitY(), 0.125,
               {Vector3(11, -0.0625, 23), Vector3(9, -0.0625, 23), Vector3(11, -0.0625, 17), Vector3(9, -0.0625, 17)});
}

TEST(BoxHalfspace, SunkBelowTheSurfaceKeepsTheLowestFace) {
  const Manifold m = contacts_of(box(1, 1, 1), at(0, -5, 0), halfspace(), at(0, 0, 0));
  ASSERT_EQ(m.count, 4);
  for (int i = 0; i < 4; ++i) EXPECT_NEAR(contact(m, i).depth, 6.0, kTolerance);
}

TEST(BoxHalfspace, EdgeAndVertexDown) {
  const double lowest = std::sqrt(2.0);
  const Manifold edge = contacts_of(box(1, 1, 1), at(Vector3(0, lowest - 0.1, 0), Vector3::UnitZ(), 0.5 * kHalfPi),
                                    halfspace(), at(0, 0, 0));
  expect_patch(edge, -Vector3::UnitY(), 0.1, {Vector3(0, -0.05, 1), Vector3(0, -0.05, -1)});

  // the diagonal (1, 1, 1) turned upright
  const Quaternion q = gravitas::test::turn_between(Vector3(1, 1, 1), Vector3::UnitY());
  const Manifold vertex =
      contacts_of(box(1, 1, 1), Pose{Vector3(0, std::sqrt(3.0) - 0.1, 0), q}, halfspace(), at(0, 0, 0));
  expect_single(vertex, Vector3(0, -0.05, 0), -Vector3::UnitY(), 0.1);
}

TEST(CylinderHalfspace, StandingGivesFourSpreadRimPoints) {
  const Manifold m = contacts_of(cylinder(0.5, 1), at(0, 0.9, 0), halfspace(), at(0, 0, 0));
  expect_patch(m, -Vector3::UnitY(), 0.1,
               {Vector3(0.5, -0.05, 0), Vector3(-0.5, -0.05, 0), Vector3(0, -0.05, 0.5), Vector3(0, -0.05, -0.5)});
}

TEST(CylinderHalfspace, SpinAboutTheOwnAxisMovesNoContact) {
  const Manifold reference = contacts_of(cylinder(0.5, 1), at(0, 0.9, 0), halfspace(), at(0, 0, 0));
  for (int i = 1; i < 50; ++i) {
    const Manifold m =
        contacts_of(cylinder(0.5, 1), at(Vector3(0, 0.9, 0), Vector3::UnitY(), 0.13 * i), halfspace(), at(0, 0, 0));
    ASSERT_EQ(m.count, 4);
    for (int k = 0; k < 4; ++k) {
      expect_near(contact(m, k).point, contact(reference, k).point);
      EXPECT_EQ(contact(m, k).feature, contact(reference, k).feature);
    }
  }
}

TEST(CylinderHalfspace, TiltedStandsOnItsDeepestRimPoint) {
  // 0.2 rad about an axis 0.7 rad off x: the deepest point lies between the four fixed directions
  const double tilt = 0.2;
  const Vector3 about(std::cos(0.7), 0, std::sin(0.7));
  const double lowest = std::cos(tilt) * 1.0 + std::sin(tilt) * 0.5;
  const Manifold m =
      contacts_of(cylinder(0.5, 1), at(Vector3(0, lowest - 0.01, 0), about, tilt), halfspace(), at(0, 0, 0));
  ASSERT_EQ(m.count, 1);
  EXPECT_NEAR(contact(m, 0).depth, 0.01, kTolerance);
}

// A disk that rolls on its rim: also where its lowest point passes one of the four that stand for a rim at rest.
TEST(CylinderHalfspace, TheDeepestRimPointGoesOnSmoothly) {
  const double tilt = 0.2, lowest = std::cos(tilt) + 0.5 * std::sin(tilt);
  const double across = std::sin(tilt) - 0.5 * std::cos(tilt);
  for (const double heading : {-1e-3, -1e-4, -1e-5, 0.0, 1e-6, 3e-5, 3e-4}) {
    const Vector3 about(std::sin(heading), 0, std::cos(heading));
    const Manifold m =
        contacts_of(cylinder(0.5, 1), at(Vector3(0, lowest - 0.01, 0), about, tilt), halfspace(), at(0, 0, 0));
    ASSERT_EQ(m.count, 1);
    expect_near(contact(m, 0).point, Vector3(across * std::cos(heading), -0.005, -across * std::sin(heading)));
  }
}

TEST(CylinderHalfspace, LyingGivesBothEndsOfTheSideLine) {
  const Manifold m =
      contacts_of(cylinder(0.5, 1), at(Vector3(0, 0.4, 0), Vector3::UnitZ(), kHalfPi), halfspace(), at(0, 0, 0));
  expect_patch(m, -Vector3::UnitY(), 0.1, {Vector3(1, -0.05, 0), Vector3(-1, -0.05, 0)});
}

TEST(HalfspaceHalfspace, HasNoContacts) {
  EXPECT_EQ(contacts_of(halfspace(), at(0, 0, 0), halfspace(), at(0, 1, 0), 1.0).count, 0);
  EXPECT_FALSE(intersects(halfspace(), at(0, 0, 0), halfspace(), at(0, 1, 0)));
}

// ---- box - box ----

TEST(BoxBox, RestingFaceOnGivesFourEqualContacts) {
  const Manifold m = contacts_of(box(2, 1, 2), at(0, 0, 0), box(0.5, 0.5, 0.5), at(0.25, 1.49, -0.5));
  expect_patch(
      m, Vector3::UnitY(), 0.01,
      {Vector3(0.75, 0.995, 0), Vector3(-0.25, 0.995, 0), Vector3(0.75, 0.995, -1), Vector3(-0.25, 0.995, -1)});
}

TEST(BoxBox, EqualBoxesStackedFlushKeepTheirVertices) {
  // rounding sides either way must not change the features
  Random random(1);
  std::set<std::uint32_t> features;
  for (int i = 0; i < 200; ++i) {
    const Vector3 noise = random.vector(-1e-13, 1e-13);
    const Manifold m = contacts_of(box(1, 1, 1), at(0, 0, 0), box(1, 1, 1),
                                   Pose{Vector3(0, 1.999, 0) + noise, Quaternion::Identity()});
    ASSERT_EQ(m.count, 4);
    for (int k = 0; k < 4; ++k) EXPECT_NEAR(contact(m, k).depth, 0.001, kTolerance);
    if (features.empty()) features = features_of(m);
    EXPECT_EQ(features_of(m), features);
  }
  EXPECT_EQ(features.size(), 4u);
}

TEST(BoxBox, OverhangIsCutAtTheEdge) {
  const Manifold m = contacts_of(box(1, 1, 1), at(0, 0, 0), box(1, 1, 1), at(1.5, 1.9, 0));
  expect_patch(m, Vector3::UnitY(), 0.1,
               {Vector3(0.5, 0.95, 1), Vector3(0.5, 0.95, -1), Vector3(1, 0.95, 1), Vector3(1, 0.95, -1)});
}

TEST(BoxBox, TurnedByAnEighthReducesTheOctagonToFourSpreadPoints) {
  const Manifold m =
      contacts_of(box(1, 1, 1), at(0, 0, 0), box(1, 1, 1), at(Vector3(0, 1.9, 0), Vector3::UnitY(), 0.5 * kHalfPi));
  ASSERT_EQ(m.count, 4);
  // any four corners of the octagon that span it cover at least half of its area, 8 (sqrt 2 - 1)
  Vector3 sum = Vector3::Zero();
  for (int i = 0; i < 4; ++i) {
    EXPECT_NEAR(contact(m, i).depth, 0.1, kTolerance);
    sum += contact(m, i).point;
  }
  EXPECT_LE((0.25 * sum - Vector3(0, 0.95, 0)).norm(), 0.3);
}

TEST(BoxBox, CrossedEdgesTouchInOnePoint) {
  // two boxes turned by 45 degrees about different axes, one edge up along z, the other down along
  // x
  const double r = std::sqrt(2.0);
  const Pose below = at(Vector3::Zero(), Vector3::UnitZ(), 0.5 * kHalfPi);
  const Pose above = at(Vector3(0.1, 2 * r - 0.05, 0.2), Vector3::UnitX(), 0.5 * kHalfPi);
  const Manifold m = contacts_of(box(1, 1, 1), below, box(1, 1, 1), above);
  expect_single(m, Vector3(0, r - 0.025, 0.2), Vector3::UnitY(), 0.05);
}

TEST(BoxBox, FeaturesSurviveASmallMotion) {
  // a box turned by 20 degrees half over the edge: vertices, and edges crossing edges
  Random random(2);
  const Pose base = at(0, 0, 0);
  const Pose top = at(Vector3(0.9, 1.49, 0.1), Vector3::UnitY(), 0.35);
  const auto features = features_of(contacts_of(box(1, 1, 1), base, box(0.7, 0.5, 0.6), top, 1e-3));
  EXPECT_GE(features.size(), 3u);
  for (int i = 0; i < 200; ++i) {
    Pose moved = top;
    moved.position += random.vector(-1e-7, 1e-7);
    const Vector3 turn = random.vector(-1e-7, 1e-7);
    moved.orientation = Quaternion(1, turn.x(), turn.y(), turn.z()).normalized() * top.orientation;
    EXPECT_EQ(features_of(contacts_of(box(1, 1, 1), base, box(0.7, 0.5, 0.6), moved, 1e-3)), features);
  }
}

TEST(BoxBox, GapBetweenVerticesHasTheirDirection) {
  const Vector3 out = Vector3(2, 3, 6) / 7.0;
  const Pose X{Vector3(2, 2, 2) + 0.25 * out, Quaternion::Identity()};
  expect_single(contacts_of(box(1, 1, 1), at(0, 0, 0), box(1, 1, 1), X, 0.3), Vector3(1, 1, 1) + 0.125 * out, out,
                -0.25);
  EXPECT_EQ(contacts_of(box(1, 1, 1), at(0, 0, 0), box(1, 1, 1), X, 0.24).count, 0);
}

TEST(BoxBox, GapBetweenParallelEdgesGivesBothEndsOfTheirOverlap) {
  const Manifold m = contacts_of(box(1, 1, 1), at(0, 0, 0), box(1, 1, 1), at(2.3, 2.4, 0.5), 0.6);
  expect_patch(m, Vector3(0.6, 0.8, 0), -0.5, {Vector3(1.15, 1.2, 1), Vector3(1.15, 1.2, -0.5)});
}

TEST(BoxBox, CoincidentBoxesLeaveThroughAFace) {
  const Manifold m = contacts_of(box(1, 2, 3), at(0, 0, 0), box(1, 2, 3), at(0, 0, 0));
  ASSERT_GE(m.count, 1);
  EXPECT_NEAR(deepest(m), 2.0, kTolerance);
  EXPECT_NEAR(std::fabs(contact(m, 0).normal.x()), 1.0, kTolerance);
}

// ---- box - cylinder ----

TEST(BoxCylinder, StandingOnAFaceGivesFourRimPoints) {
  const Manifold m = contacts_of(box(2, 1, 2), at(0, 0, 0), cylinder(0.5, 1), at(0.3, 1.99, 0.4));
  expect_patch(
      m, Vector3::UnitY(), 0.01,
      {Vector3(0.8, 0.995, 0.4), Vector3(-0.2, 0.995, 0.4), Vector3(0.3, 0.995, 0.9), Vector3(0.3, 0.995, -0.1)});
}

TEST(BoxCylinder, SpinOnAFaceMovesNoContact) {
  const Manifold reference = contacts_of(box(2, 1, 2), at(0, 0, 0), cylinder(0.5, 1), at(0.3, 1.99, 0.4));
  for (int i = 1; i < 50; ++i) {
    const Manifold m = contacts_of(box(2, 1, 2), at(0, 0, 0), cylinder(0.5, 1),
                                   at(Vector3(0.3, 1.99, 0.4), Vector3::UnitY(), 0.13 * i));
    ASSERT_EQ(m.count, 4);
    for (int k = 0; k < 4; ++k) {
      expect_near(contact(m, k).point, contact(reference, k).point);
      EXPECT_EQ(contact(m, k).feature, contact(reference, k).feature);
    }
  }
}

TEST(BoxCylinder, CapOverAnEdgeIsCutThere) {
  // the rim of radius 1 about (0.5, 0) crosses x = 1 at z = +- sqrt(3) / 2
  const Manifold m = contacts_of(box(1, 1, 2), at(0, 0, 0), cylinder(1, 1), at(0.5, 1.99, 0));
  ASSERT_EQ(m.count, 4);
  double farthest = -1e300;
  for (int i = 0; i < 4; ++i) {
    EXPECT_NEAR(contact(m, i).depth, 0.01, kTolerance);
    EXPECT_LE(contact(m, i).point.x(), 1.0 + kTolerance);
    farthest = std::max(farthest, contact(m, i).point.x());
  }
  EXPECT_NEAR(farthest, 1.0, kTolerance);
}

TEST(BoxCylinder, SmallBoxOnACapGivesItsVertices) {
  const Manifold m = contacts_of(box(0.3, 0.5, 0.3), at(0.1, 1.49, 0), cylinder(1, 1), at(0, 0, 0));
  expect_patch(
      m, -Vector3::UnitY(), 0.01,
      {Vector3(0.4, 0.995, 0.3), Vector3(-0.2, 0.995, 0.3), Vector3(0.4, 0.995, -0.3), Vector3(-0.2, 0.995, -0.3)});
}

TEST(BoxCylinder, LyingOnAFaceGivesTwoPoints) {
  const Manifold m =
      contacts_of(box(2, 1, 2), at(0, 0, 0), cylinder(0.5, 1), at(Vector3(0.5, 1.49, 0), Vector3::UnitZ(), kHalfPi));
  expect_patch(m, Vector3::UnitY(), 0.01, {Vector3(1.5, 0.995, 0), Vector3(-0.5, 0.995, 0)});
}

TEST(BoxCylinder, LyingAcrossAnEdgeIsCutThere) {
  const Manifold m =
      contacts_of(box(2, 1, 2), at(0, 0, 0), cylinder(0.5, 1), at(Vector3(1.75, 1.49, 0), Vector3::UnitZ(), kHalfPi));
  expect_patch(m, Vector3::UnitY(), 0.01, {Vector3(2, 0.995, 0), Vector3(0.75, 0.995, 0)}, 1e-8);
}

TEST(BoxCylinder, SideAlongAnEdgeGivesTwoPoints) {
  // cylinder parallel to z beyond the edge (1, 1): normal along the diagonal, depth 0.05
  const double s = std::sqrt(0.5);
  const Vector3 out(s, s, 0);
  const Pose X = at(Vector3(1, 1, 0.5) + 0.45 * out, Vector3::UnitX(), kHalfPi);
  const Manifold m = contacts_of(box(1, 1, 1), at(0, 0, 0), cylinder(0.5, 1), X);
  const Vector3 middle = Vector3(1, 1, 0) - 0.025 * out;
  expect_patch(m, out, 0.05, {middle + Vector3(0, 0, 1), middle - Vector3(0, 0, 0.5)});
}

TEST(BoxCylinder, SideJustBeyondAnEdgeOfAFaceStillGivesTwoPoints) {
  // the axis is 0.01 beyond the edge: the face is within 1 % of the least depth, but nothing of the
  // side line lies over it, so the edge's normal must be used
  const Vector3 arm(0.01, 0.9, 0);
  const Manifold m =
      contacts_of(box(1, 1, 1), at(0, 0, 0), cylinder(1, 2), at(Vector3(1, 1, 0) + arm, Vector3::UnitX(), kHalfPi));
  const Vector3 out = arm.normalized();
  const double depth = 1.0 - arm.norm();
  const Vector3 middle = Vector3(1, 1, 0) - 0.5 * depth * out;
  expect_patch(m, out, depth, {middle + Vector3(0, 0, 1), middle - Vector3(0, 0, 1)});
}

TEST(BoxCylinder, EdgeAcrossTheSideTouchesInOnePoint) {
  // edge up along z under a cylinder along x
  const double r = std::sqrt(2.0);
  const Manifold m = contacts_of(box(1, 1, 1), at(Vector3::Zero(), Vector3::UnitZ(), 0.5 * kHalfPi), cylinder(0.5, 1),
                                 at(Vector3(0.2, r + 0.45, 0.3), Vector3::UnitZ(), kHalfPi));
  expect_single(m, Vector3(0, r - 0.025, 0.3), Vector3::UnitY(), 0.05);
}

// Faces that are nearly parallel and cross in two edges: the vertex that would be deepest lies beside.
TEST(BoxBox, NearlyParallelFacesThatCrossInEdgesTouchInAllOfTheirPatch) {
  const Pose X_B{Vector3(1.5, 1.98, 1.5),
                 Quaternion(Eigen::AngleAxisd(-0.03, Vector3::UnitZ())) * Eigen::AngleAxisd(-0.03, Vector3::UnitX())};
  const Shape cube = box(1, 1, 1);
  const Manifold m = contacts_of(cube, at(0, 0, 0), cube, X_B, 0.1);
  ASSERT_EQ(m.count, 4);
  const Vector3 n = contact(m, 0).normal;
  // across an edge of each
  EXPECT_NEAR(n.dot(Vector3::UnitZ()), 0.0, 1e-15);
  EXPECT_NEAR(n.dot(X_B.orientation * Vector3::UnitX()), 0.0, 1e-15);
  EXPECT_NEAR(deepest(m), depth_along(cube, at(0, 0, 0), cube, X_B, n), 1e-15);
  // its corners: where the edges cross, and half a metre along both
  double along_x = 0.0, along_z = 0.0;
  for (int i = 0; i < 4; ++i) {
    along_x = std::max(along_x, 1.0 - contact(m, i).point.x());
    along_z = std::max(along_z, contact(m, i).point.z() - 0.5);
  }
  EXPECT_NEAR(along_x, 0.5, 0.05);
  EXPECT_NEAR(along_z, 0.5, 0.05);
}

TEST(BoxCylinder, VertexIntoTheSideHasTheRadialNormal) {
  // a vertex of the box pointing along +x at a cylinder standing on y, 0.05 deep
  const Quaternion q = gravitas::test::turn_between(Vector3(1, 1, 1), Vector3::UnitX());
  const double reach = std::sqrt(3.0);
  const Manifold m = contacts_of(box(1, 1, 1), Pose{Vector3::Zero(), q}, cylinder(2, 3), at(reach + 1.95, 0, 0));
  expect_single(m, Vector3(reach - 0.025, 0, 0), Vector3::UnitX(), 0.05);
}

TEST(BoxCylinder, EdgeAgainstTheRimHasTheEllipseNormal) {
  // Seen along the box edge (z), a cylinder tilted by angle t about x has a rim whose ellipse has
  // semi-axes r and r sin t. Its lowest point in direction (-1, -1) / sqrt 2 gives depth and
  // normal.
  const double t = 0.6;
  const double r = 1.0;
  const double half_height = 2.0;
  const Pose X = at(Vector3(2.9, 3.4, 0.1), Vector3::UnitX(), t);
  const Shape b = cylinder(r, half_height);
  const Shape a = box(1, 1, 3);
  const Manifold m = contacts_of(a, at(0, 0, 0), b, X, 5.0);
  ASSERT_GE(m.count, 1);
  const Vector3 n = contact(m, 0).normal;
  EXPECT_NEAR(n.z(), 0.0, kTolerance);
  // stationary and deepest among the neighbours perpendicular to the edge, by its closed form
  const auto h = [&](double angle) {
    return depth_along(a, at(0, 0, 0), b, X, Vector3(std::cos(angle), std::sin(angle), 0));
  };
  const double angle = std::atan2(n.y(), n.x());
  EXPECT_NEAR(deepest(m), h(angle), kTolerance);
  // central difference with step 1e-4: truncation 1e-8 times the third derivative
  EXPECT_NEAR((h(angle + 1e-4) - h(angle - 1e-4)) / 2e-4, 0.0, 1e-6);
  EXPECT_LT(h(angle), h(angle + 1e-3));
  EXPECT_LT(h(angle), h(angle - 1e-3));
}

// ---- cylinder - cylinder ----

TEST(CylinderCylinder, StandingOnACapGivesFourRimPoints) {
  const Manifold m = contacts_of(cylinder(1, 1), at(0, 0, 0), cylinder(0.5, 1), at(0.2, 1.99, 0.1));
  ASSERT_EQ(m.count, 4);
  Vector3 sum = Vector3::Zero();
  for (int i = 0; i < 4; ++i) {
    EXPECT_NEAR(contact(m, i).depth, 0.01, kTolerance);
    const Vector3 arm = contact(m, i).point - Vector3(0.2, 0.995, 0.1);
    EXPECT_NEAR(arm.norm(), 0.5, kTolerance);
    sum += arm;
  }
  expect_near(sum, Vector3::Zero());
}

TEST(CylinderCylinder, EqualCylindersStackedGiveFourPoints) {
  Random random(3);
  std::set<std::uint32_t> features;
  for (int i = 0; i < 100; ++i) {
    const Vector3 noise = random.vector(-1e-13, 1e-13);
    const Manifold m = contacts_of(cylinder(1, 1), at(0, 0, 0), cylinder(1, 1),
                                   at(Vector3(0, 1.99, 0) + noise, Vector3::UnitY(), 0.1 * i));
    ASSERT_EQ(m.count, 4);
    if (features.empty()) features = features_of(m);
    EXPECT_EQ(features_of(m), features);
  }
}

TEST(CylinderCylinder, CapsOverlappingInALensGiveItsTipsAndSides) {
  // unit discs 1 apart: tips at (0.5, +- sqrt(3) / 2), sides at x = 0 and 1
  const Manifold m = contacts_of(cylinder(1, 1), at(0, 0, 0), cylinder(1, 1), at(1, 1.99, 0));
  const double tip = std::sqrt(0.75);
  expect_patch(m, Vector3::UnitY(), 0.01,
               {Vector3(0.5, 0.995, tip), Vector3(0.5, 0.995, -tip), Vector3(0, 0.995, 0), Vector3(1, 0.995, 0)}, 1e-8);
}

TEST(CylinderCylinder, ParallelSidesGiveTwoPoints) {
  const Manifold m = contacts_of(cylinder(1, 1), at(0, 0, 0), cylinder(0.5, 1), at(1.2, 0.5, 0.864), 0.0);
  const double distance = std::hypot(1.2, 0.864);
  const Vector3 n(1.2 / distance, 0, 0.864 / distance);
  const double depth = 1.5 - distance;
  const Vector3 middle = (1.0 - 0.5 * depth) * n;
  expect_patch(m, n, depth, {middle + Vector3(0, 1, 0), middle - Vector3(0, 0.5, 0)});
}

TEST(CylinderCylinder, CrossingSidesTouchInOnePoint) {
  const Manifold m = contacts_of(cylinder(0.5, 2), at(Vector3::Zero(), Vector3::UnitZ(), kHalfPi), cylinder(0.25, 2),
                                 at(Vector3(0.3, 0.7, 0.4), Vector3::UnitX(), kHalfPi));
  expect_single(m, Vector3(0.3, 0.475, 0), Vector3::UnitY(), 0.05);
}

TEST(CylinderCylinder, SideOnACapGivesTwoPoints) {
  const Manifold m =
      contacts_of(cylinder(1, 1), at(0, 0, 0), cylinder(0.25, 2), at(Vector3(0, 1.24, 0.6), Vector3::UnitZ(), kHalfPi));
  expect_patch(m, Vector3::UnitY(), 0.01, {Vector3(0.8, 0.995, 0.6), Vector3(-0.8, 0.995, 0.6)}, 1e-8);
}

TEST(CylinderCylinder, CoaxialAndCoincidentEndInAFixedDirection) {
  const Manifold thin = contacts_of(cylinder(1, 5), at(0, 0, 0), cylinder(0.5, 5), at(0, 0, 0));
  ASSERT_GE(thin.count, 1);
  EXPECT_NEAR(deepest(thin), 1.5, kTolerance);
  EXPECT_NEAR(contact(thin, 0).normal.y(), 0.0, kTolerance);
  const Manifold flat = contacts_of(cylinder(5, 1), at(0, 0, 0), cylinder(4, 0.5), at(0, 0, 0));
  ASSERT_GE(flat.count, 1);
  EXPECT_NEAR(deepest(flat), 1.5, kTolerance);
  EXPECT_NEAR(std::fabs(contact(flat, 0).normal.y()), 1.0, kTolerance);
}

TEST(CylinderCylinder, RimAgainstRimIsSymmetricForACrossedPair) {
  // Two thin discs, one turned about x by +-t, seen from above: both rims meet over the x axis by
  // symmetry under the half turn about x that exchanges them, so the normal has no x component.
  const double t = 0.9;
  const Shape disc = cylinder(1, 0.01);
  const Pose a = at(Vector3(0, 0, 0), Vector3::UnitX(), t);
  const Pose b = at(Vector3(0, 0, 1.3), Vector3::UnitX(), -t);
  const Manifold m = contacts_of(disc, a, disc, b, 3.0);
  ASSERT_GE(m.count, 1);
  EXPECT_NEAR(contact(m, 0).normal.x(), 0.0, 1e-9);
  EXPECT_NEAR(deepest(m), depth_along(disc, a, disc, b, contact(m, 0).normal), kTolerance);
}

TEST(CylinderCylinder, RimsThatMeetTwiceWithinAFewDegreesPartAtTheShallowerPlace) {
  // rims that run side by side, tilted by 0.008: the places are 3e-5 apart in depth
  const Shape a = cylinder(0.904926, 0.527304), b = cylinder(0.936323, 0.837026);
  const Pose X_WA = at(0, 0, 0);
  const Pose X_WB{Vector3(1.99568, 1.149239, 0.006669),
                  Quaternion(0.994411, 0.004001, -0.000424, -0.105502).normalized()};
  Random random(5);
  const double least = sampled_depth(a, X_WA, b, X_WB, 20000, &random);
  EXPECT_NEAR(deepest(contacts_of(a, X_WA, b, X_WB)), least, 1e-6);
}

}  // namespace
}  // namespace gravitas::collision
