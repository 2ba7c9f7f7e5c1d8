// Kinematic bodies that follow a Motion: what they do, what they do to others, and tables that are refused.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <string>

#include "tests/scenes/scene_run.h"

namespace gravitas {
namespace {

using harness::SceneRun;
using harness::set;

// A lift that is at t^2/2 at time t, a turning door whose hinge stays, and a crate on the lift.
std::string lift(const std::string& integrator) {
  std::string rows, door;
  for (int i = 0; i <= 10; ++i) {
    const double t = 0.2 * i;
    rows += (i > 0 ? ", " : "") + std::string("{") + harness::literal(t) + ", " +
            harness::literal(Vector3(0, 0.5 * t * t - 0.25, 0)) + ", {1, 0, 0, 0}}";
    door += (i > 0 ? ", " : "") + std::string("{") + harness::literal(t) + ", {9, 0, 0}, " +
            harness::literal(harness::turned({0, 1, 0}, 0.8 * t)) + "}";
  }
  return R"(
Geometries {
  Geometry { Type = "Box" Id = "Deck" CustomProperties { HalfExtents = {2, 0.25, 2} } }
  Geometry { Type = "Box" Id = "Crate" CustomProperties { HalfExtents = {0.3, 0.2, 0.3} } }
}
Forces { Force { Type = "Gravity" Id = "Down" CustomProperties { Acceleration = {0, -9.81, 0} } }
  Force { Type = "Spring" Id = "Rope" CustomProperties { Stiffness = 40 AnchorBody = "Lift" AnchorPoint = {0, 0.25, 0} } } }
Simulator { CustomProperties { TimeStep = 0.005 Duration = 2 } }
Environment {
  Space { Bodies {
    Body { Id = "Lift" GeometryId = "Deck" Kinematic = true Motion = {)" +
         rows + R"(} }
    Body { Id = "Door" GeometryId = "Deck" Kinematic = true Mass = 5 PrincipalMoments = {1, 1, 1} CentreOfMass = {1, 0, 0} Motion = {)" +
         door + R"(} }
    Body { Id = "Box" GeometryId = "Crate" Mass = 4 KineticProperties { Position = {0, 0.2, 0} } Forces = { "Down" } }
    Body { Id = "Hung" Mass = 1 PrincipalMoments = {1, 1, 1} KineticProperties { Position = {0, 5, 0} LinearVelocity = {0, 0, 0} } Forces = { "Rope" } }
  } }
  ConstraintSolver = "Newton"
  KineticIntegrator = ")" +
         integrator + R"("
}
)";
}

class PrescribedMotion : public ::testing::TestWithParam<const char*> {};

INSTANTIATE_TEST_SUITE_P(EachIntegrator, PrescribedMotion,
                         ::testing::Values("Euler", "SemiImplicitEuler", "Verlet", "BasicVerlet", "RK4", "RKMK4",
                                           "SymplecticSplitting", "ImplicitMidpoint", "DormandPrince54",
                                           "DormandPrince853", "Rosenbrock", "Radau"),
                         [](const auto& which) { return std::string(which.param); });

TEST_P(PrescribedMotion, IsWhereItsTableHasItWithTheVelocitiesThere) {
  SceneRun run(lift(GetParam()));
  while (!run.is_done()) {
    run.step();
    const double t = run.time();
    const SceneRun::Motion now = run.body("Lift"), door = run.body("Door");
    // rounding of the table's numbers, and of their quotients over 0.2 s
    ASSERT_NEAR(now.pose.position.y(), 0.5 * t * t - 0.25, 1e-14);
    ASSERT_NEAR(now.twist.linear.y(), t, 1e-13);
    ASSERT_LT(harness::angle_between(door.pose.orientation, harness::turned({0, 1, 0}, 0.8 * t)), 1e-13);
    ASSERT_LT((door.twist.angular - Vector3(0, 0.8, 0)).norm(), 1e-13);
  }
}

TEST_P(PrescribedMotion, LiftsWhatStandsOnIt) {
  SceneRun run(lift(GetParam()));
  while (!run.is_done()) {
    run.step();
    const SceneRun::Motion box = run.body("Box");
    ASSERT_NEAR(box.pose.position.y() - 0.2, 0.5 * run.time() * run.time(), 1e-9) << run.time();
    ASSERT_NEAR(box.twist.linear.y(), run.time(), 1e-9) << run.time();
  }
}

// y'' = -k (y - L), L = t^2/2: y = L - 1/k + (5 + 1/k) cos(w t) for m = 1, from y = 5 at rest.
TEST(PrescribedMotion, IsSeenByForcesAtTheTimesTheyAreAskedFor) {
  SceneRun run(lift("RK4"));
  run.to_end();
  const double k = 40.0, w = std::sqrt(k), t = run.time();
  // RK4 at h w = 0.03 over 400 steps: (h w)^4/120 times w t
  EXPECT_NEAR(run.body("Hung").pose.position.y(), 0.5 * t * t - 1.0 / k + (5.0 + 1.0 / k) * std::cos(w * t), 5e-7);
}

}  // namespace
}  // namespace gravitas
