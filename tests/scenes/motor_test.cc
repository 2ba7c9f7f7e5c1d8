// Angular motors, and joints that break.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <string>
#include <vector>

#include "tests/scenes/scene_run.h"

namespace gravitas {
namespace {

using harness::SceneRun;
using harness::set;

class Motor : public ::testing::TestWithParam<const char*> {
 protected:
  std::vector<std::string> with(std::vector<std::string> more) const {
    more.push_back(set("Integrator", std::string(GetParam())));
    return more;
  }
};

INSTANTIATE_TEST_SUITE_P(EachIntegrator, Motor, ::testing::Values("Euler", "SemiImplicitEuler"),
                         [](const auto& which) { return std::string(which.param); });

TEST_P(Motor, ReachesItsSpeedInAStepAndKeepsIt) {
  SceneRun run("motor_pair.gravitas", with({}));
  while (!run.is_done()) {
    run.step();
    const Vector3 relative = run.body("Rotor").twist.angular - run.body("Stator").twist.angular;
    ASSERT_LE((relative - Vector3(0, 2, 0)).norm(), 1e-9) << "at " << run.time();
  }
  ASSERT_EQ(run.report().drives_size(), 1);
  EXPECT_NEAR(run.report().drives(0).speed(), 2.0, 1e-9);
  EXPECT_EQ(run.report().drives(0).target(), 2.0);
  EXPECT_LE(run.report().max_joint_error(), 1e-12);
}

// A lift that turns with its shaft, half as strong as the load wants: the report has its speed along the axis, which is missed.
TEST_P(Motor, OfASliderThatIsTooWeakIsTold) {
  for (const double strength : {10.0, 0.5}) {
    SceneRun run(
        "Forces { Force { Type = \"Gravity\" Id = \"G\" CustomProperties { Acceleration = {0, -9.81, 0} } } }\n"
        "Environment { Space { Bodies { Body { Id = \"Shaft\" Mass = 1 PrincipalMoments = {1, 1, 1} Kinematic = true "
        "KineticProperties { AngularVelocity = {0, 3, 0} } } Body { Id = \"Load\" Mass = 2 PrincipalMoments = {1, 1, "
        "1} "
        "Forces = {\"G\"} KineticProperties { Position = {1, 0, 0} } } } }\n"
        "Constraints { Constraint { Type = \"Slider\" Id = \"Lift\" Body1 = \"Shaft\" Body2 = \"Load\" "
        "CustomProperties { "
        "BindPoint = {1, 0, 0} Axis = {0, 2, 0} Speed = 0.4 MaximumForce = " +
            harness::literal(strength * 2 * kG) + " } } } }\n",
        with({"Simulator.Duration=0.5"}));
    run.to_end();
    const report::v1::Report report = run.report();
    ASSERT_EQ(report.sliding_drives_size(), 1);
    EXPECT_EQ(report.sliding_drives(0).target(), 0.4);
    EXPECT_NEAR(report.sliding_drives(0).speed(), strength > 1.0 ? 0.4 : -0.5 * kG * run.time(), 1e-6) << strength;
    EXPECT_EQ(report.drives_size(), 0);
  }
}

TEST_P(Motor, BetweenFreeBodiesTurnsEachInTheMeasureOfTheOther) {
  SceneRun run("motor_pair.gravitas", with({}));
  const double stator = run.moments("Stator").y(), rotor = run.moments("Rotor").y();
  while (!run.is_done()) {
    run.step();
    // rounding of moments of a few dozen kg m^2
    ASSERT_LE(run.angular_momentum().norm(), 1e-11) << "at " << run.time();
    ASSERT_LE(run.momentum().norm(), 1e-11) << "at " << run.time();
  }
  EXPECT_NEAR(run.body("Stator").twist.angular.y(), -2.0 * rotor / (stator + rotor), 1e-9);
  EXPECT_NEAR(run.body("Rotor").twist.angular.y(), 2.0 * stator / (stator + rotor), 1e-9);
}

TEST_P(Motor, InATumblingPairKeepsItsSpeedAboutTheMovingAxis) {
  // both turn about their common centre: the axis sweeps round
  SceneRun run(
      "motor_pair.gravitas",
      with({set("Body.Stator.LinearVelocity", Vector3(0.5, 0, 0)),
            set("Body.Rotor.LinearVelocity", Vector3(-0.5, 0, 0)), set("Body.Stator.AngularVelocity", Vector3(0, 0, 1)),
            set("Body.Rotor.AngularVelocity", Vector3(0, 0, 1)), set("Simulator.TimeStep", 1.0 / 240)}));
  const Vector3 momentum = run.momentum();
  while (!run.is_done()) {
    run.step();
    const SceneRun::Motion stator = run.body("Stator"), rotor = run.body("Rotor");
    const Vector3 axis = (rotor.pose.position - stator.pose.position).normalized();
    // the drive acts along the axis of the free step, which the turn of this step, 1/240 rad, still tilts
    ASSERT_NEAR(axis.dot(rotor.twist.angular - stator.twist.angular), 2.0, 1e-4) << "at " << run.time();
    ASSERT_NEAR((rotor.pose.position - stator.pose.position).norm(), 1.0, 1e-6) << "at " << run.time();
    ASSERT_LE((run.momentum() - momentum).norm(), 1e-10) << "at " << run.time();
  }
  EXPECT_LE(run.report().max_joint_error(), 1e-6);
}

TEST_P(Motor, HasALargestTorque) {
  SceneRun run("motor_disc.gravitas", with({}));
  const double inertia = run.moments("Rotor").y(), h = run.time_step();
  EXPECT_NEAR(inertia, 0.5 * 12.0 * 0.25, 1e-12);
  while (!run.is_done()) {
    run.step();
    const Vector3 w = run.body("Rotor").twist.angular;
    ASSERT_NEAR(w.y(), std::min(5.0, run.step_count() * h * 3.0 / inertia), 1e-9) << "at " << run.time();
    ASSERT_NEAR(std::hypot(w.x(), w.z()), 0.0, 1e-12);
  }
  EXPECT_LE(run.body("Rotor").pose.position.norm(), 1e-12);
}

TEST_P(Motor, JointBreaksBeyondItsForce) {
  const std::string hanging = set("Body.Ball.Position", Vector3(0, -1, 0));
  // 1 kg hangs at rest: the joint bears 9.81 N from the first step on
  SceneRun holds("pendulum.gravitas", with({hanging, set("Constraint.Pivot.BreakingForce", kG * (1.0 + 1e-6))}));
  holds.to_end();
  EXPECT_TRUE(holds.holds("Pivot"));
  EXPECT_EQ(holds.count_events(EventKind::kBreak), 0U);
  EXPECT_NEAR(holds.body("Ball").pose.position.y(), -1.0, 1e-9);

  SceneRun breaks("pendulum.gravitas", with({hanging, set("Constraint.Pivot.BreakingForce", kG * (1.0 - 1e-6))}));
  breaks.steps(500);
  EXPECT_FALSE(breaks.holds("Pivot"));
  ASSERT_EQ(breaks.count_events(EventKind::kBreak), 1U);
  EXPECT_EQ(breaks.events()[0].step, 1U);
  EXPECT_EQ(breaks.events()[0].a, kNone);
  EXPECT_EQ(breaks.events()[0].b, 0U);
  EXPECT_EQ(breaks.events()[0].constraint, 0U);
  // it falls freely from the step on that was too much
  EXPECT_NEAR(breaks.body("Ball").twist.linear.y(), -kG * 500 * breaks.time_step(), 1e-12);
  // what no longer holds has no joint error
  EXPECT_LE(breaks.report().max_joint_error(), 1e-12);
}

TEST_P(Motor, JointBreaksBeyondItsThreshold) {
  // at 1/60 s the joint of a pendulum let go level holds back up to 3 g h^2 = 8.2 mm, at the lowest point
  const std::string coarse = set("Simulator.TimeStep", 1.0 / 60);
  SceneRun holds("pendulum.gravitas", with({coarse, set("Constraint.Pivot.BreakingThreshold", 1e-2)}));
  holds.to_end();
  EXPECT_TRUE(holds.holds("Pivot"));

  SceneRun breaks("pendulum.gravitas", with({coarse, set("Constraint.Pivot.BreakingThreshold", 5e-3)}));
  breaks.to_end();
  EXPECT_FALSE(breaks.holds("Pivot"));
  EXPECT_EQ(breaks.count_events(EventKind::kBreak), 1U);
  EXPECT_LE(breaks.report().max_joint_error(), 1e-5);
  EXPECT_GT(breaks.body("Ball").pose.position.norm(), 10.0);
}

// Solvers leave next to no error: what the threshold is judged on is how far the impulse held the joint, g h^2 of a ball that
// hangs, with each of them alike.
TEST_P(Motor, JointThatIsLeftNoErrorBreaksByWhatItHolds) {
  const auto holds = [&](const char* solver, double threshold) {
    SceneRun run("pendulum.gravitas",
                 with({set("Body.Ball.Position", Vector3(0, -1, 0)), std::string("Solver=") + solver,
                       set("Constraint.Pivot.BreakingThreshold", threshold)}));
    run.steps(100);
    EXPECT_EQ(run.count_events(EventKind::kBreak), run.holds("Pivot") ? 0U : 1U);
    return run.holds("Pivot");
  };
  const double held = kG * 1e-3 * 1e-3;
  for (const char* solver : {"Sequential", "Newton", "Direct"}) {
    EXPECT_TRUE(holds(solver, held * (1.0 + 1e-6))) << solver;
    EXPECT_FALSE(holds(solver, held * (1.0 - 1e-6))) << solver;
  }
}

}  // namespace
}  // namespace gravitas
