// Drives without bound that something is in the way of, and joined bodies that touch: what holds, holds, and nothing runs away.
#include <gtest/gtest.h>

#include <cmath>
#include <numbers>
#include <string>
#include <vector>

#include "tests/scenes/scene_run.h"

namespace gravitas {
namespace {

using harness::SceneRun;
using harness::set;

class Jams : public ::testing::TestWithParam<const char*> {
 protected:
  // Arms and diagonals of a square of 1 m, blocks of 0.4 m, and a ground.
  static std::string scene(const std::string& bodies, const std::string& constraints, const std::string& more = "") {
    return "Geometries {\n"
           "Geometry { Type = \"Box\" Id = \"Arm\" CustomProperties { HalfExtents = {0.5, 0.05, 0.05} } }\n"
           "Geometry { Type = \"Box\" Id = \"Diagonal\" CustomProperties { HalfExtents = {0.70710678118654752, 0.05, "
           "0.05} } }\n"
           "Geometry { Type = \"Box\" Id = \"Block\" CustomProperties { HalfExtents = {0.2, 0.2, 0.2} } }\n"
           "Geometry { Type = \"Box\" Id = \"Chassis\" CustomProperties { HalfExtents = {1.5, 0.3, 0.6} } }\n"
           "Geometry { Type = \"Sphere\" Id = \"Wheel\" CustomProperties { Radius = 0.35 } }\n"
           "Geometry { Type = \"Halfspace\" Id = \"Flat\" }\n}\n"
           "Materials { Material { Id = \"Rubber\" StaticFrictionCoefficient = 0.8 } }\n"
           "Forces { Force { Type = \"Gravity\" Id = \"Down\" CustomProperties { Acceleration = {0, -9.81, 0} } } }\n"
           "Simulator { CustomProperties { TimeStep = 0.01 Duration = 2 } }\n"
           "Environment { " +
           more + " Space { Bodies {\n" + bodies + "} } Constraints {\n" + constraints + "} }\n";
  }

  static std::string body(const std::string& id, const std::string& geometry, const std::string& at,
                          double degrees = 0.0, const std::string& more = "") {
    const double half = degrees * std::numbers::pi / 360.0;
    return "Body { Id = \"" + id + "\" GeometryId = \"" + geometry + "\" " + more +
           " KineticProperties { Position = " + at + " Orientation = " + "{" + harness::literal(std::cos(half)) +
           ", 0, 0, " + harness::literal(std::sin(half)) + "} } }\n";
  }

  static std::string about_z(const std::string& type, const std::string& id, const std::string& body1,
                             const std::string& body2, const std::string& at, const std::string& more) {
    return "Constraint { Type = \"" + type + "\" Id = \"" + id + "\" Body1 = \"" + body1 + "\" Body2 = \"" + body2 +
           "\" CustomProperties { BindAxisPoint1 = {" + at + ", 0} BindAxisPoint2 = {" + at + ", 1} " + more + " } }\n";
  }

  static inline const std::string kFalls = "Forces = { \"Down\" }", kFixed = "Immovable = true",
                                  kNothingTouches = "CollisionFilter { DefaultAllow = false }";

  SceneRun run(const std::string& text, double time_step) const {
    return SceneRun(text,
                    {set("Solver", std::string(GetParam())), set("Simulator.TimeStep", harness::literal(time_step))});
  }
  static constexpr double kSteps[] = {1.0 / 60, 1.0 / 240, 1.0 / 1000};

