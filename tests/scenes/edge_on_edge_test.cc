// Parallel edges that meet head on, where any direction between the faces would do as the normal: what is symmetric stays so.
#include <gtest/gtest.h>

#include <cmath>
#include <string>

#include "tests/scenes/scene_run.h"

namespace gravitas {
namespace {

using harness::literal;
using harness::SceneRun;
using harness::set;

constexpr double kHalfLength = 1.0, kHalfThickness = 0.05, kAngle = 0.4;

std::string body(const std::string& name, const Vector3& position, double turn, double speed) {
  return "Body { Id = \"" + name + "\" GeometryId = \"Beam\" Material = \"M\" Mass = 2 Forces = {\"Down\"} " +
         "KineticProperties { Position = " + literal(position) + " Orientation = {" + literal(std::cos(0.5 * turn)) +
         ", 0, 0, " + literal(std::sin(0.5 * turn)) + "} LinearVelocity = {" + literal(speed) + ", 0, 0} } }\n";
}

std::string scene(const std::string& shape, double friction, double restitution, double gravity, double duration,
                  const std::string& bodies) {
  return "Geometries { Geometry { Type = \"Halfspace\" Id = \"Ground\" CustomProperties { } } Geometry { Id = "
         "\"Beam\" " +
         shape + " } }\nMaterials { Material { Id = \"M\" RestitutionCoefficient = " + literal(restitution) +
         " StaticFrictionCoefficient = " + literal(friction) + " DynamicFrictionCoefficient = " + literal(friction) +
         " } }\nForces { Force { Type = \"Gravity\" Id = \"Down\" CustomProperties { Acceleration = {0, " +
         literal(-gravity) + ", 0} } } }\nSimulator { CustomProperties { Duration = " + literal(duration) +
         " } }\nEnvironment { Space { Bodies {\n" + bodies + "} } }\n";
}

const std::string kBeam = "Type = \"Box\" CustomProperties { HalfExtents = {0.05, 1, 0.3} }";

// Two beams lean on each other. The ground presses each foot with its weight W, and about the foot the push H at the edges
// above holds it up: H h = W a, a the way from the foot to below the centre, h the height of the edges; H = mu W at the
// limit. Before, gables stood for twice that friction alone, and slid to one side.
TEST(EdgeOnEdge, GableStandsWhereStaticsSays) {
  const double c = std::cos(kAngle), s = std::sin(kAngle);
  const double least = (kHalfLength * s - kHalfThickness * c) / (2.0 * kHalfLength * c);
  const Vector3 right(kHalfLength * s + kHalfThickness * c, kHalfLength * c + kHalfThickness * s, 0.0);
  const Vector3 left(-right.x(), right.y(), 0.0);
  const std::string bodies = "Body { Id = \"Ground\" GeometryId = \"Ground\" Material = \"M\" }\n" +
                             body("Right", right, kAngle, 0.0) + body("Left", left, -kAngle, 0.0);
  const auto slides = [&](double share, const std::string& solver, double time_step) {
    SceneRun run(scene(kBeam, share * least, 0.0, kG, 1.0, bodies),
                 {"Solver=" + solver, set("Simulator.TimeStep", time_step)});
    run.to_end();
    const Vector3 end = run.body("Right").pose.position;
    EXPECT_NEAR(end.x(), -run.body("Left").pose.position.x(), 1e-6) << share << ", " << solver << ", " << time_step;
    return std::fabs(end.x() - right.x()) > 1e-3;
  };
  for (const std::string solver : {"Newton", "Direct", "Sequential"}) {
    for (const double time_step : {1.0 / 60.0, 1.0 / 240.0}) {
      EXPECT_FALSE(slides(1.05, solver, time_step)) << solver << ", " << time_step;
      EXPECT_TRUE(slides(0.95, solver, time_step)) << solver << ", " << time_step;
    }
  }
}

// Two turned alike, thrown at each other without friction and loss: J (1/m + y^2/I) = 2 v, y the height of the edges over the
// centres. Before, they left with 0.2 to 0.4 m/s across.
TEST(EdgeOnEdge, MirroredBodiesLeaveMirrored) {
  constexpr double kX = 0.1, kY = 0.3, kMass = 2.0;
  constexpr double kMoment = kMass * (kX * kX + kY * kY) / 3.0;
  const std::string shape = "Type = \"Box\" CustomProperties { HalfExtents = {0.1, 0.3, 0.3} }";
  for (const double angle : {0.3, 0.6}) {
    const double c = std::cos(angle), s = std::sin(angle);
    const double x = kX * c + kY * s, y = kY * c - kX * s;
    const double impulse = 2.0 / (1.0 / kMass + y * y / kMoment);
    const std::string bodies =
        body("Right", {x + 0.01, 0, 0}, angle, -1.0) + body("Left", {-x - 0.01, 0, 0}, -angle, 1.0);
    for (const std::string simulator : {"Basic", "Continuous"}) {
      SceneRun run(scene(shape, 0.0, 1.0, 0.0, 0.1, bodies), {"Simulator=" + simulator, "Solver=Newton"});
      run.to_end();
      for (const double side : {1.0, -1.0}) {
        const Twist twist = run.body(side > 0.0 ? "Right" : "Left").twist;
        const std::string what = literal(angle) + ", " + simulator;
        EXPECT_NEAR(twist.linear.x(), side * (impulse / kMass - 1.0), 1e-5) << what;
        EXPECT_NEAR(twist.linear.y(), 0.0, 1e-5) << what;
        EXPECT_NEAR(twist.angular.z(), -side * y * impulse / kMoment, 1e-4) << what;
      }
    }
  }
}

}  // namespace
}  // namespace gravitas
