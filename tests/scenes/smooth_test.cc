// The simulator Smooth through scenes: drives, motions as drives, what it refuses.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <functional>
#include <string>
#include <tuple>
#include <utility>
#include <vector>

#include "tests/paths.h"
#include "tests/scenes/scene_run.h"
#include "tests/scenes/watched_run.h"

namespace gravitas {
namespace {

using harness::literal;
using harness::SceneRun;
using harness::set;
using harness::WatchedRun;
using ::testing::HasSubstr;
using ::testing::ThrowsMessage;

std::vector<std::string> smooth(const std::vector<std::string>& more) {
  std::vector<std::string> all = {"Simulator=Smooth"};
  all.insert(all.end(), more.begin(), more.end());
  return all;
}

TEST(Smooth, KeepsTheEnergyOfADoublePendulum) {
  SceneRun run("double_pendulum.gravitas", smooth({"Solver=Newton", "Integrator=RK4", set("Simulator.Duration", 2.0)}));
  const double energy = run.energy();
  run.to_end();
  // RK4 at h = 1/240 s, with rates up to 20 rad/s: (h w)^4/120 times 20 J
  EXPECT_NEAR(run.energy(), energy, 1e-5);
  EXPECT_LT(run.report().max_joint_error(), 1e-14);
}

// A bob on a rod whose upper end is driven sideways as x(t) = t^2: the pendulum feels -2 m/s^2, so that it swings about
// the apparent vertical. Small swings: angle = -a/g (1 - cos w t), w^2 = g/l.
TEST(Smooth, FeelsTheAccelerationOfAMotion) {
  SceneRun run(R"(
Forces { Force { Type = "Gravity" Id = "Down" CustomProperties { Acceleration = {0, -9.81, 0} } } }
Simulator { Type = "Smooth" CustomProperties { TimeStep = 0.01 Duration = 1 } }
Environment {
  Space { Bodies {
    Body { Id = "Cart" Kinematic = true Motion = {{0, {0, 0, 0}, {1, 0, 0, 0}}, {0.5, {0.00025, 0, 0}, {1, 0, 0, 0}}, {1, {0.001, 0, 0}, {1, 0, 0, 0}}} }
    Body { Id = "Bob" Mass = 1 PrincipalMoments = {1, 1, 1} KineticProperties { Position = {0, -2, 0} } Forces = { "Down" } }
  } }
  Constraints { Constraint { Type = "Distance" Id = "Rod" Body1 = "Cart" Body2 = "Bob" CustomProperties { BindPoint1 = {0, 0, 0} BindPoint2 = {0, -2, 0} } } }
  KineticIntegrator = "RK4"
  ConstraintSolver = "Direct"
}
)");
  run.to_end();
  const double w = std::sqrt(9.81 / 2.0), angle = -0.002 / 9.81 * (1.0 - std::cos(w));
  // of the third order in an angle of 4e-4, times 2 m
  EXPECT_NEAR(run.body("Bob").pose.position.x(), 0.001 + 2.0 * angle, 1e-9);
}

// A body on a hinge that is hit, and was given velocities that the hinge does not allow, turns steadily from the start: what
// is left of both is the angular momentum about the hinge.
TEST(Smooth, WhatJointsDoNotAllowAtTheStartIsGoneAtOnce) {
  for (const char* integrator : {"RK4", "SymplecticSplitting", "DormandPrince853", "Radau"}) {
    for (const char* solver : {"Newton", "Direct"}) {
      SceneRun run(R"(
Forces { Force { Type = "Basic" Id = "Hit" CustomProperties { Force = {1, 3, 0} ApplicationPoint = {0.25, 0, 0} Instantaneous = true } } }
Simulator { Type = "Smooth" CustomProperties { TimeStep = 0.05 Duration = 1 } }
Environment {
  Space { Bodies {
    Body { Id = "Bar" Mass = 2 PrincipalMoments = {0.1, 0.2, 0.3} Forces = { "Hit" }
      KineticProperties { Position = {0.5, 0, 0} LinearVelocity = {0.3, -1, 0.7} AngularVelocity = {1, -2, 0.4} } }
  } }
  Constraints { Constraint { Type = "Revolute" Id = "Hinge" Body2 = "Bar" CustomProperties { BindAxisPoint1 = {0, 0, 0} BindAxisPoint2 = {0, 0, 1} } } }
})",
                   {set("Integrator", std::string(integrator)), set("Solver", std::string(solver))});
      run.to_end();
      const double rate = (0.5 * 2.0 * -1.0 + 0.3 * 0.4 + 0.75 * 3.0) / (0.3 + 2.0 * 0.25);
      const Vector3 end = 0.5 * Vector3(std::cos(rate), std::sin(rate), 0.0);
      // of a turn of 0.09 rad a step
      EXPECT_LT((run.body("Bar").pose.position - end).norm(), 1e-7) << integrator << ", " << solver;
    }
  }
}

// Two bars of 1 m with a ball between them that each holds by its centre: however small the ball is, they fall as if it were
// none of their own hinges. Stages of a method are off the joints; a torque of that error times the joint's force would turn
// the ball away (I = 1e-11 kg m^2).
TEST(Smooth, ASmallBallBetweenJointsDoesNotTurn) {
  for (const char* integrator : {"RK4", "RKMK4", "DormandPrince54", "Radau"}) {
    for (const double moment : {1e-3, 1e-7, 1e-11}) {
      const std::string inertia = literal(moment);
      SceneRun run(R"(
Forces { Force { Type = "Gravity" Id = "Down" CustomProperties { Acceleration = {0, -9.81, 0} } } }
Simulator { Type = "Smooth" CustomProperties { TimeStep = 0.0166666666666666667 Duration = 1 SleepEnergy = 0 } }
Environment {
  Space { Bodies {
    Body { Id = "A" Mass = 1 PrincipalMoments = {0.0002, 0.0834, 0.0834} KineticProperties { Position = {0.5, 0, 0} } Forces = { "Down" } }
    Body { Id = "Ball" Mass = 0.001 PrincipalMoments = {)" +
                       inertia + ", " + inertia + ", " + inertia +
                       R"(} KineticProperties { Position = {1, 0, 0} } Forces = { "Down" } }
    Body { Id = "B" Mass = 1 PrincipalMoments = {0.0002, 0.0834, 0.0834} KineticProperties { Position = {1.5, 0, 0} } Forces = { "Down" } }
  } }
  Constraints {
    Constraint { Type = "Spherical" Id = "Top" Body2 = "A" CustomProperties { BindPoint = {0, 0, 0} } }
    Constraint { Type = "Spherical" Id = "Left" Body1 = "A" Body2 = "Ball" CustomProperties { BindPoint = {1, 0, 0} } }
    Constraint { Type = "Spherical" Id = "Right" Body1 = "Ball" Body2 = "B" CustomProperties { BindPoint = {1, 0, 0} } }
  }
  ConstraintSolver = "Newton"
})",
                   {set("Integrator", std::string(integrator))});
      run.to_end();
      EXPECT_LT(run.body("Ball").twist.angular.norm(), 1e-3) << integrator << ", " << moment;
      // RK4 at 1/60 s
      EXPECT_NEAR(run.energy(), 0.0, 1e-3) << integrator << ", " << moment;
    }
  }
}

// A link of 0.1 g that holds 10 t feels the rounding of what it carries, 1e5 N: methods that look for rounding's end in what a round
// changes must not look for ever, nor refuse. The reference is of the equations of a double pendulum in its two angles.
TEST(Smooth, ALightLinkHoldsAHeavyBody) {
  const std::string scene = R"(
Forces { Force { Type = "Gravity" Id = "Down" CustomProperties { Acceleration = {0, -9.81, 0} } } }
Simulator { Type = "Smooth" CustomProperties { TimeStep = 0.01 Duration = 0.5 } }
Environment {
  Space { Bodies {
    Body { Id = "Link" Mass = 1e-4 PrincipalMoments = {1e-5, 1e-5, 1e-5} KineticProperties { Position = {0.5, 0, 0} } Forces = { "Down" } }
    Body { Id = "Load" Mass = 1e4 PrincipalMoments = {1e3, 1e3, 1e3} KineticProperties { Position = {1.25, -0.4, 0} } Forces = { "Down" } }
  } }
  Constraints {
    Constraint { Type = "Revolute" Id = "Pivot" Body2 = "Link" CustomProperties { BindAxisPoint1 = {0, 0, 0} BindAxisPoint2 = {0, 0, 1} } }
    Constraint { Type = "Revolute" Id = "Hook" Body1 = "Link" Body2 = "Load" CustomProperties { BindAxisPoint1 = {1, 0, 0} BindAxisPoint2 = {1, 0, 1} } }
  }
  ConstraintSolver = "Direct"
}
)";
  const Vector3 end(0.6434869411116291, -1.2078867456907545, 0);
  for (const auto& [integrator, time_step, tolerance] :
       {std::tuple{"Radau", 0.01, 1e-8}, std::tuple{"ImplicitMidpoint", 0.001, 4e-6},
        std::tuple{"ImplicitMidpoint", 0.0005, 1e-6}, std::tuple{"DormandPrince54", 0.01, 1e-8}}) {
    SceneRun run(scene, {set("Integrator", std::string(integrator)), set("Simulator.TimeStep", time_step)});
    run.to_end();
    EXPECT_LE((run.body("Load").pose.position - end).norm(), tolerance) << integrator << " " << time_step;
  }
}

