// Every joint in motion: against closed forms, against the same joint made of other rows, with every solver.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <string>
#include <tuple>
#include <vector>

#include "plugin_sdk/discrepancy.h"
#include "plugin_sdk/math/rotation.h"
#include "tests/scenes/scene_run.h"

namespace gravitas {
namespace {

using harness::angle_between;
using harness::literal;
using harness::SceneRun;
using harness::set;

std::string body(const std::string& id, const Vector3& at, const std::string& more = "", const std::string& motion = "",
                 const Vector3& moments = {0.1, 0.2, 0.25}) {
  return "Body { Id = \"" + id + "\" Mass = 1 PrincipalMoments = " + literal(moments) +
         " KineticProperties { Position = " + literal(at) + motion + " } " + more + " }\n";
}

std::string joint(const std::string& type, const std::string& id, const std::string& body1, const std::string& body2,
                  const std::string& properties) {
  return "Constraint { Type = \"" + type + "\" Id = \"" + id + "\" Body1 = \"" + body1 + "\" Body2 = \"" + body2 +
         "\" CustomProperties { " + properties + " } }\n";
}

std::string scene(const std::string& bodies, const std::string& joints, double time_step, double duration) {
  return "Forces { Force { Type = \"Gravity\" Id = \"Down\" CustomProperties { Acceleration = {0, -9.81, 0} } } }\n"
         "Simulator { CustomProperties { TimeStep = " +
         literal(time_step) + " Duration = " + literal(duration) + " } }\nEnvironment { Space { Bodies {\n" + bodies +
         "} } Constraints {\n" + joints + "} }\n";
}

const std::string kFalls = "Forces = { \"Down\" }";

class JointsInMotion : public ::testing::TestWithParam<const char*> {
 protected:
  std::vector<std::string> solver() const { return {set("Solver", std::string(GetParam()))}; }
  bool is_end_of_step() const { return std::string(GetParam()) != "Sequential"; }
  // What the joint's points may be apart at a committed state.
  double gap(double otherwise) const { return is_end_of_step() ? 1e-12 : otherwise; }
};

INSTANTIATE_TEST_SUITE_P(Each, JointsInMotion, ::testing::Values("Sequential", "Newton", "Direct"),
                         [](const auto& which) { return std::string(which.param); });

// ---- closed forms

// v = g sin t to rounding, and the way of SemiImplicitEuler: t (t + h)/2 of it. The force acts beside the guide.
TEST_P(JointsInMotion, ASliderFallsAlongItsAxis) {
  const double h = 1.0 / 60;
  const Vector3 axis = Vector3(1, -1, 0.5).normalized();
  SceneRun run(scene(body("Sled", {0.3, 0.2, 0.1}, kFalls),
                     joint("Slider", "Guide", "", "Sled", "BindPoint = {0, 0, 0} Axis = {2, -2, 1}"), h, 3),
               solver());
  const Vector3 start = run.body("Sled").pose.position;
  const double a = -kG * axis.y();
  while (!run.is_done()) {
    run.step();
    const SceneRun::Motion sled = run.body("Sled");
    const double t = run.time();
    ASSERT_LE((sled.twist.linear - a * t * axis).norm(), 1e-11 * (1.0 + a * t)) << "at " << t;
    ASSERT_LE((sled.pose.position - start - 0.5 * a * t * (t + h) * axis).norm(), 1e-10) << "at " << t;
    ASSERT_LE(sled.twist.angular.norm(), 1e-11) << "at " << t;
  }
  EXPECT_LE(run.report().max_joint_error(), 1e-12);
}

// Without a bound on its force it stalls there, with gravity against it or along, and leaves where it points away.
TEST_P(JointsInMotion, ASlidersDriveStallsAtALimit) {
  const auto run_to_end = [&](const std::string& properties, const std::string& simulator) {
    std::vector<std::string> overrides = solver();
    overrides.push_back(set("Simulator", simulator));
    SceneRun run(
        scene(body("Sled", {0.3, 0.2, 0.1}, kFalls),
              joint("Slider", "Guide", "", "Sled", "BindPoint = {0, 0, 0} Axis = {0, 1, 0} " + properties), 0.01, 1),
        overrides);
    while (!run.is_done()) {
      run.step();
      EXPECT_LE(run.body("Sled").pose.position.y(), 0.7031 + 1e-12) << properties << " at " << run.time();
    }
    EXPECT_LE(run.report().max_joint_error(), 1e-12) << properties;
    return run.body("Sled");
  };
  for (const std::string simulator : {"Basic", "Smooth"}) {
    if (simulator == "Smooth" && !is_end_of_step()) continue;
    for (const auto& [properties, end] :
         {std::pair{"UpperLimit = 0.5031 Speed = 1", 0.7031}, std::pair{"LowerLimit = -0.5031 Speed = -1", -0.3031},
          std::pair{"LowerLimit = 0 UpperLimit = 2 Speed = -1", 0.2}}) {
      const SceneRun::Motion sled = run_to_end(properties, simulator);
      EXPECT_NEAR(sled.pose.position.y(), end, 1e-12) << properties;
      EXPECT_NEAR(sled.twist.linear.y(), 0.0, 1e-12) << properties;
    }
    EXPECT_NEAR(run_to_end("LowerLimit = -2 UpperLimit = 0 Speed = -1", simulator).twist.linear.y(), -1.0, 1e-12);
  }
}

// A motor without a bound on a hinge with limits: the four points that drive are no row of the hinge's limit. To the stop,
// against gravity, and away from it.
TEST_P(JointsInMotion, AMotorStallsAtAHingesLimit) {
  const std::string axis = "BindAxisPoint1 = {0, 0, 0} BindAxisPoint2 = {0, 0, 0.5} ";
  const auto run_to_end = [&](const std::string& limit, const std::string& speed) {
    SceneRun run(scene(body("Door", {0.8, 0, 0}, kFalls),
                       joint("Revolute", "Hinge", "", "Door", axis + limit) +
                           joint("AngularMotor", "Motor", "", "Door", axis + "AngularSpeed = " + speed),
                       0.01, 1),
                 solver());
    run.to_end();
    EXPECT_LE(run.report().max_joint_error(), is_end_of_step() ? 1e-9 : 1e-3) << limit;
    return run.body("Door");
  };
  for (const auto& [limit, speed, angle] :
       {std::tuple{"UpperLimit = 0.503", "1", 0.503}, std::tuple{"LowerLimit = -0.503", "-1", -0.503}}) {
    const SceneRun::Motion door = run_to_end(limit, speed);
    const double tolerance = is_end_of_step() ? 1e-9 : 1e-4;
    EXPECT_NEAR(std::atan2(door.pose.position.y(), door.pose.position.x()), angle, tolerance);
    EXPECT_NEAR(door.twist.angular.z(), 0.0, 10.0 * tolerance);
  }
  // the points drive along where the step's turns have left them, 1 - cos(2 h w)
  EXPECT_NEAR(run_to_end("UpperLimit = 0", "-1").twist.angular.z(), -1.0, 2.1e-4);
}

// The drive gains F/m until it has its speed, and the limit stops it.
TEST_P(JointsInMotion, ASlidersDriveHasItsForceSpeedAndLimit) {
  const double h = 0.01;
  SceneRun run(scene(body("Sled", {0.3, 0.2, 0.1}),
                     joint("Slider", "Guide", "", "Sled",
                           "BindPoint = {0, 0, 0} Axis = {1, 0, 0} UpperLimit = 1.5 Speed = 2 MaximumForce = 4"),
                     h, 2),
               solver());
  while (!run.is_done()) {
    run.step();
    const SceneRun::Motion sled = run.body("Sled");
    const double way = sled.pose.position.x() - 0.3;
    ASSERT_LE(way, 1.5 + 1e-9) << "at " << run.time();
    if (way < 1.45) {
      ASSERT_NEAR(sled.twist.linear.x(), std::min(2.0, 4.0 * run.time()), 1e-9) << "at " << run.time();
    }
  }
  EXPECT_NEAR(run.body("Sled").pose.position.x(), 1.8, 1e-9);
  EXPECT_NEAR(run.body("Sled").twist.linear.x(), 0.0, 1e-9);
}

// Point pendulum, l = 1: T = 2.36784194757623745 s from the horizontal; of first order, so that two steps extrapolate.
TEST_P(JointsInMotion, ARodIsAPointPendulum) {
  const auto period = [&](double h) {
    SceneRun run(scene(body("Bob", {-1, 0, 0}, kFalls),
                       joint("Distance", "Rod", "", "Bob", "BindPoint1 = {0, 0, 0} BindPoint2 = {-1, 0, 0}"), h, 6),
                 solver());
    double first = 0.0;
    for (;;) {
      const double before = run.body("Bob").pose.position.x(), time = run.time();
      run.step();
      EXPECT_NEAR(run.body("Bob").pose.position.norm(), 1.0, gap(1e-4 * h / 0.004));
      const double after = run.body("Bob").pose.position.x();
      if (!(before < 0.0 && after >= 0.0)) continue;
      const double crossing = time + h * before / (before - after);
      if (first > 0.0) return crossing - first;
      first = crossing;
    }
  };
  const double exact = 2.36784194757623745;
  const double coarse = period(0.002), fine = period(0.001);
  EXPECT_NEAR(coarse / exact, 1.0, 8.0 * 0.002);
  EXPECT_NEAR((2.0 * fine - coarse) / exact, 1.0, 400.0 * 1e-6);
}

TEST_P(JointsInMotion, ARopeIsSlackAndThenHolds) {
  const double h = 1.0 / 240;
  SceneRun run(scene(body("Load", {0.3, -0.4, 0}, kFalls),
                     joint("Distance", "Rope", "", "Load",
                           "BindPoint1 = {0, 0, 0} BindPoint2 = {0.3, -0.4, 0} MaximumDistance = 1"),
                     h, 3),
               solver());
  while (!run.is_done()) {
    run.step();
    const SceneRun::Motion load = run.body("Load");
    // free fall from (0.3, -0.4) until y = -sqrt(1 - 0.09)
    if (0.5 * kG * run.time() * (run.time() + h) < std::sqrt(0.91) - 0.4) {
      ASSERT_NEAR(load.twist.linear.y(), -kG * run.time(), 1e-12) << "at " << run.time();
    }
    ASSERT_LE(load.pose.position.norm(), 1.0 + gap(1e-3)) << "at " << run.time();
  }
  EXPECT_LT(run.energy(), 0.0);
}

// Two shafts held in bearings, the first driven: the bars p1 and p2 of the cross are across their shafts s1 and s2 and
// across each other, so w1 s1.(p1 x p2) = w2 s2.(p1 x p2). Three of the four rows of the joint are redundant.
TEST_P(JointsInMotion, HookesJointTurnsUnevenlyAsItsBarsSay) {
  const double h = 1.0 / 240, bend = 0.6, speed = 3.0;
  const Vector3 s1 = Vector3::UnitX(), s2(std::cos(bend), std::sin(bend), 0.0);
  const auto text = [&](const std::string& type, const std::string& axes) {
    return scene(body("Driving", {-1, 0, 0}) + body("Driven", 1.0 * s2),
                 joint("AngularMotor", "Motor", "", "Driving",
                       "BindAxisPoint1 = {-1.5, 0, 0} BindAxisPoint2 = {-0.5, 0, 0} AngularSpeed = " + literal(speed)) +
                     joint("Revolute", "Bearing", "", "Driven",
                           "BindAxisPoint1 = " + literal(Vector3(0.5 * s2)) +
                               " BindAxisPoint2 = " + literal(Vector3(1.5 * s2))) +
                     joint(type, "Cross", "Driving", "Driven", "BindPoint = {0, 0, 0} " + axes),
                 h, 3);
  };
  const Vector3 p2(-std::sin(bend), std::cos(bend), 0.0);
  SceneRun hooke(text("Universal", "Axis1 = {0, 0, 1} Axis2 = " + literal(p2)), solver());
  while (!hooke.is_done()) {
    hooke.step();
    const Vector3 bar1 = hooke.body("Driving").pose.orientation * Vector3::UnitZ();
    const Vector3 across = bar1.cross(s2.cross(bar1).normalized());
    const double expected = speed * s1.dot(across) / s2.dot(across);
    // the driving shaft's bearing is held at the end of the step by Newton and Direct alone
    ASSERT_NEAR(hooke.body("Driven").twist.angular.dot(s2), expected, is_end_of_step() ? 1e-8 : 0.05 * speed)
        << "at " << hooke.time();
  }
  // measured along the axes of the trial state, which the step still turns
  EXPECT_LE(hooke.report().max_joint_error(), is_end_of_step() ? 1e-6 : 1e-3);

  SceneRun even(text("ConstantVelocity", "Axis1 = {1, 0, 0} Axis2 = " + literal(s2)), solver());
  while (!even.is_done()) {
    even.step();
    // with others the bisector of the shafts is that of the trial state
    ASSERT_NEAR(even.body("Driven").twist.angular.dot(s2), speed, (is_end_of_step() ? 1e-8 : 1e-4) * speed)
        << "at " << even.time();
  }
}

// A wheel hangs in its spring: m g/k deep, and it rolls on undisturbed.
TEST_P(JointsInMotion, AnAxlesSpringCarriesAndItsWheelRolls) {
  SceneRun run(scene(body("Wheel", {0, 0, 0}, kFalls, " AngularVelocity = {0, 0, 5}", {0.1, 0.1, 0.2}),
                     joint("Axle", "Axle", "", "Wheel",
                           "BindPoint = {0, 0, 0} SteeringAxis = {0, 1, 0} RollingAxis = {0, 0, 1} "
                           "SuspensionStiffness = 500 SuspensionDamping = 40"),
                     1.0 / 240, 3),
               solver());
  run.to_end();
  EXPECT_NEAR(run.body("Wheel").pose.position.y(), -kG / 500.0, 1e-9);
  EXPECT_NEAR(run.body("Wheel").twist.angular.z(), 5.0, 1e-9);
  EXPECT_LE(run.body("Wheel").twist.linear.norm(), 1e-9);
  EXPECT_LE(run.report().max_joint_error(), 1e-9);
}

// A pendulum in a socket: its axis stays within the cone, round or not, and its twist within the limits.
TEST_P(JointsInMotion, ASocketHoldsItsReachConeAndTwist) {
  for (const char* cone : {"ReachConeAngle = 0.5", "ReachCone = {{0, 0.5}, {1.5, 0.3}, {3.1, 0.5}, {4.6, 0.4}}"}) {
    SceneRun run(
        scene(body("Arm", {0, -1, 0}, kFalls, " LinearVelocity = {2, 0, 1.5} AngularVelocity = {-1.5, 3, 2}"),
              joint("Spherical", "Socket", "", "Arm",
                    std::string("BindPoint = {0, 0, 0} Axis = {0, -1, 0} TwistLower = -0.4 TwistUpper = 0.7 ") + cone),
              1.0 / 240, 5),
        solver());
    double widest = 0.0;
    while (!run.is_done()) {
      run.step();
      const Vector3 axis = run.body("Arm").pose.orientation * Vector3(0, -1, 0);
      widest = std::max(widest, std::acos(std::clamp(-axis.y(), -1.0, 1.0)));
    }
    EXPECT_GT(widest, 0.25) << cone;
    // an angle is closed to second order in the turn of a step, 0.02 rad
    EXPECT_LE(widest, 0.5 + 1e-3) << cone;
    EXPECT_LE(run.report().max_joint_error(), 1e-3) << cone;
  }
}

// A limit that is met far bent, while the bend changes: the angle is held, whatever its row's scale.
TEST_P(JointsInMotion, ASocketHoldsItsTwistFarBent) {
  if (!is_end_of_step()) GTEST_SKIP() << "first order";
  SceneRun run(scene(body("Arm", {0, -1, 0}, "", " AngularVelocity = {3, 5, 2}", {0.1, 0.3, 0.2}),
                     joint("Spherical", "Socket", "", "Arm",
                           "BindPoint = {0, 0, 0} Axis = {0, -1, 0} TwistLower = -1 TwistUpper = 1.5"),
                     1.0 / 100, 3),
               solver());
  const Quaternion frame = exp_rotation(Vector3(0, 0, -0.5 * std::numbers::pi));  // its first axis is {0, -1, 0}
  double largest = -4.0, smallest = 4.0, widest = 0.0;
  while (!run.is_done()) {
    run.step();
    const Quaternion turned = run.body("Arm").pose.orientation * frame;
    largest = std::max(largest, twist_between(frame, turned));
    smallest = std::min(smallest, twist_between(frame, turned));
    widest = std::max(widest, swing_between(frame * Vector3::UnitX(), turned * Vector3::UnitX()).angle);
  }
  EXPECT_GT(widest, 0.5);
  EXPECT_TRUE(largest > 1.5 - 1e-3 || smallest < -1.0 + 1e-3) << largest << " " << smallest;
  EXPECT_LE(largest, 1.5 + 1e-6);
  EXPECT_GE(smallest, -1.0 - 1e-6);
}

TEST_P(JointsInMotion, AHingeStopsAtItsLimit) {
  SceneRun run(scene(body("Flap", {1, 0, 0}, kFalls),
                     joint("Revolute", "Hinge", "", "Flap",
                           "BindAxisPoint1 = {0, 0, -1} BindAxisPoint2 = {0, 0, 1} LowerLimit = -0.8 UpperLimit = 0.1"),
                     1.0 / 240, 3),
               solver());
  run.to_end();
  EXPECT_NEAR(angle_between(run.body("Flap").pose.orientation, Quaternion::Identity()), 0.8, 1e-6);
  EXPECT_LE(run.body("Flap").twist.angular.norm(), 1e-9);
}

// Two rods of 3 cm and 1 m from a point, let go askew: what their ends' joints exert has no moment about their axes, where the
// moment of inertia is a seven hundredth, so they never begin to spin.
TEST_P(JointsInMotion, SlenderRodsOnBallJointsDoNotBeginToSpin) {
  const auto rod = [](const std::string& id, const Vector3& middle, const std::string& orientation) {
    return "Body { Id = \"" + id +
           "\" Mass = 1 PrincipalMoments = {0.0834, 0.0001125, 0.0834} KineticProperties { Position = " +
           literal(middle) + " Orientation = " + orientation + " } " + kFalls + " }\n";
  };
  for (const double time_step : {1.0 / 60, 1.0 / 240}) {
    // along x, then along z: y of the body turned there
    SceneRun run(scene(rod("One", {0.5, 0, 0}, "{0.7071067811865476, 0, 0, -0.7071067811865476}") +
                           rod("Two", {1, 0, 0.5}, "{0.7071067811865476, 0.7071067811865476, 0, 0}"),
                       joint("Spherical", "Top", "", "One", "BindPoint = {0, 0, 0}") +
                           joint("Spherical", "Elbow", "One", "Two", "BindPoint = {1, 0, 0}"),
                       time_step, 4),
                 solver());
    double spin = 0.0;
    while (!run.is_done()) {
      run.step();
      for (const char* id : {"One", "Two"}) {
        const SceneRun::Motion body = run.body(id);
        spin = std::max(spin, std::fabs((body.pose.orientation.conjugate() * body.twist.angular).y()));
      }
    }
    // rows of S* leave what is of second order in the step; it was 3 rad/s within a second at 1/60 s
    EXPECT_LT(spin, is_end_of_step() ? 1e-6 : 1e-2) << time_step;
    EXPECT_LT(run.report().max_joint_error(), 1e-3) << time_step;
  }
}

// ---- the same joint of other rows

// Two bodies that tumble in free space with a joint between them, and where they are after a second.
std::vector<SceneRun::Motion> tumbled(const std::string& joints, double time_step,
                                      const std::vector<std::string>& overrides) {
  SceneRun run(scene(body("A", {-0.5, 0, 0}, "", " LinearVelocity = {0.2, 0, 0.4} AngularVelocity = {1, 2, -1}") +
                         body("B", {0.6, 0.1, 0}, "", " LinearVelocity = {0, 0.3, 0} AngularVelocity = {-0.5, 2, 3}",
                              {0.3, 0.15, 0.2}),
                     joints, time_step, 1),
               overrides);
  const Vector3 momentum = run.momentum();
  run.to_end();
  EXPECT_LE((run.momentum() - momentum).norm(), 1e-12);
  return {run.body("A"), run.body("B")};
}

TEST_P(JointsInMotion, RedundantRowsMoveLikeThoseWithout) {
  struct Pair {
    const char* what;
    std::string plain, redundant;
  };
  const std::string a = "{0.1, -0.2, 0}", b = "{0.3, 0.4, 0.5}", c = "{-0.4, 0.3, 0.1}";
  const auto ball = [](const std::string& id, const std::string& at) {
    return joint("Spherical", id, "A", "B", "BindPoint = " + at);
  };
  const std::string ends = "BindAxisPoint1 = " + a + " BindAxisPoint2 = " + b;
  const std::vector<Pair> pairs = {
      // 5 rows, and the motor's, whose drive has no torque
      {"hinge and motor without torque", joint("Revolute", "J", "A", "B", ends),
       joint("AngularMotor", "J", "A", "B", ends + " AngularSpeed = 2 MaximumTorque = 0")},
      {"hinge and two ball joints", joint("Revolute", "J", "A", "B", ends), ball("J", a) + ball("K", b)},
      // 6 rows of rank 6, and the seed's 9
      {"rigid and three ball joints", joint("Rigid", "J", "A", "B", "BindPoint = " + a),
       ball("J", a) + ball("K", b) + ball("L", c)},
      {"rigid and a slider that is held", joint("Rigid", "J", "A", "B", "BindPoint = " + a),
       joint("Slider", "J", "A", "B", "BindPoint = " + a + " Axis = {1, 2, 3} LowerLimit = 0 UpperLimit = 0")},
      {"ball joint and two of it", ball("J", a), ball("J", a) + ball("K", a)},
  };
  for (const Pair& pair : pairs) {
    // Sequential's rows are those of S*, so that other ones for the same joint are off by the first order of the step
    const double time_step = is_end_of_step() ? 1.0 / 240 : 1.0 / 7680;
    const std::vector<SceneRun::Motion> one = tumbled(pair.plain, time_step, solver()),
                                        other = tumbled(pair.redundant, time_step, solver());
    for (std::size_t i = 0; i < 2; ++i) {
      const double tolerance = is_end_of_step() ? 1e-9 : 1e-4;
      EXPECT_LE((one[i].pose.position - other[i].pose.position).norm(), tolerance) << pair.what;
      EXPECT_LE(angle_between(one[i].pose.orientation, other[i].pose.orientation), tolerance) << pair.what;
      EXPECT_LE((one[i].twist.angular - other[i].twist.angular).norm(), 10.0 * tolerance) << pair.what;
    }
  }
}

// Bricard's mechanism (IFToMM A04): five rods, six hinges, 30 rows of hinges of rank 5 each on 30 freedoms, and it moves.
TEST_P(JointsInMotion, BricardsMechanismMovesThoughItsRowsAreTooMany) {
  const Vector3 point[] = {{0, 0, 0}, {1, 0, 0}, {1, -1, 0}, {1, -1, 1}, {0, -1, 1}, {0, 0, 1}};
  const Vector3 axis[] = {Vector3::UnitY(), Vector3::UnitZ(), Vector3::UnitX(),
                          Vector3::UnitY(), Vector3::UnitZ(), Vector3::UnitX()};
  std::string bodies, joints;
  for (int i = 0; i < 5; ++i) {
    const Vector3 along = point[i + 1] - point[i];
    const Vector3 moments = (Vector3::Ones() - along.cwiseAbs()) / 12.0 + 1e-5 * along.cwiseAbs();
    bodies += body("R" + std::to_string(i), 0.5 * (point[i] + point[i + 1]), kFalls, "", moments);
  }
  for (int i = 0; i < 6; ++i)
    joints += joint("Revolute", "H" + std::to_string(i), i == 0 ? "" : "R" + std::to_string(i - 1),
                    i == 5 ? "" : "R" + std::to_string(i),
                    "BindAxisPoint1 = " + literal(Vector3(point[i] - 0.5 * axis[i])) +
                        " BindAxisPoint2 = " + literal(Vector3(point[i] + 0.5 * axis[i])));
  SceneRun run(scene(bodies, joints, 1.0 / 240, 1), solver());
  const Vector3 start = run.body("R2").pose.position;
  run.to_end();
  EXPECT_GT((run.body("R2").pose.position - start).norm(), 0.1);
  // a loop is where sweeps converge worst: Sequential's run out, and the joints open by centimetres half a metre from their
  // points, where 0.2 rad are 0.1 m
  EXPECT_LE(run.report().max_joint_error(), is_end_of_step() ? 1e-10 : 0.2);
  EXPECT_LE(run.energy(), 5.0 * kG * (is_end_of_step() ? 1e-3 : 0.1));
}

// A body that two others, which move apart, both hold: no blow-up, and it stays midway.
TEST_P(JointsInMotion, ContradictingJointsCompromise) {
  SceneRun run(scene(body("Left", {-1, 0, 0}, "Kinematic = true", " LinearVelocity = {-0.1, 0, 0}") +
                         body("Right", {1, 0, 0}, "Kinematic = true", " LinearVelocity = {0.1, 0, 0}") +
                         body("Middle", {0, 0, 0}),
                     joint("Spherical", "L", "Left", "Middle", "BindPoint = {0, 0, 0}") +
                         joint("Spherical", "R", "Right", "Middle", "BindPoint = {0, 0, 0}"),
                     0.01, 2),
               solver());
  while (!run.is_done()) {
    run.step();
    const SceneRun::Motion middle = run.body("Middle");
    ASSERT_LE(middle.pose.position.norm(), 1e-9);
    ASSERT_LE(middle.twist.linear.norm(), 1e-9);
  }
}

// A wall of n x n bricks between the world and what goes away from it: each row of joints opens alike, those at the ends, which
// one side alone gives way to, half as far. Beyond n = 10 a step met its deadline of 2 s no more.
TEST_P(JointsInMotion, AWallThatIsPulledApartOpensAlike) {
  const int count = is_end_of_step() ? 12 : 3;
  std::string bodies =
      body("Puller", {0, static_cast<double>(count), 0}, "Kinematic = true", " LinearVelocity = {0, 0.1, 0}");
  std::string joints;
  const auto brick = [](int i, int j) { return "B" + std::to_string(i) + "_" + std::to_string(j); };
  const auto join = [&](const std::string& one, const std::string& two, const Vector3& at) {
    joints += joint("Rigid", one + "-" + two, one, two, "BindPoint = " + literal(at));
  };
  for (int i = 0; i < count; ++i)
    for (int j = 0; j < count; ++j) {
      bodies += body(brick(i, j), {static_cast<double>(i), static_cast<double>(j), 0});
      join(j > 0 ? brick(i, j - 1) : "", brick(i, j), {i + 0.0, j - 0.5, 0});
      if (i > 0) join(brick(i - 1, j), brick(i, j), {i - 0.5, j + 0.0, 0});
      if (j == count - 1) join(brick(i, j), "Puller", {i + 0.0, j + 0.5, 0});
    }
  SceneRun run(scene(bodies, joints, 0.01, 0.05), solver());
  run.to_end();
  const double opened = 0.1 * run.time();
  for (int i = 0; i < count; ++i)
    for (int j = 0; j < count; ++j)
      EXPECT_NEAR(run.body(brick(i, j)).pose.position.y() - j, opened * (j + 0.5) / count, 1e-6) << i << ' ' << j;
}

// A cone without an Axis is about the way from its point to the body.
TEST(ConeWithoutAnAxis, IsAboutTheWayToTheBody) {
  std::vector<Vector3> ends;
  for (const std::string axis : {"Axis = {3, 0, -4}", ""}) {
    SceneRun run(R"(
Simulator { CustomProperties { TimeStep = 0.01 Duration = 1 } }
Environment {
  Space { Bodies { Body { Id = "B" Mass = 1 PrincipalMoments = {0.1, 0.1, 0.1}
    KineticProperties { Position = {0.6, 1, -0.8} AngularVelocity = {2, 3, 1} } } } }
  Constraints { Constraint { Type = "Spherical" Id = "J" Body2 = "B" CustomProperties {
    BindPoint = {0, 1, 0} ReachConeAngle = 0.3 TwistLower = -0.1 TwistUpper = 0.2 )" +
                 axis + " } } } }");
    run.to_end();
    ends.push_back(run.body("B").pose.position);
  }
  EXPECT_LE((ends[1] - ends[0]).norm(), 1e-12);
  EXPECT_LE(std::acos(Vector3(0.6, 0, -0.8).dot(ends[0] - Vector3(0, 1, 0))), 0.3 + 1e-6);
}

}  // namespace
}  // namespace gravitas
