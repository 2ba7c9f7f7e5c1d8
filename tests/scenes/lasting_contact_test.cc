// What touches all the time is told to meet once, wherever steps are cut: solvers leave gaps of the second order of a step's turn,
// which are no flights.
#include <gtest/gtest.h>

#include <cmath>
#include <string>

#include "tests/scenes/scene_run.h"

namespace gravitas {
namespace {

using harness::literal;
using harness::SceneRun;
using harness::set;
using harness::turned;

// A slender capsule that leans by `lean` (rad) from the vertical, its foot at x, on a ground and beside a wall at x = 0.
std::string leaning(double x, double lean, double friction) {
  const Vector3 up(std::sin(lean), std::cos(lean), 0.0);
  return R"(
Geometries { Geometry { Type = "Capsule" Id = "Rod" CustomProperties { Radius = 0.02 Height = 2 } }
             Geometry { Type = "Halfspace" Id = "Plane" CustomProperties { } } }
Materials { Material { Id = "M" StaticFrictionCoefficient = )" +
         literal(friction) + R"( } }
Forces { Force { Type = "Gravity" Id = "Down" CustomProperties { Acceleration = {0, -9.81, 0} } } }
Simulator { CustomProperties { Duration = 0.5 } }
Environment { Space { Bodies {
  Body { Id = "Ground" GeometryId = "Plane" Material = "M" }
  Body { Id = "Wall" GeometryId = "Plane" Material = "M" KineticProperties { Orientation = )" +
         literal(turned(Vector3::UnitZ(), -0.5 * kPi)) + R"( } }
  Body { Id = "Rod" GeometryId = "Rod" Material = "M" Mass = 1 Forces = {"Down"} KineticProperties { Position = )" +
         literal(Vector3(x, 0.02, 0.0) + up) + " Orientation = " + literal(turned(Vector3::UnitZ(), -lean)) + R"( } }
} } }
)";
}

void expect_to_meet(const std::string& scene, std::uint32_t times, const std::string& simulator, double time_step) {
  for (const char* solver : {"Newton", "Sequential", "Direct"}) {
    SceneRun run(scene,
                 {"Simulator=" + simulator, std::string("Solver=") + solver, set("Simulator.TimeStep", time_step)});
    run.to_end();
    EXPECT_EQ(run.count_events(EventKind::kCollisionStart), times) << simulator << solver << time_step;
    EXPECT_EQ(run.count_events(EventKind::kCollisionEnd), 0U) << simulator << solver << time_step;
  }
}

// It slides down the wall, which lets it go at two thirds of its height alone: after 0.65 s.
TEST(LastingContact, ALadderThatSlidesDownAWall) {
  const std::string scene = leaning(0.02 + 2.0 * std::sin(0.3), -0.3, 0.0);
  for (const double time_step : {1.0 / 60.0, 1.0 / 240.0, 1e-3}) expect_to_meet(scene, 2, "Continuous", time_step);
  expect_to_meet(scene, 2, "Bisection", 1.0 / 240.0);
}

TEST(LastingContact, APencilThatFallsAboutItsFoot) {
  const std::string scene = leaning(3.0, 0.1, 0.6);
  for (const double time_step : {1.0 / 240.0, 1e-3}) expect_to_meet(scene, 1, "Continuous", time_step);
}

// What a step's fall would move through a thin plate, or deep into it, stays on it, however it is pressed. It went through, as what
// touches when a step begins was looked for at its end alone.
TEST(LastingContact, WhatIsPressedOnAThinPlateStaysOnIt) {
  const auto scene = [](double thickness, double weights, double height) {
    return R"(
Geometries { Geometry { Type = "Box" Id = "Die" CustomProperties { HalfExtents = {0.01, 0.01, 0.01} } }
             Geometry { Type = "Box" Id = "Plate" CustomProperties { HalfExtents = )" +
           literal(Vector3(1, 0.5 * thickness, 1)) + R"( } } }
Forces { Force { Type = "Gravity" Id = "Down" CustomProperties { Acceleration = )" +
           literal(Vector3(0, -9.81 * weights, 0)) + R"( } } }
Simulator { CustomProperties { Duration = 0.5 } }
Environment { Space { Bodies {
  Body { Id = "Plate" GeometryId = "Plate" Immovable = true KineticProperties { Position = )" +
           literal(Vector3(0, -0.5 * thickness, 0)) + R"( } }
  Body { Id = "Die" GeometryId = "Die" Mass = 1 Forces = {"Down"} KineticProperties { Position = )" +
           literal(Vector3(0.3, 0.01 + height, 0.2)) + R"( } }
} } }
)";
  };
  for (const std::string simulator : {"Continuous", "Bisection"})
    for (const double thickness : {1e-4, 2e-3, 2e-2})
      for (const double weights : {1.0, 10.0, 100.0})
        for (const double height : {0.0, 0.05}) {
          if (simulator == "Bisection" && height > 0.0) continue;  // passes as any that is fast
          SceneRun run(scene(thickness, weights, height),
                       {"Simulator=" + simulator, set("Simulator.TimeStep", 1.0 / 60.0)});
          run.to_end();
          EXPECT_NEAR(run.body("Die").pose.position.y(), 0.01, 1e-9)
              << simulator << ' ' << thickness << ' ' << weights << ' ' << height;
          EXPECT_EQ(run.count_events(EventKind::kCollisionEnd), 0U)
              << simulator << ' ' << thickness << ' ' << weights << ' ' << height;
        }
}

}  // namespace
}  // namespace gravitas
