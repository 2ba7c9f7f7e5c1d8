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

// The solver takes a contact's arm where the free step left the bodies, midway between their surfaces. Explicit Euler
// leaves a rolling ball on the ground, and the arm is the radius; SemiImplicitEuler lets it sink by g cos a h^2 first, so
// the arm is short by this share. It is of second order; velocities feel it in proportion.
double missing_arm(const Method& method, double slope, double radius) {
  const double h = method.time_step;
  return std::string(method.integrator) == "Euler" ? 0.0 : 0.5 * kG * std::cos(slope) * h * h / radius;
}

TEST_P(OnSlope, ABallRollsWhereFrictionIsEnough) {
  const double slope = kPi / 12.0, radius = 0.2, h = GetParam().time_step;
  const double short_by = 1.01 * missing_arm(GetParam(), slope, radius);
  const double least = 2.0 / 7.0 * std::tan(slope);
  for (const double mu : {1.001 * least, 0.4, 2.0}) {
    SceneRun run("ball_on_slope.gravitas", with(GetParam(), {set("Material.Steel.StaticFrictionCoefficient", mu),
                                                             set("Force.Tilted.Acceleration", tilted(slope))}));
    run.to_end();
    const double a = 5.0 / 7.0 * kG * std::sin(slope), t = run.time();
    const SceneRun::Motion ball = run.body("Ball");
    // 1/(1 + 2/5 r^2/arm^2) changes by 4/7 of the arm's share, the turning by another 3/7
    EXPECT_NEAR(ball.twist.linear.x(), a * t, a * t * short_by * 4.0 / 7.0 + 1e-9) << "mu " << mu;
    EXPECT_NEAR((ball.twist.angular - Vector3(0, 0, -a * t / radius)).norm(), 0.0, a * t / radius * short_by + 1e-8)
        << "mu " << mu;
    EXPECT_NEAR(ball.pose.position.x(), 0.5 * a * t * t, 0.5 * a * t * (h + t * short_by) + 1e-9) << "mu " << mu;
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
    EXPECT_NEAR(ball.twist.angular.z(), -spin, spin * 1.01 * missing_arm(GetParam(), slope, radius) + 1e-8)
        << "share " << share;
  }
}

// A ball that is pushed off without spin slides, and rolls from t = 2 v/(7 mu g) on with 5/7 of its speed.
TEST(Rolling, ASlidingBallEndsWithFiveSeventhsOfItsSpeed) {
  const double v = 5.0, mu = 0.3, radius = 0.2, h = 0.001;
  const double short_by = 1.01 * missing_arm({"SemiImplicitEuler", h}, 0.0, radius);
  SceneRun run(
      "ball_on_slope.gravitas",
      {set("Material.Steel.StaticFrictionCoefficient", mu), set("Force.Tilted.Acceleration", Vector3(0, -kG, 0)),
       set("Body.Ball.LinearVelocity", Vector3(v, 0, 0)), set("Simulator.TimeStep", h)});
  const double rolls_from = 2.0 * v / (7.0 * mu * kG);
  while (run.time() < rolls_from - 0.002) run.step();
  EXPECT_NEAR(run.body("Ball").twist.linear.x(), v - mu * kG * run.time(), 1e-9);
  while (run.time() < rolls_from + 0.001) run.step();
  const SceneRun::Motion ball = run.body("Ball");
  EXPECT_NEAR(ball.twist.linear.x(), 5.0 / 7.0 * v, 5.0 / 7.0 * v * short_by);
  EXPECT_NEAR(ball.twist.angular.z(), -ball.twist.linear.x() / radius, ball.twist.linear.x() / radius * short_by);
  run.to_end();
  // it goes on rolling, for there is no rolling friction
  EXPECT_NEAR(run.body("Ball").twist.linear.x(), ball.twist.linear.x(), 1e-9);
  EXPECT_NEAR(run.body("Ball").pose.position.y(), radius, 1e-9);
}

}  // namespace
}  // namespace gravitas
