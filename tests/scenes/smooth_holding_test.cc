// Simulator Smooth, what holds in some states only: taut ropes, closed stops, bounded drives. While they hold, motion has the
// integrator's order; where they let go, or begin to hold, a step's.
#include <gtest/gtest.h>

#include <cmath>
#include <string>
#include <vector>

#include "tests/scenes/scene_run.h"

namespace gravitas {
namespace {

using harness::SceneRun;
using harness::set;

const char* const kOfHighOrder[] = {"RK4", "RKMK4", "DormandPrince54", "DormandPrince853", "Radau"};

std::string held_scene(const std::string& bodies, const std::string& joints, const std::string& forces = "") {
  return R"(
Forces { Force { Type = "Gravity" Id = "Down" CustomProperties { Acceleration = {0, -9.81, 0} } } )" +
         forces + R"( }
Simulator { Type = "Smooth" CustomProperties { TimeStep = 0.01 Duration = 1 CheckPhysicsEvery = 1 } }
Environment { Space { Bodies { )" +
         bodies + " } } CollisionFilter { DefaultAllow = false Rules { } } Constraints { " + joints + " } }";
}

std::string held_body(const std::string& kinetic, const std::string& forces = "\"Down\"") {
  return "Body { Id = \"A\" Mass = 2 PrincipalMoments = {0.1, 0.2, 0.3} Forces = {" + forces +
         "} KineticProperties { " + kinetic + " } }";
}

std::string rope(const std::string& length) {
  return "Constraint { Type = \"Distance\" Id = \"R\" Body2 = \"A\" CustomProperties { BindPoint1 = {0, 0, 0} "
         "BindPoint2 = {1, 0, 0} " +
         length + " } }";
}

TEST(SmoothHolding, ARopeThatIsTautIsARod) {
  const std::string body = held_body("Position = {1, 0, 0} LinearVelocity = {0, -1, 2}");
  for (const char* integrator : kOfHighOrder) {
    SceneRun rod(held_scene(body, rope("")), {set("Integrator", std::string(integrator))});
    SceneRun taut(held_scene(body, rope("MaximumDistance = 1")), {set("Integrator", std::string(integrator))});
    rod.to_end(), taut.to_end();
    EXPECT_LT((taut.body("A").pose.position - rod.body("A").pose.position).norm(), 1e-13) << integrator;
    EXPECT_NEAR(taut.energy(), 5.0, 1e-5) << integrator;
  }
}

// The roundings of what presses a hinge on its stop were told as joints that take all of the velocities.
TEST(SmoothHolding, AHingeThatIsPressedOnItsStopIsNothingToWarnOf) {
  for (const char* integrator : kOfHighOrder) {
    SceneRun run(
        "Forces { Force { Type = \"Basic\" Id = \"F\" CustomProperties { Torque = {0, 0, 1.279260121227908} } } }\n"
        "Simulator { Type = \"Smooth\" CustomProperties { TimeStep = 0.01 Duration = 1 } }\nEnvironment { Space { "
        "Bodies { "
        "Body { Id = \"B\" Mass = 0.3132997052381185 PrincipalMoments = {0.3132997052381185, 0.3132997052381185, "
        "0.3132997052381185} Forces = {\"F\"} } } } Constraints { Constraint { Type = \"Revolute\" Id = \"J\" Body2 = "
        "\"B\" "
        "CustomProperties { BindAxisPoint1 = {0, 0, 0} BindAxisPoint2 = {0, 0, 1} UpperLimit = 0.11827111003688934 } } "
        "} }",
        {set("Integrator", std::string(integrator))});
    run.to_end();
    EXPECT_TRUE(run.environment().warnings().empty()) << integrator;
  }
}

// v0^2 = g r (2 + 3 cos 60): the rope goes slack 60 degrees from the top, with v^2 = g r cos 60, and the rest is a throw.
TEST(SmoothHolding, ARopeGoesSlackWhereItsTensionEnds) {
  const double speed = std::sqrt(3.5 * kG);
  const std::string scene =
      held_scene(held_body("Position = {0, -1, 0} LinearVelocity = " + harness::literal(Vector3(speed, 0, 0))),
                 "Constraint { Type = \"Distance\" Id = \"R\" Body2 = \"A\" CustomProperties { "
                 "BindPoint1 = {0, 0, 0} BindPoint2 = {0, -1, 0} MaximumDistance = 1 } }");
  SceneRun run(scene, {set("Simulator.TimeStep", 0.0005)});
  while (run.body("A").pose.position.norm() > 1.0 - 1e-9) run.step();
  const Vector3 there = run.body("A").pose.position;
  // within two steps
  EXPECT_NEAR(there.y(), 0.5, 0.0005 * 2.0 * speed);
  EXPECT_NEAR(run.body("A").twist.linear.norm(), std::sqrt(0.5 * kG), 0.01);
  const Vector3 thrown = run.body("A").twist.linear;
  run.steps(100);
  const Vector3 expected = there + 0.05 * thrown - 0.5 * kG * 0.05 * 0.05 * Vector3::UnitY();
  EXPECT_LT((run.body("A").pose.position - expected).norm(), 1e-10);
}

// Bounded by more than it takes, a drive is one without bound: a crank that gravity speeds up and slows down.
TEST(SmoothHolding, ABoundThatIsNotReachedChangesNothing) {
  const auto crank = [](const std::string& bound) {
    return held_scene(held_body("Position = {0.5, 0, 0} LinearVelocity = {0, 1.5, 0} AngularVelocity = {0, 0, 3}"),
                      "Constraint { Type = \"AngularMotor\" Id = \"M\" Body2 = \"A\" CustomProperties { "
                      "BindAxisPoint1 = {0, 0, 0} BindAxisPoint2 = {0, 0, 1} AngularSpeed = 3 " +
                          bound + " } }");
  };
  for (const char* integrator : kOfHighOrder) {
    SceneRun run(crank("MaximumTorque = 20"), {set("Integrator", std::string(integrator))});
    run.to_end();
    EXPECT_LT((run.body("A").pose.position - 0.5 * Vector3(std::cos(3.0), std::sin(3.0), 0)).norm(), 1e-8)
        << integrator;
  }
}

// Its weight, beside the axis, presses a shaft that swings to and fro on the limit of its twist. Limits count as twist times the
// cosine of half the bend, which is another one in each stage; a single one is met again once a turn.
TEST(SmoothHolding, ATwistAtItsLimitHoldsWhileTheBendChanges) {
  for (const std::string limits : {"TwistUpper = 0.05", "TwistLower = -1 TwistUpper = 0.05"}) {
    const std::string scene = held_scene(held_body("Position = {0.5, -0.5, 0.2}"),
                                         "Constraint { Type = \"Spherical\" Id = \"S\" Body2 = \"A\" "
                                         "CustomProperties { BindPoint = {0, 0, 0} Axis = {1, -1, 0} " +
                                             limits + " } }");
    std::vector<double> lost;
    for (const double h : {0.02, 0.01}) {
      SceneRun run(scene, {set("Integrator", std::string("RK4")), set("Simulator.TimeStep", h)});
      while (run.time() < 0.2 - 0.5 * h) run.step();
      const double closed = run.energy();
      while (run.time() < 0.4 - 0.5 * h) run.step();
      lost.push_back(std::fabs(run.energy() - closed));
    }
    EXPECT_LT(lost[1], 1e-7) << limits;
    EXPECT_GT(lost[0] / lost[1], 12.0) << limits;
  }
}

std::string slider(const std::string& drive) {
  return "Constraint { Type = \"Slider\" Id = \"S\" Body2 = \"A\" CustomProperties { BindPoint = {0, 0, 0} "
         "Axis = {0, 1, 0} " +
         drive + " } }";
}

// 15 N against 19.62: it gives way with what is left, from rest, by 2.31 m/s^2.
TEST(SmoothHolding, AnOverloadedDriveSlipsWithAllItHas) {
  for (const char* integrator : kOfHighOrder) {
    SceneRun run(held_scene(held_body(""), slider("Speed = 0 MaximumForce = 15")),
                 {set("Integrator", std::string(integrator))});
    run.to_end();
    EXPECT_NEAR(run.body("A").pose.position.y(), -0.5 * 2.31, 1e-9) << integrator;
    EXPECT_NEAR(run.body("A").twist.linear.y(), -2.31, 1e-9) << integrator;
  }
}

// (39.62 - 19.62)/2 = 10 m/s^2 up to 2.5 m/s, which it has after a quarter of a second.
TEST(SmoothHolding, ADriveReachesItsSpeedAndHoldsIt) {
  for (const char* integrator : kOfHighOrder) {
    SceneRun run(held_scene(held_body(""), slider("Speed = 2.5 MaximumForce = 39.62")),
                 {set("Integrator", std::string(integrator))});
    run.steps(20);
    EXPECT_NEAR(run.body("A").pose.position.y(), 5.0 * 0.2 * 0.2, 1e-9) << integrator;
    run.to_end();
    EXPECT_NEAR(run.body("A").twist.linear.y(), 2.5, 1e-9) << integrator;
    // one step of it more or less
    EXPECT_NEAR(run.body("A").pose.position.y(), 2.5 * (1.0 - 0.125), 2.5 * 0.01) << integrator;
  }
}

// Pressed on its stop by its weight, it leaves when 39.24 N lift it, at half a second.
TEST(SmoothHolding, AStopHoldsAndLetsGo) {
  const std::string lift =
      "Force { Type = \"Basic\" Id = \"Lift\" CustomProperties { "
      "Table = {{0, 0, 0, 0}, {0.5, 0, 0, 0}, {0.5, 0, 39.24, 0}, {2, 0, 39.24, 0}} } }";
  for (const char* integrator : kOfHighOrder) {
    SceneRun run(held_scene(held_body("", "\"Down\", \"Lift\""), slider("LowerLimit = 0"), lift),
                 {set("Integrator", std::string(integrator))});
    run.steps(49);
    EXPECT_NEAR(run.body("A").pose.position.y(), 0.0, 1e-14) << integrator;
    run.to_end();
    EXPECT_NEAR(run.body("A").pose.position.y(), 0.5 * kG * 0.25, 1e-9) << integrator;
  }
}

// A drive that presses on a stop does all it can, and the stop bears that and the weight.
TEST(SmoothHolding, ADriveThatPressesOnAStopStalls) {
  SceneRun run(held_scene(held_body(""), slider("LowerLimit = 0 UpperLimit = 2 Speed = -1 MaximumForce = 30")));
  run.to_end();
  EXPECT_NEAR(run.body("A").pose.position.y(), 0.0, 1e-12);
  EXPECT_NEAR(run.body("A").twist.linear.y(), 0.0, 1e-12);
}

}  // namespace
}  // namespace gravitas
