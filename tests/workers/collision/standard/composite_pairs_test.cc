// Meshes and compounds: flush surfaces have no edges, solids push outward, and a box made of triangles answers as the box.
#include <gtest/gtest.h>

#include <cmath>

#include "tests/workers/allocation_count.h"
#include "tests/workers/collision/standard/shape_fixture.h"

namespace gravitas::collision {
namespace {

using namespace test;  // NOLINT(google-build-using-namespace): the fixture of these tests
using gravitas::test::RandomShapes;

// Every place of a path over the edges and corners of a level field, 1 mm deep: the normal is up, the depth 1 mm.
TEST(Mesh, FlushTrianglesHaveNoEdges) {
  Shapes shapes;
  const Shape& field = shapes.field(6);
  struct Mover {
    const Shape* shape;
    double height;
    std::size_t points;
  };
  const Shape ball = sphere(0.3), brick = box(0.4, 0.2, 0.3), can = cylinder(0.3, 0.25);
  const Mover movers[] = {{&ball, 0.3, 1},
                          {&brick, 0.2, 4},
                          {&can, 0.25, 3},
                          {&shapes.cone(0.4, 0.3), 0.3, 3},
                          {&shapes.box_hull({0.4, 0.2, 0.3}), 0.2, 4},
                          {&shapes.box_mesh({0.4, 0.2, 0.3}), 0.2, 4}};
  for (const Mover& mover : movers) {
    for (int i = 0; i < 400; ++i) {
      // across squares, along their borders and diagonals, and turning
      const double s = -2.0 + 0.01 * i;
      const Vector3 places[] = {{s, 0, 0.37 * s}, {s, 0, 0}, {s, 0, s}, {s, 0, 1.0 - 1e-9}};
      for (const Vector3& place : places) {
        const Pose X{place + Vector3(0, mover.height - 1e-3, 0),
                     Quaternion(Eigen::AngleAxisd(i % 2 == 0 ? 0.0 : 0.1 * i, Vector3::UnitY()))};
        const ContactList contacts = all_contacts(field, at(0, 0, 0), *mover.shape, X, 1e-3);
        ASSERT_GE(contacts.size(), mover.points)
            << static_cast<int>(mover.shape->type) << " at " << X.position.transpose();
        double deepest = 0.0;
        for (std::size_t k = 0; k < contacts.size(); ++k) {
          ASSERT_NEAR(contacts[k].normal.y(), 1.0, 1e-12)
              << static_cast<int>(mover.shape->type) << " at " << X.position.transpose();
          deepest = std::max(deepest, contacts[k].depth);
          ASSERT_LE(contacts[k].depth, 1e-3 + 1e-12);
        }
        ASSERT_NEAR(deepest, 1e-3, 1e-12);
      }
    }
  }
}

TEST(Mesh, BoxOfTrianglesAnswersAsTheBox) {
  Shapes shapes;
  RandomShapes random(51);
  const Vector3 half(1.0, 0.7, 1.3);
  const Shape& mesh = shapes.box_mesh(half);
  const Shape solid = box(half.x(), half.y(), half.z());
  for (const SceneShape::Kind kind : gravitas::test::kConvexKinds) {
    for (int i = 0; i < 150; ++i) {
      const Shape& other = shapes.random(kind, &random);
      // brought to touch the box, then 1 mm into it, or out
      Pose X{random.uniform(1.5, 3.0) * random.direction(), random.rotation()};
      for (int k = 0; k < 4; ++k) {
        const ContactList contacts = all_contacts(solid, at(0, 0, 0), other, X, 10.0);
        X.position += contacts.deepest() * contacts[0].normal;
      }
      const double depth = i % 2 == 0 ? 1e-3 : -1e-3;
      X.position -= depth * all_contacts(solid, at(0, 0, 0), other, X, 10.0)[0].normal;
      const ContactList expected = all_contacts(solid, at(0, 0, 0), other, X, 0.01);
      const ContactList found = all_contacts(mesh, at(0, 0, 0), other, X, 0.01);
      ASSERT_GT(found.size(), 0U) << static_cast<int>(kind) << " pair " << i;
      // a triangle does not know that the way out over another face of the box is shorter: it may say the full millimetre
      const double least = expected.deepest();
      EXPECT_GE(found.deepest(), least - 2e-5) << static_cast<int>(kind) << " pair " << i;
      EXPECT_LE(found.deepest(), least < 0.0 ? least + 2e-5 : 1.1e-3) << static_cast<int>(kind) << " pair " << i;
    }
  }
}

// Of a face that has sunk in askew all corners are told, not its deepest alone, else bodies rock from corner to corner; and
// none is pushed sideways, out over the far end of the slab.
TEST(Mesh, IsHeldByAllCornersOfATiltedFace) {
  Shapes shapes;
  RandomShapes random(55);
  const Vector3 half(0.3, 0.2, 0.25);
  const Shape &mesh = shapes.box_mesh(half), &hull = shapes.box_hull(half);
  const Shape slab = box(1.0, 0.3, 1.0);
  for (int i = 0; i < 100; ++i) {
    const Vector3 axis = Vector3(random.uniform(-1, 1), 0.0, random.uniform(-1, 1)).normalized();
    const Quaternion turn(Eigen::AngleAxisd(random.uniform(0.0, 0.1), axis));
    const Pose X{Vector3(random.uniform(-0.5, 0.5), 0.45, random.uniform(-0.5, 0.5)), turn};
    const ContactList expected = all_contacts(slab, at(0, 0, 0), hull, X, 0.01);
    const ContactList found = all_contacts(slab, at(0, 0, 0), mesh, X, 0.01);
    ASSERT_EQ(expected.size(), 4U) << i;
    for (std::size_t m = 0; m < 4; ++m) {
      double nearest = 1.0;
      for (std::size_t k = 0; k < found.size(); ++k)
        nearest = std::min(nearest, (found[k].point - expected[m].point).norm());
      // along the slab's normal or along the face's: 0.1 rad apart, of a depth of 0.1 m at most
      EXPECT_LE(nearest, 0.1 * 0.1) << i;
    }
    for (std::size_t k = 0; k < found.size(); ++k) {
      EXPECT_GE(found[k].normal.y(), 0.99) << i;
      EXPECT_LE(found[k].depth, 0.12) << i;
    }
  }
}

TEST(Mesh, PushesOutwardFromWithin) {
  Shapes shapes;
  const Shape& mesh = shapes.box_mesh({2, 2, 2});
  // fully contained, nearest to the face x = 2
  const ContactList inside = all_contacts(mesh, at(0, 0, 0), sphere(0.25), at(1.2, 0.3, -0.2));
  ASSERT_EQ(inside.size(), 1U);
  EXPECT_NEAR(inside[0].normal.x(), 1.0, 1e-14);
  EXPECT_NEAR(inside[0].depth, 1.05, 1e-14);
  // another mesh, whichever is the first
  const Shape& small = shapes.box_mesh({0.1, 0.1, 0.1});
  for (const bool is_first : {true, false}) {
    const ContactList nested = is_first ? all_contacts(mesh, at(0, 0, 0), small, at(1.2, 0.3, -0.2))
                                        : all_contacts(small, at(1.2, 0.3, -0.2), mesh, at(0, 0, 0));
    ASSERT_EQ(nested.size(), 1U);
    EXPECT_NEAR(nested[0].normal.x(), is_first ? 1.0 : -1.0, 1e-14);
    EXPECT_NEAR(nested[0].depth, 0.9, 1e-14);
    EXPECT_NEAR(nested[0].point.x(), 1.55, 1e-14);
  }
  // one that is turned and half out, none of whose triangles tells a normal that both surfaces have: over x = 1, whole
  const Shape &unit = shapes.box_mesh({1, 1, 1}), &block = shapes.box_mesh({0.3, 0.3, 0.3});
  const Pose half_out{Vector3(0.775, 0, 0),
                      Quaternion(0.81462242327153234, 0, -0.4101160247437402, 0.41011602474374037)};
  const Matrix3 R = half_out.orientation.toRotationMatrix();
  const ContactList crossing = all_contacts(unit, at(0, 0, 0), block, half_out);
  ASSERT_EQ(crossing.size(), 1U);
  EXPECT_NEAR(crossing[0].normal.x(), 1.0, 1e-14);
  EXPECT_NEAR(crossing[0].depth, 1.0 - 0.775 + 0.3 * R.row(0).cwiseAbs().sum(), 1e-12);
  // an open field pushes to the side on which the centre is
  const Shape& field = shapes.field(4);
  for (const double side : {1.0, -1.0}) {
    const ContactList contacts = all_contacts(field, at(0, 0, 0), sphere(0.25), at(0.3, side * 0.2, 0.1));
    ASSERT_EQ(contacts.size(), 1U);
    EXPECT_NEAR(contacts[0].normal.y(), side, 1e-14);
    EXPECT_NEAR(contacts[0].depth, 0.05, 1e-14);
  }
}

// Deep in each other no vertex need be inside, and no triangle tells a normal that both surfaces have.
TEST(Mesh, ConvexMeshesInEachOtherPartAsHulls) {
  Shapes shapes;
  const double a = 0.2;
  const std::vector<Vector3> corners = {{a, a, a}, {-a, -a, a}, {-a, a, -a}, {a, -a, -a}};
  const Shape& mesh = shapes.mesh(corners, {{0, 2, 1}, {0, 1, 3}, {0, 3, 2}, {1, 2, 3}});
  const Shape &hull = shapes.hull(corners), &cube = shapes.box_mesh({a, a, a}), &box = shapes.box_hull({a, a, a});
  for (const Vector3& offset : {Vector3(0, 0, 0), Vector3(0.03, 0.01, 0.02), Vector3(0.1, 0.05, 0.02),
                                Vector3(0.2, 0.01, 0.02), Vector3(0.03, 0, 0)}) {
    for (const auto& [of_mesh, of_hull] : {std::pair(&mesh, &hull), std::pair(&cube, &box)}) {
      const Pose X{offset, Quaternion::Identity()};
      const ContactList found = all_contacts(*of_mesh, at(0, 0, 0), *of_mesh, X);
      const ContactList known = all_contacts(*of_hull, at(0, 0, 0), *of_hull, X);
      double deepest = 0.0, known_deepest = 0.0;
      for (std::size_t i = 0; i < known.size(); ++i) known_deepest = std::max(known_deepest, known[i].depth);
      for (std::size_t i = 0; i < found.size(); ++i) deepest = std::max(deepest, found[i].depth);
      SCOPED_TRACE(testing::Message() << offset.transpose());
      ASSERT_EQ(found.size(), known.size());
      ASSERT_GT(found.size(), 0U);
      EXPECT_NEAR(deepest, known_deepest, 1e-12);
      // of those that lie in the same place all ways out are as long
      if (!offset.isZero(0.0)) {
        EXPECT_GT(found[0].normal.dot(known[0].normal), 1.0 - 1e-9);
      }
    }
  }
}

TEST(Mesh, StandsOnItsVerticesOnAPlane) {
  Shapes shapes;
  const Shape& mesh = shapes.box_mesh({0.5, 1, 0.7});
  const ContactList contacts = all_contacts(halfspace(), at(0, 0, 0), mesh, at(3, 0.99, -2), 0.05);
  ASSERT_EQ(contacts.size(), 4U);
  for (std::size_t i = 0; i < 4; ++i) {
    EXPECT_NEAR(contacts[i].depth, 0.01, 1e-15);
    EXPECT_EQ(contacts[i].normal, Vector3(0, 1, 0));
    EXPECT_NEAR(std::fabs(contacts[i].point.x() - 3), 0.5, 1e-14);
  }
}

TEST(Mesh, MeshStandsOnMesh) {
  Shapes shapes;
  const Shape &field = shapes.field(6), &cube = shapes.box_mesh({0.5, 0.5, 0.5}), &slab = shapes.box_mesh({3, 0.2, 3});
  RandomShapes random(52);
  for (int i = 0; i < 100; ++i) {
    const Vector3 place{random.uniform(-1.5, 1.5), 0.499, random.uniform(-1.5, 1.5)};
    const Pose X{place, Quaternion(Eigen::AngleAxisd(random.uniform(0, 3), Vector3::UnitY()))};
    for (const auto& [ground, pose] : {std::pair(&field, at(0, 0, 0)), std::pair(&slab, at(0, -0.2, 0))}) {
      const ContactList contacts = all_contacts(*ground, pose, cube, X, 0.01);
      ASSERT_EQ(contacts.size(), 4U) << i;
      for (std::size_t k = 0; k < 4; ++k) {
        EXPECT_NEAR(contacts[k].normal.y(), 1.0, 1e-12);
        EXPECT_NEAR(contacts[k].depth, 1e-3, 1e-12);
        // the corners of the cube
        EXPECT_NEAR((contacts[k].point - X.position).cwiseProduct(Vector3(1, 0, 1)).norm(), std::sqrt(0.5), 1e-9);
      }
    }
  }
}

// Of which the slab's side was told 2.67 m deep, where the block's side crosses it and is turned to it by a rounding.
TEST(Mesh, MeshOverAnEdgeOfMeshStandsOnIt) {
  Shapes shapes;
  const Shape &block = shapes.box_mesh({1.0, 0.2, 1.0}), &slab = shapes.box_mesh({0.7, 0.1, 1.7});
  for (const double turn : {0.0, 1e-18, 1e-16, 1e-14, 1e-12})
    for (const Vector3& axis : {Vector3(1.0, 0.0, 0.0), Vector3(0.0, 0.0, 1.0)}) {
      const Pose X{Vector3(0.3, 0.297, 0.03), Quaternion(1.0, turn * axis.x(), 0.0, turn * axis.z())};
      const ContactList contacts = all_contacts(block, at(0, 0, 0), slab, X, 1e-3);
      ASSERT_GT(contacts.size(), 0U) << turn;
      for (std::size_t i = 0; i < contacts.size(); ++i) {
        EXPECT_NEAR(contacts[i].normal.y(), 1.0, 1e-9) << turn;
        EXPECT_NEAR(contacts[i].depth, 0.003, 1e-9) << turn;
      }
    }
}

TEST(Mesh, ZeroAreaTrianglesChangeNothing) {
  Shapes shapes;
  const Shape& clean = shapes.field(1);
  const Shape& dirty = shapes.mesh({{-0.5, 0, -0.5}, {-0.5, 0, 0.5}, {0.5, 0, -0.5}, {0.5, 0, 0.5}, {0, 0, 0}},
                                   {{0, 1, 3}, {0, 3, 2}, {0, 4, 3}, {1, 1, 2}});
  const ContactList one = all_contacts(clean, at(0, 0, 0), sphere(0.2), at(0.1, 0.15, 0.2));
  const ContactList other = all_contacts(dirty, at(0, 0, 0), sphere(0.2), at(0.1, 0.15, 0.2));
  ASSERT_EQ(one.size(), other.size());
  EXPECT_EQ(one[0].depth, other[0].depth);
}

TEST(Mesh, SwapMirrorsBitForBit) {
  Shapes shapes;
  RandomShapes random(53);
  const Shape &cube = shapes.box_mesh({0.5, 0.4, 0.3}), &field = shapes.field(4);
  const Shape& table = shapes.compound({{&cube, at(0.5, 0, 0)}, {&shapes.cone(0.3, 0.4), at(-0.5, 0, 0)}});
  for (int i = 0; i < 100; ++i) {
    const Pose X_A{random.vector(-0.2, 0.2), random.rotation()}, X_B{random.vector(-0.7, 0.7), random.rotation()};
    for (const auto& [a, b] : {std::pair(&cube, &field), std::pair(&cube, &table), std::pair(&field, &table)}) {
      const ContactList one = all_contacts(*a, X_A, *b, X_B, 0.1), other = all_contacts(*b, X_B, *a, X_A, 0.1);
      ASSERT_EQ(one.size(), other.size());
      for (std::size_t k = 0; k < one.size(); ++k) {
        EXPECT_EQ(one[k].point, other[k].point);
        EXPECT_EQ(one[k].normal, Vector3(-other[k].normal));
        EXPECT_EQ(one[k].depth, other[k].depth);
        EXPECT_EQ(one[k].feature, other[k].feature);
        if (k > 0) {
          EXPECT_LT(one[k - 1].feature, one[k].feature);
        }
      }
    }
  }
}

TEST(Compound, IsTheUnionOfItsChildren) {
  Shapes shapes;
  RandomShapes random(54);
  const Shape &pill = shapes.capsule(0.2, 0.5), &cone = shapes.cone(0.4, 0.4);
  const Pose X_1 = at(1, 0, 0), X_2 = at(Vector3(-1, 0.2, 0), Vector3::UnitX(), 1.0);
  const Shape& both = shapes.compound({{&pill, X_1}, {&cone, X_2}});
  const Shape& nested = shapes.compound({{&both, at(0, 0, 0)}});
  for (int i = 0; i < 200; ++i) {
    const Pose X_A{random.vector(-1, 1), random.rotation()},
        X_B{X_A.position + random.vector(-2, 2), random.rotation()};
    const Shape other = i % 2 == 0 ? box(0.5, 0.3, 0.4) : sphere(0.6);
    const ContactList alone_1 = all_contacts(pill, compose(X_A, X_1), other, X_B, 0.05);
    const ContactList alone_2 = all_contacts(cone, compose(X_A, X_2), other, X_B, 0.05);
    const ContactList together = all_contacts(both, X_A, other, X_B, 0.05);
    EXPECT_EQ(together.size() > 0, alone_1.size() + alone_2.size() > 0);
    if (together.size() == 0) continue;
    // the poses are composed in another frame
    EXPECT_NEAR(together.deepest(), std::max(alone_1.deepest(), alone_2.deepest()), 1e-9);
    EXPECT_NEAR(all_contacts(nested, X_A, other, X_B, 0.05).deepest(), together.deepest(), 1e-9);
  }
}

TEST(Composite, AsksTheHeapForNothingOnceWarm) {
  Shapes shapes;
  const Shape &field = shapes.field(6), &cube = shapes.box_mesh({0.5, 0.5, 0.5});
  ContactList contacts;
  const auto ask = [&] { collide(field, at(0, 0, 0), cube, at(0.2, 0.49, 0.1), 0.01, &contacts); };
  ask();
  const long before = gravitas::test::allocation_count();
  for (int i = 0; i < 20; ++i) ask();
  EXPECT_EQ(gravitas::test::allocation_count(), before);
}

}  // namespace
}  // namespace gravitas::collision
