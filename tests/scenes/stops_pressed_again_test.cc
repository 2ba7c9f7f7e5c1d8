// `Smooth`: stops and ropes that open within a step and are pressed again within it, time and again, by a stiff spring.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <string>
#include <vector>

#include "tests/scenes/scene_run.h"

namespace gravitas {
namespace {

using harness::literal;
using harness::SceneRun;
using harness::set;

// A falls with C at 1 m/s, and is stopped 20 mm below, where C goes on against the spring between them, above A or below it.
struct Fall {
  bool is_rope = false, is_force = false;
  double stiffness = 1e6, light = 0.1, restitution = 0.0;  // N/m; kg of A
};

constexpr double kHeavy = 1.0, kApart = 0.5;  // kg, m

std::string scene_of(const Fall& fall) {
  const double side = fall.is_rope ? -kApart : kApart;
  const auto body = [&](const std::string& id, double mass, double height, const std::string& forces) {
    return "Body { Id = \"" + id + "\" Mass = " + literal(mass) + " PrincipalMoments = {0.1, 0.1, 0.1} Forces = {" +
           forces + "} KineticProperties { Position = " + literal(Vector3(0, height, 0)) +
           " LinearVelocity = {0, -1, 0} } }\n";
  };
  const auto slider = [](const std::string& id, const std::string& bodies, const std::string& more) {
    return "Constraint { Type = \"Slider\" Id = \"" + id + "\" " + bodies +
           " CustomProperties { BindPoint = {0, 0, 0} Axis = {0, 1, 0} " + more + " } }\n";
  };
  const std::string bounce = " Restitution = " + literal(fall.restitution);
  const std::string coil =
      "Force { Type = \"Spring\" Id = \"Coil\" CustomProperties { Stiffness = " + literal(fall.stiffness) +
      " RestLength = 0.5 AnchorBody = \"A\" } }";
  return "Forces { Force { Type = \"Gravity\" Id = \"Down\" CustomProperties { Acceleration = {0, -9.81, 0} } } " +
         (fall.is_force ? coil : "") +
         " }\nSimulator { Type = \"Smooth\" CustomProperties { TimeStep = 0.016666666666666666 Duration = 1.5 } }\n"
         "Environment { Space { Bodies {\n" +
         body("A", fall.light, 0.0, "\"Down\"") +
         body("C", kHeavy, side, fall.is_force ? "\"Down\", \"Coil\"" : "\"Down\"") + "} }\nConstraints {\n" +
         slider("Rail", "Body2 = \"A\"", fall.is_rope ? "" : "LowerLimit = -0.02" + bounce) +
         (fall.is_rope
              ? "Constraint { Type = \"Distance\" Id = \"Rope\" Body2 = \"A\" CustomProperties { BindPoint1 = {0, 1, "
                "0} BindPoint2 = {0, 0, 0} MaximumDistance = 1.02" +
                    bounce + " } }\n"
              : "") +
         slider("Guide", "Body1 = \"A\" Body2 = \"C\"", fall.is_force ? "" : "Stiffness = " + literal(fall.stiffness)) +
         "} }\n";
}

double energy_of(const SceneRun& run, const Fall& fall) {
  const double a = run.body("A").pose.position.y(), c = run.body("C").pose.position.y();
  const double stretch = std::fabs(c - a) - kApart;
  return run.kinetic_energy() + kG * (fall.light * a + kHeavy * c) + 0.5 * fall.stiffness * stretch * stretch;
}

// A dead stop takes energy and gives none. What came back to it within the step was put out of it at the step's end, against the
// spring: the scenes went from 5.5 J to 38 J, from 5.9 J to 112 J, and the ropes from -4.4 J to 4800 J.
class PressedAgain : public ::testing::TestWithParam<const char*> {};
INSTANTIATE_TEST_SUITE_P(By, PressedAgain,
                         ::testing::Values("DormandPrince54", "DormandPrince853", "Radau", "Rosenbrock"),
                         [](const auto& one) { return std::string(one.param); });

TEST_P(PressedAgain, StopsAndRopesGiveNoEnergy) {
  for (const Fall& fall : {Fall{.stiffness = 1e5}, Fall{.light = 1.0}, Fall{.is_rope = true, .stiffness = 1e5},
                           Fall{.is_force = true, .stiffness = 1e5}}) {
    SceneRun run(scene_of(fall), {std::string("Integrator=") + GetParam(), set("Simulator.Duration", 0.4)});
    const double start = energy_of(run, fall);
    double before = start, least = 0.0;
    while (!run.is_done()) {
      run.step();
      const double energy = energy_of(run, fall);
      EXPECT_LE(energy, before + 1e-6) << fall.is_rope << fall.is_force << ' ' << fall.light << ' ' << run.time();
      before = energy;
      least = std::min(least, run.body("A").pose.position.y());
    }
    EXPECT_NEAR(least, -0.02, 1e-9) << fall.is_rope << fall.is_force << ' ' << fall.light;
    EXPECT_TRUE(run.warnings().empty()) << run.warnings().front();
  }
}

// At steps that the spring swings in many times as at those that resolve it.
TEST_P(PressedAgain, LoseTheEnergyThatShortStepsLose) {
  const Fall fall{.light = 1.0};
  const auto end = [&](double step) {
    SceneRun run(scene_of(fall), {std::string("Integrator=") + GetParam(), set("Simulator.TimeStep", step),
                                  set("Simulator.Duration", 0.25)});
    run.to_end();
    return energy_of(run, fall);
  };
  const double right = end(1e-4);
  for (const double step : {1.0 / 60.0, 1.0 / 240.0}) EXPECT_NEAR(end(step), right, 1e-3) << step;
}

TEST_P(PressedAgain, ElasticStopsKeepTheEnergy) {
  const Fall fall{.stiffness = 1e5, .restitution = 1.0};
  SceneRun run(scene_of(fall), {std::string("Integrator=") + GetParam(), set("Simulator.Duration", 0.3)});
  const double start = energy_of(run, fall);
  run.to_end();
  EXPECT_NEAR(energy_of(run, fall), start, 1e-5);
}

// The hardest of them: 55 rad of the spring's swing in a step.
TEST(PressedAgainByDefault, ARopeGivesNoEnergy) {
  const Fall fall{.is_rope = true};
  SceneRun run(scene_of(fall), {set("Simulator.Duration", 0.2)});
  double before = energy_of(run, fall);
  while (!run.is_done()) {
    run.step();
    const double energy = energy_of(run, fall);
    EXPECT_LE(energy, before + 1e-6) << run.time();
    before = energy;
  }
}

}  // namespace
}  // namespace gravitas
