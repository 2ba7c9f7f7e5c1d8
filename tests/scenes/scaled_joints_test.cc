// Joints of bodies of any size, and axes that are told by points far away: lengths times s, moments times s^2, accelerations
// times s, and the motion is the same times s.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <string>
#include <tuple>
#include <vector>

#include "tests/scenes/scene_run.h"

namespace gravitas {
namespace {

using harness::angle_between;
using harness::literal;
using harness::SceneRun;
using harness::set;

struct JointOfSize {
  const char* type;
  // Of a joint at a point, with lengths in units of `size`; an axis is told by points `out` of them along it.
  std::string (*properties)(const Vector3& point, double size, double out);
};

std::string two_points(const Vector3& point, double size, double out) {
  // along a coordinate, so that points far out tell it exactly
  const Vector3 axis = Vector3::UnitZ();
  return "BindAxisPoint1 = " + literal(Vector3(size * (point + out * axis))) +
         " BindAxisPoint2 = " + literal(Vector3(size * (point + (out + 1.0) * axis)));
}

std::string bind_point(const Vector3& point, double size) { return "BindPoint = " + literal(Vector3(size * point)); }

const JointOfSize kSizedJoints[] = {
    {"Spherical", [](const Vector3& point, double size, double) { return bind_point(point, size); }},
    {"Revolute", two_points},
    {"Rigid", [](const Vector3& point, double size, double) { return bind_point(point, size); }},
    {"AngularMotor",
     [](const Vector3& point, double size, double out) {
       return two_points(point, size, out) + " AngularSpeed = 1 MaximumTorque = " + literal(0.2 * size * size);
     }},
    {"Slider", [](const Vector3& point, double size, double) { return bind_point(point, size) + " Axis = {1, 1, 0}"; }},
    {"Distance",
     [](const Vector3& point, double size, double) {
       return "BindPoint1 = " + literal(Vector3(size * point)) +
              " BindPoint2 = " + literal(Vector3(size * (point + Vector3(0.3, 0.2, 0.1))));
     }},
    {"Universal", [](const Vector3& point, double size,
                     double) { return bind_point(point, size) + " Axis1 = {1, 0.3, 0} Axis2 = {0, 0.2, 1}"; }},
    {"ConstantVelocity", [](const Vector3& point, double size,
                            double) { return bind_point(point, size) + " Axis1 = {1, 0.3, 0} Axis2 = {1, 0.1, 0.2}"; }},
    {"Axle", [](const Vector3& point, double size,
                double) { return bind_point(point, size) + " SteeringAxis = {0, 1, 0} RollingAxis = {0, 0.2, 1}"; }},
};

void PrintTo(const JointOfSize& joint, std::ostream* out) { *out << joint.type; }

// Three bodies that hang from the world and from each other, of masses 1, 2 and 3, and tumble at the start as joints do
// not allow, which the first step mends.
std::string chain(const JointOfSize& joint, double size, double out) {
  const Vector3 places[] = {{0.5, 0.1, 0.0}, {1.5, 0.0, 0.2}, {2.3, 0.3, -0.1}};
  const Vector3 points[] = {{0.0, 0.0, 0.0}, {1.0, 0.0, 0.0}, {2.0, 0.1, 0.0}};
  const Vector3 moments(0.1, 0.2, 0.25);
  std::string bodies, joints;
  for (int i = 0; i < 3; ++i) {
    const std::string id = std::to_string(i);
    bodies += "Body { Id = \"" + id + "\" Mass = " + std::to_string(i + 1) +
              " PrincipalMoments = " + literal(Vector3(size * size * moments)) +
              " KineticProperties { Position = " + literal(Vector3(size * places[i])) +
              " AngularVelocity = {0.1, 0.3, 1} } Forces = { \"Down\" } }\n";
    joints += std::string("Constraint { Type = \"") + joint.type + "\" Id = \"J" + id + "\" Body1 = \"" +
              (i == 0 ? "" : std::to_string(i - 1)) + "\" Body2 = \"" + id + "\" CustomProperties { " +
              joint.properties(points[i], size, out) + " } }\n";
  }
  return "Forces { Force { Type = \"Gravity\" Id = \"Down\" CustomProperties { Acceleration = " +
         literal(Vector3(0, -kG * size, 0)) +
         " } } }\nSimulator { CustomProperties { TimeStep = 0.01 Duration = 2 } }\nEnvironment { Space { Bodies {\n" +
         bodies + "} } Constraints {\n" + joints + "} }\n";
}

class JointsOfAnySize : public ::testing::TestWithParam<std::tuple<JointOfSize, const char*>> {
 protected:
  const JointOfSize& joint() const { return std::get<0>(GetParam()); }
  bool is_end_of_step() const { return std::string(std::get<1>(GetParam())) != "Sequential"; }

  struct End {
    std::vector<SceneRun::Motion> bodies;
    double joint_error;
  };
  End end_of(double size, double out = 0.0) const {
    SceneRun run(chain(joint(), size, out), {set("Solver", std::string(std::get<1>(GetParam())))});
    run.to_end();
    End end{{}, run.report().max_joint_error()};
    for (const char* id : {"0", "1", "2"}) end.bodies.push_back(run.body(id));
    return end;
  }

