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
                     {set("Solver", solver), set("Simulator.TimeStep", 0.01)});
        run.steps(2000);
        EXPECT_NEAR(angle_about_y(run), 0.3, 1e-6) << joint << ' ' << between << ' ' << solver;
      }
}

// theta = w0/w sin(w t), w^2 = k/I, beyond a right angle, too: w0/w = 2 rad.
TEST(SkewSprings, SwingAtTheirFrequencyInTheLarge) {
  const double w = 5.0, rate = 2.0 * w;
  for (const SkewJoint& joint : kSkewJoints)
    for (const double between : {90.0, 75.0, 50.0}) {
      SceneRun run(joint.scene(between * kPi / 180.0, 0.0,
                               "KineticProperties { AngularVelocity = " + harness::literal(Vector3(0, rate, 0)) + " }"),
                   {set("Simulator", std::string("Smooth")), set("Integrator", std::string("RK4")),
                    set("Simulator.TimeStep", 0.005)});
      for (int i = 1; i <= 300; ++i) {
        run.step();
        ASSERT_NEAR(angle_about_y(run), 2.0 * std::sin(w * 0.005 * i), 1e-5) << joint << ' ' << between << ' ' << i;
      }
    }
}

}  // namespace
}  // namespace gravitas
