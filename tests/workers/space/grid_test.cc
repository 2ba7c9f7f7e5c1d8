// Space `Grid`: what is its own. That it agrees with the others is in space_agreement_test.cc.
#include <gtest/gtest.h>

#include <cmath>

#include "tests/workers/space/space_problem.h"

namespace gravitas::test {
namespace {

const double kDefaultCell = std::nan("");

// CellSize and CleanupInterval.
std::vector<double> settings(double cell_size) { return {cell_size, 1.0}; }

// Two bodies that share many cells, one of them tested against all besides.
TEST(GridSpace, NamesEachPairOnce) {
  PluginUnderTest grid("space_grid", settings(1.0));
  const std::vector<BoundedBody> bodies = {cube({0, 0, 0}, 1.4), cube({0.1, 0, 0}, 1.4), cube({0, 0, 0}, 400.0),
                                           cube({0, 1, 0}, 500.0)};
  EXPECT_EQ(ask_pairs(&grid, bodies), (Pairs{{0, 1}, {0, 2}, {0, 3}, {1, 2}, {1, 3}, {2, 3}}));
}

TEST(GridSpace, DeclaresItsSettings) {
  PluginUnderTest grid("space_grid", settings(kDefaultCell));
  const PluginDeclaration& declared = grid.declaration();
  EXPECT_EQ(declared.name, "Grid");
  ASSERT_EQ(declared.properties.size(), 2U);
  EXPECT_EQ(declared.properties[0].name, "CellSize");
  EXPECT_TRUE(declared.properties[0].exclusive_minimum);
  EXPECT_EQ(declared.properties[1].name, "CleanupInterval");
  EXPECT_THROW(PluginUnderTest("space_grid"), std::runtime_error);
}

}  // namespace
}  // namespace gravitas::test
