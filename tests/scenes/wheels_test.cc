// Wheels on sprung axles: where they settle, and that what drives them does not steer them.
#include <gtest/gtest.h>

#include <cmath>
#include <string>

#include "tests/scenes/scene_run.h"

namespace gravitas {
namespace {

using harness::SceneRun;
using harness::set;

class SprungWheel : public ::testing::Test {
 protected:
  static constexpr double kSag = 100.0 * kG / 2e4;  // m

  // A body of 100 kg that is guided upright, on a sprung axle whose wheel is held by the world: joints that repeat each other.
  static SceneRun guided(const std::string& solver, double time_step) {
    return run(
        "Body { Id = \"Wheel\" Mass = 20 PrincipalMoments = {0.5, 0.5, 0.9} Forces = {\"G\"} }\n"
        "Body { Id = \"Car\" Mass = 100 PrincipalMoments = {10, 10, 10} Forces = {\"G\"} KineticProperties { Position "
        "= "
        "{0, 0.3, 0} } }\n",
        "Constraint { Type = \"Revolute\" Id = \"Hub\" Body2 = \"Wheel\" CustomProperties { BindAxisPoint1 = {0, 0, 0} "
        "BindAxisPoint2 = {0, 0, 1} } }\n"
        "Constraint { Type = \"Slider\" Id = \"Guide\" Body2 = \"Car\" CustomProperties { BindPoint = {0, 0.3, 0} Axis "
        "= "
        "{0, 1, 0} } }\n" +
            axle("{0, 0, 0}"),
        solver, time_step);
  }
  // The same on a wheel of 0.2 m width, which rolls on the ground and may steer, along a rail, with a torque of 100 N m.
  static SceneRun driven(const std::string& solver, double time_step) {
    return run(
        "Body { Id = \"Floor\" GeometryId = \"Ground\" Material = \"M\" }\n"
        "Body { Id = \"Rail\" Mass = 1 PrincipalMoments = {1, 1, 1} Forces = {\"G\"} KineticProperties { Position = "
        "{0, 1, "
        "0} } }\n"
        "Body { Id = \"Car\" Mass = 100 PrincipalMoments = {10, 10, 10} Forces = {\"G\"} KineticProperties { Position "
        "= "
        "{0, 0.6, 0} } }\n"
        "Body { Id = \"Wheel\" GeometryId = \"Tyre\" Material = \"M\" Mass = 20 Forces = {\"G\", \"T\"} "
        "KineticProperties { Position = {0, 0.3, 0} Orientation = {0.7071067811865476, 0.7071067811865476, 0, 0} } }\n",
        "Constraint { Type = \"Slider\" Id = \"Along\" Body2 = \"Rail\" CustomProperties { BindPoint = {0, 1, 0} Axis "
        "= "
        "{1, 0, 0} } }\n"
        "Constraint { Type = \"Slider\" Id = \"Guide\" Body1 = \"Rail\" Body2 = \"Car\" CustomProperties { BindPoint = "
        "{0, 0.6, 0} Axis = {0, 1, 0} } }\n" +
            axle("{0, 0.3, 0}"),
        solver, time_step);
  }

