// Forces that jump or bend at a time, within a step and at its end: what comes before the jump and what comes after do not mix.
#include <gtest/gtest.h>

#include <cmath>
#include <string>

#include "tests/scenes/scene_run.h"

namespace gravitas {
namespace {

using harness::SceneRun;
using harness::set;

// 8 N on 2 kg from 0.505 s to 0.9 s, the second of which is the end of a step; above `ground`.
std::string scene(const std::string& ground) {
  return R"(
Geometries { Geometry { Type = "Sphere" Id = "Unit" CustomProperties { Radius = 0.1 } }
             Geometry { Type = "Halfspace" Id = "Flat" } }
Forces { Force { Type = "Basic" Id = "Push" CustomProperties {
  Table = {{0, {0, 0, 0}}, {0.505, {0, 0, 0}}, {0.505, {8, 0, 0}}, {0.9, {8, 0, 0}}, {0.9, {0, 0, 0}}} } } }
Simulator { CustomProperties { TimeStep = 0.01 Duration = 1.5 } }
Environment { Space { Bodies { )" +
         ground + R"(
  Body { Id = "Ball" GeometryId = "Unit" Mass = 2 Forces = { "Push" } KineticProperties { Position = {0, 5, 0} } } } } }
)";
}
const std::string kWithoutGround = scene("");
const std::string kScene = scene("Body { Id = \"Ground\" GeometryId = \"Flat\" Immovable = true }");
constexpr double kSpeed = 4.0 * 0.395, kWay = 0.5 * 4.0 * 0.395 * 0.395 + kSpeed * 0.6;

// Of sums of 150 terms of size 2.
constexpr double kRounding = 1e-13;

TEST(SwitchedForce, ActsAsLongAsItIsOnWithEveryIntegrator) {
  for (const std::string integrator :
       {"Euler", "SemiImplicitEuler", "Verlet", "BasicVerlet", "RK4", "RKMK4", "SymplecticSplitting",
        "ImplicitMidpoint", "DormandPrince54", "DormandPrince853", "Rosenbrock", "Radau"}) {
    SCOPED_TRACE(integrator);
    SceneRun run(kScene, {set("Integrator", integrator)});
    run.to_end();
    const SceneRun::Motion ball = run.body("Ball");
    // whose velocities are displacements over the step, 0.01 s
    const double rounding = integrator == "BasicVerlet" ? kRounding / 0.01 : kRounding;
    EXPECT_NEAR(ball.twist.linear.x(), kSpeed, rounding);
    // methods of order 1 are off by a h t/2
    if (!integrator.ends_with("Euler")) {
      EXPECT_NEAR(ball.pose.position.x(), kWay, rounding);
    }
  }
}

TEST(SwitchedForce, ActsAsLongAsItIsOnInEverySimulator) {
  for (const std::string simulator : {"Basic", "Substepping", "Continuous", "Bisection", "Smooth"}) {
    SCOPED_TRACE(simulator);
    SceneRun run(simulator == "Smooth" ? kWithoutGround : kScene,
                 {set("Integrator", std::string("RK4")), set("Simulator.Type", simulator)});
    run.to_end();
    EXPECT_NEAR(run.body("Ball").pose.position.x(), kWay, kRounding);
  }
}

// The same whatever the step: at 1/7 s no jump is the end of one.
TEST(SwitchedForce, IsNotSmearedOverLongSteps) {
  for (const double step : {1.5, 1.0 / 7, 0.015, 1e-3}) {
    SCOPED_TRACE(step);
    SceneRun run(kScene, {set("Integrator", std::string("Verlet")), set("Simulator.TimeStep", step)});
    run.to_end();
    EXPECT_NEAR(run.body("Ball").pose.position.x(), kWay, 10 * kRounding);  // up to 1500 terms
  }
}

// A triangle of 2 N s on 2 kg, however short against the step: 1 m/s from its middle on, with methods that are exact for
// a force that is linear in time.
TEST(SwitchedForce, ARampIsNotSteppedOver) {
  for (const double width : {0.1, 0.01, 0.001}) {
    const std::string table = "{{0, {0, 0, 0}}, {1.0371, {0, 0, 0}}, {" + harness::literal(1.0371 + width) + ", {" +
                              harness::literal(2.0 / width) + ", 0, 0}}, {" + harness::literal(1.0371 + 2.0 * width) +
                              ", {0, 0, 0}}}";
    for (const std::string integrator :
         {"RK4", "RKMK4", "DormandPrince54", "DormandPrince853", "Radau", "Rosenbrock"}) {
      for (const double step : {0.5, 0.02}) {
        SCOPED_TRACE(integrator + ", width " + std::to_string(width) + ", step " + std::to_string(step));
        SceneRun run(kWithoutGround, {set("Integrator", integrator), set("Simulator.TimeStep", step),
                                      set("Simulator.Duration", 2.0), set("Force.Push.Table", table)});
        run.to_end();
        EXPECT_NEAR(run.body("Ball").twist.linear.x(), 1.0, 1e-9);
        EXPECT_NEAR(run.body("Ball").pose.position.x(), 2.0 - 1.0371 - width, 1e-9);
      }
    }
  }
}

// A body on a spring whose other end follows a Motion with rows within steps, where its acceleration jumps.
TEST(SwitchedForce, ASpringToAMotionKeepsTheOrder) {
  const auto end = [](double time_step, const char* integrator) {
    SceneRun run(R"(
Forces { Force { Type = "Spring" Id = "Bound" CustomProperties { Stiffness = 30 Damping = 2 AnchorBody = "Hand" } } }
Simulator { CustomProperties { Duration = 1 } }
Environment { Space { Bodies {
  Body { Id = "Hand" Kinematic = true Motion = {{0, {0, 0, 0}, {1, 0, 0, 0}}, {0.1337, {1, 0, 0}, {1, 0, 0, 0}}, {0.4113, {0, 0.5, 0}, {1, 0, 0, 0}}, {0.7771, {0, 0, 1}, {1, 0, 0, 0}}, {1.2, {1, 1, 1}, {1, 0, 0, 0}}} }
  Body { Id = "Bob" Mass = 1 PrincipalMoments = {1, 1, 1} KineticProperties { Position = {1, 0, 0} } Forces = { "Bound" } } } } })",
                 {set("Simulator.TimeStep", time_step), set("Integrator", std::string(integrator))});
    run.to_end();
    return run.body("Bob").pose.position;
  };
  const Vector3 exact = end(0.001, "DormandPrince853");
  const double coarse = (end(0.02, "RK4") - exact).norm(), fine = (end(0.01, "RK4") - exact).norm();
  EXPECT_LT(fine, 1e-6);
  EXPECT_NEAR(std::log2(coarse / fine), 4.0, 0.6);
}

}  // namespace
}  // namespace gravitas
