// Laws that every answer of the narrow phase obeys, over some thousand random placements of every
// pair: exact mirroring, invariance under rigid motion and scale, agreement with the support
// functions of the shapes and with an independent search over directions, separation by the
// reported depth, contact points on both surfaces, and no use of the heap.
#include <gtest/gtest.h>

#include <cmath>
#include <string>
#include <vector>

#include "tests/sanitized.h"
#include "tests/workers/allocation_count.h"
#include "tests/workers/collision/standard/narrow_phase_fixture.h"
#include "workers/collision/standard/narrow_phase.h"

namespace gravitas::collision {
namespace {

using namespace test;  // NOLINT(google-build-using-namespace): the fixture of these tests

struct Pair {
  Shape a;
  Pose X_WA;
  Shape b;
  Pose X_WB;
};

enum class Kind { kFat, kFlat, kAligned, kShallow };

// The unordered pairs of types, without half-space against half-space.
std::vector<std::pair<ShapeType, ShapeType>> type_pairs() {
  constexpr ShapeType kTypes[] = {ShapeType::kSphere, ShapeType::kBox, ShapeType::kCylinder, ShapeType::kHalfspace};
  std::vector<std::pair<ShapeType, ShapeType>> pairs;
  for (int i = 0; i < 3; ++i) {
    for (int j = i; j < 4; ++j) pairs.emplace_back(kTypes[i], kTypes[j]);
  }
  return pairs;
}

Shape random_shape(ShapeType type, Kind kind, Random* random) {
  Shape shape{type, random->vector(0.3, 2.0)};
  if (kind == Kind::kFlat) shape.size[static_cast<int>(random->uniform(0, 2.999))] *= 0.05;
  return shape;
}

// a rotation by quarter turns about the axes, so that faces and lines are parallel
Quaternion quarter_turns(Random* random) {
  const double s = std::sqrt(0.5);
  Quaternion q = Quaternion::Identity();
  for (int axis = 0; axis < 3; ++axis) {
    const int turns = static_cast<int>(random->uniform(0, 3.999));
    for (int i = 0; i < turns; ++i) {
      Quaternion turn(s, 0, 0, 0);
      turn.vec()[axis] = s;
      q = (turn * q).normalized();
    }
  }
  return q;
}

Pair random_pair(ShapeType type_a, ShapeType type_b, Kind kind, Random* random) {
  Pair pair;
  pair.a = random_shape(type_a, kind, random);
  pair.b = random_shape(type_b, kind, random);
  const bool aligned = kind == Kind::kAligned;
  pair.X_WA = {random->vector(-5, 5), aligned ? quarter_turns(random) : random->rotation()};
  pair.X_WB.orientation = aligned ? quarter_turns(random) : random->rotation();
  pair.X_WB.position = pair.X_WA.position + random->uniform(0, 3) * random->direction();
  if (kind != Kind::kShallow) return pair;
  // brought to touch, then a tenth of a millimetre into or out of contact
  for (int i = 0; i < 4; ++i) {
    const Manifold m = contacts_of(pair.a, pair.X_WA, pair.b, pair.X_WB, 10.0);
    const double rest = i < 3 ? 0.0 : random->uniform(-1e-4, 1e-4);
    if (m.count > 0) pair.X_WB.position += (deepest(m) - rest) * contact(m, 0).normal;
  }
  return pair;
}

// calls test(pair) for `count` pairs of each combination of types and kinds
template <typename Test>
void for_random_pairs(std::uint64_t seed, int count, const Test& test) {
  Random random(seed);
  for (const auto& [type_a, type_b] : type_pairs()) {
    for (const Kind kind : {Kind::kFat, Kind::kFlat, Kind::kAligned, Kind::kShallow}) {
      SCOPED_TRACE("types " + std::to_string(static_cast<int>(type_a)) + ", " +
                   std::to_string(static_cast<int>(type_b)) + ", kind " + std::to_string(static_cast<int>(kind)));
      for (int i = 0; i < harness::unless_sanitized(count); ++i) {
        test(random_pair(type_a, type_b, kind, &random), &random);
        if (testing::Test::HasFailure()) return;
      }
    }
  }
}

double thinnest(const Pair& pair) {
  return std::min(pair.a.type == ShapeType::kHalfspace ? 1e300 : smallest_half_extent(pair.a),
                  pair.b.type == ShapeType::kHalfspace ? 1e300 : smallest_half_extent(pair.b));
}

// the preference for faces and the reduction of patches, as narrow_phase.h states them
double preference(const Pair& pair, double depth) { return 0.0102 * std::max(depth, 0.0) + 1.2e-6 * thinnest(pair); }

TEST(NarrowPhaseLaws, SwappedBodiesMirrorBitForBit) {
  for_random_pairs(11, 300, [](const Pair& p, Random*) {
    const Manifold m = contacts_of(p.a, p.X_WA, p.b, p.X_WB, 0.5);
    const Manifold w = contacts_of(p.b, p.X_WB, p.a, p.X_WA, 0.5);
    ASSERT_EQ(m.count, w.count);
    for (int i = 0; i < m.count; ++i) {
      EXPECT_EQ(contact(m, i).point, contact(w, i).point);
      EXPECT_EQ(contact(m, i).normal, Vector3(-contact(w, i).normal));
      EXPECT_EQ(contact(m, i).depth, contact(w, i).depth);
      EXPECT_EQ(contact(m, i).feature, contact(w, i).feature);
    }
  });
}

TEST(NarrowPhaseLaws, EqualBodiesMirrorBitForBit) {
  Random random(12);
  for (int i = 0; i < 2000; ++i) {
    const ShapeType type = i % 2 == 0 ? ShapeType::kBox : ShapeType::kCylinder;
    Pair p = random_pair(type, type, i % 4 < 2 ? Kind::kFat : Kind::kAligned, &random);
    p.b = p.a;
    if (i % 5 == 0) p.X_WB.position = p.X_WA.position;
    const Manifold m = contacts_of(p.a, p.X_WA, p.b, p.X_WB, 0.5);
    const Manifold w = contacts_of(p.b, p.X_WB, p.a, p.X_WA, 0.5);
    ASSERT_EQ(m.count, w.count);
    for (int k = 0; k < m.count; ++k) {
      EXPECT_EQ(contact(m, k).point, contact(w, k).point);
      EXPECT_EQ(contact(m, k).depth, contact(w, k).depth);
      EXPECT_EQ(contact(m, k).feature, contact(w, k).feature);
      if (p.X_WA.orientation.coeffs() != p.X_WB.orientation.coeffs()) {
        EXPECT_EQ(contact(m, k).normal, Vector3(-contact(w, k).normal));
      }
    }
  }
}

TEST(NarrowPhaseLaws, NormalsAreUnitFeaturesUniqueAndSorted) {
  for_random_pairs(13, 300, [](const Pair& p, Random*) {
    const Manifold m = contacts_of(p.a, p.X_WA, p.b, p.X_WB, 0.5);
    ASSERT_LE(m.count, kManifoldCapacity);
    for (int i = 0; i < m.count; ++i) {
      EXPECT_NEAR(contact(m, i).normal.norm(), 1.0, 1e-14);
      EXPECT_EQ(contact(m, i).normal, contact(m, 0).normal);
      EXPECT_GE(contact(m, i).depth, -0.5);
      if (i > 0) {
        EXPECT_LT(contact(m, i - 1).feature, contact(m, i).feature);
      }
    }
  });
}

TEST(NarrowPhaseLaws, DeepestContactHasTheDepthOfTheSupportingPlanes) {
  for_random_pairs(14, 500, [](const Pair& p, Random*) {
    const Manifold m = contacts_of(p.a, p.X_WA, p.b, p.X_WB, 1.0);
    if (m.count == 0) return;
    double h = depth_along(p.a, p.X_WA, p.b, p.X_WB, contact(m, 0).normal);
    if (p.b.type == ShapeType::kHalfspace) {
      h = support_of(p.a, p.X_WA.orientation.conjugate() * contact(m, 0).normal) -
          contact(m, 0).normal.dot(p.X_WB.position - p.X_WA.position);
    }
    EXPECT_NEAR(deepest(m), h, preference(p, h));
  });
}

TEST(NarrowPhaseLaws, NoSampledDirectionIsShallower) {
  for_random_pairs(15, 40, [](const Pair& p, Random* random) {
    if (p.b.type == ShapeType::kHalfspace) return;
    const Manifold m = contacts_of(p.a, p.X_WA, p.b, p.X_WB, 10.0);
    ASSERT_GE(m.count, 1);
    const double h = depth_along(p.a, p.X_WA, p.b, p.X_WB, contact(m, 0).normal);
    // the normal beats, or ties with, everything sampled
    EXPECT_LE(h, sampled_depth(p.a, p.X_WA, p.b, p.X_WB, 1500, random) + preference(p, h));
  });
}

TEST(NarrowPhaseLaws, DistanceOfSeparatedPairsIsProvenFromBothSides) {
  // points of the two solids that far apart bound the distance from above, the supporting planes
  // from below
  Random random(16);
  int count = 0;
  for (const auto& [type_a, type_b] : type_pairs()) {
    if (type_b == ShapeType::kHalfspace) continue;
    for (int i = 0; i < 1500; ++i) {
      Pair p = random_pair(type_a, type_b, i % 2 == 0 ? Kind::kFat : Kind::kFlat, &random);
      p.X_WB.position = p.X_WA.position + random.uniform(0, 6) * random.direction();
      const Manifold m = contacts_of(p.a, p.X_WA, p.b, p.X_WB, 10.0);
      ASSERT_GE(m.count, 1);
      if (deepest(m) >= 0.0) continue;
      ++count;
      int k = 0;
      while (contact(m, k).depth < deepest(m)) ++k;
      const ContactPoint& c = contact(m, k);
      EXPECT_NEAR(depth_along(p.a, p.X_WA, p.b, p.X_WB, c.normal), c.depth, 1e-10);
      const Vector3 on_a = inverse_transform_point(p.X_WA, c.point + 0.5 * c.depth * c.normal);
      const Vector3 on_b = inverse_transform_point(p.X_WB, c.point - 0.5 * c.depth * c.normal);
      // 1e-9: the surface point moves by the error of the normal times the distance
      EXPECT_LE(distance_to_surface(p.a, on_a), 1e-9);
      EXPECT_LE(distance_to_surface(p.b, on_b), 1e-9);
    }
  }
  EXPECT_GT(count, 3000);
}

TEST(NarrowPhaseLaws, MovingByTheDepthSeparates) {
  for_random_pairs(17, 300, [](const Pair& p, Random*) {
    const Manifold m = contacts_of(p.a, p.X_WA, p.b, p.X_WB);
    if (m.count == 0) return;
    ASSERT_TRUE(intersects(p.a, p.X_WA, p.b, p.X_WB));
    Pose moved = p.X_WB;
    const double depth = deepest(m);
    moved.position += (depth + preference(p, depth)) * contact(m, 0).normal;
    EXPECT_FALSE(intersects(p.a, p.X_WA, p.b, moved));
    // and a little less than the depth does not
    moved.position = p.X_WB.position + (0.97 * depth - 2.4e-6) * contact(m, 0).normal;
    if (depth > 1e-4) {
      EXPECT_TRUE(intersects(p.a, p.X_WA, p.b, moved));
    }
  });
}

TEST(NarrowPhaseLaws, ContactPointsLieMidwayBetweenBothSurfaces) {
  for_random_pairs(18, 300, [](const Pair& p, Random*) {
    const Manifold m = contacts_of(p.a, p.X_WA, p.b, p.X_WB, 0.1);
    for (int i = 0; i < m.count; ++i) {
      const ContactPoint& c = contact(m, i);
      const Vector3 on_a = c.point + 0.5 * c.depth * c.normal;
      const Vector3 on_b = c.point - 0.5 * c.depth * c.normal;
      // sidelong misplacements only where a preferred face or a nearly parallel pair of lines is
      // used
      const double tolerance = 0.15 * std::max(c.depth, 0.0) + 1e-6;
      EXPECT_NEAR(distance_to_surface(p.a, inverse_transform_point(p.X_WA, on_a)), 0.0, tolerance);
      EXPECT_NEAR(distance_to_surface(p.b, inverse_transform_point(p.X_WB, on_b)), 0.0, tolerance);
    }
  });
}

// Compares two manifolds of one geometry, the second moved by X and scaled by s.
void expect_same_geometry(const Manifold& m, const Manifold& moved, const Pose& X, double s, double tolerance) {
  ASSERT_EQ(m.count, moved.count);
  for (int i = 0; i < m.count; ++i) {
    const Vector3 point = X.orientation * (s * contact(m, i).point) + X.position;
    const Vector3 normal = X.orientation * contact(m, i).normal;
    EXPECT_LE((contact(moved, i).point - point).norm(), tolerance);
    EXPECT_LE((contact(moved, i).normal - normal).norm(), tolerance / s);
    EXPECT_NEAR(contact(moved, i).depth, s * contact(m, i).depth, tolerance);
    EXPECT_EQ(contact(moved, i).feature, contact(m, i).feature);
  }
}

TEST(NarrowPhaseLaws, RigidMotionMovesTheManifoldAlong) {
  for_random_pairs(19, 200, [](const Pair& p, Random* random) {
    if (p.a.type == p.b.type && p.a.size == p.b.size) return;
    const Pose X{random->vector(-10, 10), random->rotation()};
    const Manifold m = contacts_of(p.a, p.X_WA, p.b, p.X_WB, 0.1);
    const Manifold moved = contacts_of(p.a, compose(X, p.X_WA), p.b, compose(X, p.X_WB), 0.1);
    // poses are rounded at 20 m (1e-15 each); the normal of a nearly touching or nearly
    // osculating pair amplifies that
    expect_same_geometry(m, moved, X, 1.0, 1e-9);
  });
}

TEST(NarrowPhaseLaws, ScalingScalesLengthsAndKeepsNormals) {
  for (const double s : {1e-3, 1e3, 0x1p-10, 1e6, 1e-6}) {
    for_random_pairs(20, 60, [s](const Pair& p, Random*) {
      Pair q = p;
      q.a.size *= s;
      q.b.size *= s;
      q.X_WA.position *= s;
      q.X_WB.position *= s;
      const Manifold m = contacts_of(p.a, p.X_WA, p.b, p.X_WB, 0.1);
      const Manifold scaled = contacts_of(q.a, q.X_WA, q.b, q.X_WB, 0.1 * s);
      expect_same_geometry(m, scaled, Pose{}, s, 1e-9 * s);
    });
  }
}

TEST(NarrowPhaseLaws, FarFromTheOriginOnlyTheFinalSumIsRounded) {
  // positions on a grid of 2^-20 m, so the move by 2^30 m is exact and so is every difference
  const auto on_grid = [](const Vector3& v) -> Vector3 { return (v * 0x1p20).array().round().matrix() * 0x1p-20; };
  for_random_pairs(21, 100, [&](const Pair& p, Random*) {
    Pose X_WA = p.X_WA;
    Pose X_WB = p.X_WB;
    X_WA.position = on_grid(X_WA.position);
    X_WB.position = on_grid(X_WB.position);
    const Manifold m = contacts_of(p.a, X_WA, p.b, X_WB, 0.1);
    const Vector3 far(0x1p30, -0x1p30, 0x1p29);
    X_WA.position += far;
    X_WB.position += far;
    const Manifold moved = contacts_of(p.a, X_WA, p.b, X_WB, 0.1);
    ASSERT_EQ(m.count, moved.count);
    for (int i = 0; i < m.count; ++i) {
      EXPECT_EQ(contact(m, i).depth, contact(moved, i).depth);
      EXPECT_EQ(contact(m, i).normal, contact(moved, i).normal);
      // half a unit in the last place of 2^30
      EXPECT_LE((contact(moved, i).point - far - contact(m, i).point).cwiseAbs().maxCoeff(), 0x1p-22);
    }
  });
}

TEST(NarrowPhaseLaws, ExtremeSizesGiveFiniteAnswers) {
  Random random(22);
  int touching = 0;
  for (const auto& [type_a, type_b] : type_pairs()) {
    for (int i = 0; i < 3000; ++i) {
      Pair p = random_pair(type_a, type_b, i % 3 == 0 ? Kind::kAligned : Kind::kFat, &random);
      for (int k = 0; k < 3; ++k) {
        p.a.size[k] = std::pow(10.0, random.uniform(-6, 6));
        p.b.size[k] = std::pow(10.0, random.uniform(-6, 6));
      }
      const double far = std::pow(10.0, random.uniform(-8, 6));
      p.X_WB.position = p.X_WA.position + far * random.direction();
      const Manifold m = contacts_of(p.a, p.X_WA, p.b, p.X_WB, 0.1 * far);
      touching += m.count > 0 ? 1 : 0;
      for (int k = 0; k < m.count; ++k) {
        ASSERT_TRUE(contact(m, k).point.allFinite());
        ASSERT_NEAR(contact(m, k).normal.norm(), 1.0, 1e-12);
        ASSERT_TRUE(std::isfinite(contact(m, k).depth));
      }
    }
  }
  EXPECT_GT(touching, 3000);
}

TEST(NarrowPhaseLaws, PositionsThatAreNotFiniteOrFarAwayTouchNothing) {
  const double values[] = {std::nan(""), std::numeric_limits<double>::infinity(), 1e200, -1e308};
  for (const auto& [type_a, type_b] : type_pairs()) {
    Random random(23);
    for (const double value : values) {
      Pair p = random_pair(type_a, type_b, Kind::kAligned, &random);
      p.X_WA.orientation = Quaternion::Identity();
      p.X_WB.orientation = Quaternion::Identity();
      p.X_WA.position.y() = std::fabs(value);
      EXPECT_EQ(contacts_of(p.a, p.X_WA, p.b, p.X_WB, 0.1).count, 0);
    }
  }
}

TEST(NarrowPhaseLaws, AnswersDoNotDependOnEarlierQueries) {
  std::vector<Pair> pairs;
  for_random_pairs(24, 20, [&](const Pair& p, Random*) { pairs.push_back(p); });
  std::vector<Manifold> forward;
  for (const Pair& p : pairs) forward.push_back(contacts_of(p.a, p.X_WA, p.b, p.X_WB, 0.2));
  for (std::size_t i = pairs.size(); i-- > 0;) {
    const Manifold m = contacts_of(pairs[i].a, pairs[i].X_WA, pairs[i].b, pairs[i].X_WB, 0.2);
    ASSERT_EQ(m.count, forward[i].count);
    for (int k = 0; k < m.count; ++k) {
      EXPECT_EQ(contact(m, k).point, contact(forward[i], k).point);
      EXPECT_EQ(contact(m, k).normal, contact(forward[i], k).normal);
    }
  }
}

TEST(NarrowPhaseLaws, QueriesNeverAllocate) {
  std::vector<Pair> pairs;
  for_random_pairs(25, 50, [&](const Pair& p, Random*) { pairs.push_back(p); });
  int touching = 0;
  Manifold m;
  const long before = gravitas::test::allocation_count();
  for (const Pair& p : pairs) {
    collide(p.a, p.X_WA, p.b, p.X_WB, 0.2, &m);
    touching += m.count;
  }
  EXPECT_EQ(gravitas::test::allocation_count(), before);
  EXPECT_GT(touching, 100);
}

}  // namespace
}  // namespace gravitas::collision
