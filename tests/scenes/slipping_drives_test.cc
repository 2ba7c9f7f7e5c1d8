// Bounded drives and friction of joints with Smooth: where they come to their velocity an inner step ends, so that motion keeps the
// integrator's order; and a drive about a bar of a cross knows whether it slips, however far a step turns.
#include <gtest/gtest.h>

#include <ostream>
#include <string>
#include <vector>

#include "plugin_sdk/math/rotation.h"
#include "tests/scenes/scene_run.h"

namespace gravitas::slipping_drives {
namespace {

using harness::literal;
using harness::SceneRun;
using harness::set;

struct Method {
  const char *integrator, *solver;
  double rounding;  // m, m/s, rad/s
  double turning;   // rad, what the method turns bodies right to
};
void PrintTo(const Method& method, std::ostream* out) { *out << method.integrator << method.solver; }

class SlippingDrives : public ::testing::TestWithParam<Method> {
 protected:
  static std::vector<std::string> with(double time_step) {
    return {"Simulator=Smooth", set("Simulator.TimeStep", time_step),
            std::string("Integrator=") + GetParam().integrator, std::string("Solver=") + GetParam().solver};
  }
};

INSTANTIATE_TEST_SUITE_P(Each, SlippingDrives,
                         ::testing::Values(Method{"RK4", "Newton", 1e-12, 1e-9},
                                           Method{"Verlet", "Direct", 1e-12, 1e-12},
                                           Method{"ImplicitMidpoint", "Newton", 1e-11, 1e-4},
                                           Method{"SymplecticSplitting", "Newton", 1e-11, 1e-11},
                                           Method{"DormandPrince54", "Direct", 1e-11, 1e-11},
                                           Method{"Radau", "Newton", 1e-10, 1e-10}),
                         [](const auto& one) { return std::string(one.param.integrator) + one.param.solver; });

// A body on a guide, or that turns about z, 0.6 s long.
std::string one_body(const std::string& joint, const Vector3& velocity, const Vector3& spin) {
  return "Simulator { CustomProperties { TimeStep = 0.01 Duration = 0.6 } }\nEnvironment { Space { Bodies { Body { Id "
         "= "
         "\"A\" Mass = 2 PrincipalMoments = {0.1, 0.2, 0.3} KineticProperties { LinearVelocity = " +
         literal(velocity) + " AngularVelocity = " + literal(spin) +
         " } } } }\nConstraints { Constraint { Id = \"J\" Body2 = \"A\" " + joint + " } } }\n";
}
std::string guide(const std::string& drive) {
  return "Type = \"Slider\" CustomProperties { BindPoint = {0, 0, 0} Axis = {1, 0, 0} " + drive + " }";
}
std::string hinge(const std::string& drive) {
  return "Type = \"Revolute\" CustomProperties { BindAxisPoint1 = {0, 0, 0} BindAxisPoint2 = {0, 0, 1} " + drive + " }";
}

// Uniformly accelerated until then, at 0.31 m/s from then on: at 0.207 s, or after 3e-7 s.
TEST_P(SlippingDrives, ComeToTheirVelocityWhenTheirForceBringsThemThere) {
  constexpr double kSpeed = 0.31, kMass = 2.0, kEnd = 0.6;
  for (const double force : {3.0, 2e6})
    for (const double h : {0.02, 0.01}) {
      SceneRun run(one_body(guide("Speed = 0.31 MaximumForce = " + literal(force)), Vector3::Zero(), Vector3::Zero()),
                   with(h));
      run.to_end();
      const double gained = kSpeed * kMass / force;
      EXPECT_NEAR(run.body("A").pose.position.x(), kSpeed * (kEnd - 0.5 * gained), GetParam().rounding) << force << h;
      EXPECT_NEAR(run.body("A").twist.linear.x(), kSpeed, GetParam().rounding) << force << h;
    }
}

// A brake of 1.1 N m stops 0.3 kg m^2 at 2 rad/s after 0.545 s and 6/11 rad; then it holds.
TEST_P(SlippingDrives, StandStillWhereFrictionStopsThem) {
  SceneRun run(one_body(hinge("AngularSpeed = 0 MaximumTorque = 1.1"), Vector3::Zero(), Vector3(0, 0, 2)), with(0.02));
  run.to_end();
  const Quaternion q = run.body("A").pose.orientation;
  EXPECT_NEAR(log_rotation(q).z(), 6.0 / 11.0, GetParam().turning);
  EXPECT_NEAR(run.body("A").twist.angular.norm(), 0.0, GetParam().rounding);
}

// A pendulum whose bearing rubs: it turns back where it stops, and at last stays.
TEST(SlippingDrivesOfAPendulum, HaveMoreThanThirdOrderWithRK4) {
  const std::string text =
      "Forces { Force { Type = \"Gravity\" Id = \"G\" CustomProperties { Acceleration = {0, -9.81, 0} } } }\n"
      "Simulator { Type = \"Smooth\" CustomProperties { TimeStep = 0.02 Duration = 2 } }\n"
      "Environment { Space { Bodies { Body { Id = \"A\" Mass = 1 PrincipalMoments = {0.1, 0.1, 0.1} Forces = {\"G\"} "
      "KineticProperties { CanSleep = false Position = {0.5, 0, 0} } } } }\nConstraints { Constraint { Id = \"J\" "
      "Body2 = \"A\" " +
      hinge("AngularSpeed = 0 MaximumTorque = 0.7") + " } } }\n";
  const auto end = [&](const std::string& integrator, double h) {
    SceneRun run(text, {set("Simulator.TimeStep", h), "Integrator=" + integrator, "Solver=Newton"});
    run.to_end();
    return run.body("A").pose.position;
  };
  const Vector3 reference = end("DormandPrince853", 0.004);
  const double coarse = (end("RK4", 0.02) - reference).norm(), fine = (end("RK4", 0.01) - reference).norm();
  EXPECT_LE(coarse, 1e-6);
  EXPECT_LE(fine, coarse / 8.0);
}

// ---- about the bars of crosses

struct Cross {
  const char *name, *joint;
};
void PrintTo(const Cross& cross, std::ostream* out) { *out << cross.name; }

class DrivenCross : public ::testing::TestWithParam<Cross> {};

// The second, seen from the other body, is the first: bars change places, and point the other way.
const Cross kFirstBar = {
    "FirstBar",
    "Type = \"Universal\" Body2 = \"A\" CustomProperties { BindPoint = {0, 0.3, 0} Axis1 = {1, 0, 0.3} "
    "Axis2 = {0, 0.4, 1} AngularSpeed1 = 1.7 MaximumTorque1 = 1.4 Damping2 = 0.05 }"};
const Cross kSecondBar = {
    "SecondBar",
    "Type = \"Universal\" Body1 = \"A\" CustomProperties { BindPoint = {0, 0.3, 0} Axis1 = {0, -0.4, "
    "-1} Axis2 = {-1, 0, -0.3} AngularSpeed2 = 1.7 MaximumTorque2 = 1.4 Damping1 = 0.05 }"};

INSTANTIATE_TEST_SUITE_P(
    Each, DrivenCross,
    ::testing::Values(kFirstBar, kSecondBar,
                      Cross{"SquareFirstBar",
                            "Type = \"Universal\" Body2 = \"A\" CustomProperties { BindPoint = {0, 0.3, 0} Axis1 = {1, "
                            "0, 0} Axis2 = {0, 0, 1} AngularSpeed1 = 1.7 MaximumTorque1 = 1.4 }"},
                      Cross{"SquareSecondBar",
                            "Type = \"Universal\" Body2 = \"A\" CustomProperties { BindPoint = {0, 0.3, 0} Axis1 = {1, "
                            "0, 0} Axis2 = {0, 0, 1} AngularSpeed2 = -1.9 MaximumTorque2 = 1.4 }"},
                      Cross{
                          "SteeredWheel",
                          "Type = \"Axle\" Body2 = \"A\" CustomProperties { BindPoint = {0, 0.3, 0} SteeringAxis = {0, "
                          "1, 0.1} RollingAxis = {1, 0.2, 0} AngularSpeed = 4 MaximumTorque = 1.4 }"}),
    [](const auto& one) { return one.param.name; });

std::string on_a_cross(const std::string& joint) {
  return "Forces { Force { Type = \"Gravity\" Id = \"G\" CustomProperties { Acceleration = {-2, -9.4, 1.7} } } }\n"
         "Simulator { Type = \"Smooth\" CustomProperties { TimeStep = 0.01 Duration = 0.6 Accuracy = 1e-10 } }\n"
         "Environment { Space { Bodies { Body { Id = \"A\" Mass = 0.7 PrincipalMoments = {0.04, 0.05, 0.043} Forces = "
         "{\"G\"} KineticProperties { CanSleep = false Position = {0, 0.1, 0.05} AngularVelocity = {0, 0, 0} } } } }\n"
         "Constraints { Constraint { Id = \"J\" " +
         joint + " } } }\n";
}

// An adaptive integrator meets its accuracy whatever the step. In states that it tried drives seemed to slip by the square of what had
// turned since the step began: 5e-4 off, and thirty times the work.
TEST_P(DrivenCross, MovesAlikeWhateverTheStep) {
  const auto end = [&](double h) {
    SceneRun run(on_a_cross(GetParam().joint),
                 {set("Simulator.TimeStep", h), "Integrator=DormandPrince853", "Solver=Newton"});
    run.to_end();
    return run.body("A");
  };
  const SceneRun::Motion fine = end(0.01 / 16), coarse = end(0.01);
  EXPECT_LE((coarse.pose.position - fine.pose.position).norm(), 1e-8);
  EXPECT_LE((coarse.twist.angular - fine.twist.angular).norm(), 1e-7);
}

TEST(DrivenCrossFromEitherSide, IsTheSame) {
  const auto end = [](const Cross& cross) {
    SceneRun run(on_a_cross(cross.joint), {"Integrator=DormandPrince853", "Solver=Newton"});
    run.to_end();
    return run.body("A").pose.position;
  };
  EXPECT_LE((end(kSecondBar) - end(kFirstBar)).norm(), 1e-10);
}

}  // namespace
}  // namespace gravitas::slipping_drives