// A mass on a spring of 1e13 N/m is a pendulum to the midpoint rule at 10 ms: the middle of each step lies on the circle, in the
// direction that free flight gives it. What is beyond is the rounding of the length, 1e-16 m, times the spring.
TEST(ImplicitMidpoint, SwingsOnAStiffSpringAsOnARod) {
  SceneRun run(R"(
Forces { Force { Type = "Gravity" Id = "Down" CustomProperties { Acceleration = {0, -9.81, 0} } }
         Force { Type = "Spring" Id = "Rod" CustomProperties { Stiffness = 1e13 RestLength = 1 } } }
Simulator { CustomProperties { TimeStep = 0.01 Duration = 1 } }
Environment {
  Space { Bodies { Body { Id = "Bob" Mass = 1 PrincipalMoments = {0.1, 0.1, 0.1} Forces = { "Down", "Rod" } KineticProperties { Position = {1, 0, 0} } } } }
  KineticIntegrator = "ImplicitMidpoint"
}
)");
  const double h = 0.01;
  Vector3 x(1, 0, 0), v = Vector3::Zero();
  while (!run.is_done()) {
    run.step();
    const Vector3 middle = (x + 0.5 * h * v + 0.25 * h * h * Vector3(0, -9.81, 0)).normalized();
    v = 4.0 / h * (middle - x) - v;
    x = 2.0 * middle - x;
    ASSERT_LE((run.body("Bob").pose.position - x).norm(), 2e-3) << run.time();
  }
}

