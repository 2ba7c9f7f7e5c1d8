// Times of impact of composite shapes: as those of the same solid made otherwise, and where the answer is known.
#include "workers/collision/standard/moving_pairs.h"

#include <gtest/gtest.h>

#include <cmath>

#include "plugin_sdk/math/rotation.h"
#include "tests/workers/collision/standard/shape_fixture.h"

namespace gravitas::collision {
namespace {

using test::at;
constexpr double kTarget = 1e-6;

MovingBody still(const Pose& start) { return {{}, start, {}}; }
MovingBody moving(const Pose& start, const Vector3& displacement, const Vector3& rotation = Vector3::Zero()) {
  return {{}, start, {displacement, rotation}};
}

// Of the boxes that a mesh, a polyhedron and a compound may stand for.
struct BoxForms {
  std::vector<const Shape*> forms;
  BoxForms(test::Shapes* shapes, const Vector3& half)
      : forms{&shapes->primitive(SceneShape::Kind::kBox, half), &shapes->box_hull(half), &shapes->box_mesh(half)} {
    const Vector3 half_of_it(half.x(), half.y(), 0.5 * half.z());
    const Shape& part = shapes->primitive(SceneShape::Kind::kBox, half_of_it);
    const auto piece = [&](double side) { return Pose{Vector3(0, 0, side * 0.5 * half.z()), Quaternion::Identity()}; };
    forms.push_back(&shapes->compound({{&part, piece(1)}, {&part, piece(-1)}}));
  }
};

TEST(MovingPairs, ABoxIsABoxHoweverItIsMade) {
  gravitas::test::RandomShapes random(61);
  test::Shapes shapes;
  int found_count = 0;
  for (int i = 0; i < 25; ++i) {
    const BoxForms one(&shapes, random.vector(0.3, 1.0)), other(&shapes, random.vector(0.3, 1.0));
    const Vector3 way = random.direction();
    const MovingBody a{{random.vector(-0.3, 0.3), random.rotation()},
                       {random.vector(-1, 1), random.rotation()},
                       {random.vector(-1, 1), random.vector(-6, 6)}};
    const MovingBody b{{random.vector(-0.3, 0.3), random.rotation()},
                       {5.0 * way + random.vector(-1, 1), random.rotation()},
                       {-9.0 * way + random.vector(-1, 1), random.vector(-6, 6)}};
    const std::optional<Impact> known = first_impact(*one.forms[0], a, *other.forms[0], b, kTarget);
    found_count += known ? 1 : 0;
    for (std::size_t k = 0; k < one.forms.size(); ++k) {
      for (std::size_t m = 0; m < other.forms.size(); ++m) {
        SCOPED_TRACE(testing::Message() << "flight " << i << ", forms " << k << " and " << m);
        const std::optional<Impact> found = first_impact(*one.forms[k], a, *other.forms[m], b, kTarget);
        ASSERT_EQ(found.has_value(), known.has_value());
        if (!known) continue;
        // the same gap is reached within the target at some tenth of a metre per interval at least
        EXPECT_NEAR(found->fraction, known->fraction, 1e-5);
        EXPECT_LE(-found->depth, kTarget * (1.0 + 1e-9));
        EXPECT_GE(-found->depth, 0.5 * kTarget * (1.0 - 1e-6));
      }
    }
  }
  EXPECT_GT(found_count, 8);
}

TEST(MovingPairs, AMeshMeetsAPlaneWithItsLowestVertex) {
  gravitas::test::RandomShapes random(62);
  test::Shapes shapes;
  for (int i = 0; i < 40; ++i) {
    const BoxForms box(&shapes, random.vector(0.3, 1.0));
    const MovingBody body = moving({Vector3(0, 3, 0), random.rotation()}, {1, -6, 1}, random.vector(-9, 9));
    const MovingBody ground = still(at(0, 0, 0));
    const Shape plane = test::halfspace();
    const std::optional<Impact> known = first_impact(*box.forms[0], body, plane, ground, kTarget);
    ASSERT_TRUE(known);
    for (const Shape* form : box.forms) {
      const std::optional<Impact> found = first_impact(*form, body, plane, ground, kTarget);
      ASSERT_TRUE(found);
      EXPECT_NEAR(found->fraction, known->fraction, 1e-6);
      EXPECT_EQ(found->normal, -Vector3::UnitY());
    }
  }
}

TEST(MovingPairs, ABulletDoesNotPassASheetOfTriangles) {
  test::Shapes shapes;
  const Shape& field = shapes.field(20);
  const Shape& bullet = shapes.primitive(SceneShape::Kind::kSphere, Vector3::Constant(0.005));
  gravitas::test::RandomShapes random(63);
  for (int i = 0; i < 50; ++i) {
    // 900 m/s for 1/60 s: 3000 times its radius
    const Vector3 way = (random.vector(-0.4, 0.4) - Vector3::UnitY()).normalized();
    const Vector3 start{random.uniform(-2, 2), 7.0, random.uniform(-2, 2)};
    const std::optional<Impact> found =
        first_impact(field, still(at(0, 0, 0)), bullet, moving({start, Quaternion::Identity()}, 15.0 * way), kTarget);
    ASSERT_TRUE(found) << i;
    EXPECT_NEAR(found->fraction, (7.0 - 0.005) / (-15.0 * way.y()), kTarget);
    EXPECT_LE((found->normal - Vector3::UnitY()).norm(), 1e-9);
  }
}

TEST(MovingPairs, ACubeAt1000MetresPerSecondMeetsAnOpenMesh) {
  test::Shapes shapes;
  const Shape& field = shapes.field(10);
  const Shape& cube = shapes.primitive(SceneShape::Kind::kBox, Vector3::Constant(0.1));
  for (const double start : {0.2, 1.0, 8.0}) {
    const MovingBody flying = moving(at(0.3, start, 0.2), {0, -1000.0 / 60.0, 0});
    const std::optional<Impact> found = first_impact(cube, flying, field, still(at(0, 0, 0)), kTarget);
    ASSERT_TRUE(found);
    EXPECT_NEAR(found->fraction, (start - 0.1) * 60.0 / 1000.0, kTarget);
    EXPECT_LE((found->normal + Vector3::UnitY()).norm(), 1e-9);
  }
  // beside its border
  EXPECT_FALSE(first_impact(cube, moving(at(5.11, 1, 0), {0, -16, 0}), field, still(at(0, 0, 0)), kTarget));
}

TEST(MovingPairs, WhatIsInsideAClosedMeshTouchesAtTheStart) {
  test::Shapes shapes;
  const Shape& room = shapes.box_mesh(Vector3::Constant(2.0));
  const Shape& ball = shapes.primitive(SceneShape::Kind::kSphere, Vector3::Constant(0.1));
  const Shape& box = shapes.box_mesh(Vector3::Constant(0.1));
  for (const Shape* inner : {&ball, &box}) {
    const std::optional<Impact> found =
        first_impact(room, still(at(0, 0, 0)), *inner, moving(at(0.5, 0, 0), {0.1, 0, 0}), kTarget);
    ASSERT_TRUE(found);
    EXPECT_EQ(found->fraction, 0.0);
    EXPECT_GT(found->depth, 1.0);
    EXPECT_LE((found->normal - Vector3::UnitX()).norm(), 1e-12);
    const std::optional<Impact> other =
        first_impact(*inner, moving(at(0.5, 0, 0), {0.1, 0, 0}), room, still(at(0, 0, 0)), kTarget);
    ASSERT_TRUE(other);
    EXPECT_LE((other->normal + Vector3::UnitX()).norm(), 1e-12);
  }
}

// The difference of a vertex and the place of the surface next to it is rounding: a normal made of it was not of unit length.
TEST(MovingPairs, WhatBarelyTouchesAClosedMeshHasItsFacesNormal) {
  test::Shapes shapes;
  gravitas::test::RandomShapes random(64);
  const Shape& room = shapes.box_mesh(Vector3::Constant(2.0));
  const Shape& box = shapes.box_mesh(Vector3::Constant(0.1));
  for (int i = 0; i < 200; ++i) {
    const Pose X_WR{random.vector(-1, 1), random.rotation()};
    const double depth = 1e-14 * std::pow(10.0, i % 8);
    const MovingBody outer = still(X_WR);
    const MovingBody inner = moving(compose(X_WR, at(2.1 - depth, 0.3, -0.2)), random.vector(-0.1, 0.1));
    for (const double side : {1.0, -1.0}) {
      const std::optional<Impact> found =
          side > 0.0 ? first_impact(room, outer, box, inner, kTarget) : first_impact(box, inner, room, outer, kTarget);
      ASSERT_TRUE(found) << "depth " << depth;
      EXPECT_EQ(found->fraction, 0.0);
      EXPECT_NEAR(found->normal.squaredNorm(), 1.0, 1e-14) << "depth " << depth;
      EXPECT_LE((side * found->normal - X_WR.orientation * Vector3::UnitX()).norm(), 1e-6) << "depth " << depth;
    }
  }
}

// A mesh that turns under a ball that stands still: the edge of a wheel's paddle.
TEST(MovingPairs, ATurningMeshMeetsWhatStandsStill) {
  test::Shapes shapes;
  const Shape& paddle = shapes.box_mesh({1.0, 0.01, 0.5});
  const Shape& ball = shapes.primitive(SceneShape::Kind::kSphere, Vector3::Constant(0.1));
  const MovingBody turning{
      {Vector3(1, 0, 0), Quaternion::Identity()}, at(0, 0, 0), {Vector3::Zero(), Vector3(0, 0, 30)}};
  const std::optional<Impact> found = first_impact(paddle, turning, ball, still(at(0, 1, 0)), kTarget);
  ASSERT_TRUE(found);
  // its plane stands 0.11 m off the ball's centre at asin of that before the quarter turn
  EXPECT_NEAR(30.0 * found->fraction, 0.5 * M_PI - std::asin(0.11), 3.0 * kTarget);
}

TEST(MovingPairs, RaysMeetShapesInTheWorld) {
  gravitas::test::RandomShapes random(64);
  test::Shapes shapes;
  for (int i = 0; i < 200; ++i) {
    const BoxForms box(&shapes, random.vector(0.3, 1.0));
    const Pose pose{random.vector(-5, 5), random.rotation()};
    const Vector3 origin = pose.position + 4.0 * random.direction();
    const Ray ray{origin, (pose.position + 0.9 * random.direction() - origin).normalized(), 9.0};
    const std::optional<RayHit> known = cast_ray(*box.forms[0], pose, ray);
    for (const Shape* form : box.forms) {
      const std::optional<RayHit> hit = cast_ray(*form, pose, ray);
      ASSERT_EQ(hit.has_value(), known.has_value());
      if (!hit) continue;
      EXPECT_NEAR(hit->distance, known->distance, 1e-12);
      EXPECT_LE((hit->normal - known->normal).norm(), 1e-12);
    }
  }
}

}  // namespace
}  // namespace gravitas::collision
