// Distance and depth of convex solids: against a search over directions that uses nothing but support points, and where
// the answer is known.
#include "plugin_sdk/geometry/penetration.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>

#include "plugin_sdk/geometry/simplex.h"
#include "tests/plugin_sdk/geometry/random_shapes.h"
#include "tests/sanitized.h"

namespace gravitas {
namespace {

// The least h(n) that random directions and a random descent from the best of them find: an upper bound of the depth.
double searched_depth(const PlacedPair& pair, const Vector3& start, test::RandomShapes* random) {
  double depth = std::numeric_limits<double>::infinity();
  Vector3 best = start;
  const auto offer = [&](const Vector3& n) {
    const double h = pair.depth_along(n);
    if (!(h < depth)) return false;
    depth = h, best = n;
    return true;
  };
  offer(start);
  for (int i = 0; i < 400; ++i) offer(random->direction());
  for (double radius = 0.1; radius > 1e-7;) {
    bool is_better = false;
    for (int i = 0; i < 10; ++i) is_better |= offer((best + radius * random->direction()).normalized());
    if (!is_better) radius *= 0.7;
  }
  return depth;
}

TEST(Penetration, IsTheLeastOverAllDirections) {
  test::RandomShapes random(31);
  for (const SceneShape::Kind kind_a : test::kConvexKinds) {
    for (const SceneShape::Kind kind_b : test::kConvexKinds) {
      for (int i = 0; i < harness::unless_sanitized(15); ++i) {
        const SceneShape a = random.convex(kind_a), b = random.convex(kind_b);
        const auto map_a = make_support_map(a), map_b = make_support_map(b);
        const PlacedPair pair{*map_a, *map_b, random.rotation().toRotationMatrix(),
                              random.uniform(0.05, 2.5) * random.direction()};
        const Separation found = find_separation(pair, 100.0);
        SCOPED_TRACE(testing::Message() << "kinds " << static_cast<int>(kind_a) << ", " << static_cast<int>(kind_b)
                                        << ", pair " << i << ", depth " << found.depth);
        EXPECT_NEAR(found.normal.norm(), 1.0, 1e-14);
        // what it says is a translation that separates
        EXPECT_NEAR(found.depth, pair.depth_along(found.normal), 1e-9 * pair.reach());
        // of curved solids whose directions are all about the least 96 points are not always enough (see the header)
        EXPECT_LE(found.depth, searched_depth(pair, found.normal, &random) + 1e-4 * pair.reach());
        // and its points are as far apart as it says, along the normal
        EXPECT_LE((found.point_a - found.point_b - found.depth * found.normal).norm(), 1e-6 * pair.reach());
      }
    }
  }
}

// Flat faces: exact to rounding.
TEST(Penetration, OfPolyhedraIsExact) {
  test::RandomShapes random(32);
  for (const SceneShape::Kind kind_b : {SceneShape::Kind::kSphere, SceneShape::Kind::kBox, SceneShape::Kind::kCapsule,
                                        SceneShape::Kind::kConvexPolyhedron}) {
    for (int i = 0; i < harness::unless_sanitized(80); ++i) {
      const SceneShape a = random.convex(SceneShape::Kind::kConvexPolyhedron), b = random.convex(kind_b);
      const auto map_a = make_support_map(a), map_b = make_support_map(b);
      const PlacedPair pair{*map_a, *map_b, random.rotation().toRotationMatrix(),
                            random.uniform(0.0, 2.5) * random.direction()};
      const Separation found = find_separation(pair, 100.0);
      EXPECT_LE(found.depth, searched_depth(pair, found.normal, &random) + 1e-14 * pair.reach());
      // moved out by the depth they touch: neither apart nor overlapping
      PlacedPair moved{*map_a, *map_b, pair.R_AB, pair.p_AB + found.depth * found.normal};
      EXPECT_NEAR(find_separation(moved, 100.0).depth, 0.0, 1e-13 * pair.reach());
    }
  }
}

TEST(Penetration, ScalesWithTheSolids) {
  test::RandomShapes random(33);
  for (const double scale : {1e-6, 1e-3, 1e3, 1e6}) {
    for (const SceneShape::Kind kind :
         {SceneShape::Kind::kBox, SceneShape::Kind::kCapsule, SceneShape::Kind::kCone, SceneShape::Kind::kCylinder}) {
      for (int i = 0; i < 40; ++i) {
        SceneShape a = random.convex(kind), b = random.convex(SceneShape::Kind::kCone);
        const Matrix3 R = random.rotation().toRotationMatrix();
        const Vector3 p = random.uniform(0.2, 2.0) * random.direction();
        const auto map_a = make_support_map(a), map_b = make_support_map(b);
        const Separation one = find_separation({*map_a, *map_b, R, p}, 100.0);
        a.size *= scale, b.size *= scale;
        const auto large_a = make_support_map(a), large_b = make_support_map(b);
        const Separation other = find_separation({*large_a, *large_b, R, scale * p}, 100.0 * scale);
        // two searches that may end at different points of nearly one depth
        EXPECT_NEAR(other.depth / scale, one.depth, 1e-6) << scale;
      }
    }
  }
}

TEST(Penetration, OfCoincidentSolidsHasADirection) {
  for (const SceneShape::Kind kind : test::kConvexKinds) {
    test::RandomShapes random(34);
    const SceneShape shape = random.convex(kind);
    const auto map = make_support_map(shape);
    const Separation found = find_separation({*map, *map, Matrix3::Identity(), Vector3::Zero()}, 0.0);
    EXPECT_NEAR(found.normal.norm(), 1.0, 1e-14);
    EXPECT_GT(found.depth, 0.0);
    if (kind == SceneShape::Kind::kBox) {
      EXPECT_NEAR(found.depth, 2.0 * shape.size.minCoeff(), 1e-14);
    }
    if (kind == SceneShape::Kind::kSphere) {
      EXPECT_NEAR(found.depth, 2.0 * shape.size.x(), 1e-14);
    }
  }
}

TEST(Penetration, OfFlatAndThinSolids) {
  const TriangleMap triangle({Vector3(0, 0, 0), Vector3(1, 0, 0), Vector3(0, 0, 1)}, Vector3(0, -1, 0));
  SceneShape ball;
  ball.size = Vector3::Constant(0.5);
  const auto map = make_support_map(ball);
  // the ball's centre in the triangle's plane, and 0.2 above it
  EXPECT_NEAR(find_separation({triangle, *map, Matrix3::Identity(), Vector3(0.2, 0, 0.2)}, 0.0).depth, 0.5, 1e-15);
  const Separation above = find_separation({triangle, *map, Matrix3::Identity(), Vector3(0.2, 0.2, 0.2)}, 0.0);
  EXPECT_NEAR(above.depth, 0.3, 1e-15);
  EXPECT_NEAR(above.normal.y(), 1.0, 1e-15);
  // two triangles in one plane, and crossing
  EXPECT_NEAR(find_separation({triangle, triangle, Matrix3::Identity(), Vector3(0.1, 0, 0.1)}, 0.0).depth, 0.0, 1e-15);
  const Matrix3 upright = Eigen::AngleAxisd(0.5 * EIGEN_PI, Vector3::UnitX()).toRotationMatrix();
  EXPECT_NEAR(find_separation({triangle, triangle, upright, Vector3(0.1, 0.05, 0.3)}, 0.0).depth, 0.05, 1e-15);
  // a needle and a sheet, 1 : 1e6
  SceneShape needle, sheet;
  needle.kind = sheet.kind = SceneShape::Kind::kBox;
  needle.size = Vector3(1e-6, 1, 1e-6), sheet.size = Vector3(1, 1e-6, 1);
  const auto needle_map = make_support_map(needle), sheet_map = make_support_map(sheet);
  const Separation touch = find_separation({*sheet_map, *needle_map, Matrix3::Identity(), Vector3(0.3, 1.0, 0.2)}, 0.0);
  EXPECT_NEAR(touch.depth, 1e-6, 1e-15);
  EXPECT_NEAR(touch.normal.y(), 1.0, 1e-15);
}

// ---- simplices

TEST(Simplex, NearestPointsAreNearerThanAnyOther) {
  test::RandomShapes random(35);
  for (int i = 0; i < 3000; ++i) {
    std::array<Vector3, 4> x;
    for (Vector3& corner : x) corner = random.vector(-1, 1) + Vector3(0, 0.4, 0);
    if (i % 3 == 0) x[3] = x[0] + 0.5 * (x[1] - x[0]);                    // flat
    if (i % 5 == 0) x[2] = x[0] + random.uniform(-1, 2) * (x[1] - x[0]);  // in a line
    for (std::size_t count = 1; count <= 4; ++count) {
      const SimplexPoint found = closest_on_simplex({x.data(), count});
      Vector3 sum = Vector3::Zero();
      double weights = 0.0;
      for (std::size_t k = 0; k < 4; ++k) {
        EXPECT_GE(found.weight[k], 0.0);
        sum += found.weight[k] * x[k];
        weights += found.weight[k];
      }
      EXPECT_NEAR(weights, 1.0, 1e-14);
      EXPECT_LE((sum - found.point).norm(), 1e-11);
      for (int trial = 0; trial < 20; ++trial) {
        Vector3 other = Vector3::Zero();
        double total = 0.0;
        std::array<double, 4> weight{};
        for (std::size_t k = 0; k < count; ++k) total += weight[k] = random.uniform(0, 1);
        for (std::size_t k = 0; k < count; ++k) other += weight[k] / total * x[k];
        EXPECT_LE(found.point.norm(), other.norm() + 1e-12);
      }
    }
  }
}

}  // namespace
}  // namespace gravitas
