// What the plan says plugins need not do: each entry appears with its reason and goes with the first thing that needs the
// work, and the bits are those of a run that has a use for it, far away from all that moves.
#include "services/run/omissions.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <string>
#include <vector>

#include "services/run/report.h"
#include "tests/scenes/scene_run.h"

namespace gravitas {
namespace {

using harness::SceneRun;
using ::testing::Contains;
using ::testing::Not;
using ::testing::UnorderedElementsAre;

// Balls that fall on a plane, and one of material `material` with shape `shape` that hangs far above, out of their way.
std::string balls(const std::string& material, const std::string& shape) {
  const auto ball = [](const std::string& id, const std::string& at, const std::string& more, const std::string& form) {
    return "Body { Id = \"" + id + "\" GeometryId = \"" + form + "\" Material = \"" + more + "\" Mass = 1 Forces = { " +
           (id == "Far" ? "" : "\"Down\"") + " } KineticProperties { Position = " + at + " } }\n";
  };
  return "Geometries { Geometry { Type = \"Sphere\" Id = \"Ball\" CustomProperties { Radius = 0.5 } }\n"
         "  Geometry { Type = \"Box\" Id = \"Crate\" CustomProperties { HalfExtents = {0.5, 0.5, 0.5} } }\n"
         "  Geometry { Type = \"Halfspace\" Id = \"Plane\" } }\n"
         "Materials {\n"
         "  Material { Id = \"Ice\" StaticFrictionCoefficient = 0 }\n"
         "  Material { Id = \"Rubber\" StaticFrictionCoefficient = 0.8 }\n"
         "  Material { Id = \"Sand\" StaticFrictionCoefficient = 0 RollingFrictionCoefficient = 0.1 }\n"
         "  Material { Id = \"Gravel\" StaticFrictionCoefficient = 0 SurfacePerturbationCoefficient = 0.2 } }\n"
         "Forces { Force { Type = \"Gravity\" Id = \"Down\" CustomProperties { Acceleration = {0, -9.81, 0} } } }\n"
         "Simulator { Type = \"Basic\" Id = \"Main\" CustomProperties { TimeStep = 0.01 Duration = 1.5 } }\n"
         "Environment { Id = \"World\" Space { Type = \"Grid\" Id = \"Cells\" Bodies {\n"
         "  Body { Id = \"Ground\" GeometryId = \"Plane\" Material = \"Ice\" }\n" +
         ball("One", "{0, 0.8, 0}", "Ice", "Ball") + ball("Two", "{0.3, 2, 0.1}", "Ice", "Ball") +
         ball("Three", "{-0.2, 3.3, 0}", "Ice", "Ball") + ball("Far", "{0, 1000, 0}", material, shape) +
         "} } KineticIntegrator = \"SemiImplicitEuler\" ConstraintSolver = \"Sequential\" }";
}

std::vector<std::string> left_out(const SceneRun& run) {
  std::vector<std::string> what;
  for (const kernel::LeftOut& one : omissions(const_cast<SceneRun&>(run).environment(), run.description())) {
    EXPECT_FALSE(one.why.empty()) << one.what;
    what.push_back(one.what);
  }
  return what;
}

std::string chain_of(SceneRun* run) {
  run->to_end();
  return run->environment().chain_hash().text();
}

TEST(Omissions, OfBallsOnIce) {
  SceneRun run(balls("Ice", "Ball"));
  EXPECT_THAT(left_out(run), UnorderedElementsAre("friction", "rolling friction", "surface perturbation", "manifolds",
                                                  "times of impact", "physics checks"));
}

TEST(Omissions, ChangeNoBit) {
  SceneRun shortest(balls("Ice", "Ball"));
  const std::string chain = chain_of(&shortest);
  EXPECT_GT(shortest.count_events(EventKind::kCollisionStart), 2U);
  struct Use {
    const char* what;
    std::string scene;
    std::vector<std::string> overrides;
  };
  const Use uses[] = {{"friction", balls("Rubber", "Ball"), {}},
                      {"rolling friction", balls("Sand", "Ball"), {}},
                      {"surface perturbation", balls("Gravel", "Ball"), {}},
                      {"manifolds", balls("Ice", "Crate"), {}},
                      {"physics checks", balls("Ice", "Ball"), {"Simulator.CheckPhysicsEvery=1"}}};
  for (const Use& use : uses) {
    SCOPED_TRACE(use.what);
    SceneRun run(use.scene, use.overrides);
    EXPECT_THAT(left_out(run), Not(Contains(use.what)));
    EXPECT_EQ(left_out(run).size(), 5U);
    EXPECT_EQ(chain_of(&run), chain);
  }
}

// What slots are left out for is not said twice.
TEST(Omissions, SayNothingOfContactsThatCannotBe) {
  SceneRun run(balls("Ice", "Ball"), {"Environment.CollisionFilter.DefaultAllow=false"});
  EXPECT_THAT(left_out(run), UnorderedElementsAre("physics checks"));
}

TEST(Omissions, AContinuousSimulatorAsksForTimesOfImpact) {
  SceneRun run(balls("Ice", "Ball"), {"Simulator=Continuous"});
  EXPECT_THAT(left_out(run), Not(Contains("times of impact")));
}

// They stand in the plan that people and reports see, after the kernel's.
TEST(Omissions, StandInThePlan) {
  SceneRun run(balls("Ice", "Ball"));
  const report::v1::Plan plan = plan_message(run.environment(), run.description());
  const auto what = [](const report::v1::LeftOut& one) { return one.what(); };
  const auto& all = plan.left_out();
  EXPECT_NE(std::ranges::find(all, "friction", what), all.end());
  EXPECT_NE(std::ranges::find(all, "constraint", what), all.end());
}

}  // namespace
}  // namespace gravitas
