// Pairs at which a method may lose its direction: touching exactly, corner on corner, edges that are parallel or nearly
// so, one inside the other, needles and sheets. The answers are known beforehand, or those of the SDK's search by support
// points, which knows nothing of axes.
#include <gtest/gtest.h>

#include <cmath>

#include "plugin_sdk/geometry/penetration.h"
#include "tests/workers/collision/standard/shape_fixture.h"
#include "workers/collision/standard/pair_functions.h"

namespace gravitas::collision {
namespace {

using namespace test;  // NOLINT(google-build-using-namespace): the fixture of these tests
using gravitas::test::kConvexKinds;
using gravitas::test::RandomShapes;

constexpr double kRoot = 1.41421356237309504880;

double least_depth(const Shape& a, const Pose& X_A, const Shape& b, const Pose& X_B) {
  SupportMapBuffer buffer_a, buffer_b;
  const Pose X_AB = relative(X_A, X_B);
  return find_separation({support_map_of(a, &buffer_a), support_map_of(b, &buffer_b),
                          X_AB.orientation.toRotationMatrix(), X_AB.position},
                         1e9)
      .depth;
}

// How far a shape reaches along a direction of the world.
double reach_along(const Shape& shape, const Quaternion& q, const Vector3& n) {
  SupportMapBuffer buffer;
  const SupportMap& map = support_map_of(shape, &buffer);
  const Vector3 n_S = q.conjugate() * n;
  return n_S.dot(map.support(n_S)) + map.rounding();
}

// Of each kind one that is 2 m high and reaches 0.5 m to the sides, standing on its end.
const Shape& standing(SceneShape::Kind kind, Shapes* shapes) {
  if (kind == SceneShape::Kind::kConvexPolyhedron) return shapes->box_hull({0.5, 1.0, 0.5});
  if (kind == SceneShape::Kind::kSphere) return shapes->primitive(kind, Vector3::Constant(1.0));
  return shapes->primitive(kind, kind == SceneShape::Kind::kCapsule ? Vector3(0.5, 0.5, 0.5) : Vector3(0.5, 1.0, 0.5));
}

TEST(DegeneratePairs, WhatTouchesExactlyHasNoDepth) {
  Shapes shapes;
  const Shape &ground = shapes.primitive(SceneShape::Kind::kBox, {4, 1, 4}), &hull = shapes.box_hull({4, 1, 4}),
              &mesh = shapes.box_mesh({4, 1, 4}),
              &plane = shapes.primitive(SceneShape::Kind::kHalfspace, Vector3::Ones());
  for (const SceneShape::Kind kind : kConvexKinds) {
    const Shape& body = standing(kind, &shapes);
    for (const Shape* const below : {&ground, &hull, &mesh, &plane}) {
      SCOPED_TRACE(testing::Message() << "kind " << static_cast<int>(kind) << " on " << static_cast<int>(below->type));
      const Pose X_below = below == &plane ? at(0, 1, 0) : at(0, 0, 0);
      const ContactList contacts = all_contacts(*below, X_below, body, at(0.25, 2, -0.125), 1e-9);
      ASSERT_GT(contacts.size(), 0U);
      EXPECT_EQ(contacts.size(), kind == SceneShape::Kind::kSphere || kind == SceneShape::Kind::kCapsule ? 1U : 4U);
      for (std::size_t i = 0; i < contacts.size(); ++i) {
        EXPECT_NEAR(contacts[i].depth, 0.0, 4e-15);
        EXPECT_NEAR(contacts[i].normal.y(), 1.0, 1e-14);
        EXPECT_NEAR(contacts[i].point.y(), 1.0, 1e-14);
      }
    }
  }
}

TEST(DegeneratePairs, CornerOnCorner) {
  Shapes shapes;
  const Shape &box = shapes.primitive(SceneShape::Kind::kBox, Vector3::Ones()),
              &hull = shapes.box_hull(Vector3::Ones());
  for (const auto& [a, b] : {std::pair(&box, &box), std::pair(&box, &hull), std::pair(&hull, &hull)}) {
    for (const double gap : {0.0, 1e-9, 1e-3}) {
      const ContactList contacts = all_contacts(*a, at(0, 0, 0), *b, at(2 + gap, 2 + gap, 2 + gap), 0.1);
      ASSERT_EQ(contacts.size(), 1U) << gap;
      EXPECT_NEAR(contacts[0].depth, -std::sqrt(3.0) * gap, gap == 1e-3 ? 1e-14 : 1e-9);
      EXPECT_LE((contacts[0].point - Vector3::Constant(1 + 0.5 * gap)).norm(), 1e-9 + 1e-9 * gap);
      if (gap == 1e-3) {
        EXPECT_LE((contacts[0].normal - Vector3::Ones() / std::sqrt(3.0)).norm(), 1e-12);
      }
    }
  }
  // apex on apex
  const Shape& cone = shapes.cone(0.5, 1.0);
  const ContactList tips = all_contacts(cone, at(0, 0, 0), cone, at({0, 2, 0}, Vector3::UnitX(), EIGEN_PI), 1e-3);
  ASSERT_EQ(tips.size(), 1U);
  EXPECT_NEAR(tips[0].depth, 0.0, 1e-9);
  EXPECT_LE((tips[0].point - Vector3(0, 1, 0)).norm(), 1e-9);
}

TEST(DegeneratePairs, ParallelEdges) {
  Shapes shapes;
  const Shape &box = shapes.primitive(SceneShape::Kind::kBox, {1, 1, 2}), &hull = shapes.box_hull({1, 1, 2});
  for (const auto& [a, b] : {std::pair(&box, &box), std::pair(&box, &hull), std::pair(&hull, &hull)}) {
    for (const double gap : {1e-3, 0.0, -1e-3}) {
      // edges along z, one above the other, overlapping over 3 m
      const Pose X_A = at({0, 0, 0}, Vector3::UnitZ(), 0.25 * EIGEN_PI);
      const Pose X_B = at({0, 2 * kRoot + gap, 1}, Vector3::UnitZ(), 0.25 * EIGEN_PI);
      const ContactList contacts = all_contacts(*a, X_A, *b, X_B, 0.01);
      ASSERT_GT(contacts.size(), 0U) << gap;
      // the way out of an overlap is along the faces' normal
      EXPECT_NEAR(contacts.deepest(), gap > 0.0 ? -gap : -gap / kRoot, 1e-14) << gap;
      if (gap <= 0.0) continue;
      ASSERT_EQ(contacts.size(), 2U);
      for (std::size_t i = 0; i < 2; ++i) {
        EXPECT_NEAR(contacts[i].normal.y(), 1.0, 1e-12);
        EXPECT_NEAR(std::fabs(contacts[i].point.z() - 0.5), 1.5, 1e-12);
      }
    }
  }
}

TEST(DegeneratePairs, NearlyParallelEdges) {
  Shapes shapes;
  RandomShapes random(61);
  for (const double angle : {1e-2, 1e-4, 1e-6, 1e-7, 1e-8, 1e-9, 1e-12, 1e-16}) {
    for (int i = 0; i < 300; ++i) {
      const Shape &a = shapes.random(SceneShape::Kind::kBox, &random),
                  &b = shapes.random(SceneShape::Kind::kBox, &random);
      const Pose X_A{random.vector(-3, 3), random.rotation()};
      Pose X_B{X_A.position + random.uniform(0.5, 3.0) * random.direction(),
               Quaternion(Eigen::AngleAxisd(angle, random.direction())) * X_A.orientation};
      // as it lies, and within a tenth of a millimetre of touching
      for (const bool is_near : {false, true}) {
        const double least = least_depth(a, X_A, b, X_B);
        const ContactList contacts = all_contacts(a, X_A, b, X_B, 10.0);
        ASSERT_GT(contacts.size(), 0U);
        // a face is preferred by 1 % of the depth, and by 1e-7 of the thinnest half extent; points count as equally
        // deep up to 1e-6 of it
        EXPECT_NEAR(contacts.deepest(), least, 0.0102 * std::max(least, 0.0) + 1.3e-6)
            << angle << (is_near ? ", near" : "");
        X_B.position += (contacts.deepest() + random.uniform(-1e-4, 1e-4)) * contacts[0].normal;
      }
    }
  }
}

TEST(DegeneratePairs, WhatIsInsideLeavesByTheShortestWay) {
  Shapes shapes;
  RandomShapes random(62);
  const Shape &room = shapes.primitive(SceneShape::Kind::kBox, {20, 20, 20}), &hull = shapes.box_hull({20, 20, 20}),
              &column = shapes.primitive(SceneShape::Kind::kCylinder, {20, 60, 20});
  for (const SceneShape::Kind kind : kConvexKinds) {
    for (int i = 0; i < 40; ++i) {
      const Shape& inner = shapes.random(kind, &random);
      const Pose X_I{{17, random.uniform(-3, 3), random.uniform(-3, 3)}, random.rotation()};
      for (const Shape* const outer : {&room, &hull}) {
        const double depth = 3.0 + reach_along(inner, X_I.orientation, -Vector3::UnitX());
        const ContactList contacts = all_contacts(*outer, at(0, 0, 0), inner, X_I);
        ASSERT_GT(contacts.size(), 0U) << static_cast<int>(kind);
        EXPECT_NEAR(contacts.deepest(), depth, 1e-6);
        EXPECT_NEAR(contacts[0].normal.x(), 1.0, 1e-9);
      }
      // through the side of a column, seen along the line from its axis
      const ContactList contacts = all_contacts(column, at(0, 0, 0), inner, X_I);
      ASSERT_GT(contacts.size(), 0U) << static_cast<int>(kind);
      EXPECT_NEAR(contacts.deepest(), least_depth(column, at(0, 0, 0), inner, X_I), 0.0102 * contacts.deepest());
    }
  }
}

TEST(DegeneratePairs, NeedlesAndSheetsStandAndLie) {
  Shapes shapes;
  constexpr double kThin = 1e-6, kSunk = 1e-7;
  const Shape& ground = shapes.primitive(SceneShape::Kind::kBox, {4, 1, 4});
  const auto box_of = [&](SceneShape::Kind kind, const Vector3& half) -> const Shape& {
    return kind == SceneShape::Kind::kConvexPolyhedron ? shapes.box_hull(half) : shapes.primitive(kind, half);
  };
  for (const SceneShape::Kind kind :
       {SceneShape::Kind::kBox, SceneShape::Kind::kConvexPolyhedron, SceneShape::Kind::kCylinder,
        SceneShape::Kind::kCone, SceneShape::Kind::kCapsule}) {
    const bool is_round = kind == SceneShape::Kind::kCapsule;
    // half heights: of the needle upright, of the sheet flat
    const Shape &needle = box_of(kind, {kThin, 1.0, kThin}), &sheet = box_of(kind, {1.0, kThin, 1.0});
    const double up = is_round ? 1.0 + kThin : 1.0, flat = is_round ? 1.0 + kThin : kThin;
    for (const auto& [shape, half] : {std::pair(&needle, up), std::pair(&sheet, flat)}) {
      const ContactList contacts = all_contacts(ground, at(0, 0, 0), *shape, at(0.3, 1.0 + half - kSunk, 0.2));
      ASSERT_GT(contacts.size(), 0U) << static_cast<int>(kind);
      EXPECT_NEAR(contacts.deepest(), kSunk, 1e-13) << static_cast<int>(kind);
      EXPECT_NEAR(contacts[0].normal.y(), 1.0, 1e-12);
    }
    if (kind == SceneShape::Kind::kCone) continue;
    // the needle lying, turned about the vertical
    const Quaternion lying = Quaternion(Eigen::AngleAxisd(0.7, Vector3::UnitY())) *
                             Quaternion(Eigen::AngleAxisd(0.5 * EIGEN_PI, Vector3::UnitZ()));
    const ContactList contacts = all_contacts(ground, at(0, 0, 0), needle, {{0.3, 1.0 + kThin - kSunk, 0.2}, lying});
    ASSERT_GE(contacts.size(), 2U) << static_cast<int>(kind);
    for (std::size_t i = 0; i < contacts.size(); ++i) EXPECT_NEAR(contacts[i].depth, kSunk, 1e-13);
  }
}

TEST(DegeneratePairs, NeedlesAndSheetsInAnyPoseHaveTheLeastDepth) {
  Shapes shapes;
  RandomShapes random(63);
  constexpr double kThin = 1e-6;
  const Vector3 sizes[] = {{kThin, 1, kThin}, {1, kThin, 1}, {0.7, 0.5, 0.6}};
  for (const Vector3& size_a : sizes) {
    for (const Vector3& size_b : sizes) {
      for (int i = 0; i < 400; ++i) {
        const Shape &a = shapes.primitive(SceneShape::Kind::kBox, size_a),
                    &b = shapes.primitive(SceneShape::Kind::kBox, size_b);
        const Pose X_A{random.vector(-3, 3), random.rotation()};
        const Pose X_B{X_A.position + random.uniform(0.0, 2.0) * random.direction(), random.rotation()};
        const double least = least_depth(a, X_A, b, X_B);
        const ContactList contacts = all_contacts(a, X_A, b, X_B, 10.0);
        ASSERT_GT(contacts.size(), 0U);
        EXPECT_NEAR(contacts.deepest(), least, 0.0102 * std::max(least, 0.0) + 1e-9)
            << size_a.transpose() << " on " << size_b.transpose();
      }
    }
  }
}

}  // namespace
}  // namespace gravitas::collision