// At the origin of the world a joint's points have no coordinates to be rounded; steps that closed it no further never ended.
TEST(Smooth, AHingeAtTheOriginRestsAndSwings) {
  const auto pendulum = [](const char* motion, double time_step, const char* integrator, const char* solver) {
    SceneRun run(std::string(R"(
Forces { Force { Type = "Gravity" Id = "Down" CustomProperties { Acceleration = {0, -9.81, 0} } } }
Simulator { Type = "Smooth" CustomProperties { TimeStep = 0.01 Duration = 0.3 } }
Environment {
  Space { Bodies {
    Body { Id = "Bob" Mass = 1 PrincipalMoments = {0.1, 0.1, 0.1} Forces = { "Down" }
      KineticProperties { Position = {0, -0.5, 0} )") +
                     motion + R"( } }
  } }
  Constraints { Constraint { Type = "Revolute" Id = "Hinge" Body2 = "Bob" CustomProperties { BindAxisPoint1 = {0, 0, 0} BindAxisPoint2 = {0, 0, 1} } } }
})",
                 {set("Integrator", std::string(integrator)), set("Solver", std::string(solver)),
                  set("Simulator.TimeStep", time_step)});
    run.to_end();
    EXPECT_LT(run.report().max_joint_error(), 1e-14);
    return run.body("Bob").pose.position;
  };
  for (const char* solver : {"Newton", "Direct"}) {
    for (const double time_step : {0.05, 1.0 / 60, 0.01, 0.001})
      EXPECT_LT((pendulum("", time_step, "RK4", solver) - Vector3(0, -0.5, 0)).norm(), 1e-14) << solver;
    const char* pushed = "LinearVelocity = {1, 0, 0} AngularVelocity = {0, 0, 2}";
    const Vector3 fine = pendulum(pushed, 0.0003, "RK4", solver);
    for (const char* integrator : {"RKMK4", "DormandPrince54", "DormandPrince853", "Radau"})
      EXPECT_LT((pendulum(pushed, 0.001, integrator, solver) - fine).norm(), 1e-7) << solver << ", " << integrator;
  }
}

// A pivot whose Motion has rows off the steps, where its acceleration jumps: the pendulum on it keeps the order of RK4.
TEST(Smooth, KeepsTheOrderWhereAMotionsRowsLieWithinSteps) {
  const auto end = [](double time_step) {
    SceneRun run(R"(
Forces { Force { Type = "Gravity" Id = "Down" CustomProperties { Acceleration = {0, -9.81, 0} } } }
Simulator { Type = "Smooth" CustomProperties { TimeStep = 0.01 Duration = 1 } }
Environment {
  Space { Bodies {
    Body { Id = "Cart" Kinematic = true Motion = {{0, {0, 0, 0}, {1, 0, 0, 0}}, {0.0637, {0, 0, 0}, {1, 0, 0, 0}}, {0.237, {0.1, 0, 0}, {1, 0, 0, 0}}, {0.519, {-0.05, 0.1, 0}, {1, 0, 0, 0}}, {0.871, {0.05, 0, 0}, {1, 0, 0, 0}}} }
    Body { Id = "Bob" Mass = 1 PrincipalMoments = {0.1, 0.1, 0.1} KineticProperties { Position = {0, -0.5, 0} } Forces = { "Down" } }
  } }
  Constraints { Constraint { Type = "Spherical" Id = "Pivot" Body1 = "Cart" Body2 = "Bob" CustomProperties { BindPoint = {0, 0, 0} } } }
  KineticIntegrator = "RK4"
  ConstraintSolver = "Direct"
}
)",
                 {set("Simulator.TimeStep", time_step)});
    run.to_end();
    return run.body("Bob").pose.position;
  };
  const Vector3 exact = end(0.0005);
  const double coarse = (end(0.02) - exact).norm(), fine = (end(0.01) - exact).norm();
  EXPECT_LT(fine, 1e-6);
  EXPECT_NEAR(std::log2(coarse / fine), 4.0, 0.6);
}

