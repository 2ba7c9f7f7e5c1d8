// Drives and friction of Universal and Spherical: what they take and hold, and what work they do, in closed form.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <string>
#include <utility>
#include <vector>

#include "tests/scenes/watched_run.h"

namespace gravitas::joint_friction {
namespace {

using harness::literal;
using harness::SceneRun;
using ::testing::HasSubstr;
using ::testing::ThrowsMessage;
using Watched = harness::WatchedRun;

constexpr double kInertia = 0.2;  // kg m^2, of the ball about any axis

// A ball of 2 kg on the world, or on a free or driven frame of three times its moment.
std::string scene(const std::string& joint, const std::string& kinetic = "", const std::string& body1 = "",
                  const std::string& frame = "Mass = 5 PrincipalMoments = {0.6, 0.6, 0.6}") {
  return "Forces { Force { Type = \"Gravity\" Id = \"Down\" CustomProperties { Acceleration = {0, -9.81, 0} } } }\n"
         "Simulator { CustomProperties { TimeStep = 0.01 Duration = 1 SleepEnergy = 0 } }\n"
         "Environment { Space { Bodies {\nBody { Id = \"Frame\" " +
         frame + " }\nBody { Id = \"Ball\" Mass = 2 PrincipalMoments = {0.2, 0.2, 0.2} " + kinetic +
         " } } }\nConstraints { Constraint { Id = \"J\" Body1 = \"" + body1 + "\" Body2 = \"Ball\" " + joint +
         " } } }\n";
}
std::string spinning(const Vector3& spin) { return "KineticProperties { AngularVelocity = " + literal(spin) + " }"; }

std::string cross(const std::string& more, const Vector3& axis1 = Vector3::UnitZ(),
                  const Vector3& axis2 = Vector3::UnitX()) {
  return "Type = \"Universal\" CustomProperties { BindPoint = {0, 0, 0} Axis1 = " + literal(axis1) +
         " Axis2 = " + literal(axis2) + " " + more + " }";
}
std::string ball(const std::string& more) {
  return "Type = \"Spherical\" CustomProperties { BindPoint = {0, 0, 0} " + more + " }";
}
std::string about(int bar, double speed, double torque = 0.0) {
  const std::string which = std::to_string(bar);
  return "AngularSpeed" + which + " = " + literal(speed) +
         (torque > 0.0 ? " MaximumTorque" + which + " = " + literal(torque) : "") + " ";
}
std::string about(const Vector3& velocity, double torque = 0.0) {
  return "AngularVelocity = " + literal(velocity) + (torque > 0.0 ? " MaximumTorque = " + literal(torque) : "") + " ";
}

struct Way {
  const char *solver, *simulator;
};
class JointDrives : public ::testing::TestWithParam<Way> {
 protected:
  std::vector<std::string> with(std::vector<std::string> more = {}) const {
    more.push_back(std::string("Solver=") + GetParam().solver);
    more.push_back(std::string("Simulator=") + GetParam().simulator);
    if (is_smooth()) more.emplace_back("Integrator=RK4");
    return more;
  }
  bool is_smooth() const { return std::string(GetParam().simulator) == "Smooth"; }
  static Vector3 spin(const SceneRun& run) { return run.body("Ball").twist.angular; }
};
INSTANTIATE_TEST_SUITE_P(Each, JointDrives,
                         ::testing::Values(Way{"Sequential", "Basic"}, Way{"Newton", "Basic"}, Way{"Direct", "Basic"},
                                           Way{"Newton", "Continuous"}, Way{"Direct", "Smooth"}),
                         [](const auto& which) { return std::string(which.param.solver) + which.param.simulator; });

// w = T t/I, up to the speed.
TEST_P(JointDrives, TakeTheirTime) {
  const std::pair<std::string, Vector3> joints[] = {{cross(about(1, 5, 2)), Vector3::UnitZ()},
                                                    {cross(about(2, 5, 2)), Vector3::UnitX()},
                                                    {cross(about(1, -5, 2)), -Vector3::UnitZ()},
                                                    {ball(about(Vector3(0, 5, 0), 2)), Vector3::UnitY()},
                                                    {ball(about(Vector3(0, 0, -5), 2)), -Vector3::UnitZ()}};
  for (const auto& [joint, axis] : joints) {
    SceneRun run(scene(joint), with());
    while (!run.is_done()) {
      run.step();
      const Vector3 wanted = std::min(5.0, 2.0 / kInertia * run.time()) * axis;
      ASSERT_LT((spin(run) - wanted).norm(), 1e-9) << joint << " at " << run.time();
    }
    EXPECT_LT(run.body("Ball").pose.position.norm(), 1e-12);
  }
}

// Without a bound it is there in a step, and either body has its share.
TEST_P(JointDrives, WithoutABoundReachTheirSpeedInAStep) {
  for (const std::string& joint : {cross(about(1, 2)), ball(about(Vector3(0, 0, 2)))}) {
    SceneRun run(scene(joint, "", "Frame"), with());
    for (int i = 0; i < 20; ++i) {
      run.step();
      ASSERT_LT((spin(run) - 1.5 * Vector3::UnitZ()).norm(), 1e-9) << joint << " at " << run.time();
      ASSERT_LT((run.body("Frame").twist.angular + 0.5 * Vector3::UnitZ()).norm(), 1e-9) << joint;
    }
  }
}

// Friction: it takes T t/I off what turns about either bar, or each of the axes by itself, and then holds.
TEST_P(JointDrives, OfSpeedNoughtAreFriction) {
  struct Case {
    std::string joint;
    Vector3 axis;
    double torque;
  };
  const Vector3 between = Vector3(1, 1, -1).normalized();
  for (const Case& one :
       {Case{cross(about(1, 0, 2)), Vector3::UnitZ(), 2.0}, Case{cross(about(2, 0, 2)), Vector3::UnitX(), 2.0},
        Case{ball(about(Vector3::Zero(), 2)), Vector3::UnitX(), 2.0},
        // three of them at once
        Case{ball(about(Vector3::Zero(), 1)), between, std::sqrt(3.0)}}) {
    Watched watched(scene(one.joint, spinning(6.0 * one.axis)), with());
    while (!watched.run.is_done()) {
      watched.run.step();
      const double wanted = std::max(0.0, 6.0 - one.torque / kInertia * watched.run.time());
      ASSERT_LT((spin(watched.run) - wanted * one.axis).norm(), 1e-9) << one.joint << " at " << watched.run.time();
      if (wanted < 0.1) continue;
      const auto reactions = watched.reactions();
      ASSERT_EQ(reactions.size(), 1U);
      const Vector3 share(reactions[0].drive_torque(0), reactions[0].drive_torque(1), reactions[0].drive_torque(2));
      ASSERT_LT((share + one.torque * one.axis).norm(), 1e-9) << one.joint;
    }
  }
}

// An arm of 2 kg, 0.5 m from its joint, weighs 9.81 N m: friction of 10 N m holds it, and bears just that; with 9 N m it sinks as if
// it weighed that much less.
TEST_P(JointDrives, HoldUpToTheirTorque) {
  const double weight = 2.0 * kG * 0.5, inertia = kInertia + 2.0 * 0.25;
  for (const double torque : {10.0, 9.0})
    for (const std::string& joint :
         {cross(about(1, 0, torque), Vector3::UnitZ(), Vector3::UnitY()), ball(about(Vector3::Zero(), torque))}) {
      Watched watched(scene(joint, "Forces = {\"Down\"} KineticProperties { Position = {0.5, 0, 0} }"),
                      with({"Simulator.TimeStep=0.001", "Simulator.Duration=0.05"}));
      watched.run.to_end();
      const double sinks = std::max(0.0, (weight - torque) / inertia * 0.05);
      // the arm turns by 2 mrad, and its weight's lever is that much shorter at most
      EXPECT_NEAR(spin(watched.run).z(), -sinks, torque > weight ? 1e-9 : 1e-5 * weight) << joint;
      const auto reactions = watched.reactions();
      ASSERT_EQ(reactions.size(), 1U);
      EXPECT_NEAR(reactions[0].drive_torque(2), std::min(weight, torque), 1e-5 * weight) << joint;
    }
}

// Both bars: w = p a1 + q a2, a2 where the cross has turned.
TEST_P(JointDrives, OfBothBarsGoOnTopOfEachOther) {
  const double p = 1.0, q = -2.0;
  for (const Vector3& axis2 : {Vector3(1, 0, 0), Vector3(0.8, 0, 0.6)}) {
    SceneRun run(scene(cross(about(1, p) + about(2, q), Vector3::UnitZ(), axis2)), with());
    run.to_end();
    const Vector3 turned = harness::turned(Vector3::UnitZ(), p * run.time()) * axis2;
    // of the second order of 0.03 rad a step with rows of S*, and of the fourth
    const double off = is_smooth() ? 1e-8 : 1e-3;
    // the cross of a Verlet is behind by half of the first step, in which it is set in motion
    const double behind =
        std::string(GetParam().simulator) == "Continuous" ? 0.5 * run.time_step() * std::fabs(p * q) : 0.0;
    EXPECT_LT((spin(run) - p * Vector3::UnitZ() - q * turned).norm(), behind + off);
    ASSERT_EQ(run.report().drives_size(), 2);
    EXPECT_NEAR(run.report().drives(0).speed(), p, off);
    EXPECT_NEAR(run.report().drives(1).speed(), q, off);
  }
}

// Bars at 53 degrees: a torque about the one does its work by what turns about it, and turns nothing about the other, so that of
// the ball w.a2 = 0, and p = T t/(I sin^2).
TEST_P(JointDrives, OfABarDoTheWorkOfItsTurning) {
  const Vector3 axis2(0.8, 0, 0.6);
  SceneRun run(scene(cross(about(1, 100, 2), Vector3::UnitZ(), axis2)),
               with({"Simulator.TimeStep=0.0005", "Simulator.Duration=0.1"}));
  run.to_end();
  const double p = 2.0 * 0.1 / (kInertia * 0.64);
  // p t/2 = 0.08 rad, of which the cosine is lost; steps turn by 8e-4 rad
  EXPECT_NEAR(run.report().drives(0).speed(), p, 2e-3);
  EXPECT_NEAR(spin(run).dot(run.body("Ball").pose.orientation * axis2), 0.0, 1e-3);
  EXPECT_NEAR(run.kinetic_energy(), 2.0 * 0.5 * p * 0.1, 2e-3);
}

// What body 1 carries turns the velocity that is kept.
TEST_P(JointDrives, OfABallKeepTheirVelocityInBody1) {
  const double quarter = 0.5 * kPi;
  SceneRun run(
      scene(ball(about(Vector3(2, 0, 0))), "", "Frame",
            "Kinematic = true KineticProperties { AngularVelocity = {0, 0, 1} Orientation = {0.6, 0.8, 0, 0} }"),
      with({"Simulator.Duration=" + literal(quarter), "Simulator.TimeStep=" + literal(quarter / 400)}));
  run.to_end();
  EXPECT_LT((spin(run) - Vector3(0, 2, 1)).norm(), 1e-2);
}

// Friction of a ball joint is no other joint's: a pendulum in a plane swings as one on a hinge with the same friction, and stops.
TEST_P(JointDrives, OfABallAreThatOfAHingeInAPlane) {
  const std::string arm = "Forces = {\"Down\"} KineticProperties { Position = {0.5, 0, 0} }";
  const std::string hinge =
      "Type = \"Revolute\" CustomProperties { BindAxisPoint1 = {0, 0, 0} BindAxisPoint2 = {0, 0, 1} AngularSpeed = 0 "
      "MaximumTorque = 1 }";
  SceneRun one(scene(hinge, arm), with({"Simulator.Duration=10"}));
  SceneRun two(scene(ball(about(Vector3::Zero(), 1)), arm), with({"Simulator.Duration=10"}));
  SceneRun three(scene(cross(about(1, 0, 1) + about(2, 0, 1)), arm), with({"Simulator.Duration=10"}));
  for (int i = 0; i < 150; ++i) one.step(), two.step(), three.step();
  for (const SceneRun* other : {&two, &three}) {
    EXPECT_LT((other->body("Ball").pose.position - one.body("Ball").pose.position).norm(), 1e-6);
    EXPECT_LT((spin(*other) - spin(one)).norm(), 1e-6);
  }
  two.to_end();
  EXPECT_LT(spin(two).norm(), 1e-6);
  // where it stands its weight asks for no more than the friction
  EXPECT_LE(std::fabs(two.body("Ball").pose.position.x()) * 2.0 * kG, 1.0 + 1e-6);
}

TEST(JointDrivesOf, CrossesAndBallsAreRefusedByHalves) {
  const auto refused = [&](const std::string& joint, const std::string& text) {
    EXPECT_THAT([&] { SceneRun(scene(joint)); }, ThrowsMessage<std::exception>(HasSubstr(text))) << joint;
  };
  refused(cross("MaximumTorque2 = 1"), "MaximumTorque2 is given without AngularSpeed2");
  refused(ball("MaximumTorque = 1"), "MaximumTorque is given without AngularVelocity");
}

}  // namespace
}  // namespace gravitas::joint_friction
