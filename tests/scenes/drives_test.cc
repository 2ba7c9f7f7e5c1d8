// Drives of hinges and wheels: the time that they take, what bounds them, what they hold and how they brake, in closed form.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <string>
#include <tuple>
#include <utility>
#include <vector>

#include "plugin_sdk/math/rotation.h"
#include "tests/scenes/scene_run.h"

namespace gravitas {
namespace {

using harness::literal;
using harness::SceneRun;

constexpr double kInertia = 0.2;  // kg m^2, of a disc about its axis

// A disc of 2 kg about z, on the world or on a free frame of three times its moment.
std::string driven_disc(const std::string& joint, const std::string& body1 = "", const std::string& more = "") {
  return "Forces { Force { Type = \"Gravity\" Id = \"Down\" CustomProperties { Acceleration = {0, -9.81, 0} } } }\n"
         "Simulator { CustomProperties { TimeStep = 0.01 Duration = 1 SleepEnergy = 0 } }\n"
         "Environment { Space { Bodies {\n"
         "Body { Id = \"Frame\" Mass = 5 PrincipalMoments = {1, 1, 0.6} }\n"
         "Body { Id = \"Disc\" Mass = 2 PrincipalMoments = {0.1, 0.1, 0.2} " +
         more + " } } }\nConstraints { Constraint { Id = \"J\" Body1 = \"" + body1 + "\" Body2 = \"Disc\" " + joint +
         " } } }\n";
}

std::string hinge(const std::string& more) {
  return "Type = \"Revolute\" CustomProperties { BindAxisPoint1 = {0, 0, 0} BindAxisPoint2 = {0, 0, 1} " + more + " }";
}
std::string wheel(const std::string& more) {
  return "Type = \"Axle\" CustomProperties { BindPoint = {0, 0, 0} SteeringAxis = {0, 1, 0} RollingAxis = {0, 0, 1} " +
         more + " }";
}

Quaternion turned_back(double angle) { return harness::turned(Vector3::UnitX(), -angle); }

struct DriveCase {
  const char *solver, *simulator;
};

class Drives : public ::testing::TestWithParam<DriveCase> {
 protected:
  std::vector<std::string> with(std::vector<std::string> more = {}) const {
    more.push_back(std::string("Solver=") + GetParam().solver);
    more.push_back(std::string("Simulator=") + GetParam().simulator);
    if (is_smooth()) more.emplace_back("Integrator=RK4");
    return more;
  }
  bool is_smooth() const { return std::string(GetParam().simulator) == "Smooth"; }
  static double turn_of(const SceneRun& run) { return run.body("Disc").twist.angular.z(); }
};

INSTANTIATE_TEST_SUITE_P(Each, Drives,
                         ::testing::Values(DriveCase{"Sequential", "Basic"}, DriveCase{"Newton", "Basic"},
                                           DriveCase{"Direct", "Basic"}, DriveCase{"Newton", "Continuous"},
                                           DriveCase{"Direct", "Smooth"}),
                         [](const auto& which) { return std::string(which.param.solver) + which.param.simulator; });

// w = T t / I, up to the speed, which is reached at I w / T.
TEST_P(Drives, TakeTheirTime) {
  for (const double speed : {5.0, -5.0})
    for (const std::string& joint :
         {hinge("AngularSpeed = " + literal(speed) + " MaximumTorque = 2"),
          wheel("SteeringLowerLimit = 0 SteeringUpperLimit = 0 AngularSpeed = " + literal(speed) +
                " MaximumTorque = 2"),
          wheel("SteeringStiffness = 1000 SteeringDamping = 10 AngularSpeed = " + literal(speed) +
                " MaximumTorque = 2")}) {
      SceneRun run(driven_disc(joint), with());
      while (!run.is_done()) {
        run.step();
        const double w = std::min(5.0, 2.0 / kInertia * run.time());
        ASSERT_NEAR(turn_of(run), std::copysign(w, speed), 1e-9) << joint << " at " << run.time();
      }
      ASSERT_EQ(run.report().drives_size(), 1);
      EXPECT_EQ(run.report().drives(0).target(), speed);
      EXPECT_NEAR(run.report().drives(0).speed(), speed, 1e-9);
      EXPECT_LE(run.body("Disc").pose.position.norm(), 1e-12);
    }
}

// Absent, a drive is none: its joint turns freely, and no report tells it.
TEST_P(Drives, AreNoneWhereAbsent) {
  for (const std::string& joint : {hinge(""), wheel("SteeringLowerLimit = 0 SteeringUpperLimit = 0")}) {
    SceneRun run(driven_disc(joint, "", "KineticProperties { AngularVelocity = {0, 0, 3} }"), with());
    run.to_end();
    EXPECT_NEAR(turn_of(run), 3.0, 1e-9) << joint;
    EXPECT_EQ(run.report().drives_size(), 0) << joint;
  }
}

// Without a bound it is there in a step, and each body turns in the measure of the other.
TEST_P(Drives, WithoutABoundReachTheirSpeedInAStep) {
  for (const std::string& joint : {hinge("AngularSpeed = 2"), wheel("AngularSpeed = 2")}) {
    SceneRun run(driven_disc(joint, "Frame"), with());
    for (int i = 0; i < 20; ++i) {
      run.step();
      ASSERT_NEAR(turn_of(run), 2.0 * 0.6 / 0.8, 1e-9) << joint << " at " << run.time();
      ASSERT_NEAR(run.body("Frame").twist.angular.z(), -2.0 * 0.2 / 0.8, 1e-9) << joint << " at " << run.time();
    }
  }
}

// A brake: speed nought. It takes T t / I off, and then holds what is not more than its torque.
TEST_P(Drives, OfSpeedNoughtAreBrakes) {
  for (const std::string& joint :
       {hinge("AngularSpeed = 0 MaximumTorque = 2"),
        wheel("SteeringLowerLimit = 0 SteeringUpperLimit = 0 AngularSpeed = 0 MaximumTorque = 2")}) {
    SceneRun run(driven_disc(joint, "", "KineticProperties { AngularVelocity = {0, 0, 6} }"), with());
    while (!run.is_done()) {
      run.step();
      ASSERT_NEAR(turn_of(run), std::max(0.0, 6.0 - 2.0 / kInertia * run.time()), 1e-9)
          << joint << " at " << run.time();
    }
  }
}

// An arm of 2 kg, 0.5 m from its hinge, weighs 9.81 N m: a brake of 10 N m holds it where it is, one of 9 N m lets it sink as if
// it weighed that much less.
TEST_P(Drives, HoldUpToTheirTorque) {
  const double weight = 2.0 * kG * 0.5, inertia = kInertia + 2.0 * 0.25;
  for (const double torque : {10.0, 9.0}) {
    SceneRun run(driven_disc(hinge("AngularSpeed = 0 MaximumTorque = " + literal(torque)), "",
                             "Forces = {\"Down\"} KineticProperties { Position = {0.5, 0, 0} }"),
                 with({"Simulator.TimeStep=0.001", "Simulator.Duration=0.05"}));
    run.to_end();
    const double sinks = std::max(0.0, (weight - torque) / inertia * 0.05);
    // the arm turns by 2 mrad, and its weight's lever is that much shorter at most
    EXPECT_NEAR(turn_of(run), -sinks, torque > weight ? 1e-9 : 1e-5 * weight) << torque;
  }
}

// To the stop of its own joint, bounded or not, against gravity, and away from there. Two joints had to say it before.
TEST_P(Drives, OfAHingeStallAtItsLimit) {
  for (const std::string& bound : {"", " MaximumTorque = 30"})
    for (const auto& [limits, speed, angle] : {std::tuple{"LowerLimit = -0.4 UpperLimit = 0.503", 1.0, 0.503},
                                               std::tuple{"LowerLimit = -0.503 UpperLimit = 0.4", -1.0, -0.503},
                                               std::tuple{"LowerLimit = 0 UpperLimit = 0.503", -1.0, 0.0}}) {
      const auto end_of = [&](const std::string& all) {
        SceneRun run(
            driven_disc(hinge(all + bound), "", "Forces = {\"Down\"} KineticProperties { Position = {0.5, 0, 0} }"),
            with());
        run.to_end();
        return run.body("Disc");
      };
      const SceneRun::Motion stalled = end_of(std::string(limits) + " AngularSpeed = " + literal(speed));
      EXPECT_NEAR(std::atan2(stalled.pose.position.y(), stalled.pose.position.x()), angle, 1e-6) << limits << bound;
      EXPECT_NEAR(stalled.twist.angular.z(), 0.0, 1e-6) << limits << bound;
    }
  SceneRun leaves(driven_disc(hinge("UpperLimit = 0 AngularSpeed = -1")), with());
  leaves.to_end();
  EXPECT_NEAR(turn_of(leaves), -1.0, 1e-9);
}

// A universal joint, too, whose drives turn about its bars: each stalls at its own stop, within what it turns by in a step and not
// beyond, and the bar that nothing drives stays where it is if the other is square to it. That must not hang on the last bit of
// their angle: 1e-3 off, bars are alike.
TEST_P(Drives, OfAUniversalStallAtTheirStops) {
  constexpr double kStop = 0.6, kSpeed = 1.0, kStill = 1e-6;
  // m: a tenth of the open joints that are warned of, 1 % of 0.3 m; Sequential leaves some as both drives meet their stops
  constexpr double kOpen = 3e-4;
  for (const double step : {1.0 / 20.0, 1.0 / 60.0, 1.0 / 240.0})
    for (const double off : {0.0, 1e-3})
      for (const char* force : {"", "\"Down\""})
        for (const auto& [sign1, sign2] : {std::pair{1.0, 0.0}, {-1.0, 0.0}, {0.0, 1.0}, {0.0, -1.0}, {1.0, -1.0}}) {
          const Vector3 axis2(off, 0.0, 1.0);
          const auto driven = [&](double sign, const std::string& which) {
            if (sign == 0.0) return std::string();
            return "AngularSpeed" + which + " = " + literal(sign * kSpeed) +
                   (sign > 0.0 ? " UpperLimit" : " LowerLimit") + which + " = " + literal(sign * kStop) + " ";
          };
          SceneRun run(
              "Forces { Force { Type = \"Gravity\" Id = \"Down\" CustomProperties { Acceleration = {0, -9.81, 0} "
              "} } }\nSimulator { CustomProperties { TimeStep = " +
                  literal(step) +
                  " Duration = 1.5 SleepEnergy = 0 } }\nEnvironment { Space { Bodies { Body { Id = \"Arm\" Mass "
                  "= 1 PrincipalMoments = {0.02, 0.03, 0.01} KineticProperties { Position = {0, -0.3, 0} } "
                  "Forces = { " +
                  std::string(force) +
                  " } } } }\nConstraints { Constraint { Id = \"J\" Body2 = \"Arm\" Type = \"Universal\" "
                  "CustomProperties { BindPoint = {0, 0, 0} Axis1 = {1, 0, 0} Axis2 = " +
                  literal(axis2) + " " + driven(sign1, "1") + driven(sign2, "2") + "} } } }\n",
              with());
          const Quaternion start = run.body("Arm").pose.orientation;
          run.to_end();
          const std::string which =
              literal(step) + " s, " + literal(off) + " off, " + literal(sign1) + ", " + literal(sign2) + " " + force;
          // turned by angle 1 about Axis1 after angle 2 about Axis2
          const Quaternion turned = run.body("Arm").pose.orientation * start.conjugate();
          const Vector3 bar = turned * axis2;
          const double angle1 = std::atan2(-bar.y(), bar.z());
          const Quaternion rest = turned_back(angle1) * turned;
          const double angle2 = 2.0 * std::atan2(rest.vec().dot(axis2.normalized()), rest.w());
          for (const auto& [angle, sign] : {std::pair{angle1, sign1}, {angle2, sign2}}) {
            if (sign != 0.0) {
              EXPECT_LE(sign * angle, kStop + kStill) << which;
              EXPECT_GE(sign * angle, kStop - kSpeed * step) << which;
            } else {
              EXPECT_NEAR(angle, 0.0, off == 0.0 ? 1e-9 : 2.0 * off) << which;
            }
          }
          if (off == 0.0) EXPECT_LE(run.body("Arm").twist.angular.norm(), kStill) << which;
          EXPECT_LE(run.report().max_joint_error(), kOpen) << which;
        }
}

// Beside a spring it holds where k (angle - rest) is its torque.
TEST_P(Drives, OfAHingePressAgainstItsSpring) {
  SceneRun run(driven_disc(hinge("Stiffness = 8 Damping = 2.53 AngularSpeed = 100 MaximumTorque = 4")),
               with({"Simulator.Duration=5"}));
  run.to_end();
  const Quaternion q = run.body("Disc").pose.orientation;
  // with Smooth the spring is in the derivative and a bounded drive at the end of the step, which moves by half of what it does there,
  // so that the damper sees the other half: c h T/(2 I k)
  const double first_order = is_smooth() ? 2.53 * 0.01 * 4.0 / (2.0 * kInertia * 8.0) : 0.0;
  EXPECT_NEAR(2.0 * std::atan2(q.z(), q.w()), 0.5, 1.05 * first_order + 1e-6);
}

// A wheel that is steered is driven about the axis to which it is steered, which stays where it is; a motor in its hub turns
// nothing about the steering axis, though the axes are not across each other.
TEST_P(Drives, OfASteeredWheelKeepItsAxis) {
  const std::string steering = "SteeringStiffness = 1e4 SteeringDamping = 100 ";
  for (const double angle : {0.0, 0.3, -0.6})
    for (const Vector3& rolling : {Vector3(0, 0, 1), Vector3(0, 0.6, 0.8)}) {
      SceneRun run(
          "Simulator { CustomProperties { TimeStep = 0.002 Duration = 1 SleepEnergy = 0 } }\n"
          "Environment { Space { Bodies { Body { Id = \"Disc\" Mass = 2 PrincipalMoments = {0.2, 0.2, 0.2} } "
          "} }\nConstraints { Constraint { Id = \"J\" Body2 = \"Disc\" Type = \"Axle\" CustomProperties { "
          "BindPoint = {0, 0, 0} SteeringAxis = {0, 1, 0} RollingAxis = " +
              literal(rolling) + " SteeringAngle = " + literal(angle) + " " + steering +
              "AngularSpeed = 5 MaximumTorque = 2 } } } }\n",
          with());
      // I w/T = 0.5 s, and 20 times c/k
      run.steps(350);
      const Quaternion before = run.body("Disc").pose.orientation;
      run.to_end();
      const Vector3 axis = run.body("Disc").pose.orientation * rolling, then = before * rolling;
      EXPECT_NEAR((axis - then).norm(), 0.0, 1e-5) << angle << literal(rolling);
      const Vector3 wanted = Vector3(rolling.z() * std::sin(angle), rolling.y(), rolling.z() * std::cos(angle));
      EXPECT_NEAR((axis - wanted).norm(), 0.0, 1e-4) << angle << literal(rolling);
      EXPECT_NEAR(run.body("Disc").twist.angular.norm(), 5.0, 1e-5) << angle << literal(rolling);
      EXPECT_NEAR(run.report().drives(0).speed(), 5.0, 1e-5) << angle << literal(rolling);
    }
}

// Limits, the spring's angle and what is told are the same angle, whatever the axes make with each other.
TEST_P(Drives, OfASteeredWheelPressOnItsLimits) {
  for (const double limit : {0.3, -0.6})
    for (const Vector3& rolling : {Vector3(0, 0, 1), Vector3(0, 0.6, 0.8)}) {
      SceneRun run("Forces { Force { Type = \"Basic\" Id = \"Turn\" CustomProperties { Torque = {0, " +
                       literal(limit > 0.0 ? 1.0 : -1.0) +
                       ", 0} } } }\nSimulator { CustomProperties { TimeStep = 0.002 Duration = 2 SleepEnergy = 0 } }\n"
                       "Environment { Space { Bodies { Body { Id = \"Disc\" Mass = 2 PrincipalMoments = {0.2, 0.2, "
                       "0.2} Forces = "
                       "{ \"Turn\" } } } }\nConstraints { Constraint { Id = \"J\" Body2 = \"Disc\" Type = \"Axle\" "
                       "CustomProperties { BindPoint = {0, 0, 0} SteeringAxis = {0, 1, 0} RollingAxis = " +
                       literal(rolling) + " SteeringLowerLimit = -0.6 SteeringUpperLimit = 0.3 } } } }\n",
                   with());
      run.to_end();
      const Vector3 axis = run.body("Disc").pose.orientation * rolling;
      EXPECT_NEAR(std::atan2(axis.x(), axis.z()), limit, 1e-6) << literal(rolling);
    }
}

// Free to steer, with its axes at 53 degrees: a motor in the hub gives the wheel no spin about the steering axis. A torque about
// the rolling axis alone would.
TEST_P(Drives, OfAWheelSteerNothing) {
  SceneRun run(
      "Simulator { CustomProperties { TimeStep = 0.001 Duration = 0.1 SleepEnergy = 0 } }\n"
      "Environment { Space { Bodies { Body { Id = \"Disc\" Mass = 2 PrincipalMoments = {0.2, 0.2, 0.2} } } }\n"
      "Constraints { Constraint { Id = \"J\" Body2 = \"Disc\" Type = \"Axle\" CustomProperties { BindPoint = "
      "{0, 0, 0} SteeringAxis = {0, 1, 0} RollingAxis = {0, 0.6, 0.8} AngularSpeed = 100 MaximumTorque = 2 } "
      "} } }\n",
      with());
  run.to_end();
  // L = I w has no part along the steering axis, and T d = T r' / 0.8 turns it
  // rows are those of S*: of first order in the turn of a step, a thousandth of a radian
  EXPECT_NEAR(run.body("Disc").twist.angular.y(), 0.0, 1e-4);
  EXPECT_NEAR(run.body("Disc").twist.angular.norm(), 2.0 / 0.8 / 0.2 * 0.1, 1e-3);
}

// A car of 1000 kg on four wheels of 20 kg, each sprung, steered stiffly and driven alike; it begins unsprung.
class DrivenCar : public ::testing::TestWithParam<const char*> {
 protected:
  static constexpr double kBody = 1000.0, kWheel = 20.0, kRadius = 0.3, kSpring = 50000.0;
  static constexpr double kSag = kBody * kG / (4.0 * kSpring);
  // what moves with the car, as wheels that roll turn as well
  static constexpr double kRolling = kBody + 4.0 * kWheel * (1.0 + 0.4);