// A shaft that hangs from a point, spins and drives a second one by a constant-velocity joint that bends as they fall: RK4
// keeps its order, and the shafts turn alike to rounding.
TEST(Smooth, KeepsTheOrderOfConstantVelocityJoints) {
  const auto end = [](double h) {
    SceneRun run(R"(
Forces { Force { Type = "Gravity" Id = "Down" CustomProperties { Acceleration = {0, -9.81, 0} } } }
Simulator { Type = "Smooth" CustomProperties { TimeStep = 0.01 Duration = 0.4 } }
Environment {
  Space { Bodies {
    Body { Id = "Driving" Mass = 1 PrincipalMoments = {0.1, 0.2, 0.3} KineticProperties { Position = {0.5, 0, 0} AngularVelocity = {6, 0, 0} } Forces = { "Down" } }
    Body { Id = "Driven" Mass = 2 PrincipalMoments = {0.3, 0.2, 0.1} KineticProperties { Position = {1, 0, 0.5} AngularVelocity = {0, 0, 6} } Forces = { "Down" } }
  } }
  Constraints {
    Constraint { Type = "Spherical" Id = "Hook" Body2 = "Driving" CustomProperties { BindPoint = {0, 0, 0} } }
    Constraint { Type = "ConstantVelocity" Id = "Joint" Body1 = "Driving" Body2 = "Driven" CustomProperties { BindPoint = {1, 0, 0} Axis1 = {1, 0, 0} Axis2 = {0, 0, 1} } }
  }
  KineticIntegrator = "RK4"
  ConstraintSolver = "Newton"
}
)",
                 {set("Simulator.TimeStep", h)});
    run.to_end();
    EXPECT_LT(run.report().max_joint_error(), 1e-13) << h;
    return run.body("Driven").pose;
  };
  const Pose one = end(0.01), half = end(0.005), quarter = end(0.0025);
  // 2^4, less a tenth of the order
  const double ratio = (one.position - half.position).norm() / (half.position - quarter.position).norm();
  EXPECT_GT(ratio, std::exp2(3.9)) << ratio;
  EXPECT_LT(ratio, std::exp2(4.6)) << ratio;
}