  // How far two ends are apart, of bodies of size 1 and `size`; lengths in sizes.
  static double apart(const End& unit, const End& sized, double size) {
    double most = 0.0;
    for (std::size_t i = 0; i < unit.bodies.size(); ++i) {
      const SceneRun::Motion &a = unit.bodies[i], &b = sized.bodies[i];
      most = std::max({most, (b.pose.position / size - a.pose.position).norm(),
                       (b.twist.linear / size - a.twist.linear).norm(), (b.twist.angular - a.twist.angular).norm(),
                       angle_between(a.pose.orientation, b.pose.orientation)});
    }
    return most;
  }
};

INSTANTIATE_TEST_SUITE_P(Each, JointsOfAnySize,
                         ::testing::Combine(::testing::ValuesIn(kSizedJoints),
                                            ::testing::Values("Newton", "Direct", "Sequential")),
                         [](const auto& which) {
                           return std::string(std::get<0>(which.param).type) + "By" + std::get<1>(which.param);
                         });

// Over 200 steps rounding grows to some 1e-13; Sequential's sweeps end where errors of turns, which do not scale, and of ways
// are small.
TEST_P(JointsOfAnySize, MoveAlike) {
  const End unit = end_of(1.0);
  if (is_end_of_step()) {
    EXPECT_LE(unit.joint_error, 1e-12);
  }
  for (const double size : {1e-6, 1e-5, 1e-3, 1e3, 1e5, 1e6})
    EXPECT_LE(apart(unit, end_of(size), size), is_end_of_step() ? 1e-11 : 1e-7) << "bodies of " << size << " m";
}

TEST_P(JointsOfAnySize, MoveAlikeWithAnAxisToldFromAfar) {
  const std::string type = joint().type;
  if (type != "Revolute" && type != "AngularMotor") GTEST_SKIP() << "has no axis told by points";
  const End unit = end_of(1.0);
  for (const double out : {-1e3, 1e3, 1e5}) {
    const End end = end_of(1.0, out);
    EXPECT_LE(apart(unit, end, 1.0), 1e-11) << "points " << out << " m along the axis";
    EXPECT_LE(end.joint_error, is_end_of_step() ? 1e-13 : 2e-4);
  }
}

// What the joints break at grows with them: they break in the same step.
TEST_P(JointsOfAnySize, BreakAlike) {
  const auto broken_after = [&](double size, double threshold) {
    std::string scene = chain(joint(), size, 0.0);
    const std::string type = "Constraint { ";
    for (std::size_t at = scene.find(type); at != std::string::npos; at = scene.find(type, at + 1))
      scene.insert(at + type.size(), "BreakingThreshold = " + literal(threshold * size) + " ");
    SceneRun run(scene, {set("Solver", std::string(std::get<1>(GetParam())))});
    int steps = 0;
    while (run.holds("J0") && run.holds("J1") && run.holds("J2") && steps < 200) run.step(), ++steps;
    return steps;
  };
  // of motors that turn freely nothing holds much
  const double threshold = std::string(joint().type) == "AngularMotor" ? 1e-4 : 1.5e-3;
  const int unit = broken_after(1.0, threshold);
  EXPECT_LT(unit, 200);
  for (const double size : {0x1p-10, 0x1p-5, 0x1p10}) EXPECT_EQ(broken_after(size, threshold), unit) << size << " m";
}

// Beams that fall on a stop of their hinge, or on the cone of their ball joint.
TEST(LimitsOfAnySize, HoldAlike) {
  const auto end_of = [](const std::string& joint, const char* solver, double size) {
    SceneRun run("Forces { Force { Type = \"Gravity\" Id = \"Down\" CustomProperties { Acceleration = " +
                     literal(Vector3(0, -kG * size, 0)) +
                     " } } }\nSimulator { CustomProperties { TimeStep = 0.0078125 Duration = 1 } }\n"
                     "Environment { Space { Bodies { Body { Id = \"A\" Mass = 1 PrincipalMoments = " +
                     literal(Vector3(size * size * Vector3(0.01, 0.33, 0.33))) +
                     " KineticProperties { Position = " + literal(Vector3(size, 0, 0)) +
                     " } Forces = { \"Down\" } } } }\nConstraints { Constraint { " + joint + " } } }\n",
                 {set("Solver", std::string(solver))});
    double lowest = 0.0;
    while (!run.is_done()) {
      run.step();
      lowest = std::min(lowest, run.body("A").pose.position.y() / size);
    }
    return lowest;
  };
  for (const std::string joint :
       {"Type = \"Revolute\" Id = \"J\" Body2 = \"A\" CustomProperties { BindAxisPoint1 = {0, 0, 0} BindAxisPoint2 = "
        "{0, 0, 1} "
        "LowerLimit = -0.5 }",
        "Type = \"Spherical\" Id = \"J\" Body2 = \"A\" CustomProperties { BindPoint = {0, 0, 0} Axis = {1, 0, 0} "
        "ReachConeAngle = 0.5 }"})
    for (const char* solver : {"Newton", "Direct", "Sequential"})
      for (const double size : {1e-6, 1e-3, 1.0, 300.0, 1e3, 1e4, 1e6})
        EXPECT_NEAR(end_of(joint, solver, size), -std::sin(0.5), 1e-6) << solver << ", " << size << " m: " << joint;
}

}  // namespace
}  // namespace gravitas
