// Bodies on a plane: rest, sliding to a stop, slopes, rolling.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <string>
#include <utility>
#include <vector>

#include "tests/scenes/scene_run.h"

namespace gravitas {
namespace {

using harness::angle_between;
using harness::SceneRun;
using harness::set;

struct Method {
  const char* integrator;
  double time_step;
};

void PrintTo(const Method& method, std::ostream* out) { *out << method.integrator << ", dt = " << method.time_step; }

std::vector<std::string> with(const Method& method, std::vector<std::string> more = {}) {
  more.push_back(set("Integrator", std::string(method.integrator)));
  more.push_back(set("Simulator.TimeStep", method.time_step));
  return more;
}

std::vector<std::string> friction(double mu) {
  return {set("Material.Wood.StaticFrictionCoefficient", mu), set("Material.Wood.DynamicFrictionCoefficient", mu)};
}

// Gravity on a slope that falls by `angle` towards +x.
Vector3 tilted(double angle) { return kG * Vector3(std::sin(angle), -std::cos(angle), 0.0); }

class OnPlane : public ::testing::TestWithParam<Method> {};

INSTANTIATE_TEST_SUITE_P(EachMethod, OnPlane,
                         ::testing::Values(Method{"Euler", 1.0 / 60}, Method{"Euler", 1.0 / 240},
                                           Method{"SemiImplicitEuler", 1.0 / 60},
                                           Method{"SemiImplicitEuler", 1.0 / 240}));

TEST_P(OnPlane, ABoxAtRestStaysWhereItIs) {
  SceneRun run("box_on_plane.gravitas", with(GetParam()));
  const Pose start = run.body("Box").pose;
  while (!run.is_done()) {
    run.step();
    const SceneRun::Motion box = run.body("Box");
    ASSERT_LE((box.pose.position - start.position).norm(), 1e-9) << "at " << run.time();
    ASSERT_LE(angle_between(box.pose.orientation, start.orientation), 1e-9) << "at " << run.time();
    ASSERT_LE(box.twist.linear.norm() + box.twist.angular.norm(), 1e-9) << "at " << run.time();
  }
  EXPECT_LE(run.report().max_penetration(), 1e-12);
}

// A step's deceleration is exact; the position takes each step's new (or old) velocity, which shortens (or lengthens)
// the way by v h/2; the stop falls inside a step, which takes another mu g h^2/2 at most.
TEST_P(OnPlane, ABoxSlidesToAStopInItsStoppingDistance) {
  const double v = 5.0, mu = 0.3, h = GetParam().time_step;
  SceneRun run("box_on_plane.gravitas", with(GetParam(), {set("Body.Box.LinearVelocity", Vector3(v, 0, 0))}));
  const double exact = v * v / (2.0 * mu * kG);
  while (run.body("Box").twist.linear.norm() > 1e-9) run.step();
  const double stopped_at = run.body("Box").pose.position.x();
  EXPECT_NEAR(stopped_at, exact, 0.5 * v * h + 0.5 * mu * kG * h * h + 1e-9);
  EXPECT_NEAR(run.time(), v / (mu * kG), 2.0 * h);
  while (!run.is_done()) {
    run.step();
    ASSERT_NEAR(run.body("Box").pose.position.x(), stopped_at, 1e-9) << "at " << run.time();
    ASSERT_LE(run.body("Box").twist.linear.norm(), 1e-9) << "at " << run.time();
  }
  EXPECT_LE(angle_between(run.body("Box").pose.orientation, Quaternion::Identity()), 1e-9);
  EXPECT_NEAR(run.body("Box").pose.position.y(), 0.1, 1e-9);
}

TEST(Sliding, StopsAlikeInSixteenDirections) {
  const double v = 5.0;
  double first = 0.0;
  for (int i = 0; i < 16; ++i) {
    const double angle = 2.0 * kPi * i / 16.0;
    const Vector3 direction(std::cos(angle), 0.0, std::sin(angle));
    SceneRun run("box_on_plane.gravitas",
                 {set("Body.Box.LinearVelocity", Vector3(v * direction)),
                  // corner first, edge first and all between
                  set("Body.Box.Orientation", harness::turned(Vector3::UnitY(), 0.1)), set("Simulator.Duration", 2.5)});
    run.to_end();
    const SceneRun::Motion box = run.body("Box");
    const Vector3 way = box.pose.position - Vector3(0, 0.1, 0);
    if (i == 0) first = way.norm();
    EXPECT_NEAR(way.norm(), first, 1e-9 * first) << "direction " << i;
    EXPECT_NEAR((way - way.norm() * direction).norm(), 0.0, 1e-9 * first) << "direction " << i;
    EXPECT_NEAR(angle_between(box.pose.orientation, harness::turned(Vector3::UnitY(), 0.1)), 0.0, 1e-9) << i;
    EXPECT_LE(box.twist.linear.norm(), 1e-9) << "direction " << i;
  }
  EXPECT_NEAR(first, v * v / (2.0 * 0.3 * kG), 0.5 * v * 0.01 + 0.5 * 0.3 * kG * 1e-4);
}

// Friction at rest may be larger than in motion; what slides feels the smaller one.
TEST(Sliding, FeelsTheDynamicCoefficient) {
  SceneRun run("box_on_plane.gravitas",
               {set("Body.Box.LinearVelocity", Vector3(3, 0, 0)), set("Material.Wood.StaticFrictionCoefficient", 0.6),
                set("Material.Wood.DynamicFrictionCoefficient", 0.2)});
  run.steps(100);
  EXPECT_NEAR(run.body("Box").twist.linear.x(), 3.0 - 0.2 * kG * run.time(), 1e-9);
}

// Of bodies whose centres stand still: a ball that is spun on the spot comes to roll, a disc that spins is turned back by a torque
// of twice what friction holds.
TEST(Sliding, EndsOnTheSpot) {
  const std::string floor = "Body { Id = \"Floor\" GeometryId = \"F\" Material = \"M\" }\n";
  const auto scene = [&](const std::string& shape, const std::string& friction, const std::string& force,
                         const std::string& body) {
    return "Geometries { Geometry { Type = \"Halfspace\" Id = \"F\" } Geometry { Id = \"S\" Type = " + shape +
           " } }\nMaterials { Material { Id = \"M\" StaticFrictionCoefficient = " + friction +
           " } }\nForces { Force { Type = \"Gravity\" Id = \"G\" CustomProperties { Acceleration = {0, -9.81, 0} } "
           "}\n" +
           force + "}\nEnvironment { Space { Bodies {\n" + floor +
           "Body { Id = \"Thing\" GeometryId = \"S\" Material = \"M\" " + body + " } } } }\n";
  };
  for (const double h : {1.0 / 30.0, 1.0 / 60.0, 1.0 / 80.0}) {
    const std::vector<std::string> settings = {set("Simulator.TimeStep", h), set("Simulator.Duration", 0.1),
                                               "Simulator=Continuous", "Integrator=Verlet", "Solver=Newton"};
    // v = mu g t until it is r (w - 5/2 mu g t/r), the rest at 2/7 r w
    SceneRun ball(
        scene("\"Sphere\" CustomProperties { Radius = 0.1 }", "0.5", "",
              "Mass = 1 Forces = {\"G\"} KineticProperties { Position = {0, 0.1, 0} AngularVelocity = {0, 0, -2} }"),
        settings);
    ball.to_end();
    const double rolls = 2.0 / 7.0 * 0.1 * 2.0, slides = rolls / (0.5 * kG);
    EXPECT_NEAR(ball.body("Thing").pose.position.x(), rolls * (ball.time() - 0.5 * slides), 1e-10) << h;
    EXPECT_NEAR(ball.body("Thing").twist.linear.x(), rolls, 1e-10) << h;
    // a box held by its four corners: mu m g r about its axis
    const double arm = std::hypot(0.2, 0.2), moment = 0.3 * kG * arm, inertia = 0.05;
    const double back = 0.4 * h, spin = -3.0 * moment / inertia * back;
    SceneRun box(scene("\"Box\" CustomProperties { HalfExtents = {0.2, 0.05, 0.2} }", "0.3",
                       "Force { Type = \"Basic\" Id = \"T\" CustomProperties { Torque = " +
                           harness::literal(Vector3(0, 2.0 * moment, 0)) + " } }\n",
                       "Mass = 1 PrincipalMoments = {0.05, 0.05, 0.05} Forces = {\"G\", \"T\"} KineticProperties { "
                       "Position = {0, 0.05, 0} AngularVelocity = " +
                           harness::literal(Vector3(0, spin, 0)) + " }"),
                 settings);
    box.to_end();
    EXPECT_NEAR(box.body("Thing").twist.angular.y(), moment / inertia * (box.time() - back), 1e-6) << h;
  }
}

// Up a slope: there dynamic friction and the slope stop it, wherever in a step; then it stays, where static friction is
// enough, or slides back. (That static friction could have stopped it sooner must not matter.)
TEST(Sliding, EndsToRoundingWhereDynamicFrictionStopsIt) {
  struct Case {
    double slope, static_friction, dynamic_friction;
  };
  for (const Case& c : {Case{0.0, 0.6, 0.3}, Case{0.0, 0.305, 0.3}, Case{0.3, 0.5, 0.5}, Case{0.3, 0.8, 0.5},
                        Case{0.3, 0.6, 0.2}, Case{0.3, 0.31, 0.25}, Case{0.3, 0.1, 0.1}}) {
    for (const double v : {1.0, 2.3}) {
      for (const double h : {1.0 / 60, 1.0 / 240}) {
        for (const char* simulator : {"Continuous", "Bisection"}) {
          SceneRun run("box_on_plane.gravitas",
                       {set("Simulator", std::string(simulator)), set("Solver", std::string("Newton")),
                        set("Integrator", std::string("Verlet")), set("Simulator.TimeStep", h),
                        set("Simulator.Duration", 2.0), set("Force.Down.Acceleration", tilted(-c.slope)),
                        set("Material.Wood.StaticFrictionCoefficient", c.static_friction),
                        set("Material.Wood.DynamicFrictionCoefficient", c.dynamic_friction),
                        set("Body.Box.LinearVelocity", Vector3(v, 0, 0))});
          run.to_end();
          const double down = kG * std::sin(c.slope), rubs = c.dynamic_friction * kG * std::cos(c.slope);
          const double stops = v / (down + rubs), back = std::tan(c.slope) > c.static_friction ? down - rubs : 0.0;
          const double rest = run.time() - stops;
          EXPECT_NEAR(run.body("Box").pose.position.x(), 0.5 * v * stops - 0.5 * back * rest * rest, 1e-10)
              << simulator << ", slope " << c.slope << ", friction " << c.static_friction << " and "
              << c.dynamic_friction << ", " << v << " m/s, dt " << h;
        }
      }
    }
  }
}

class OnSlope : public OnPlane {};

INSTANTIATE_TEST_SUITE_P(EachMethod, OnSlope,
                         ::testing::Values(Method{"Euler", 1.0 / 60}, Method{"Euler", 1.0 / 240},
                                           Method{"SemiImplicitEuler", 1.0 / 60},
                                           Method{"SemiImplicitEuler", 1.0 / 240}));

TEST_P(OnSlope, ABoxSticksAboveTheAngleOfFriction) {
  const double slope = std::atan(0.5);
  for (const double mu : {0.5 + 1e-6, 0.8}) {
    std::vector<std::string> scene = with(GetParam(), friction(mu));
    scene.push_back(set("Force.Down.Acceleration", tilted(slope)));
    SceneRun run("box_on_plane.gravitas", scene);
    const Pose start = run.body("Box").pose;
    while (!run.is_done()) {
      run.step();
      ASSERT_LE((run.body("Box").pose.position - start.position).norm(), 1e-9) << "mu " << mu << " at " << run.time();
    }
    EXPECT_LE(angle_between(run.body("Box").pose.orientation, start.orientation), 1e-9);
  }
}

TEST_P(OnSlope, ABoxSlidesBelowTheAngleOfFriction) {
  const double slope = std::atan(0.5), h = GetParam().time_step;
  for (const double mu : {0.49, 0.2, 0.0}) {
    std::vector<std::string> scene = with(GetParam(), friction(mu));
    scene.push_back(set("Force.Down.Acceleration", tilted(slope)));
    scene.push_back(set("Simulator.Duration", 2));
    SceneRun run("box_on_plane.gravitas", scene);
    run.to_end();
    const double a = kG * (std::sin(slope) - mu * std::cos(slope)), t = run.time();
    const SceneRun::Motion box = run.body("Box");
    EXPECT_NEAR(box.twist.linear.x(), a * t, 1e-9) << "mu " << mu;
    // the way of a constant acceleration is off by a t h/2, as in free flight
    EXPECT_NEAR(box.pose.position.x(), 0.5 * a * t * t, 0.5 * a * t * h + 1e-9) << "mu " << mu;
    EXPECT_NEAR(box.pose.position.y(), 0.1, 1e-9) << "mu " << mu;
    EXPECT_LE(angle_between(box.pose.orientation, Quaternion::Identity()), 1e-9) << "mu " << mu;
  }
}

TEST_P(OnSlope, ABallRollsWhereFrictionIsEnough) {
  const double slope = kPi / 12.0, radius = 0.2, h = GetParam().time_step;
  const double least = 2.0 / 7.0 * std::tan(slope);
  for (const double mu : {1.001 * least, 0.4, 2.0}) {
    SceneRun run("ball_on_slope.gravitas", with(GetParam(), {set("Material.Steel.StaticFrictionCoefficient", mu),
                                                             set("Force.Tilted.Acceleration", tilted(slope))}));
    run.to_end();
    const double a = 5.0 / 7.0 * kG * std::sin(slope), t = run.time();
    const SceneRun::Motion ball = run.body("Ball");
    EXPECT_NEAR(ball.twist.linear.x(), a * t, 1e-9) << "mu " << mu;
    EXPECT_NEAR((ball.twist.angular - Vector3(0, 0, -a * t / radius)).norm(), 0.0, 1e-8) << "mu " << mu;
    EXPECT_NEAR(ball.pose.position.x(), 0.5 * a * t * t, 0.5 * a * t * h + 1e-9) << "mu " << mu;
    EXPECT_NEAR(ball.pose.position.y(), radius, 1e-9) << "mu " << mu;
  }
}

TEST_P(OnSlope, ABallSlipsWhereFrictionIsNotEnough) {
  const double slope = kPi / 12.0, radius = 0.2;
  for (const double share : {0.99, 0.5}) {
    const double mu = share * 2.0 / 7.0 * std::tan(slope);
    SceneRun run("ball_on_slope.gravitas", with(GetParam(), {set("Material.Steel.StaticFrictionCoefficient", mu),
                                                             set("Force.Tilted.Acceleration", tilted(slope))}));
    run.to_end();
    const double t = run.time();
    const SceneRun::Motion ball = run.body("Ball");
    EXPECT_NEAR(ball.twist.linear.x(), kG * (std::sin(slope) - mu * std::cos(slope)) * t, 1e-9) << "share " << share;
    // alpha = r mu m g cos / (2/5 m r^2)
    const double spin = 2.5 * mu * kG * std::cos(slope) / radius * t;
    EXPECT_NEAR(ball.twist.angular.z(), -spin, 1e-8) << "share " << share;
  }
}

// A ball that is pushed off without spin slides, and rolls from t = 2 v/(7 mu g) on with 5/7 of its speed.
TEST(Rolling, ASlidingBallEndsWithFiveSeventhsOfItsSpeed) {
  const double v = 5.0, mu = 0.3, radius = 0.2, h = 0.001;
  SceneRun run(
      "ball_on_slope.gravitas",
      {set("Material.Steel.StaticFrictionCoefficient", mu), set("Force.Tilted.Acceleration", Vector3(0, -kG, 0)),
       set("Body.Ball.LinearVelocity", Vector3(v, 0, 0)), set("Simulator.TimeStep", h)});
  const double rolls_from = 2.0 * v / (7.0 * mu * kG);
  while (run.time() < rolls_from - 0.002) run.step();
  EXPECT_NEAR(run.body("Ball").twist.linear.x(), v - mu * kG * run.time(), 1e-9);
  while (run.time() < rolls_from + 0.001) run.step();
  const SceneRun::Motion ball = run.body("Ball");
  EXPECT_NEAR(ball.twist.linear.x(), 5.0 / 7.0 * v, 1e-9);
  EXPECT_NEAR(ball.twist.angular.z(), -ball.twist.linear.x() / radius, 1e-8);
  run.to_end();
  // it goes on rolling, for there is no rolling friction
  EXPECT_NEAR(run.body("Ball").twist.linear.x(), ball.twist.linear.x(), 1e-9);
  EXPECT_NEAR(run.body("Ball").pose.position.y(), radius, 1e-9);
}

// Rolling friction b slows a rolling ball by 5 b g/(7 r), spinning friction one that spins on the spot by 5 b g/(2 r^2).
TEST(Rolling, AndSpinningEndToRoundingWhereFrictionStopsThem) {
  const double radius = 0.2, b = 0.016, v = 1.3, spin = 7.0;
  for (const char* solver : {"Newton", "Sequential"}) {
    for (const double h : {1.0 / 60, 1.0 / 240}) {
      std::vector<std::string> scene = {set("Simulator", std::string("Continuous")),
                                        set("Solver", std::string(solver)),
                                        set("Integrator", std::string("Verlet")),
                                        set("Simulator.TimeStep", h),
                                        set("Simulator.Duration", 3.0),
                                        set("Force.Tilted.Acceleration", Vector3(0, -kG, 0)),
                                        set("Material.Steel.RollingFrictionCoefficient", b),
                                        set("Material.Steel.SpinningFrictionCoefficient", b)};
      std::vector<std::string> rolls = scene, spins = scene;
      rolls.push_back(set("Body.Ball.LinearVelocity", Vector3(v, 0, 0)));
      rolls.push_back(set("Body.Ball.AngularVelocity", Vector3(0, 0, -v / radius)));
      SceneRun rolling("ball_on_slope.gravitas", rolls);
      rolling.to_end();
      const double slowed = 5.0 * b * kG / (7.0 * radius);
      EXPECT_NEAR(rolling.body("Ball").pose.position.x(), 0.5 * v * v / slowed, 1e-10) << solver << ", dt " << h;
      spins.push_back(set("Body.Ball.AngularVelocity", Vector3(0, spin, 0)));
      SceneRun spinning("ball_on_slope.gravitas", spins);
      spinning.to_end();
      const double turn = 0.5 * spin * spin / (2.5 * b * kG / (radius * radius));
      EXPECT_NEAR(angle_between(spinning.body("Ball").pose.orientation, harness::turned(Vector3::UnitY(), turn)), 0.0,
                  1e-7)
          << solver << ", dt " << h;
    }
  }
}

// In a trial a ball of 1 mm sinks by more than its radius at 1/60 s. What is left of the spin follows from the angular
// momentum about the line of contact, whatever friction does.
TEST(Rolling, OfSmallBallsAtLongStepsIsExact) {
  for (const char* solver : {"Sequential", "Newton"}) {
    for (const char* simulator : {"Basic", "Continuous"}) {
      for (const double radius : {0.001, 0.005, 0.028, 0.2}) {
        const double v = 1.0, back = 0.5;
        SceneRun run(
            "ball_on_slope.gravitas",
            {set("Solver", std::string(solver)), set("Simulator", std::string(simulator)),
             set("Geometry.Round.Radius", radius), set("Force.Tilted.Acceleration", Vector3(0, -kG, 0)),
             set("Body.Ball.Position", Vector3(0, radius, 0)), set("Body.Ball.LinearVelocity", Vector3(v, 0, 0)),
             set("Body.Ball.AngularVelocity", Vector3(0, 0, back / radius)), set("Simulator.TimeStep", 1.0 / 60),
             set("Simulator.Duration", 1.0)});
        run.to_end();
        const SceneRun::Motion ball = run.body("Ball");
        EXPECT_NEAR(ball.twist.linear.x(), (5.0 * v - 2.0 * back) / 7.0, 1e-9)
            << solver << ", " << simulator << ", " << radius;
        EXPECT_NEAR(ball.twist.angular.z() * radius, -ball.twist.linear.x(), 1e-9)
            << solver << ", " << simulator << ", " << radius;
      }
    }
  }
}

// A ball of 0.1 m that flies and spins without gravity onto a plane: friction stops the slip of 1.5 m/s at once, wherever in a
// step that is. It took the whole step, and the ball was off by half of that times what friction changed.
TEST(Impact, OfAFlyingBallWithFrictionIsOverInNoTime) {
  for (const char* solver : {"Newton", "Sequential", "Direct"}) {
    for (const double time_step : {1.0 / 60, 1.0 / 240, 1e-3, 0.11}) {
      SceneRun run(R"(
Geometries { Geometry { Type = "Halfspace" Id = "Flat" } Geometry { Type = "Sphere" Id = "Round" CustomProperties { Radius = 0.1 } } }
Materials { Material { Id = "Rubber" RestitutionCoefficient = 0.3 StaticFrictionCoefficient = 0.4 } }
Simulator { Type = "Continuous" CustomProperties { TimeStep = 0.01 Duration = 0.15 } }
Environment {
  Space { Bodies {
    Body { Id = "Floor" GeometryId = "Flat" Material = "Rubber" Immovable = true }
    Body { Id = "Ball" GeometryId = "Round" Material = "Rubber" Mass = 1
      KineticProperties { Position = {0, 0.21, 0} LinearVelocity = {1, -1, 0} AngularVelocity = {0, 0, 5} } }
  } }
  KineticIntegrator = "Verlet"
})",
                   {set("Simulator.TimeStep", time_step), set("Solver", std::string(solver))});
      run.to_end();
      const SceneRun::Motion ball = run.body("Ball");
      // of the slip, two sevenths go to the ball's speed
      EXPECT_NEAR(ball.twist.linear.x(), 1.0 - 1.5 * 2.0 / 7.0, 1e-12) << solver << ", " << time_step;
      EXPECT_NEAR(ball.pose.position.x(), 0.11 + 0.04 * 4.0 / 7.0, 1e-9) << solver << ", " << time_step;
      EXPECT_NEAR(ball.pose.position.y(), 0.1 + 0.3 * 0.04, 1e-9) << solver << ", " << time_step;
    }
  }
}

}  // namespace
}  // namespace gravitas