// Drives about axes that are square, so that a rate of 1 may be rounded up: in every stage they hold as others do. RK4 keeps its
// order, a drive's torque is that of finer steps, and an adaptive method takes no more calls than 1e-3 off square.
TEST(Smooth, KeepsTheOrderOfDrivesAboutSquareAxes) {
  const auto wheel = [](const std::string& joint, const std::string& integrator, double h) {
    return "Simulator { Type = \"Smooth\" CustomProperties { TimeStep = " + literal(h) +
           " Duration = 0.5 } }\nEnvironment { Space { Bodies { Body { Id = \"Wheel\" Mass = 4 PrincipalMoments = "
           "{0.22, "
           "0.04, 0.2} KineticProperties { AngularVelocity = {0, 1.3, 0.9} } } } }\nConstraints { Constraint { Id = "
           "\"J\" "
           "Body2 = \"Wheel\" Type = " +
           joint + " } }\nKineticIntegrator = \"" + integrator + "\"\nConstraintSolver = \"Direct\" }\n";
  };
  struct End {
    Quaternion orientation;
    Vector3 torque;
    std::uint32_t solutions;
  };
  const auto end = [&](const std::string& joint, const std::string& integrator, double h) {
    WatchedRun watched(wheel(joint, integrator, h));
    watched.run.to_end();
    const report::v1::Reaction reaction = watched.reactions().at(0);
    const auto& torque = reaction.drive_torque();
    std::uint32_t solutions = 0;
    for (const auto& stage : watched.run.report().stages())
      if (stage.stage() == "solve") solutions += stage.calls();
    return End{watched.run.body("Wheel").pose.orientation, Vector3(torque.at(0), torque.at(1), torque.at(2)),
               solutions};
  };
  const std::string point = " CustomProperties { BindPoint = {0, 0, 0} ";
  const auto axle = [&](const std::string& across) {
    return "\"Axle\"" + point + "SteeringAxis = {0, 1, 0} RollingAxis = {0, " + across + ", 1} AngularSpeed = 0.9 }";
  };
  const auto universal = [&](const std::string& across) {
    return "\"Universal\"" + point + "Axis1 = {0, 1, 0} Axis2 = {0, " + across + ", 1} AngularSpeed2 = 0.9 }";
  };
  for (const auto& joint : {std::function(axle), std::function(universal)}) {
    const std::string square = joint("0");
    const End exact = end(square, "RK4", 1.0 / 1920.0), coarse = end(square, "RK4", 1.0 / 60.0),
              fine = end(square, "RK4", 1.0 / 120.0);
    const double far = harness::angle_between(coarse.orientation, exact.orientation);
    const double near = harness::angle_between(fine.orientation, exact.orientation);
    EXPECT_NEAR(std::log2(far / near), 4.0, 0.1) << square << far << ", " << near;
    EXPECT_LT(far, 1e-7) << square;
    EXPECT_LT((coarse.torque - exact.torque).norm(), 1e-5 * exact.torque.norm()) << square;
    EXPECT_GT(exact.torque.norm(), 0.01) << square;
    EXPECT_LE(end(square, "DormandPrince54", 1.0 / 60.0).solutions,
              end(joint("0.001"), "DormandPrince54", 1.0 / 60.0).solutions)
        << square;
  }
}

