// Capsules, cones and polyhedra against each other and all other shapes: known answers, and the laws every pair obeys.
#include <gtest/gtest.h>

#include <cmath>
#include <set>

#include "tests/workers/allocation_count.h"
#include "tests/workers/collision/standard/shape_fixture.h"

namespace gravitas::collision {
namespace {

using namespace test;  // NOLINT(google-build-using-namespace): the fixture of these tests
using gravitas::test::RandomShapes;

constexpr double kPi = 3.14159265358979323846;

TEST(GeneralPairs, CapsulesTouchAsSegmentsDo) {
  Shapes shapes;
  const Shape& pill = shapes.capsule(0.5, 1.0);
  // crossed, 0.8 apart
  const ContactList crossed =
      all_contacts(pill, at(0, 0, 0), pill, at(Vector3(0, 0, 0.8), Vector3::UnitZ(), 0.5 * kPi));
  ASSERT_EQ(crossed.size(), 1U);
  EXPECT_NEAR(crossed[0].depth, 0.2, 1e-15);
  EXPECT_LE((crossed[0].point - Vector3(0, 0, 0.4)).norm(), 1e-15);
  EXPECT_NEAR(crossed[0].normal.z(), 1.0, 1e-15);
  // side by side, shifted by half a length: both ends of the overlap
  const ContactList beside = all_contacts(pill, at(0, 0, 0), pill, at(0.9, 1.0, 0));
  ASSERT_EQ(beside.size(), 2U);
  std::set<double> heights{beside[0].point.y(), beside[1].point.y()};
  EXPECT_EQ(heights, (std::set<double>{0.0, 1.0}));
  for (std::size_t i = 0; i < 2; ++i) EXPECT_NEAR(beside[i].depth, 0.1, 1e-15);
  // end on end, in a line, overlapping at the centres too
  const ContactList ends = all_contacts(pill, at(0, 0, 0), pill, at(0, 2.9, 0));
  ASSERT_EQ(ends.size(), 1U);
  EXPECT_NEAR(ends[0].depth, 0.1, 1e-15);
}

TEST(GeneralPairs, ConeTouchesWithBaseSideAndApex) {
  Shapes shapes;
  const Shape& cone = shapes.cone(1.0, 1.0);  // 2 m high
  const Shape ground = halfspace();
  const ContactList standing = all_contacts(ground, at(0, 0, 0), cone, at(0, 0.99, 0));
  ASSERT_EQ(standing.size(), 4U);
  for (std::size_t i = 0; i < 4; ++i) {
    EXPECT_NEAR(standing[i].depth, 0.01, 1e-15);
    EXPECT_NEAR(std::hypot(standing[i].point.x(), standing[i].point.z()), 1.0, 1e-15);
  }
  const ContactList on_apex = all_contacts(ground, at(0, 0, 0), cone, at(Vector3(0, 0.9, 0), Vector3::UnitX(), kPi));
  ASSERT_EQ(on_apex.size(), 1U);
  EXPECT_NEAR(on_apex[0].depth, 0.1, 1e-15);
  // on its side: the line from apex to rim lies level when the axis is tilted by the half angle, atan(1/2)
  const double half_angle = std::atan(0.5);
  const double height = std::sin(half_angle);  // of the origin over the side line: |apex - origin| sin
  const ContactList lying = all_contacts(ground, at(0, 0, 0), cone,
                                         at(Vector3(0, height - 0.01, 0), Vector3::UnitZ(), -(0.5 * kPi + half_angle)));
  ASSERT_EQ(lying.size(), 2U);
  for (std::size_t i = 0; i < 2; ++i) EXPECT_NEAR(lying[i].depth, 0.01, 1e-12);
}

TEST(GeneralPairs, PolyhedronOnItsFaceHasFourPointsOnAnyGround) {
  Shapes shapes;
  const Shape& block = shapes.box_hull({1, 0.5, 2});
  const Shape grounds[] = {halfspace(), box(5, 1, 5), shapes.box_hull({5, 1, 5}), cylinder(5, 1)};
  for (const Shape& ground : grounds) {
    const double top = ground.type == ShapeType::kHalfspace ? 0.0 : 1.0;
    const ContactList contacts = all_contacts(ground, at(0, -top, 0), block, at(0.3, 0.49, 0.2), 0.1);
    ASSERT_EQ(contacts.size(), 4U) << static_cast<int>(ground.type);
    for (std::size_t i = 0; i < 4; ++i) {
      EXPECT_NEAR(contacts[i].depth, 0.01, 1e-14);
      EXPECT_NEAR(contacts[i].normal.y(), 1.0, 1e-14);
      EXPECT_NEAR(contacts[i].point.y(), -0.005, 1e-14);
      EXPECT_NEAR(std::fabs(contacts[i].point.x() - 0.3), 1.0, 1e-12);
      EXPECT_NEAR(std::fabs(contacts[i].point.z() - 0.2), 2.0, 1e-12);
    }
  }
}

TEST(GeneralPairs, HullOfABoxAnswersAsTheBox) {
  Shapes shapes;
  RandomShapes random(41);
  for (int i = 0; i < 400; ++i) {
    const Vector3 half_a = random.vector(0.3, 1.5), half_b = random.vector(0.3, 1.5);
    const Shape& hull_a = shapes.box_hull(half_a);
    const Shape& hull_b = shapes.box_hull(half_b);
    const Pose X_A{random.vector(-1, 1), random.rotation()}, X_B{random.vector(-1, 1), random.rotation()};
    const Shape box_a = box(half_a.x(), half_a.y(), half_a.z()), box_b = box(half_b.x(), half_b.y(), half_b.z());
    const double margin = 10.0;
    const double exact = all_contacts(box_a, X_A, box_b, X_B, margin).deepest();
    // both prefer faces by up to 1 %
    const double tolerance = 0.0102 * std::max(exact, 0.0) + 1e-6;
    EXPECT_NEAR(all_contacts(hull_a, X_A, hull_b, X_B, margin).deepest(), exact, tolerance);
    EXPECT_NEAR(all_contacts(hull_a, X_A, box_b, X_B, margin).deepest(), exact, tolerance);
  }
}

TEST(GeneralPairs, SeparationByTheDepthLeavesThemTouching) {
  Shapes shapes;
  RandomShapes random(42);
  for (const SceneShape::Kind kind_a :
       {SceneShape::Kind::kCapsule, SceneShape::Kind::kCone, SceneShape::Kind::kConvexPolyhedron}) {
    for (const SceneShape::Kind kind_b : gravitas::test::kConvexKinds) {
      for (int i = 0; i < 60; ++i) {
        const Shape &a = shapes.random(kind_a, &random), &b = shapes.random(kind_b, &random);
        const Pose X_A{random.vector(-5, 5), random.rotation()};
        Pose X_B{X_A.position + random.uniform(0.1, 1.5) * random.direction(), random.rotation()};
        const ContactList contacts = all_contacts(a, X_A, b, X_B, 10.0);
        ASSERT_GT(contacts.size(), 0U);
        const double depth = contacts.deepest();
        X_B.position += depth * contacts[0].normal;
        // h(normal) is the deepest contact's depth within 1e-6 of the size, so nothing is left beyond it
        const double left = all_contacts(a, X_A, b, X_B, 10.0).deepest();
        EXPECT_NEAR(left, 0.0, 2e-6 + 1e-2 * std::max(0.0, depth))
            << static_cast<int>(kind_a) << static_cast<int>(kind_b);
        EXPECT_LE(left, 2e-6);
      }
    }
  }
}

TEST(GeneralPairs, SwapTurnAndShiftChangeNothing) {
  Shapes shapes;
  RandomShapes random(43);
  for (const SceneShape::Kind kind_a :
       {SceneShape::Kind::kCapsule, SceneShape::Kind::kCone, SceneShape::Kind::kConvexPolyhedron}) {
    for (const SceneShape::Kind kind_b : gravitas::test::kConvexKinds) {
      for (int i = 0; i < 40; ++i) {
        const Shape &a = shapes.random(kind_a, &random), &b = shapes.random(kind_b, &random);
        const Pose X_A{random.vector(-5, 5), random.rotation()};
        const Pose X_B{X_A.position + random.uniform(0.1, 2.0) * random.direction(), random.rotation()};
        const ContactList one = all_contacts(a, X_A, b, X_B, 0.5), other = all_contacts(b, X_B, a, X_A, 0.5);
        ASSERT_EQ(one.size(), other.size());
        for (std::size_t k = 0; k < one.size(); ++k) {
          EXPECT_EQ(one[k].point, other[k].point);
          EXPECT_EQ(one[k].normal, Vector3(-other[k].normal));
          EXPECT_EQ(one[k].depth, other[k].depth);
          EXPECT_EQ(one[k].feature, other[k].feature);
        }
        if (one.size() == 0) continue;
        const Pose moved{random.vector(-3, 3), random.rotation()};
        const double turned = all_contacts(a, compose(moved, X_A), b, compose(moved, X_B), 0.5).deepest();
        EXPECT_NEAR(turned, one.deepest(), 1e-6 + 0.0102 * std::max(0.0, one.deepest()));
        // far away the positions themselves are rounded
        for (const double distance : {1e4, 1e8}) {
          const Vector3 far(distance, -distance, 0.5 * distance);
          const double away =
              all_contacts(a, {X_A.position + far, X_A.orientation}, b, {X_B.position + far, X_B.orientation}, 0.5)
                  .deepest();
          EXPECT_NEAR(away, one.deepest(), 1e-6 + 0.0102 * std::max(0.0, one.deepest()) + 8e-16 * distance);
        }
      }
    }
  }
}

TEST(GeneralPairs, AskTheHeapForNothing) {
  Shapes shapes;
  RandomShapes random(44);
  const Shape &a = shapes.random(SceneShape::Kind::kCone, &random),
              &b = shapes.random(SceneShape::Kind::kConvexPolyhedron, &random);
  Manifold manifold;
  const long before = gravitas::test::allocation_count();
  for (int i = 0; i < 50; ++i)
    collide(a, at(0, 0, 0), b, {0.02 * i * Vector3::Ones(), random.rotation()}, 0.1, &manifold);
  EXPECT_EQ(gravitas::test::allocation_count(), before);
}

}  // namespace
}  // namespace gravitas::collision
