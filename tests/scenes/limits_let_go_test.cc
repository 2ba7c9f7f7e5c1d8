// Stops and ropes that bear while another one strikes: what would have to pull lets go, and the speeds after the impact are those
// of the bodies that are left to each other.
#include <gtest/gtest.h>

#include <cmath>
#include <string>

#include "tests/scenes/scene_run.h"

namespace gravitas {
namespace {

using harness::SceneRun;

class LimitsLetGo : public ::testing::TestWithParam<const char*> {};
INSTANTIATE_TEST_SUITE_P(By, LimitsLetGo, ::testing::Values("DormandPrince54", "DormandPrince853", "RK4"),
                         [](const auto& one) { return std::string(one.param); });

// A is pressed on its stop; B reaches the stop against A that pulls it off. By momentum both go at half the speed of B, slowed
// by the push F = 0.5 N, which acts on both from then on, t = 0.15 s: v = -1/2 + F t / 2 m.
TEST_P(LimitsLetGo, AStopThatWouldHaveToPull) {
  for (const double step : {1.0 / 60.0, 0.004, 0.001}) {
    SceneRun run(R"(
Forces { Force { Type = "Basic" Id = "Push" CustomProperties { Force = {0.5, 0, 0} } } }
Simulator { Type = "Smooth" CustomProperties { TimeStep = 0.001 Duration = 0.3 } }
Environment {
  Space { Bodies {
    Body { Id = "A" Mass = 1 PrincipalMoments = {1, 1, 1} Forces = {"Push"} }
    Body { Id = "B" Mass = 1 PrincipalMoments = {1, 1, 1} KineticProperties { Position = {1, 0, 0} LinearVelocity = {-1, 0, 0} } }
  } }
  Constraints {
    Constraint { Type = "Slider" Id = "S" Body2 = "A" CustomProperties { BindPoint = {0, 0, 0} Axis = {1, 0, 0} UpperLimit = 0 } }
    Constraint { Type = "Slider" Id = "T" Body1 = "A" Body2 = "B" CustomProperties { BindPoint = {0, 0, 0} Axis = {1, 0, 0} LowerLimit = -0.15 } }
  }
})",
                 {"Simulator.TimeStep=" + std::to_string(step), std::string("Integrator=") + GetParam()});
    run.to_end();
    const double after = run.time() - 0.15, exact = -0.5 * after + 0.125 * after * after;
    // the impact is told at the end of its step
    EXPECT_NEAR(run.body("A").pose.position.x(), exact, 0.5 * step) << step;
    EXPECT_NEAR(run.body("A").twist.linear.x(), -0.5 + 0.25 * after, 0.25 * step) << step;
    EXPECT_NEAR(run.body("B").pose.position.x() - run.body("A").pose.position.x(), 0.85, 1e-9) << step;
  }
}

// The rope that A hangs on goes slack when that to B, thrown up, is taut: they go on with the mean of their speeds.
TEST_P(LimitsLetGo, ARopeThatWouldHaveToPush) {
  const double way = 0.5, thrown = 6.0;
  SceneRun run(R"(
Forces { Force { Type = "Gravity" Id = "Down" CustomProperties { Acceleration = {0, -9.81, 0} } } }
Simulator { Type = "Smooth" CustomProperties { TimeStep = 0.0005 Duration = 0.31 } }
Environment {
  Space { Bodies {
    Body { Id = "A" Mass = 1 PrincipalMoments = {1, 1, 1} Forces = {"Down"} KineticProperties { Position = {0, -1, 0} } }
    Body { Id = "B" Mass = 1 PrincipalMoments = {1, 1, 1} Forces = {"Down"} KineticProperties { Position = {0, -0.5, 0} LinearVelocity = {0, 6, 0} } }
  } }
  Constraints {
    Constraint { Type = "Distance" Id = "Ceiling" Body2 = "A" CustomProperties { BindPoint1 = {0, 0, 0} BindPoint2 = {0, -1, 0} MaximumDistance = 1 } }
    Constraint { Type = "Distance" Id = "Tie" Body1 = "A" Body2 = "B" CustomProperties { BindPoint1 = {0, -1, 0} BindPoint2 = {0, -0.5, 0} MaximumDistance = 1 } }
  }
})",
               {std::string("Integrator=") + GetParam()});
  run.to_end();
  const double arrival = std::sqrt(thrown * thrown - 2.0 * kG * way), time = (thrown - arrival) / kG;
  EXPECT_NEAR(run.body("A").twist.linear.y(), 0.5 * arrival - kG * (run.time() - time), 2.0 * kG * 0.0005);
  EXPECT_GT(run.body("A").pose.position.y(), -1.0 + 0.1);
}

// Nothing moves: a spring presses a hinge on its stop, about whatever axis, and the two cancel. Rounding of the angle opened the
// stop in some stages, which told up to all of the spring's torque as the joint's.
TEST_P(LimitsLetGo, NothingThatASpringPresses) {
  for (const char* axis : {"{1, 0, 0}", "{0, 1, 0}", "{0, 0, 1}", "{1, 2, 3}"})
    for (const double step : {1.0 / 240.0, 0.001, 0.0001}) {
      SceneRun run(std::string(R"(
Simulator { Type = "Smooth" CustomProperties { TimeStep = 0.004 Duration = 0.2 } }
Environment {
  Space { Bodies { Body { Id = "D" Mass = 10 PrincipalMoments = {1, 1, 1} } } }
  Constraints { Constraint { Type = "Revolute" Id = "H" Body2 = "D" BreakingTorque = 1e-3 CustomProperties {
    BindAxisPoint1 = {0, 0, 0} BindAxisPoint2 = )") +
                       axis + R"( LowerLimit = 0 Stiffness = 5 RestAngle = -0.2 } } }
})",
                   {"Simulator.TimeStep=" + std::to_string(step), std::string("Integrator=") + GetParam()});
      run.steps(40);
      EXPECT_TRUE(run.holds("H")) << axis << ' ' << step;
      EXPECT_LE(run.body("D").twist.angular.norm(), 1e-12) << axis << ' ' << step;
    }
}

}  // namespace
}  // namespace gravitas