// How a spring of a joint that has turned far pulls when its bodies turn on must be known exactly to a linearly implicit
// method: with a Jacobian that is right for small turns alone it was of first order.
TEST(Smooth, KeepsTheOrderWhereSpringsHaveTurnedFar) {
  const auto end = [](const std::string& joint, const std::string& integrator, double step) {
    SceneRun run(
        R"(
Simulator { Type = "Smooth" CustomProperties { TimeStep = 0.01 Duration = 0.5 } }
Environment {
  Space { Bodies {
    Body { Id = "Body" Mass = 1 PrincipalMoments = {0.05, 0.08, 0.1} KineticProperties { Position = {0.3, 0, 0.1} AngularVelocity = {4, 9, 6} } }
  } }
  Constraints { Constraint { Type = )" +
            joint + R"(} } }
  KineticIntegrator )" +
            integrator + R"(
  ConstraintSolver = "Newton"
}
)",
        {set("Simulator.TimeStep", step)});
    run.to_end();
    return run.body("Body").pose.position;
  };
  const std::string place = " Id = \"Joint\" Body2 = \"Body\" CustomProperties { BindPoint = {0, 0, 0} ";
  for (const std::string& joint :
       {"\"Spherical\"" + place + "Stiffness = 20 ",
        "\"ConstantVelocity\"" + place + "Axis1 = {1, 0, 0} Axis2 = {1, 0, 0} BendStiffness = 20 ",
        "\"Bushing\"" + place + "Stiffness = {100, 100, 100} AngularStiffness = {20, 20, 20} "}) {
    const Vector3 right = end(joint, "{ Type = \"Radau\" CustomProperties { Accuracy = 1e-12 } }", 0.01);
    const std::string fixed = "{ Type = \"Rosenbrock\" CustomProperties { Accuracy = 1 } }";
    const double coarse = (end(joint, fixed, 0.005) - right).norm(), fine = (end(joint, fixed, 0.0025) - right).norm();
    EXPECT_NEAR(std::log2(coarse / fine), 4.0, 0.2) << joint << coarse << ", " << fine;
    EXPECT_LT(fine, 1e-6) << joint;
  }
}

TEST(Smooth, RefusesWhatItCannotMove) {
  EXPECT_THAT([] { SceneRun run("double_pendulum.gravitas", smooth({"Solver=Sequential"})); },
              ThrowsMessage<std::runtime_error>(HasSubstr("needs a plugin with the capability 'reactions'")));
  EXPECT_THAT([] { SceneRun run("stack.gravitas", smooth({"Solver=Direct"})); },
              ThrowsMessage<std::runtime_error>(HasSubstr("moves bodies that cannot touch, and some of these can")));
}

TEST(Smooth, HandsItsAccuracyToTheIntegrator) {
  const auto energy_error = [](double accuracy) {
    SceneRun run("double_pendulum.gravitas",
                 smooth({"Solver=Direct", "Integrator=DormandPrince54", set("Simulator.Accuracy", accuracy),
                         set("Simulator.TimeStep", 0.1), set("Simulator.Duration", 2.0)}));
    const double energy = run.energy();
    run.to_end();
    return std::fabs(run.energy() - energy);
  };
  EXPECT_LT(energy_error(1e-10), 1e-8);
  EXPECT_GT(energy_error(1e-3), 1e-7);
  EXPECT_THAT(
      [] { SceneRun run("double_pendulum.gravitas", {set("Simulator.Accuracy", 1e-3)}); },
      ThrowsMessage<std::runtime_error>(HasSubstr("Accuracy belongs to the simulators \"Smooth\" and \"Continuous\"")));
  EXPECT_THAT(
      [] {
        SceneRun run("double_pendulum.gravitas",
                     smooth({"Solver=Direct", "Integrator=RK4", set("Simulator.Accuracy", 1e-3)}));
      },
      ThrowsMessage<std::runtime_error>(HasSubstr("the integrator \"RK4\" has no Accuracy")));
}