  static SceneRun car(const std::string& drive, double speed, double friction) {
    const std::string moving = " LinearVelocity = " + literal(Vector3(speed, 0, 0));
    std::string bodies =
        "Body { Id = \"Road\" GeometryId = \"Flat\" Material = \"M\" }\n"
        "Body { Id = \"Rail\" Mass = 1 PrincipalMoments = {1, 1, 1} KineticProperties { Position = {0, 2, 0}" +
        moving +
        " } }\n"
        "Body { Id = \"Car\" Mass = 999 PrincipalMoments = {100, 800, 800} Forces = {\"Down\"} KineticProperties { "
        "Position = {0, 0.6, 0}" +
        moving + " } }\n";
    std::string joints =
        "Constraint { Type = \"Slider\" Id = \"Straight\" Body2 = \"Rail\" CustomProperties { BindPoint = {0, 2, 0} "
        "Axis "
        "= {1, 0, 0} } }\nConstraint { Type = \"Slider\" Id = \"Upright\" Body1 = \"Rail\" Body2 = \"Car\" "
        "CustomProperties { BindPoint = {0, 0.6, 0} Axis = {0, 1, 0} } }\n";
    for (int i = 0; i < 4; ++i) {
      const Vector3 at(i < 2 ? 1.2 : -1.2, kRadius, i % 2 == 0 ? 0.7 : -0.7);
      const std::string id = "W" + std::to_string(i);
      bodies +=
          "Body { Id = \"" + id +
          "\" GeometryId = \"Tyre\" Material = \"M\" Mass = 20 Forces = {\"Down\"} KineticProperties { Position = " +
          literal(at) + moving + " AngularVelocity = " + literal(Vector3(0, 0, -speed / kRadius)) + " } }\n";
      joints += "Constraint { Type = \"Axle\" Id = \"A" + std::to_string(i) + "\" Body1 = \"Car\" Body2 = \"" + id +
                "\" CustomProperties { BindPoint = " + literal(at) +
                " SteeringAxis = {0, 1, 0} RollingAxis = {0, 0, 1} SuspensionStiffness = 50000 SuspensionDamping = "
                "10000 SteeringStiffness = 1e6 SteeringDamping = 1e4 " +
                drive + " } }\n";
    }
    return SceneRun(
        "Geometries { Geometry { Type = \"Halfspace\" Id = \"Flat\" }\n"
        "Geometry { Type = \"Sphere\" Id = \"Tyre\" CustomProperties { Radius = 0.3 } } }\n"
        "Materials { Material { Id = \"M\" StaticFrictionCoefficient = " +
            literal(friction) +
            " } }\nForces { Force { Type = \"Gravity\" Id = \"Down\" CustomProperties { Acceleration = {0, "
            "-9.81, 0} } } }\nSimulator { CustomProperties { TimeStep = 0.005 Duration = 4 SleepEnergy = 0 "
            "} }\nEnvironment { CollisionFilter { DefaultAllow = false Rules { Rule { Allow = true Body = "
            "\"Road\" } } }\nSpace { Bodies {\n" +
            bodies + "} }\nConstraints {\n" + joints + "} }\n",
        {"Solver=" + std::string(GetParam())});
  }
};

INSTANTIATE_TEST_SUITE_P(Each, DrivenCar, ::testing::Values("Sequential", "Newton", "Direct"),
                         [](const auto& which) { return std::string(which.param); });

// Below the slip limit a = 4 T / (r m), m with what turns; the chassis stays as high as its springs let it.
TEST_P(DrivenCar, GainsWhatItsTorqueGives) {
  for (const double torque : {200.0, -200.0}) {
    SceneRun run = car("AngularSpeed = " + literal(torque > 0.0 ? -1000.0 : 1000.0) + " MaximumTorque = 200", 0.0, 1.0);
    run.steps(400);
    const double before = run.body("Car").twist.linear.x();
    run.to_end();
    EXPECT_NEAR(run.body("Car").twist.linear.x() - before, 2.0 * 4.0 * torque / kRadius / kRolling, 2e-2) << torque;
    EXPECT_NEAR(run.body("Car").pose.position.y(), 0.6 - kSag, 1e-4) << torque;
    EXPECT_EQ(run.report().drives_size(), 4);
  }
}

// A brake that can hold its wheel locks it: the car stops after v^2/(2 mu g), at the height that its springs give it. One of 50 N m
// does not lock it.
TEST_P(DrivenCar, BrakesAsItsTyresLetIt) {
  constexpr double kMu = 0.5, kSpeed = 10.0;
  SceneRun locked = car("AngularSpeed = 0 MaximumTorque = 2000", kSpeed, kMu);
  double height = 0.0;
  bool is_still = false;
  while (!locked.is_done()) {
    locked.step();
    if (locked.time() > 1.5) height = std::max(height, std::fabs(locked.body("Car").pose.position.y() - 0.6 + kSag));
    is_still = locked.body("Car").twist.linear.x() < 1e-6;
    if (locked.time() > 0.2 && !is_still) {
      ASSERT_LE(locked.body("W0").twist.angular.norm(), 1e-4) << "at " << locked.time();
    }
  }
  EXPECT_TRUE(is_still);
  // until the springs have settled, in some tenths of a second, the tyres bear more or less than the weight
  EXPECT_NEAR(locked.body("Car").pose.position.x(), kSpeed * kSpeed / (2.0 * kMu * kG), 0.1);
  EXPECT_LE(height, 1e-4);

  SceneRun rolling = car("AngularSpeed = 0 MaximumTorque = 50", kSpeed, kMu);
  rolling.steps(400);
  EXPECT_NEAR(rolling.body("Car").twist.linear.x(), kSpeed - 4.0 * 50.0 / kRadius / kRolling * 2.0, 1e-2);
  EXPECT_NEAR(rolling.body("W0").twist.angular.z(), -rolling.body("Car").twist.linear.x() / kRadius, 1e-2);
}

// What turns at its drive's speed from the start goes on turning in the first step, too, whatever its axis.
TEST(Drive, GoesOnFromTheStart) {
  for (int i = 1; i <= 100; ++i) {
    const Vector3 axis = Vector3(std::sin(i), std::cos(2.3 * i), std::sin(1.7 * i + 1.0)).normalized();
    const Vector3 arm(std::cos(1.1 * i), std::sin(0.7 * i), std::cos(0.3 * i));
    const double speed = 0.2 + std::fabs(std::sin(3.1 * i));
    const Vector3 spin = speed * axis;
    for (const std::string solver : {"Newton", "Direct"}) {
      SceneRun run(driven_disc("Type = \"Revolute\" CustomProperties { BindAxisPoint1 = {0, 0, 0} BindAxisPoint2 = " +
                                   literal(axis) + " AngularSpeed = " + literal(speed) + " }",
                               "",
                               "Forces = {\"Down\"} KineticProperties { Position = " + literal(arm) +
                                   " Orientation = " + literal(exp_rotation(Vector3(0.3 * i, 0.1 * i, -0.7))) +
                                   " LinearVelocity = " + literal(Vector3(spin.cross(arm))) +
                                   " AngularVelocity = " + literal(spin) + " }"),
                   {"Simulator=Smooth", "Integrator=RK4", "Solver=" + solver});
      run.steps(2);
      const Vector3 expected = exp_rotation(0.02 * spin) * arm;
      EXPECT_LT((run.body("Disc").pose.position - expected).norm(), 1e-9) << i << ' ' << solver;
    }
  }
}

}  // namespace
}  // namespace gravitas
