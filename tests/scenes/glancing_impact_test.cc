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

// Two cylinders that meet at one end and, a millisecond later, at the other: the second impact was taken for what the first had
// pressed already, and lost half of the energy.
TEST(GlancingImpact, AtTheOtherEndIsOneMore) {
  const std::string scene = R"(
Geometries { Geometry { Type = "Cylinder" Id = "Rod" CustomProperties { Radius = 0.12 Height = 0.3 } } }
Materials { Material { Id = "M" StaticFrictionCoefficient = 0 RestitutionCoefficient = 1 } }
Forces { }
Simulator { CustomProperties { Duration = 0.6 } }
Environment { Space { Bodies {
  Body { Id = "A" GeometryId = "Rod" Material = "M" Mass = 1 PrincipalMoments = {0.011, 0.017, 0.023} KineticProperties {
    Position = {-0.6, 0.024727318073039066, 0.017368695313345145} LinearVelocity = {2, 0, 0}
    Orientation = {0.7729450068111547, 0.05468761058439763, 0.17466696913335472, 0.6075003963686286}
    AngularVelocity = {-0.7583411674414605, -2.0377471016797277, 0.7523377923865361} } }
  Body { Id = "B" GeometryId = "Rod" Material = "M" Mass = 2 PrincipalMoments = {0.011, 0.017, 0.023} KineticProperties {
    Position = {0.6, 0.008031757885234803, 0.02127541424413387} LinearVelocity = {-2, 0, 0}
    Orientation = {-0.41167921878077663, 0.6651998747034459, 0.16987489071696835, -0.5993094948245425}
    AngularVelocity = {0.3550402325627298, -1.5651381958941586, 0.5246579993462065} } }
} } }
)";
  for (const char* solver : {"Newton", "Direct", "Sequential"})
    for (const double time_step : {1.0 / 60.0, 0.01, 1.0 / 240.0, 1e-3}) {
      SceneRun run(scene,
                   {"Simulator=Continuous", std::string("Solver=") + solver, set("Simulator.TimeStep", time_step)});
      const double before = run.kinetic_energy();
      run.to_end();
      EXPECT_NEAR(run.kinetic_energy(), before, 1e-3 * before) << solver << time_step;
    }
}

}  // namespace
}  // namespace gravitas
