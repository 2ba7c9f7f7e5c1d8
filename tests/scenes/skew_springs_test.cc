// Springs and dampers of joints whose axes are not across each other: their angle is the one that coordinates tell.
#include <gtest/gtest.h>

#include <cmath>
#include <string>
#include <vector>

#include "plugin_sdk/math/rotation.h"
#include "tests/scenes/scene_run.h"

namespace gravitas {
namespace {

using harness::SceneRun;
using harness::set;

// A body that turns about y alone, whose other bar makes an angle with it and is locked by a drive. A spring of 10 N m/rad and
// a damper hold the turn, of 0.4 kg m^2.
struct SkewJoint {
  std::string type;
  bool is_second = false;  // bar of Universal

  std::string scene(double between, double damping, const std::string& more) const {
    const std::string y = "{0, 1, 0}", other = harness::literal(Vector3(std::sin(between), std::cos(between), 0));
    const std::string spring = "Stiffness", damper = "Damping", n = is_second ? "2" : "1", m = is_second ? "1" : "2";
    const std::string axes = type == "Axle"
                                 ? "SteeringAxis = " + y + " RollingAxis = " + other +
                                       " AngularSpeed = 0 SteeringStiffness = 10" +
                                       " SteeringDamping = " + harness::literal(damping)
                                 : "Axis" + n + " = " + y + " Axis" + m + " = " + other + " AngularSpeed" + m +
                                       " = 0 Stiffness" + n + " = 10 Damping" + n + " = " + harness::literal(damping);
    return "Forces { Force { Type = \"Basic\" Id = \"T\" CustomProperties { Torque = {0, 3, 0} } } }\n"
           "Simulator { CustomProperties { Duration = 100 } }\nEnvironment { Space { Bodies { Body { Id = \"W\" Mass = "
           "1 "
           "PrincipalMoments = {0.4, 0.4, 0.4} " +
           more + " } } }\nConstraints { Constraint { Type = \"" + type +
           "\" Id = \"J\" Body2 = \"W\" CustomProperties { BindPoint = {0, 0, 0} " + axes + " } } } }\n";
  }
  friend std::ostream& operator<<(std::ostream& out, const SkewJoint& joint) {
    return out << joint.type << (joint.is_second ? " 2" : "");
  }
};
const std::vector<SkewJoint> kSkewJoints = {{"Axle"}, {"Universal"}, {"Universal", true}};

double angle_about_y(const SceneRun& run) { return log_rotation(run.body("W").pose.orientation).y(); }

TEST(SkewSprings, RestWhereTheyBalanceATorque) {
  for (const SkewJoint& joint : kSkewJoints)
    for (const double between : {90.0, 75.0, 50.0})
      for (const std::string solver : {"Sequential", "Newton", "Direct"}) {
        SceneRun run(joint.scene(between * kPi / 180.0, 8.0, "Forces = {\"T\"} KineticProperties { CanSleep = false }"),
                     {set("Solver", solver), set("Simulator.TimeStep", 0.002)});
        run.steps(4000);
        // the stiffness is that of the free step's end, which is off by T h^2/I
        EXPECT_NEAR(angle_about_y(run), 0.3, 1e-5) << joint << ' ' << between << ' ' << solver;
      }
}

// theta = w0/w sin(w t), w^2 = k/I, w0/w = 1.2 rad.
TEST(SkewSprings, SwingAtTheirFrequencyInTheLarge) {
  const double w = 5.0, rate = 1.2 * w;
  for (const SkewJoint& joint : kSkewJoints)
    for (const double between : {90.0, 75.0, 50.0}) {
      SceneRun run(joint.scene(between * kPi / 180.0, 0.0,
                               "KineticProperties { AngularVelocity = " + harness::literal(Vector3(0, rate, 0)) + " }"),
                   {set("Simulator", std::string("Smooth")), set("Integrator", std::string("RK4")),
                    set("Simulator.TimeStep", 0.005)});
      for (int i = 1; i <= 300; ++i) {
        run.step();
        ASSERT_NEAR(angle_about_y(run), 1.2 * std::sin(w * 0.005 * i), 1e-5) << joint << ' ' << between << ' ' << i;
      }
    }
}

// A wheel that rolls by a radian a step is steered to where its spring is at rest, and keeps its spin.
TEST(SkewSprings, SteerWheelsThatRoll) {
  constexpr double kSpin = 60.0;
  for (const std::string solver : {"Newton", "Direct", "Sequential"}) {
    SceneRun run(R"(Simulator { CustomProperties { TimeStep = 0.016666666666666667 Duration = 1 } }
Environment { Space { Bodies { Body { Id = "W" Mass = 20 PrincipalMoments = {0.9, 0.5, 0.5} KineticProperties { AngularVelocity = {60, 0, 0} } } } }
Constraints { Constraint { Type = "Axle" Id = "J" Body2 = "W" CustomProperties { BindPoint = {0, 0, 0} SteeringAxis = {0, 1, 0} RollingAxis = {1, 0, 0}
  SteeringStiffness = 5e4 SteeringDamping = 2000 SteeringAngle = 0.5 } } } })",
                 {set("Solver", solver)});
    run.to_end();
    EXPECT_NEAR(run.body("W").twist.angular.norm(), kSpin, 1e-2) << solver;
    const Vector3 rolling = run.body("W").pose.orientation * Vector3::UnitX();
    EXPECT_NEAR(std::atan2(-rolling.z(), rolling.x()), 0.5, 1e-3) << solver;
  }
}

}  // namespace
}  // namespace gravitas