// A wheel of 2 kg on an Axle's spring, from rest.
std::string sprung(double stiffness, double damping, const Vector3& along = Vector3::UnitY()) {
  return R"(
Forces { Force { Type = "Gravity" Id = "Down" CustomProperties { Acceleration = {0, -9.81, 0} } } }
Simulator { Type = "Smooth" CustomProperties { TimeStep = 0.01 Duration = 4 } }
Environment {
  Space { Bodies { Body { Id = "Wheel" Mass = 2 PrincipalMoments = {0.1, 0.1, 0.2} Forces = { "Down" } } } }
  Constraints { Constraint { Type = "Axle" Id = "Axle" Body2 = "Wheel" CustomProperties {
    BindPoint = {0, 0, 0} SteeringAxis = )" +
         literal(along) + " RollingAxis = {0, 0, 1} SuspensionStiffness = " + literal(stiffness) +
         " SuspensionDamping = " + literal(damping) + R"( } } }
  KineticIntegrator = "RK4"
  ConstraintSolver = "Newton"
}
)";
}

// Deflection m g cos/k along the axis, whichever simulator comes to rest.
TEST(Smooth, HangsInASpringAsBasicDoes) {
  const Vector3 along = Vector3(0.6, 0.8, 0.0);
  for (const char* simulator : {"Smooth", "Basic"}) {
    SceneRun run(sprung(500.0, 60.0, along), {set("Simulator", std::string(simulator)), "Simulator.SleepEnergy=0"});
    run.to_end();
    // e^(-15 * 4) of the swing is left
    EXPECT_LT((run.body("Wheel").pose.position + 2.0 * kG * 0.8 / 500.0 * along).norm(), 1e-12) << simulator;
  }
}

// y = -g/w^2 (1 - cos w t) without damping, w^2 = k/m, to the accuracy asked for.
TEST(Smooth, SwingsInASpringAsAccuratelyAsIsAsked) {
  for (const char* integrator : {"DormandPrince54", "DormandPrince853", "Radau"}) {
    SceneRun run(sprung(200.0, 0.0), {set("Integrator", std::string(integrator)), set("Simulator.TimeStep", 0.05),
                                      set("Simulator.Accuracy", 1e-9), set("Simulator.Duration", 2.0)});
    run.to_end();
    const double w = 10.0;
    // forty steps, each with what is asked of it
    EXPECT_NEAR(run.body("Wheel").pose.position.y(), -kG / (w * w) * (1.0 - std::cos(w * 2.0)), 4e-8) << integrator;
  }
}

// k h^2/m = 1e4: methods for stiff problems come to rest at m g/k, explicit ones are beyond their limit.
TEST(Smooth, NeedsAMethodForStiffProblemsWhereASpringIsStiff) {
  const double k = 2e8, damping = 2.0 * std::sqrt(2.0 * k), deflection = 2.0 * kG / k;
  for (const char* integrator : {"Radau", "Rosenbrock"}) {
    SceneRun run(sprung(k, damping),
                 {set("Integrator", std::string(integrator)), set("Simulator.Accuracy", 1e-9), "Simulator.Duration=1"});
    run.to_end();
    EXPECT_NEAR(run.body("Wheel").pose.position.y(), -deflection, 1e-2 * deflection) << integrator;
    EXPECT_LT(run.report().max_joint_error(), 1e-12);
  }
  // A-stable: it rings, and does not grow
  SceneRun midpoint(sprung(k, 0.0), {"Integrator=ImplicitMidpoint", "Simulator.Duration=1"});
  while (!midpoint.is_done()) {
    midpoint.step();
    ASSERT_LE(std::fabs(midpoint.body("Wheel").pose.position.y() + deflection), (1.0 + 1e-3) * deflection);
  }
  SceneRun explicit_one(sprung(k, 0.0), {});
  explicit_one.steps(3);
  EXPECT_GT(std::fabs(explicit_one.body("Wheel").pose.position.y()), 1e6 * deflection);
}

// An arm on a hinge, a bob that slides along it on a spring. No friction: energy stays as well as the method keeps it.
struct Swing {
  Vector3 bob;
  double energy_error;
};
Swing elastic_pendulum(const std::string& integrator, double h) {
  SceneRun run(R"(
Forces { Force { Type = "Gravity" Id = "Down" CustomProperties { Acceleration = {0, -9.81, 0} } } }
Simulator { Type = "Smooth" CustomProperties { TimeStep = 0.01 Duration = 2 } }
Environment {
  Space { Bodies {
    Body { Id = "Arm" Mass = 0.5 PrincipalMoments = {0.1, 0.1, 0.1} Forces = { "Down" } KineticProperties { Position = {0.5, 0, 0} } }
    Body { Id = "Bob" Mass = 1 PrincipalMoments = {0.02, 0.02, 0.02} Forces = { "Down" } KineticProperties { Position = {1, 0, 0} } }
  } }
  Constraints {
    Constraint { Type = "Revolute" Id = "Hinge" Body2 = "Arm" CustomProperties { BindAxisPoint1 = {0, 0, 0} BindAxisPoint2 = {0, 0, 1} } }
    Constraint { Type = "Axle" Id = "Spring" Body1 = "Arm" Body2 = "Bob" CustomProperties { BindPoint = {1, 0, 0} SteeringAxis = {1, 0, 0} RollingAxis = {0, 0, 1} SuspensionStiffness = 90 } }
  }
  KineticIntegrator = "RK4"
  ConstraintSolver = "Direct"
}
)",
               {set("Integrator", integrator), set("Simulator.TimeStep", h)});
  const auto energy = [&] {
    const double stretch = run.body("Bob").pose.position.norm() - 1.0;
    return run.energy() + 0.5 * 90.0 * stretch * stretch;
  };
  const double start = energy();
  double most = 0.0;
  while (!run.is_done()) {
    run.step();
    most = std::max(most, std::fabs(energy() - start));
  }
  return {run.body("Bob").pose.position, most};
}

