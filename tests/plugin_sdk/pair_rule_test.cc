#include "plugin_sdk/pair_rule.h"

#include <gtest/gtest.h>

#include <vector>

#include "plugin_sdk/conformance/draw.h"

namespace gravitas {
namespace {

bool brute_force(const std::vector<TouchRights>& bodies) {
  for (std::size_t i = 0; i < bodies.size(); ++i)
    for (std::size_t k = 0; k < i; ++k)
      if (may_touch(bodies[i], bodies[k])) return true;
  return false;
}

TEST(PairRule, ShapesMovabilityAndBothMasksDecide) {
  const TouchRights ball{kHasShape | kMovable, 1, 1}, ground{kHasShape, 1, 1};
  EXPECT_TRUE(may_touch(ball, ball));
  EXPECT_TRUE(may_touch(ball, ground));
  EXPECT_FALSE(may_touch(ground, ground));                      // nothing can be pushed
  EXPECT_FALSE(may_touch(ball, {kMovable, 1, 1}));              // a body without a shape
  EXPECT_FALSE(may_touch(ball, {kHasShape | kMovable, 1, 2}));  // it does not look for group 1
  EXPECT_FALSE(may_touch(ball, {kHasShape | kMovable, 2, 1}));  // nobody looks for group 2
  EXPECT_TRUE(may_touch({kHasShape | kMovable, 1, 2}, {kHasShape, 2, 1}));
}

TEST(PairRule, WhetherAnyCanTouchIsWhatLookingAtAllPairsSays) {
  int touching = 0;
  constexpr int kRuns = 20'000;
  for (int run = 0; run < kRuns; ++run) {
    conformance::Draw draw(static_cast<std::uint64_t>(run));
    std::vector<TouchRights> bodies(draw.below(7));
    for (TouchRights& body : bodies) {
      // few kinds, so that equal bodies are frequent
      body.flags = (draw.below(2) != 0 ? kHasShape : 0U) | (draw.below(2) != 0 ? kMovable : 0U);
      body.group = draw.below(4);
      body.mask = draw.below(4);
    }
    const bool expected = brute_force(bodies);
    EXPECT_EQ(can_any_touch(bodies), expected) << "run " << run;
    touching += expected ? 1 : 0;
  }
  // both answers are common
  EXPECT_GT(touching, kRuns / 10);
  EXPECT_LT(touching, kRuns * 9 / 10);
}

}  // namespace
}  // namespace gravitas
