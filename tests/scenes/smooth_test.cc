// The simulator Smooth through scenes: drives, motions as drives, what it refuses.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <string>
#include <vector>

#include "tests/scenes/scene_run.h"

namespace gravitas {
namespace {

using harness::SceneRun;
using harness::set;
using ::testing::HasSubstr;
using ::testing::ThrowsMessage;

std::vector<std::string> smooth(const std::vector<std::string>& more) {
  std::vector<std::string> all = {"Simulator=Smooth"};
  all.insert(all.end(), more.begin(), more.end());
  return all;
}

TEST(Smooth, KeepsTheEnergyOfADoublePendulum) {
  SceneRun run("double_pendulum.gravitas", smooth({"Solver=Newton", "Integrator=RK4", set("Simulator.Duration", 2.0)}));
  const double energy = run.energy();
  run.to_end();
  // RK4 at h = 1/240 s, with rates up to 20 rad/s: (h w)^4/120 times 20 J
  EXPECT_NEAR(run.energy(), energy, 1e-5);
  EXPECT_LT(run.report().max_joint_error(), 1e-14);
}

// A bob on a rod whose upper end is driven sideways as x(t) = t^2: the pendulum feels -2 m/s^2, so that it swings about
// the apparent vertical. Small swings: angle = -a/g (1 - cos w t), w^2 = g/l.
TEST(Smooth, FeelsTheAccelerationOfAMotion) {
  SceneRun run(R"(
Forces { Force { Type = "Gravity" Id = "Down" CustomProperties { Acceleration = {0, -9.81, 0} } } }
Simulator { Type = "Smooth" CustomProperties { TimeStep = 0.01 Duration = 1 } }
Environment {
  Space { Bodies {
    Body { Id = "Cart" Kinematic = true Motion = {{0, {0, 0, 0}, {1, 0, 0, 0}}, {0.5, {0.00025, 0, 0}, {1, 0, 0, 0}}, {1, {0.001, 0, 0}, {1, 0, 0, 0}}} }
    Body { Id = "Bob" Mass = 1 PrincipalMoments = {1, 1, 1} KineticProperties { Position = {0, -2, 0} } Forces = { "Down" } }
  } }
  Constraints { Constraint { Type = "Distance" Id = "Rod" Body1 = "Cart" Body2 = "Bob" CustomProperties { BindPoint1 = {0, 0, 0} BindPoint2 = {0, -2, 0} } } }
  KineticIntegrator = "RK4"
  ConstraintSolver = "Direct"
}
)");
  run.to_end();
  const double w = std::sqrt(9.81 / 2.0), angle = -0.002 / 9.81 * (1.0 - std::cos(w));
  // of the third order in an angle of 4e-4, times 2 m
  EXPECT_NEAR(run.body("Bob").pose.position.x(), 0.001 + 2.0 * angle, 1e-9);
}

TEST(Smooth, RefusesWhatItCannotMove) {
  EXPECT_THAT([] { SceneRun run("double_pendulum.gravitas", smooth({"Solver=Sequential"})); },
              ThrowsMessage<std::runtime_error>(HasSubstr("needs a plugin with the capability 'reactions'")));
  EXPECT_THAT([] { SceneRun run("stack.gravitas", smooth({"Solver=Direct"})); },
              ThrowsMessage<std::runtime_error>(HasSubstr("moves bodies that cannot touch, and some of these can")));
}

TEST(Smooth, HandsItsAccuracyToTheIntegrator) {
  const auto energy_error = [](double accuracy) {
    SceneRun run("double_pendulum.gravitas",
                 smooth({"Solver=Direct", "Integrator=DormandPrince54", set("Simulator.Accuracy", accuracy),
                         set("Simulator.TimeStep", 0.1), set("Simulator.Duration", 2.0)}));
    const double energy = run.energy();
    run.to_end();
    return std::fabs(run.energy() - energy);
  };
  EXPECT_LT(energy_error(1e-10), 1e-8);
  EXPECT_GT(energy_error(1e-3), 1e-7);
  EXPECT_THAT(
      [] { SceneRun run("double_pendulum.gravitas", {set("Simulator.Accuracy", 1e-3)}); },
      ThrowsMessage<std::runtime_error>(HasSubstr("Accuracy belongs to the simulators \"Smooth\" and \"Continuous\"")));
  EXPECT_THAT(
      [] {
        SceneRun run("double_pendulum.gravitas",
                     smooth({"Solver=Direct", "Integrator=RK4", set("Simulator.Accuracy", 1e-3)}));
      },
      ThrowsMessage<std::runtime_error>(HasSubstr("the integrator \"RK4\" has no Accuracy")));
}

}  // namespace
}  // namespace gravitas