 private:
  static std::string axle(const std::string& at) {
    return "Constraint { Type = \"Axle\" Id = \"Axle\" Body1 = \"Car\" Body2 = \"Wheel\" CustomProperties { BindPoint "
           "= " +
           at +
           " SteeringAxis = {0, 1, 0} RollingAxis = {0, 0, 1} SuspensionStiffness = 2e4 SuspensionDamping = 2e3 } }\n";
  }
  static SceneRun run(const std::string& bodies, const std::string& joints, const std::string& solver,
                      double time_step) {
    return SceneRun(
        "Geometries { Geometry { Type = \"Halfspace\" Id = \"Ground\" CustomProperties { } }\n"
        "Geometry { Type = \"Cylinder\" Id = \"Tyre\" CustomProperties { Radius = 0.3 Height = 0.2 } } }\n"
        "Materials { Material { Id = \"M\" StaticFrictionCoefficient = 0.8 } }\n"
        "Forces { Force { Type = \"Gravity\" Id = \"G\" CustomProperties { Acceleration = {0, -9.81, 0} } }\n"
        "Force { Type = \"Basic\" Id = \"T\" CustomProperties { Torque = {0, 0, -100} } } }\n"
        "Simulator { CustomProperties { Duration = 2 } }\n"
        "Environment { Space { Bodies {\n" +
            bodies + "} }\nConstraints {\n" + joints + "} }\n",
        {set("Solver", solver), set("Simulator.TimeStep", time_step)});
  }
};

// `Sequential` kept a velocity of 1e-3 to 4e-3 m/s that moved nothing, on which the damper acted.
TEST_F(SprungWheel, SettlesUnderItsLoad) {
  for (const std::string solver : {"Sequential", "Newton", "Direct"}) {
    for (const double time_step : {1.0 / 60.0, 1.0 / 240.0, 1e-3}) {
      SceneRun settling = guided(solver, time_step);
      settling.to_end();
      EXPECT_NEAR(settling.body("Car").pose.position.y(), 0.3 - kSag, 1e-6) << solver << ' ' << time_step;
      EXPECT_LE(settling.body("Car").twist.linear.norm(), 1e-6) << solver << ' ' << time_step;
    }
  }
}

// One end of the line on which the wheel rolls bore everything, and friction there steered it until it stood across: joints and
// contacts, taken in directions of two times, contradicted each other.
TEST_F(SprungWheel, IsNotSteeredByItsDrive) {
  for (const double time_step : {1.0 / 60.0, 1.0 / 240.0, 1e-3}) {
    SceneRun rolling = driven("Newton", time_step);
    rolling.to_end();
    // 100 N m on a rim of 0.3 m move 121 kg and a wheel's m r^2/2 that rolls
    EXPECT_NEAR(rolling.body("Car").twist.linear.x(), 2.0 * 100.0 / 0.3 / 131.0, 1e-2) << time_step;
    EXPECT_NEAR(rolling.body("Car").pose.position.y(), 0.6 - kSag, 1e-6) << time_step;
    const Vector3 axle = rolling.body("Wheel").pose.orientation * Vector3::UnitY();
    EXPECT_NEAR(std::fabs(axle.z()), 1.0, 1e-9) << time_step;
  }
}

// A ball rolls from the top of a fixed cylinder. Its contact goes along an arc, which looked like slides that end, thirty times a
// step.
TEST(Rolling, AlongAnArcIsNoSlide) {
  SceneRun run(
      "Geometries { Geometry { Type = \"Cylinder\" Id = \"C\" CustomProperties { Radius = 1 Height = 3 } }\n"
      "Geometry { Type = \"Sphere\" Id = \"B\" CustomProperties { Radius = 0.2 } } }\n"
      "Materials { Material { Id = \"M\" StaticFrictionCoefficient = 1 } }\n"
      "Forces { Force { Type = \"Gravity\" Id = \"G\" CustomProperties { Acceleration = {0, -9.81, 0} } } }\n"
      "Environment { Space { Bodies {\n"
      "Body { Id = \"Hill\" GeometryId = \"C\" Material = \"M\" Immovable = true KineticProperties { "
      "Orientation = {0.7071067811865476, 0.7071067811865476, 0, 0} } }\n"
      "Body { Id = \"Ball\" GeometryId = \"B\" Material = \"M\" Mass = 2 Forces = {\"G\"} KineticProperties { "
      "Position = {0, 1.2, 0.3} LinearVelocity = {1.5, 0, 0} AngularVelocity = {0, 0, -7.5} } }\n"
      "} } }\n",
      {set("Simulator.TimeStep", 1.0 / 240.0), set("Simulator.Duration", 0.3), "Simulator=Continuous",
       "Integrator=Verlet", "Solver=Newton"});
  const double energy = run.energy();
  run.to_end();
  EXPECT_LE(run.environment().stage_time(kernel::Stage::kSolve).count(), 72U * 3U);
  EXPECT_NEAR(run.energy(), energy, 1e-3 * energy);  // which it keeps; of first order in the step
  const Vector3 arm = run.body("Ball").pose.position - Vector3(0, 0, 0.3);
  EXPECT_NEAR(arm.norm(), 1.2, 1e-9);
  EXPECT_NEAR(run.body("Ball").twist.linear.norm(), 0.2 * run.body("Ball").twist.angular.norm(), 1e-9);
}

}  // namespace
}  // namespace gravitas
