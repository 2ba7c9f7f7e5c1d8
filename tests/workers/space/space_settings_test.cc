// What the spaces say about themselves, and what they refuse to be set to.
#include <gtest/gtest.h>

#include "tests/workers/space/space_problem.h"

namespace gravitas::test {
namespace {

TEST(SpaceSettings, KDTree) {
  PluginUnderTest space("space_kd_tree", {20, 12});
  const PluginDeclaration& declared = space.declaration();
  EXPECT_EQ(declared.name, "KDTree");
  ASSERT_EQ(declared.properties.size(), 2U);
  EXPECT_EQ(declared.properties[0].name, "MaximumDepth");
  EXPECT_EQ(declared.properties[1].name, "MinimumBodies");
  EXPECT_THROW(PluginUnderTest("space_kd_tree", {41, 12}), std::runtime_error);
  EXPECT_THROW(PluginUnderTest("space_kd_tree", {20, 0}), std::runtime_error);
}

TEST(SpaceSettings, SweepAndPrune) {
  PluginUnderTest space("space_sweep_and_prune", {3});
  EXPECT_EQ(space.declaration().name, "SweepAndPrune");
  ASSERT_EQ(space.declaration().properties.size(), 1U);
  EXPECT_EQ(space.declaration().properties[0].name, "Axes");
  EXPECT_THROW(PluginUnderTest("space_sweep_and_prune", {0}), std::runtime_error);
  EXPECT_THROW(PluginUnderTest("space_sweep_and_prune", {4}), std::runtime_error);
}

TEST(SpaceSettings, DynamicBVH) {
  PluginUnderTest space("space_dynamic_bvh");
  EXPECT_EQ(space.declaration().name, "DynamicBVH");
  EXPECT_TRUE(space.declaration().properties.empty());
}

}  // namespace
}  // namespace gravitas::test
