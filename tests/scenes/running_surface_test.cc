// Belts: surfaces that run along bodies that stay, or follow a Motion. With V the belt's speed, a = mu g and t = V/a, a box
// laid on it slides for t, lags by V t/2 and goes along with V; a ball of 2/5 m r^2 comes to roll at 2 V/7, at the time t 2/7.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <string>
#include <vector>

#include "plugin_sdk/math/rotation.h"
#include "tests/scenes/scene_run.h"

namespace gravitas {
namespace {

using harness::SceneRun;

constexpr double kBeltSpeed = 1.5, kBeltFriction = 0.5;

std::string belt_scene(const std::string& belt, const std::string& load, const std::string& joints = "") {
  return R"(
Geometries {
  Geometry { Type = "Box" Id = "Belt" CustomProperties { HalfExtents = {5, 0.1, 1} } }
  Geometry { Type = "Halfspace" Id = "Ground" }
  Geometry { Type = "Box" Id = "Crate" CustomProperties { HalfExtents = {0.2, 0.1, 0.1} } }
  Geometry { Type = "Sphere" Id = "Ball" CustomProperties { Radius = 0.1 } }
}
Materials { Material { Id = "Rubber" StaticFrictionCoefficient = 0.5 DynamicFrictionCoefficient = 0.5 RestitutionCoefficient = 0 } }
Forces { Force { Type = "Gravity" Id = "Down" CustomProperties { Acceleration = {0, -9.81, 0} } } }
Simulator { CustomProperties { TimeStep = 0.004166666666666667 Duration = 2 } }
Environment { Space { Bodies {
  Body { Id = "Belt" Material = "Rubber" )" +
         belt + R"( }
  Body { Id = "Load" Material = "Rubber" Mass = 3 Forces = {"Down"} )" +
         load + R"( }
} } )" + joints +
         " }\n";
}

const std::string kRuns = "GeometryId = \"Belt\" SurfaceVelocity = {1.5, 0, 0} ";
const std::string kStands = kRuns + "Immovable = true KineticProperties { Position = {0, -0.1, 0} }";
const std::string kTreadmill = "GeometryId = \"Ground\" SurfaceVelocity = {1.5, 0, 0}";
const std::string kCube = "GeometryId = \"Crate\" KineticProperties { Position = {-2, 0.1, 0} }";
const std::string kRound = "GeometryId = \"Ball\" KineticProperties { Position = {-2, 0.1, 0} }";

double place_after(double time) {
  return -2.0 + kBeltSpeed * time - kBeltSpeed * kBeltSpeed / (2.0 * kBeltFriction * kG);
}

TEST(RunningSurface, CarriesWhatIsLaidOnIt) {
  for (const std::string solver : {"Sequential", "Newton", "Direct"}) {
    for (const std::string& ground : {kStands, kTreadmill}) {
      SceneRun run(belt_scene(ground, kCube), {"Solver=" + solver});
      run.to_end();
      EXPECT_NEAR(run.body("Load").twist.linear.x(), kBeltSpeed, 1e-9) << solver;
      // first order: half a step of the slide's end
      EXPECT_NEAR(run.body("Load").pose.position.x(), place_after(2.0), kBeltSpeed * run.time_step()) << solver;
      EXPECT_NEAR(run.body("Load").pose.position.y(), 0.1, 1e-5) << solver;
    }
  }
}

TEST(RunningSurface, CarriesExactlyWithContinuous) {
  SceneRun run(belt_scene(kStands, kCube), {"Simulator=Continuous", "Solver=Newton"});
  run.to_end();
  EXPECT_NEAR(run.body("Load").twist.linear.x(), kBeltSpeed, 1e-10);
  EXPECT_NEAR(run.body("Load").pose.position.x(), place_after(2.0), 1e-9);
  SceneRun ball(belt_scene(kStands, kRound), {"Simulator=Continuous", "Solver=Newton"});
  ball.to_end();
  EXPECT_NEAR(ball.body("Load").twist.linear.x(), 2.0 / 7.0 * kBeltSpeed, 1e-9);
  EXPECT_NEAR(ball.body("Load").twist.angular.z(), 5.0 / 7.0 * kBeltSpeed / 0.1, 1e-7);
}

TEST(RunningSurface, StaysWhereItIs) {
  SceneRun run(belt_scene(kStands, kCube));
  run.to_end();
  EXPECT_EQ(run.body("Belt").pose.position, Vector3(0, -0.1, 0));
  EXPECT_EQ(run.body("Belt").twist.linear, Vector3(kBeltSpeed, 0, 0));
}

// A belt that rises by asin 0.28 = 16.3 degrees holds with mu = 0.5, tan = 0.29; V goes along it.
TEST(RunningSurface, TurnsWithItsBody) {
  const std::string slope =
      kRuns + "Immovable = true KineticProperties { Orientation = {0.9899494936611665, 0, 0, 0.1414213562373095} }";
  const std::string load =
      "GeometryId = \"Crate\" KineticProperties { Position = {-0.056, 0.192, 0} "
      "Orientation = {0.9899494936611665, 0, 0, 0.1414213562373095} }";
  SceneRun run(belt_scene(slope, load), {"Simulator=Continuous", "Solver=Newton"});
  run.to_end();
  const Vector3 velocity = run.body("Load").twist.linear, up(0.96, 0.28, 0.0);
  EXPECT_LT((velocity - kBeltSpeed * up).norm(), 1e-9) << velocity.transpose();
}

// A frame that goes backwards as fast as its belt runs forwards: what lies on it stays.
TEST(RunningSurface, IsAddedToAMotion) {
  const std::string moves =
      kRuns + "Kinematic = true Motion = {{0, {0, -0.1, 0}, {1, 0, 0, 0}}, {1, {-1.5, -0.1, 0}, {1, 0, 0, 0}}}";
  SceneRun run(belt_scene(moves, kCube));
  run.to_end();
  EXPECT_NEAR(run.body("Load").pose.position.x(), -2.0, 1e-12);
  EXPECT_NEAR(run.body("Belt").pose.position.x(), -3.0, 1e-12);
}

TEST(RunningSurface, KeepsItsLoadAwakeAndLetsItSleepWhenItStops) {
  SceneRun run(belt_scene(kStands, kCube));
  run.to_end();
  EXPECT_EQ(run.count_events(EventKind::kSleep), 0);
  SceneRun stopped(belt_scene(kStands, kCube), {"Body.Belt.SurfaceVelocity={0, 0, 0}"});
  stopped.to_end();
  EXPECT_EQ(stopped.count_events(EventKind::kSleep), 1);
}

TEST(RunningSurface, PassesTheChecksOfPhysics) {
  for (const std::string solver : {"Sequential", "Newton", "Direct"}) {
    SceneRun run(belt_scene(kStands, kRound), {"Solver=" + solver, "Simulator.CheckPhysicsEvery=1"});
    run.to_end();
    EXPECT_EQ(run.count_events(EventKind::kFault), 0) << solver;
  }
}

TEST(RunningSurface, IsRefusedWhereItMeansNothing) {
  const auto problem = [](const std::string& belt, const std::string& joints = "") {
    try {
      SceneRun run(belt_scene(belt, kCube, joints));
    } catch (const std::exception& error) {
      return std::string(error.what());
    }
    return std::string("none");
  };
  EXPECT_THAT(problem(kRuns + "Mass = 1"), testing::HasSubstr("required: Immovable = true, or a Motion"));
  EXPECT_THAT(problem(kRuns + "Kinematic = true"), testing::HasSubstr("required: Immovable = true, or a Motion"));
  EXPECT_THAT(problem("SurfaceVelocity = {1, 0, 0} Immovable = true"), testing::HasSubstr("required: GeometryId"));
  EXPECT_THAT(
      problem(kStands,
              "Constraints { Constraint { Type = \"Rigid\" Id = \"Glue\" Body1 = \"Belt\" Body2 = \"Load\" } }"),
      testing::HasSubstr("holds on to a surface that runs"));
}

}  // namespace
}  // namespace gravitas