TEST(Smooth, KeepsTheEnergyOfAnElasticPendulumToTheOrderOfTheMethod) {
  constexpr double kStep = 0.01;
  const Vector3 fine = elastic_pendulum("RK4", kStep / 16.0).bob;
  const Swing one = elastic_pendulum("RK4", kStep), half = elastic_pendulum("RK4", kStep / 2.0);
  EXPECT_NEAR(std::log2((one.bob - fine).norm() / (half.bob - fine).norm()), 4.0, 0.3);
  // of RK4 that of the energy is one higher
  EXPECT_GT(std::log2(one.energy_error / half.energy_error), 3.8);
  EXPECT_LT(half.energy_error, 1e-4);
  EXPECT_LT(elastic_pendulum("DormandPrince853", kStep).energy_error, 1e-6);
}

// A frame that tumbles on two sprung wheels, which roll and steer: long steps are as good as short ones.
TEST(Smooth, MovesTwoSprungAxlesAsAccuratelyAsIsAsked) {
  const auto wheels_after = [](double h) {
    SceneRun run(in_source("/tests/determinism/suspension.gravitas"),
                 {"Integrator=DormandPrince853", set("Simulator.Accuracy", 1e-9), set("Simulator.TimeStep", h),
                  set("Simulator.Duration", 1.5)});
    run.to_end();
    EXPECT_LT(run.report().max_joint_error(), 1e-8);
    return std::pair(run.body("Front").pose.position, run.body("Rear").pose.position);
  };
  const auto [front, rear] = wheels_after(0.05);
  const auto [fine_front, fine_rear] = wheels_after(0.003125);
  // thirty steps of 1e-9 at most
  EXPECT_LT((front - fine_front).norm(), 3e-8);
  EXPECT_LT((rear - fine_rear).norm(), 3e-8);
}

}  // namespace
}  // namespace gravitas
