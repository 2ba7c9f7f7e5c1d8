// Two balls that graze each other: where they meet, and what they part with, in closed form. The normal of what overlaps at
// the end of a step is another one than where they met.
#include <gtest/gtest.h>

#include <cmath>
#include <string>

#include "tests/scenes/scene_run.h"

namespace gravitas {
namespace {

using harness::literal;
using harness::SceneRun;
using harness::set;

constexpr double kGrazed = 0.1, kGrazing = 2.0;  // radius, m; speed of each, m/s

std::string balls(double gap, double offset, double mass) {
  return R"(
Geometries { Geometry { Type = "Sphere" Id = "Ball" CustomProperties { Radius = 0.1 } } }
Materials { Material { Id = "M" StaticFrictionCoefficient = 0 RestitutionCoefficient = 1 } }
Forces { }
Simulator { CustomProperties { Duration = 0.6 } }
Environment { Space { Bodies {
  Body { Id = "A" GeometryId = "Ball" Material = "M" Mass = 1 KineticProperties { LinearVelocity = {2, 0, 0} } }
  Body { Id = "B" GeometryId = "Ball" Material = "M" Mass = )" +
         literal(mass) + " KineticProperties { Position = " + literal(Vector3(gap, offset, 0.0)) +
         R"( LinearVelocity = {-2, 0, 0} } }
} } }
)";
}

TEST(GlancingImpact, IsWhereTheBallsMeet) {
  for (const double offset : {0.0, 0.01, 0.05, 0.12, 0.19})
    for (const double gap : {1.0, 1.013, 1.026, 1.039, 1.052}) {
      const double mass = 1.0 + gap, way = std::sqrt(4.0 * kGrazed * kGrazed - offset * offset);
      const double meeting = (gap - way) / (2.0 * kGrazing);
      const Vector3 normal = Vector3(way, offset, 0.0).normalized();
      const Vector3 impulse = 2.0 * (2.0 * kGrazing * normal.x()) * mass / (1.0 + mass) * normal;
      for (const char* simulator : {"Bisection", "Continuous"})
        for (const double time_step : {1.0 / 60.0, 1.0 / 240.0}) {
          SceneRun run(balls(gap, offset, mass),
                       {std::string("Simulator=") + simulator, "Solver=Newton", set("Simulator.TimeStep", time_step)});
          const Vector3 before = run.angular_momentum();
          run.to_end();
          const Vector3 a = Vector3(kGrazing, 0, 0) - impulse, b = Vector3(-kGrazing, 0, 0) + impulse / mass;
          EXPECT_LT((run.body("A").twist.linear - a).norm(), 1e-8) << simulator << offset << gap;
          EXPECT_LT((run.body("B").twist.linear - b).norm(), 1e-8) << simulator << offset << gap;
          const Vector3 place = Vector3(kGrazing * meeting, 0, 0) + (run.time() - meeting) * a;
          EXPECT_LT((run.body("A").pose.position - place).norm(), 1e-8) << simulator << offset << gap;
          EXPECT_LT((run.angular_momentum() - before).norm(), 1e-8) << simulator << offset << gap;
          EXPECT_EQ(run.count_events(EventKind::kCollisionStart), 1U) << simulator << offset << gap;
        }
    }
}

}  // namespace
}  // namespace gravitas
