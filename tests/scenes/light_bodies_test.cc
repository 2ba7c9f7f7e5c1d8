// Bodies so light that what their joints bear would turn the free ones far in one step.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <string>

#include "plugin_sdk/conformance/draw.h"
#include "plugin_sdk/math/rotation.h"
#include "tests/scenes/scene_run.h"

namespace gravitas {
namespace {

using conformance::Draw;
using harness::SceneRun;
using harness::set;

constexpr double kMoment = 1e-4, kStep = 1.0 / 60.0, kGyration = 0.045;  // kg m^2, s, m

// A carriage of 50 g, 5 cm beside what holds it, under a torque.
std::string carriage(const std::string& joint, const Vector3& torque) {
  return "Forces { Force { Type = \"Basic\" Id = \"F\" CustomProperties { Torque = " + harness::literal(torque) +
         " } } }\nSimulator { CustomProperties { TimeStep = " + harness::literal(kStep) +
         " Duration = 0.5 SleepEnergy = 0 } }\n"
         "Environment { Space { Bodies { Body { Id = \"B\" Mass = 0.05 PrincipalMoments = {1e-4, 1e-4, 1e-4} "
         "Forces = {\"F\"} } } }\n"
         "Constraints { Constraint { Id = \"J\" Body2 = \"B\" " +
         joint + " } } }\n";
}

TEST(LightBodies, StandWhereTheirJointsBearAllThatTurnsThem) {
  const std::string joints[] = {
      "Type = \"Slider\" CustomProperties { BindPoint = {-0.05, 0, 0} Axis = {0, 1, 0} }", "Type = \"Rigid\"",
      "Type = \"Revolute\" CustomProperties { BindAxisPoint1 = {-0.05, 0, 0} BindAxisPoint2 = {-0.05, 1, 0} }"};
  Draw draw(1);
  for (int i = 0; i < 20; ++i) {
    const double turn = 0.8 + 4.2 * i / 19.0;
    const Vector3 torque = kMoment * turn / (kStep * kStep) * draw.direction();
    for (const std::string& joint : joints) {
      // a hinge bears nothing about its axis
      const bool is_hinge = joint.find("Revolute") != std::string::npos;
      const Vector3 borne = is_hinge ? Vector3(torque.x(), 0.0, torque.z()) : torque;
      for (const std::string solver : {"Newton", "Direct", "Sequential"}) {
        // `Sequential` closes joints further that are open by more than a thousandth, and its rows at S* leave 2e-4 of what a
        // hinge bears to its free turn
        const bool is_swept = solver == "Sequential";
        const double bound = !is_swept ? 1e-9 : is_hinge ? 0.05 : 1e-7;
        SceneRun run(carriage(joint, borne), {"Solver=" + solver});
        while (!run.is_done()) {
          run.step();
          const Pose pose = run.body("B").pose;
          const double turned = harness::angle_between(pose.orientation, Quaternion::Identity());
          ASSERT_LT(pose.position.norm() + kGyration * turned, bound)
              << joint << solver << turn << " at " << run.time();
        }
        EXPECT_LT(run.report().max_joint_error(), is_swept ? 1e-3 : 1e-9) << joint << solver << turn;
      }
    }
  }
}

TEST(LightBodies, StandWithEverySimulatorAndIntegrator) {
  const std::string scene =
      carriage("Type = \"Slider\" CustomProperties { BindPoint = {-0.05, 0, 0} Axis = {0, 1, 0} }", {0.3, 0, 0.4});
  for (const std::string simulator : {"Basic", "Substepping", "Continuous", "Bisection", "Smooth"})
    for (const std::string integrator : {"SemiImplicitEuler", "Euler", "RK4", "BasicVerlet", "Verlet"}) {
      SceneRun run(scene, {"Solver=Newton", "Simulator=" + simulator, "Integrator=" + integrator});
      run.to_end();
      EXPECT_LT(run.body("B").pose.position.norm(), 1e-9) << simulator << integrator;
    }
}

// What a joint does not bear is no less for it.
TEST(LightBodies, SpinUpOnAHingeAsFarAsTheirTorqueTurnsThem) {
  const double rate = 2.0 / (kStep * kStep);  // rad/s^2
  for (const std::string solver : {"Newton", "Direct", "Sequential"}) {
    SceneRun run(
        carriage("Type = \"Revolute\" CustomProperties { BindAxisPoint1 = {0, 0, 0} BindAxisPoint2 = {0, 1, 0} }",
                 {0, kMoment * rate, 0}),
        {"Solver=" + solver});
    run.to_end();
    EXPECT_NEAR(run.body("B").twist.angular.y(), 0.5 * rate, 1e-9 * rate) << solver;
    EXPECT_LT(run.report().max_joint_error(), 1e-12) << solver;
  }
}

// Loads of a thousand whole turns in a step are beyond that, and told.
TEST(LightBodies, AreToldOfWhereTheirLoadsAreTooMuch) {
  const std::string guide = "Type = \"Slider\" CustomProperties { BindPoint = {-0.05, 0, 0} Axis = {0, 1, 0} }";
  const auto warnings = [&](double turn) {
    SceneRun run(carriage(guide, {kMoment * turn / (kStep * kStep), 0, 0}), {"Solver=Newton"});
    run.step();
    return run.environment().warnings();
  };
  EXPECT_THAT(warnings(1e3), ::testing::IsEmpty());
  EXPECT_THAT(warnings(1e5),
              ::testing::ElementsAre(::testing::HasSubstr("turned body \"B\" by up to 1.525879 rad in an inner "
                                                          "step, of which a step had 256 and more")));
}

// A blow at the start, which two joints and their bodies bear.
TEST(LightBodies, BearABlow) {
  const std::string scene = R"(
Forces { Force { Type = "Basic" Id = "F" CustomProperties { Force = {25, 24, -24} ApplicationPoint = {0, -0.1, 0.3} Torque = {-4, -1, 4} Instantaneous = true } } }
Simulator { CustomProperties { TimeStep = 0.016666666666666666 Duration = 0.5 SleepEnergy = 0 } }
Environment {
  Space { Bodies {
    Body { Id = "A" Mass = 2.7 PrincipalMoments = {0.12, 0.11, 0.12} KineticProperties { Position = {0.3, -0.2, 0.4} } }
    Body { Id = "B" Mass = 4.9 PrincipalMoments = {0.2, 0.2, 0.1} Forces = {"F"} KineticProperties { Position = {0.7, -0.9, 0} } }
  } }
  Constraints {
    Constraint { Type = "Slider" Id = "G" Body2 = "B" CustomProperties { BindPoint = {0.75, -1.5, 0.1} Axis = {-0.64, -0.77, 0} } }
    Constraint { Type = "Revolute" Id = "H" Body1 = "B" Body2 = "A" CustomProperties { BindAxisPoint1 = {0.4, -0.4, 0.3} BindAxisPoint2 = {0.7, 0.6, 0.25} } }
  }
}
)";
  for (const std::string solver : {"Newton", "Direct", "Sequential"})
    for (const std::string integrator : {"SemiImplicitEuler", "BasicVerlet", "RK4"}) {
      SceneRun run(scene, {"Solver=" + solver, "Integrator=" + integrator});
      while (!run.is_done()) {
        run.step();
        ASSERT_LT(run.kinetic_energy(), 0.5 * 42.0 * 42.0 / 4.9 + 0.5 * 20.0 * 20.0 / 0.1) << solver << integrator;
      }
      EXPECT_LT(run.report().max_joint_error(), solver == "Sequential" ? 1e-4 : 1e-9) << solver << integrator;
    }
}

}  // namespace
}  // namespace gravitas
