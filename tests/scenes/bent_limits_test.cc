// Limits of crosses and of the bend of shafts in motion, against joints that say the same in other words.
#include <gtest/gtest.h>

#include <algorithm>
#include <string>
#include <vector>

#include "plugin_sdk/joint_coordinates.h"
#include "tests/scenes/scene_run.h"

namespace gravitas {
namespace {

using harness::literal;
using harness::SceneRun;
using harness::set;

struct BentCase {
  const char *solver, *simulator, *integrator;
};

class BentLimitsInMotion : public ::testing::TestWithParam<BentCase> {
 protected:
  // An arm that falls from the world's origin.
  static SceneRun arm(const std::string& joint, const Vector3& place, const Vector3& spin, double duration) {
    const BentCase& with = GetParam();
    return SceneRun(
        "Forces { Force { Type = \"Gravity\" Id = \"G\" CustomProperties { Acceleration = {0, -9.81, 0} } } }\n"
        "Simulator { Type = \"" +
            std::string(with.simulator) + "\" CustomProperties { TimeStep = 0.005 Duration = " + literal(duration) +
            " } }\nEnvironment { Space { Bodies { Body { Id = \"A\" Mass = 2 PrincipalMoments = {0.1, 0.3, 0.2} Forces "
            "= { \"G\" } KineticProperties { Position = " +
            literal(place) + " LinearVelocity = " + literal(Vector3(spin.cross(place))) +
            " AngularVelocity = " + literal(spin) +
            " } } } }\nConstraints { Constraint { Id = \"J\" Body2 = \"A\" Type = " + joint + " } } }\n",
        {set("Solver", std::string(with.solver)), set("Integrator", std::string(with.integrator))});
  }
  static void expect_alike(SceneRun one, SceneRun other) {
    while (!one.is_done()) {
      one.step(), other.step();
      const SceneRun::Motion a = one.body("A"), b = other.body("A");
      ASSERT_LE((a.pose.position - b.pose.position).norm(), 1e-8) << one.time();
      ASSERT_LE(harness::angle_between(a.pose.orientation, b.pose.orientation), 1e-8) << one.time();
    }
    EXPECT_LE(one.report().max_joint_error(), 1e-8);
  }
};

INSTANTIATE_TEST_SUITE_P(Each, BentLimitsInMotion,
                         ::testing::Values(BentCase{"Newton", "Basic", "Verlet"},
                                           BentCase{"Direct", "Substepping", "SemiImplicitEuler"},
                                           BentCase{"Newton", "Continuous", "Verlet"},
                                           BentCase{"Direct", "Bisection", "Verlet"},
                                           BentCase{"Newton", "Smooth", "RK4"}),
                         [](const auto& which) { return std::string(which.param.solver) + which.param.simulator; });

// A cross that is held about one bar is a hinge about the other.
TEST_P(BentLimitsInMotion, OfACrossThatIsHeldAboutABarAreThoseOfAHinge) {
  const std::string hinge =
      "\"Revolute\" CustomProperties { BindAxisPoint1 = {0, 0, 0} BindAxisPoint2 = {0, 0, 1} LowerLimit = -0.8 "
      "UpperLimit = 2.5 }";
  const std::string about1 =
      "\"Universal\" CustomProperties { BindPoint = {0, 0, 0} Axis1 = {0, 0, 1} Axis2 = {0.6, 0.8, 0} LowerLimit1 = "
      "-0.8 UpperLimit1 = 2.5 LowerLimit2 = 0 UpperLimit2 = 0 }";
  const std::string about2 =
      "\"Universal\" CustomProperties { BindPoint = {0, 0, 0} Axis1 = {0.6, 0.8, 0} Axis2 = {0, 0, 1} LowerLimit2 = "
      "-0.8 UpperLimit2 = 2.5 LowerLimit1 = 0 UpperLimit1 = 0 }";
  for (const std::string& cross : {about1, about2})
    for (const double spin : {0.0, 6.0})
      expect_alike(arm(cross, {1, 0, 0}, {0, 0, spin}, 1.0), arm(hinge, {1, 0, 0}, {0, 0, spin}, 1.0));
}

// Shafts that bend no further than so are a ball joint that does not twist, within a cone.
TEST_P(BentLimitsInMotion, OfShaftsAreTheConeOfABallThatDoesNotTwist) {
  expect_alike(arm("\"ConstantVelocity\" CustomProperties { BindPoint = {0, 0, 0} Axis1 = {1, 0, 0} Axis2 = {1, 0, 0} "
                   "MaximumAngle = 0.5 }",
                   {1, 0, 0}, {0, 1.5, 1}, 1.0),
               arm("\"Spherical\" CustomProperties { BindPoint = {0, 0, 0} Axis = {1, 0, 0} ReachConeAngle = 0.5 "
                   "TwistLower = 0 TwistUpper = 0 }",
                   {1, 0, 0}, {0, 1.5, 1}, 1.0));
}

// Bars that are across each other and such that are not, thrown about: both limits are met, none is passed, nothing is gained.
TEST_P(BentLimitsInMotion, OfBothBarsHoldAtOnce) {
  for (const Vector3& bar2 : {Vector3(0, 1, 0), Vector3(0, 0.8, 0.6)}) {
    SceneRun run =
        arm("\"Universal\" CustomProperties { BindPoint = {0, 0, 0} Axis1 = {0, 0, 1} Axis2 = " + literal(bar2) +
                " LowerLimit1 = -0.3 UpperLimit1 = 0.4 LowerLimit2 = -1.2 UpperLimit2 = 1 }",
            {1, 0, 0}, {0, 4, 0}, 2.0);
    const Vector3 bar1 = Vector3::UnitZ(), start1 = (bar2 - bar2.dot(bar1) * bar1).normalized();
    const Vector3 start2 = (bar1 - bar1.dot(bar2) * bar2).normalized();
    double least[] = {0.0, 0.0}, most[] = {0.0, 0.0}, energy = run.energy();
    while (!run.is_done()) {
      run.step();
      const Quaternion turn = run.body("A").pose.orientation;
      const double angles[] = {azimuth_of(bar1, start1, turn * bar2, Vector3::Zero())->value,
                               -azimuth_of(turn * bar2, turn * start2, bar1, Vector3::Zero())->value};
      for (int k = 0; k < 2; ++k) least[k] = std::min(least[k], angles[k]), most[k] = std::max(most[k], angles[k]);
    }
    EXPECT_GE(least[0], -0.3 - 1e-6) << bar2.transpose();
    EXPECT_LE(std::max(most[1] - 1.0, -1.2 - least[1]), 1e-6) << bar2.transpose();
    EXPECT_LE(most[0], 0.4 + 1e-6);
    // `Smooth` meets them within its steps
    const double nearly = std::string(GetParam().simulator) == "Smooth" ? 1e-5 : 1e-6;
    EXPECT_LE(least[0], -0.3 + nearly) << bar2.transpose();
    EXPECT_GE(std::max(most[1] - 1.0, -1.2 - least[1]), -nearly) << bar2.transpose();
    EXPECT_GE(run.count_events(EventKind::kLimitStart), 2U);
    EXPECT_LE(run.energy(), energy);
    EXPECT_LE(run.report().max_joint_error(), 1e-6);
  }
}

}  // namespace
}  // namespace gravitas
