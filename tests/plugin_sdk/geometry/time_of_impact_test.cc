// Times of impact: where the answer is known, against fine sampling, and by laws.
#include "plugin_sdk/geometry/time_of_impact.h"

#include <gtest/gtest.h>

#include <cmath>
#include <optional>

#include "plugin_sdk/geometry/penetration.h"
#include "plugin_sdk/math/rotation.h"
#include "tests/plugin_sdk/geometry/random_shapes.h"

namespace gravitas {
namespace {

constexpr double kTarget = 1e-6;

struct Body {
  SceneShape shape;
  std::unique_ptr<SupportMap> map;
  MovingSolid solid;

  Body(SceneShape made, const Pose& start, const Motion& motion, const Pose& geometry = {})
      : shape(std::move(made)), map(make_support_map(shape)), solid{map.get(), geometry, start, motion} {}
};

SceneShape moving_shape_of(SceneShape::Kind kind, const Vector3& size) {
  SceneShape shape;
  shape.kind = kind, shape.size = size;
  return shape;
}
SceneShape ball(double radius) { return moving_shape_of(SceneShape::Kind::kSphere, Vector3::Constant(radius)); }
SceneShape box(double x, double y, double z) { return moving_shape_of(SceneShape::Kind::kBox, {x, y, z}); }
SceneShape ground() { return moving_shape_of(SceneShape::Kind::kHalfspace, Vector3::Ones()); }
Pose at(double x, double y, double z) { return {Vector3(x, y, z), Quaternion::Identity()}; }
Motion by(double x, double y, double z, const Vector3& rotation = Vector3::Zero()) { return {{x, y, z}, rotation}; }

std::optional<Impact> impact_of(const Body& a, const Body& b, double target = kTarget) {
  return first_impact(a.solid, b.solid, target);
}

// Of two bounded bodies at a time, by the distance method alone.
double gap_at(const Body& a, const Body& b, double time) {
  const auto placed = [&](const Body& body) {
    return compose(moved(body.solid.start, body.solid.motion, time), body.solid.geometry);
  };
  const Pose X_AB = relative(placed(a), placed(b));
  return -find_separation({*a.map, *b.map, X_AB.orientation.toRotationMatrix(), X_AB.position}, 1e9).depth;
}

// ---- closed forms

TEST(TimeOfImpact, OfBallsIsTheRootOfAQuadratic) {
  test::RandomShapes random(51);
  int hits = 0, misses = 0;
  for (int i = 0; i < 2000; ++i) {
    const double r = random.uniform(0.1, 1.0), s = random.uniform(0.1, 1.0);
    const Body a{ball(r), {random.vector(-1, 1), random.rotation()}, {random.vector(-1, 1), random.vector(-9, 9)}};
    const Body b{ball(s),
                 {random.vector(-1, 1) + Vector3(4, 0, 0), random.rotation()},
                 {random.vector(-2, 2) - Vector3(8, 0, 0), random.vector(-9, 9)}};
    const Vector3 p = b.solid.start.position - a.solid.start.position;
    const Vector3 v = b.solid.motion.displacement - a.solid.motion.displacement;
    // when the centres are first r + s + gap apart
    const auto reached = [&](double gap) -> std::optional<double> {
      const double reach = r + s + gap, half = p.dot(v), square = v.squaredNorm();
      const double discriminant = half * half - square * (p.squaredNorm() - reach * reach);
      if (discriminant < 0.0) return std::nullopt;
      const double t = (-half - std::sqrt(discriminant)) / square;
      return t >= 0.0 && t <= 1.0 ? std::optional(t) : std::nullopt;
    };
    const std::optional<double> earliest = reached(kTarget), latest = reached(0.5 * kTarget);
    const std::optional<Impact> found = impact_of(a, b);
    SCOPED_TRACE(i);
    if (latest) {
      ASSERT_TRUE(found);
      ++hits;
    }
    if (!earliest) {
      EXPECT_FALSE(found);
      ++misses;
    }
    if (!found) continue;
    // 1e-12: rounding
    EXPECT_GE(found->fraction, *earliest - 1e-12);
    if (latest) {
      EXPECT_LE(found->fraction, *latest + 1e-12);
    }
    const Vector3 centres = p + found->fraction * v;
    EXPECT_LE((found->normal - centres.normalized()).norm(), 1e-12);
    const Vector3 surface = a.solid.start.position + found->fraction * a.solid.motion.displacement +
                            (r - 0.5 * found->depth) * found->normal;
    EXPECT_LE((found->point - surface).norm(), 1e-12);
  }
  EXPECT_GT(hits, 500);
  EXPECT_GT(misses, 500);
}

TEST(TimeOfImpact, OfABallOnAPlane) {
  const Body plane(ground(), at(0, 0, 0), by(0, 0, 0));
  const Body falling(ball(0.5), at(3, 4.5, 1), by(7, -16, 2, {5, 6, 7}));
  const std::optional<Impact> found = impact_of(plane, falling);
  ASSERT_TRUE(found);
  EXPECT_NEAR(found->fraction, 0.25, kTarget / 16.0);
  EXPECT_LE(found->fraction, 0.25);
  EXPECT_EQ(found->normal, Vector3::UnitY());
  EXPECT_LE((found->point - Vector3(4.75, 0.0, 1.5)).norm(), kTarget);
  // the other way round
  const std::optional<Impact> other = impact_of(falling, plane);
  ASSERT_TRUE(other);
  EXPECT_EQ(other->fraction, found->fraction);
  EXPECT_EQ(other->normal, -Vector3::UnitY());
}

TEST(TimeOfImpact, OfABoxThatFallsFlatAndOneThatTumbles) {
  const Body plane(ground(), at(0, 0, 0), by(0, 0, 0));
  const std::optional<Impact> flat = impact_of(plane, Body(box(1, 0.5, 1), at(0, 1.5, 0), by(0, -4, 0)));
  ASSERT_TRUE(flat);
  EXPECT_NEAR(flat->fraction, 0.25, kTarget);
  // a unit cube that turns by t about z, its centre at height 0.6: its lowest corner is (cos t + sin t)/2 below
  const std::optional<Impact> tumbling =
      impact_of(plane, Body(box(0.5, 0.5, 0.5), at(0, 0.6, 0), by(0, 0, 0, {0, 0, 1})));
  ASSERT_TRUE(tumbling);
  const double angle = std::asin(0.6 * std::sqrt(2.0)) - 0.25 * M_PI;
  EXPECT_NEAR(tumbling->fraction, angle, 2.0 * kTarget);
  EXPECT_LE(tumbling->fraction, angle);
}

// A door that swings about its hinge, one metre off its centre, onto a peg.
TEST(TimeOfImpact, OfABodyThatTurnsAboutAPointOutsideItsShape) {
  const Body door(box(0.5, 1.0, 1e-3), at(0, 0, 0), by(0, 0, 0, {0, 3, 0}), at(1, 0, 0));
  const Body peg(ball(0.1), at(0, 0, -1), by(0, 0, 0));
  const std::optional<Impact> found = impact_of(door, peg);
  ASSERT_TRUE(found);
  // about y the door's plane z = 1e-3 turns towards -z: at the angle a its distance from the peg's centre is
  // |cos a| - 1e-3 with the peg's foot at sin a = r along it
  const double angle = std::acos(0.1 + 1e-3);
  EXPECT_NEAR(3.0 * found->fraction, angle, 2.0 * kTarget);
}

TEST(TimeOfImpact, AClearanceOfATenthOfAMillimetreIsPassedAt100MetresPerSecond) {
  for (const SceneShape::Kind kind : test::kConvexKinds) {
    if (kind == SceneShape::Kind::kConvexPolyhedron) continue;
    const SceneShape flying =
        moving_shape_of(kind, kind == SceneShape::Kind::kSphere ? Vector3::Constant(0.1) : Vector3(0.1, 0.1, 0.1));
    const auto map = make_support_map(flying);
    const double half = map->support(Vector3(0, -1, 0)).y() * -1.0 + map->rounding();
    const auto pass = [&](double clearance) {
      const Body gun(flying, at(-50, 1.0 + half + clearance, 0), by(100, 0, 0, {0, 30, 0}));
      return impact_of(Body(box(20, 1, 20), at(0, 0, 0), by(0, 0, 0)), gun, 1e-5).has_value();
    };
    EXPECT_FALSE(pass(1e-4)) << static_cast<int>(kind);
    EXPECT_TRUE(pass(-1e-6)) << static_cast<int>(kind);
  }
}

TEST(TimeOfImpact, ASpinningSlabMeetsAThinSheet) {
  // 1000 rad/s for 1/60 s; the slab's end is 1 m from the axis, its corner sqrt(1 + 0.01^2)
  const double turning = 1000.0 / 60.0;
  const Body sheet(box(1e-4, 5, 5), at(1.5, 0, 0), by(0, 0, 0));
  for (const double speed : {0.0, 0.45, 0.49, 0.51, 0.6, 3.0}) {
    const Body slab(box(1, 0.01, 0.5), at(0, 0, 0), by(speed, 0, 0, {0, 0, turning}));
    const std::optional<Impact> found = impact_of(slab, sheet);
    // brute force: the farthest corner along x at 2e5 instants
    double first = -1.0;
    for (int i = 0; i <= 200000 && first < 0.0; ++i) {
      const double t = i / 200000.0;
      const double reach = std::fabs(std::cos(turning * t)) + 0.01 * std::fabs(std::sin(turning * t));
      if (speed * t + reach >= 1.5 - 1e-4) first = t;
    }
    SCOPED_TRACE(testing::Message() << "speed " << speed << ", first seen at " << first);
    ASSERT_EQ(found.has_value(), first >= 0.0);
    if (!found) continue;
    EXPECT_NEAR(found->fraction, first, 1e-4);
    EXPECT_LE(found->fraction, first);
    EXPECT_LE(-found->depth, kTarget);
  }
}

TEST(TimeOfImpact, ACubeAt1000MetresPerSecondDoesNotPassAThinWall) {
  const Body wall(box(1e-4, 5, 5), at(0, 0, 0), by(0, 0, 0));
  for (const Vector3& spin : {Vector3(0, 0, 0), Vector3(20, 30, 5)}) {
    const Body cube(box(0.05, 0.05, 0.05), at(-8, 0, 0), by(1000.0 / 60.0, 0, 0, spin));
    const std::optional<Impact> found = impact_of(cube, wall);
    ASSERT_TRUE(found);
    EXPECT_NEAR(gap_at(cube, wall, found->fraction), 0.75 * kTarget, 0.26 * kTarget);
    if (spin.isZero()) {
      EXPECT_NEAR(found->fraction, (8.0 - 0.05 - 1e-4) * 60.0 / 1000.0, kTarget);
    }
  }
}

// A bar of 2 cm square over a thin plate, from flat to where its edge is at the height h: sin(phi + pi/4) = h/(a sqrt 2). Where it
// leaves by a/2 a radian its edges stay above: a (1.2 + phi/2 - cos phi - sin phi) is least at sin phi - cos phi = -1/2, 0.089 a.
TEST(TimeOfImpact, OfABarThatSpinsManyTimes) {
  const double a = 0.01, high = 1.2;
  const Body plate(box(1, 5e-4, 1), at(0, -5e-4, 0), by(0, 0, 0));
  const double angle = std::asin(high / std::sqrt(2.0)) - 0.25 * M_PI;
  for (const double turn : {1.0, 30.0, 1e3, 1e5, 1e7}) {
    const Pose start = at(0, high * a, 0);
    for (const SceneShape& bar : {box(a, a, 0.1), box(a, a, 0.001)}) {
      const std::optional<Impact> found = impact_of(plate, Body(bar, start, by(0, 0, 0, {0, 0, turn})));
      ASSERT_TRUE(found) << turn;
      // gaps of half the target to all of it, at the edge's speed there
      const double speed = a * std::sqrt(2.0) * std::cos(angle + 0.25 * M_PI);
      EXPECT_NEAR(turn * found->fraction, angle - 0.75 * kTarget / speed, 0.3 * kTarget / speed) << turn;
      EXPECT_LE(-found->depth, kTarget) << turn;
      EXPECT_FALSE(impact_of(plate, Body(bar, start, by(0, 0.5 * a * turn, 0, {0, 0, turn})))) << turn;
      EXPECT_FALSE(
          impact_of(Body(ground(), at(0, 0, 0), by(0, 0, 0)), Body(bar, start, by(0, 0.5 * a * turn, 0, {0, 0, turn}))))
          << turn;
    }
  }
}

// ---- what starts in touch, and what does not move

TEST(TimeOfImpact, IsZeroForWhatOverlapsOrTouches) {
  for (const double distance : {0.0, 0.3, 0.999999, 1.0, 1.0 + 0.5 * kTarget}) {
    const std::optional<Impact> found =
        impact_of(Body(ball(0.5), at(0, 0, 0), by(0, 0, 0)), Body(ball(0.5), at(distance, 0, 0), by(50, 0, 0)));
    ASSERT_TRUE(found) << distance;
    EXPECT_EQ(found->fraction, 0.0);
    EXPECT_NEAR(found->depth, 1.0 - distance, 1e-12);
  }
}

TEST(TimeOfImpact, IsNoneForWhatDoesNotMoveAndWhatMovesAsOne) {
  const Body a(box(1, 1, 1), at(0, 0, 0), by(0, 0, 0)), b(box(1, 1, 1), at(2.1, 0, 0), by(0, 0, 0));
  EXPECT_FALSE(impact_of(a, b));
  const Body c(box(1, 1, 1), at(0, 0, 0), by(1e3, 2e3, 0)), d(box(1, 1, 1), at(2.1, 0, 0), by(1e3, 2e3, 0));
  EXPECT_FALSE(impact_of(c, d));
  EXPECT_FALSE(impact_of(Body(ground(), at(0, 0, 0), by(0, 0, 0)), Body(ground(), at(0, 0, 0), by(0, -9, 0))));
}

// A cube 2 nm above another that turns, carried along: in its frame the way goes straight on where the turn goes round,
// so the gap is 2 nm + phi sin(phi) + cos(phi) - 1. Planes that do not turn come nearer by 2 nm in a 1e-8th of the way.
TEST(TimeOfImpact, IsNoneForWhatIsCarriedByABodyThatTurns) {
  for (const double turn : {1e-3, 0.3, 1.0}) {
    const Vector3 rotation(0, 0, turn);
    const Body carrier(box(0.5, 0.5, 0.5), at(0, 0, 0), by(0, 0, 0, rotation));
    const Body load(box(0.5, 0.5, 0.5), at(0, 1.0 + 2e-9, 0), {rotation.cross(Vector3(0, 1.0 + 2e-9, 0)), rotation});
    EXPECT_FALSE(impact_of(carrier, load, 1e-9)) << turn;
    EXPECT_FALSE(impact_of(load, carrier, 1e-9)) << turn;
    // and on a ground that turns
    const Body plate(ground(), at(0, 0.5, 0), by(-0.5 * turn, 0, 0, rotation));
    EXPECT_FALSE(impact_of(plate, load, 1e-9)) << turn;
  }
}

// Two cubes on edges that cross 2 nm apart, each rocking about the place where they do: their centres go straight on, so the
// edges part by the square of the turn. Their plane turns with neither.
TEST(TimeOfImpact, IsNoneForEdgesThatRockOnEachOther) {
  const double high = std::sqrt(0.5);
  const auto on_edge = [](const Vector3& axis) { return exp_rotation(0.25 * M_PI * axis); };
  for (const double turn : {1e-3, 0.1, 0.3}) {
    const Vector3 rocks_a(0, 0, -turn), rocks_b(turn, 0, 0);
    const Body below(box(0.5, 0.5, 0.5), {Vector3(0, -high, 0), on_edge(Vector3::UnitX())},
                     {Vector3(0, high, 0).cross(rocks_a), rocks_a});
    const Body above(box(0.5, 0.5, 0.5), {Vector3(0, high + 2e-9, 0), on_edge(Vector3::UnitZ())},
                     {Vector3(0, -high, 0).cross(rocks_b), rocks_b});
    for (const double time : {0.0, 0.01, 0.1, 0.5, 1.0}) EXPECT_GT(gap_at(below, above, time), 1.9e-9) << turn;
    EXPECT_FALSE(impact_of(below, above, 1e-9)) << turn;
    EXPECT_FALSE(impact_of(above, below, 1e-9)) << turn;
  }
}

TEST(TimeOfImpact, OfAPartOfTheInterval) {
  const Body a(ball(0.5), at(0, 0, 0), by(0, 0, 0)), b(ball(0.5), at(3, 0, 0), by(-4, 0, 0));
  EXPECT_FALSE(first_impact(a.solid, b.solid, kTarget, {0.0, 0.49}));
  EXPECT_TRUE(first_impact(a.solid, b.solid, kTarget, {0.49, 0.51}));
  EXPECT_EQ(first_impact(a.solid, b.solid, kTarget, {0.6, 1.0})->fraction, 0.6);
}

// ---- against sampling

struct RandomFlight {
  Body a, b;
};

RandomFlight random_flight(test::RandomShapes* random, SceneShape::Kind kind_a, SceneShape::Kind kind_b, double spin) {
  const Vector3 way = random->direction();
  const auto geometry = [&] { return Pose{0.4 * random->direction(), random->rotation()}; };
  return {Body{random->convex(kind_a),
               {random->vector(-1, 1), random->rotation()},
               {random->vector(-1, 1), spin * random->vector(-1, 1)},
               geometry()},
          Body{random->convex(kind_b),
               {5.0 * way + random->vector(-1, 1), random->rotation()},
               {-10.0 * way + random->vector(-2, 2), spin * random->vector(-1, 1)},
               geometry()}};
}

TEST(TimeOfImpact, NothingOverlapsBeforeItAndNothingIsMissed) {
  test::RandomShapes random(52);
  int found_count = 0, none_count = 0;
  for (const SceneShape::Kind kind_a : test::kConvexKinds) {
    for (const SceneShape::Kind kind_b : test::kConvexKinds) {
      for (const double spin : {0.0, 3.0, 40.0}) {
        for (int i = 0; i < 8; ++i) {
          const RandomFlight flight = random_flight(&random, kind_a, kind_b, spin);
          SCOPED_TRACE(testing::Message() << "kinds " << static_cast<int>(kind_a) << ", " << static_cast<int>(kind_b)
                                          << ", spin " << spin << ", flight " << i);
          const std::optional<Impact> found = impact_of(flight.a, flight.b);
          const double end = found ? found->fraction : 1.0;
          (found ? found_count : none_count)++;
          for (int k = 0; k <= 300; ++k) {
            const double t = end * k / 300.0;
            // 1e-9: what the distance method is good for where solids of about a metre overlap
            EXPECT_GE(gap_at(flight.a, flight.b, t), 0.5 * kTarget - 1e-9) << "at " << t;
          }
          if (!found) continue;
          EXPECT_GE(gap_at(flight.a, flight.b, end), 0.5 * kTarget - 1e-9);
          EXPECT_LE(gap_at(flight.a, flight.b, end), kTarget + 1e-9);
          EXPECT_NEAR(found->normal.norm(), 1.0, 1e-12);
        }
      }
    }
  }
  EXPECT_GT(found_count, 100);
  EXPECT_GT(none_count, 100);
}

TEST(TimeOfImpact, OfAGroundThatTilts) {
  test::RandomShapes random(53);
  int found_count = 0;
  for (const SceneShape::Kind kind : test::kConvexKinds) {
    for (int i = 0; i < 20; ++i) {
      const Body plane{ground(),
                       {Vector3::Zero(), Quaternion::Identity()},
                       {Vector3::Zero(), random.vector(-0.5, 0.5)},
                       at(random.uniform(-1, 1), -0.2, 0)};
      const Body b{
          random.convex(kind), {random.vector(2, 3), random.rotation()}, {random.vector(-3, 0), random.vector(-2, 2)}};
      const auto gap = [&](double t) {
        const Pose X_PB = relative(compose(moved(plane.solid.start, plane.solid.motion, t), plane.solid.geometry),
                                   moved(b.solid.start, b.solid.motion, t));
        const Vector3 down = X_PB.orientation.conjugate() * -Vector3::UnitY();
        return transform_point(X_PB, b.map->support(down)).y() - b.map->rounding();
      };
      const std::optional<Impact> found = impact_of(plane, b);
      const double end = found ? found->fraction : 1.0;
      found_count += found ? 1 : 0;
      SCOPED_TRACE(testing::Message() << "kind " << static_cast<int>(kind) << ", flight " << i);
      for (int k = 0; k <= 300 && end > 0.0; ++k) EXPECT_GE(gap(end * k / 300.0), 0.5 * kTarget - 1e-12);
      if (found && end > 0.0) {
        EXPECT_LE(gap(end), kTarget + 1e-12);
      }
    }
  }
  EXPECT_GT(found_count, 20);
}

// Needles and sheets, a million times as long as thick.
TEST(TimeOfImpact, OfNeedlesAndSheets) {
  const Body sheet(box(10, 1e-5, 10), at(0, 0, 0), by(0, 0, 0));
  const Body needle(box(1e-5, 10, 1e-5), at(0, 15, 0), by(0, -20, 0, {0, 9, 0}));
  const std::optional<Impact> found = impact_of(sheet, needle, 1e-7);
  ASSERT_TRUE(found);
  EXPECT_NEAR(found->fraction, (5.0 - 1e-5) / 20.0, 1e-8);
  // two needles that cross, and two that miss each other by their own thickness
  for (const double aside : {0.0, 4e-5}) {
    const Body first(box(10, 1e-5, 1e-5), at(0, 0, 0), by(0, 0, 0));
    const Body second(box(1e-5, 1e-5, 10), at(10.0 + aside, 5, 0), by(0, -10, 0));
    const std::optional<Impact> crossing = impact_of(first, second, 1e-7);
    EXPECT_EQ(crossing.has_value(), aside == 0.0);
    if (crossing) {
      EXPECT_NEAR(crossing->fraction, (5.0 - 2e-5) / 10.0, 1e-7);
    }
  }
}

// ---- laws

TEST(TimeOfImpact, IsTheSameForTheExchangedPairAndInAMovedWorld) {
  test::RandomShapes random(54);
  for (const SceneShape::Kind kind_a : test::kConvexKinds) {
    for (const SceneShape::Kind kind_b : test::kConvexKinds) {
      for (int i = 0; i < 6; ++i) {
        const RandomFlight flight = random_flight(&random, kind_a, kind_b, 5.0);
        const std::optional<Impact> one = impact_of(flight.a, flight.b), other = impact_of(flight.b, flight.a);
        // by grazing the target, one may end at an earlier near miss than the other
        const auto same = [&](const std::optional<Impact>& x, double tolerance) {
          ASSERT_EQ(one.has_value(), x.has_value());
          if (!one) return;
          // within the time that the target's half takes at a tenth of the speed
          EXPECT_NEAR(x->fraction, one->fraction, tolerance);
        };
        SCOPED_TRACE(testing::Message() << "kinds " << static_cast<int>(kind_a) << ", " << static_cast<int>(kind_b)
                                        << ", flight " << i);
        same(other, 1e-5);
        const Pose frame{random.vector(-1e3, 1e3), random.rotation()};
        const auto shifted = [&](const Body& body) {
          MovingSolid solid = body.solid;
          solid.start = compose(frame, solid.start);
          solid.start.orientation.normalize();
          solid.motion = {frame.orientation * solid.motion.displacement, frame.orientation * solid.motion.rotation};
          return solid;
        };
        same(first_impact(shifted(flight.a), shifted(flight.b), kTarget), 1e-5);
      }
    }
  }
}

TEST(TimeOfImpact, ScalesWithTheWorld) {
  test::RandomShapes random(55);
  for (const double scale : {1e-6, 1e-3, 1e3, 1e6}) {
    for (int i = 0; i < 40; ++i) {
      const RandomFlight flight = random_flight(
          &random, SceneShape::Kind::kBox, i % 2 == 0 ? SceneShape::Kind::kCone : SceneShape::Kind::kCylinder, 6.0);
      const auto scaled = [&](const Body& body) {
        SceneShape shape = body.shape;
        shape.size *= scale;
        MovingSolid solid = body.solid;
        solid.geometry.position *= scale, solid.start.position *= scale, solid.motion.displacement *= scale;
        return Body(shape, solid.start, solid.motion, solid.geometry);
      };
      const std::optional<Impact> one = impact_of(flight.a, flight.b);
      const std::optional<Impact> other = impact_of(scaled(flight.a), scaled(flight.b), scale * kTarget);
      ASSERT_EQ(one.has_value(), other.has_value());
      if (one) {
        EXPECT_NEAR(one->fraction, other->fraction, 1e-5);
      }
    }
  }
}

TEST(TimeOfImpact, FarFromTheOriginLosesWhatThePositionsLose) {
  for (const double far : {1e3, 1e6, 1e8}) {
    const Body a(box(1, 1, 1), at(far, far, 0), by(far, 0, 0)), b(box(1, 1, 1), at(far + 4, far, 0), by(far - 4, 0, 0));
    const std::optional<Impact> found = impact_of(a, b, 1e-6);
    ASSERT_TRUE(found) << far;
    EXPECT_NEAR(found->fraction, 0.5, 1e-6 + 4e-16 * far) << far;
  }
}

}  // namespace
}  // namespace gravitas
