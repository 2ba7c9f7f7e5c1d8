// A collision filter in a whole run, in every space, and what the plan leaves out for it.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <string>
#include <vector>

#include "tests/scenes/scene_run.h"

namespace gravitas {
namespace {

using harness::SceneRun;
using harness::set;

TEST(CollisionFilter, DecidesWhoFallsThrough) {
  for (const std::string space : {"Basic", "Grid", "KDTree", "SweepAndPrune", "DynamicBVH"}) {
    SceneRun run("filter.gravitas", {set("Space", space)});
    run.to_end();
    // free fall to second order in the step: half a step's fall more or less
    EXPECT_NEAR(run.body("Ghost").pose.position.y(), 1.0 - 0.5 * 9.81 * 4.0, 0.06) << space;
    EXPECT_NEAR(run.body("Solid").pose.position.y(), 0.5, 1e-6) << space;
    EXPECT_NEAR(run.body("Rider").pose.position.y(), 0.5, 1e-6) << space;
  }
}

TEST(CollisionFilter, GivesTheSameChainInEverySpace) {
  SceneRun basic("filter.gravitas", {set("Space", std::string("Basic"))});
  basic.to_end();
  for (const std::string space : {"Grid", "KDTree", "SweepAndPrune", "DynamicBVH"}) {
    SceneRun run("filter.gravitas", {set("Space", space)});
    run.to_end();
    EXPECT_EQ(run.environment().chain_hash().text(), basic.environment().chain_hash().text()) << space;
  }
}

TEST(CollisionFilter, ThatAllowsNothingLeavesThePipelineOut) {
  SceneRun run("filter.gravitas", {"Environment.CollisionFilter.DefaultAllow=false"});
  std::vector<std::string> left_out;
  for (const kernel::LeftOut& left : run.environment().plan().left_out) left_out.push_back(left.what);
  EXPECT_THAT(left_out, ::testing::IsSupersetOf({"space", "collision", "solver"}));
}

}  // namespace
}  // namespace gravitas