  bool is_end_of_step() const { return std::string(GetParam()) != "Sequential"; }
  // Of a joint's points: Sequential closes them where S* has them, to the square of the step's turn.
  double open(double turn) const { return is_end_of_step() ? 1e-12 : 2.0 * turn * turn; }
};

INSTANTIATE_TEST_SUITE_P(Each, Jams, ::testing::Values("Sequential", "Newton", "Direct"),
                         [](const auto& which) { return std::string(which.param); });

// A motor presses an arm against a block: the block's lower edge (0.7, 0.6) is 0.05 m from the arm's middle line, so that it
// rests at asin(0.6/r) - asin(0.05/r) from the horizontal, r = sqrt(0.85). With a bound on its torque the wall pushes back in
// positions, too.
TEST_P(Jams, AMotorStallsAtAWall) {
  const double r = std::sqrt(0.85), angle = std::asin(0.6 / r) - std::asin(0.05 / r);
  for (const std::string bound : {"", " MaximumTorque = 1000"}) {
    for (const double h : kSteps) {
      SceneRun scene_run = run(scene(body("A", "Arm", "{0.5, 0, 0}") + body("W", "Block", "{0.5, 0.8, 0}", 0, kFixed),
                                     about_z("AngularMotor", "M", "", "A", "0, 0", "AngularSpeed = 1" + bound)),
                               h);
      scene_run.to_end();
      const SceneRun::Motion arm = scene_run.body("A");
      EXPECT_NEAR(std::atan2(arm.pose.position.y(), arm.pose.position.x()), angle, is_end_of_step() ? 1e-9 : 1e-3)
          << h << bound;
      EXPECT_LE(arm.twist.angular.norm(), 1e-9) << h << bound;
      EXPECT_LE(scene_run.report().max_joint_error(), open(h)) << h << bound;
    }
  }
}

// With its own weight on it, and against the ground, which pushes back through a body of its own.
TEST_P(Jams, AMotorStallsOnTheGround) {
  for (const double h : kSteps) {
    SceneRun scene_run =
        run(scene(body("A", "Arm", "{0.5, 0.5, 0}", 0, kFalls) + body("F", "Flat", "{0, 0, 0}", 0, kFixed),
                  about_z("AngularMotor", "M", "", "A", "0, 0.5", "AngularSpeed = -1")),
            h);
    scene_run.to_end();
    const SceneRun::Motion arm = scene_run.body("A");
    EXPECT_NEAR(arm.pose.orientation.z(),
                -std::sin(0.5 * (std::asin(0.5 / std::sqrt(1.0025)) - std::asin(0.05 / std::sqrt(1.0025)))),
                is_end_of_step() ? 1e-9 : 1e-3)
        << h;
    EXPECT_LE(arm.twist.angular.norm(), 1e-9) << h;
    EXPECT_LE(scene_run.report().max_joint_error(), open(h)) << h;
  }
}

// Two rods and the ground make a triangle, which nothing turns: it stands, the motor stalls, and that is a contradiction.
TEST_P(Jams, AMotorCannotTurnATriangle) {
  for (const double h : kSteps) {
    SceneRun scene_run =
        run(scene(body("A", "Arm", "{0.5, 0, 0}", 0, kFalls) + body("B", "Diagonal", "{0.5, 0.5, 0}", 135, kFalls),
                  about_z("AngularMotor", "M", "", "A", "0, 0", "AngularSpeed = 1") +
                      about_z("Revolute", "H1", "A", "B", "1, 0", "") + about_z("Revolute", "H2", "", "B", "0, 1", ""),
                  kNothingTouches),
            h);
    scene_run.to_end();
    for (const char* id : {"A", "B"}) {
      EXPECT_LE(scene_run.body(id).twist.linear.norm(), 1e-9) << h;
      EXPECT_LE(scene_run.body(id).twist.angular.norm(), 1e-9) << h;
    }
    EXPECT_LE(scene_run.report().max_joint_error(), 1e-12) << h;
  }
}

// A motor on one crank of a parallelogram runs into the limit of the other, half a radian on.
TEST_P(Jams, AMotorStallsAtALimitBehindOtherBodies) {
  for (const double h : kSteps) {
    SceneRun scene_run = run(
        scene(body("A", "Arm", "{0, 0.5, 0}", 90, kFalls) + body("C", "Arm", "{0.5, 1, 0}", 0, kFalls) +
                  body("B", "Arm", "{1, 0.5, 0}", 90, kFalls),
              about_z("AngularMotor", "M", "", "A", "0, 0", "AngularSpeed = -1") +
                  about_z("Revolute", "H1", "A", "C", "0, 1", "") + about_z("Revolute", "H2", "C", "B", "1, 1", "") +
                  about_z("Revolute", "H3", "", "B", "1, 0", "LowerLimit = -0.5 UpperLimit = 0.5"),
              kNothingTouches),
        h);
    scene_run.to_end();
    const Vector3 crank = scene_run.body("A").pose.position;
    EXPECT_NEAR(std::atan2(crank.x(), crank.y()), 0.5, is_end_of_step() ? 1e-9 : 1e-4) << h;
    EXPECT_LE(scene_run.body("A").twist.angular.norm(), 1e-6) << h;
    EXPECT_LE(scene_run.report().max_joint_error(), open(h)) << h;
  }
}

// A motor presses a block against a wall, and both stay.
TEST_P(Jams, AMotorSqueezesABlock) {
  SceneRun scene_run = run(scene(body("A", "Arm", "{0.5, 0, 0}") + body("W", "Block", "{0.7, 0.7, 0}", 0, kFixed) +
                                     body("P", "Block", "{0.7, 0.299, 0}"),
                                 about_z("AngularMotor", "M", "", "A", "0, 0", "AngularSpeed = 1")),
                           1.0 / 60);
  scene_run.to_end();
  EXPECT_LE(scene_run.body("A").twist.angular.norm(), 1e-9);
  EXPECT_LE(scene_run.body("P").twist.linear.norm(), 1e-9);
  EXPECT_NEAR(scene_run.body("P").pose.position.y(), 0.3, 2e-3);
  EXPECT_LE(scene_run.report().max_joint_error(), open(1.0 / 60));
}

// A motor folds two arms until they meet: the one on a hinge of the world then stands still, as nothing else turns them.
TEST_P(Jams, AMotorFoldsTwoArmsUntilTheyMeet) {
  if (!is_end_of_step()) GTEST_SKIP() << "its contact near the hinge leaves velocities that are not there";
  for (const double h : kSteps) {
    SceneRun scene_run = run(scene(body("A", "Arm", "{0.5, 0, 0}") + body("B", "Arm", "{0.5, 0.2, 0}", 0),
                                   about_z("Revolute", "H", "", "A", "0, 0", "") +
                                       about_z("AngularMotor", "M", "A", "B", "1, 0.1", "AngularSpeed = 1")),
                             h);
    scene_run.to_end();
    EXPECT_NEAR(scene_run.body("A").twist.angular.z(), scene_run.body("B").twist.angular.z(), 1e-6) << h;
    EXPECT_LE(scene_run.report().max_joint_error(), 1e-9) << h;
  }
}

// Two boxes with a hinge in the middle of their flush faces swing from level as two that are joined rigidly.
TEST_P(Jams, FlushBoxesOnAHingeSwingAsOne) {
  const auto two = [&](const std::string& joint, const std::string& more) {
    return run(scene(body("A", "Arm", "{0.5, 0, 0}", 0, kFalls) + body("B", "Arm", "{1.5, 0, 0}", 0, kFalls),
                     about_z("Revolute", "H", "", "A", "0, 0", "") + joint, more),
               1.0 / 1000);
  };
  SceneRun hinged = two(about_z("Revolute", "M", "A", "B", "1, 0", ""), "");
  SceneRun rigid =
      two("Constraint { Type = \"Rigid\" Id = \"M\" Body1 = \"A\" Body2 = \"B\" CustomProperties { BindPoint = {1, 0, "
          "0} } }\n",
          kNothingTouches);
  while (!hinged.is_done()) {
    hinged.step(), rigid.step();
    ASSERT_LE((hinged.body("B").pose.position - rigid.body("B").pose.position).norm(), 1e-3) << hinged.time();
  }
  EXPECT_LE(hinged.report().max_joint_error(), is_end_of_step() ? 1e-12 : 1e-5);
}

// Ball wheels that touch the chassis which they are joined to, to rounding, on a slope: the contacts have nothing to say. By
// energy alone nothing is faster than g t.
TEST_P(Jams, WheelsThatTouchTheirChassisDoNotRunAway) {
  const double angle = 0.1, degrees = angle * 180.0 / std::numbers::pi;
  const Vector3 along(std::cos(angle), std::sin(angle), 0), up(-std::sin(angle), std::cos(angle), 0);
  const auto place = [&](double x, double y, double z) {
    return harness::literal(Vector3(x * along + y * up + z * Vector3::UnitZ()));
  };
  // the wheels' centres are 0.35 m from the lower edges
  const double side = 0.6 + 0.35 * std::sin(0.8), below = 0.6 + 0.35 * std::cos(0.8);
  std::string bodies = body("Floor", "Flat", "{0, 0, 0}", degrees, kFixed + " Material = \"Rubber\"") +
                       body("Chassis", "Chassis", place(0, 0.35 + below - 0.3, 0), degrees,
                            kFalls + " Material = \"Rubber\" Mass = 1000");
  std::string axles;
  for (const double z : {-side, side}) {
    const std::string id = z < 0 ? "Left" : "Right", at = place(1, 0.35, z);
    bodies += body(id, "Wheel", at, degrees, kFalls + " Material = \"Rubber\" Mass = 20");
    axles += "Constraint { Type = \"Axle\" Id = \"" + id + "Axle\" Body1 = \"Chassis\" Body2 = \"" + id +
             "\" CustomProperties { BindPoint = " + at + " SteeringAxis = " + harness::literal(up) +
             " RollingAxis = {0, 0, 1} } }\n";
  }
  for (const double h : kSteps) {
    SceneRun scene_run = run(scene(bodies, axles), h);
    while (!scene_run.is_done() && scene_run.time() < 0.25) {
      scene_run.step();
      for (const char* id : {"Chassis", "Left", "Right"})
        ASSERT_LE(scene_run.body(id).twist.linear.norm(), 9.81 * scene_run.time() + 1e-6)
            << id << " with " << h << " at " << scene_run.time();
    }
    EXPECT_LE(scene_run.report().max_joint_error(), is_end_of_step() ? 1e-12 : 1e-3) << h;
  }
}

}  // namespace
}  // namespace gravitas
