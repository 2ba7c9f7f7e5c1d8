// Space `Basic` against the contract: who is a pair, and in which order.
#include <gtest/gtest.h>

#include "plugin_sdk/conformance/draw.h"
#include "tests/workers/space/space_problem.h"

namespace gravitas::test {
namespace {

class BasicSpace : public testing::Test {
 protected:
  Pairs pairs(const std::vector<BoundedBody>& bodies) { return ask_pairs(&space_, bodies); }
  PluginUnderTest space_{"space_basic"};
};

TEST_F(BasicSpace, SaysWhatItIs) {
  EXPECT_EQ(space_.declaration().name, "Basic");
  EXPECT_EQ(space_.declaration().slot, Slot::kSpace);
}

TEST_F(BasicSpace, OfNothingIsNothing) {
  EXPECT_EQ(pairs({}), Pairs{});
  EXPECT_EQ(pairs({cube({0, 0, 0}, 1)}), Pairs{});
}

TEST_F(BasicSpace, ClosedBoundsTouch) {
  const BoundedBody here = cube({0, 0, 0}, 1);
  EXPECT_EQ(pairs({here, cube({2, 0, 0}, 1)}), (Pairs{{0, 1}}));  // a face
  EXPECT_EQ(pairs({here, cube({2, 2, 2}, 1)}), (Pairs{{0, 1}}));  // a corner
  EXPECT_EQ(pairs({here, cube({2.0000001, 0, 0}, 1)}), Pairs{});
  EXPECT_EQ(pairs({here, cube({0, -2.0000001, 0}, 1)}), Pairs{});
  EXPECT_EQ(pairs({here, cube({0.2, 0, 0}, 0.1)}), (Pairs{{0, 1}}));  // inside
}

TEST_F(BasicSpace, WantsShapesAndOneThatMoves) {
  BoundedBody ball = cube({0, 0, 0}, 1), ground = ball, moved = ball, ghost = ball;
  ground.flags = kHasShape;
  moved.flags = kHasShape | kKinematic;
  ghost.flags = kMovable;
  EXPECT_EQ(pairs({ball, ground}), (Pairs{{0, 1}}));
  EXPECT_EQ(pairs({moved, ball}), (Pairs{{0, 1}}));
  EXPECT_EQ(pairs({ground, ground, moved, moved}), Pairs{});
  EXPECT_EQ(pairs({ball, ghost}), Pairs{});
}

TEST_F(BasicSpace, WantsBothFiltersToAllow) {
  BoundedBody a = cube({0, 0, 0}, 1), b = a;
  a.group = 1, a.mask = 2;
  b.group = 2, b.mask = 1;
  EXPECT_EQ(pairs({a, b}), (Pairs{{0, 1}}));
  EXPECT_EQ(pairs({a, a}), Pairs{});
  b.mask = 4;  // a would, b would not
  EXPECT_EQ(pairs({a, b}), Pairs{});
  b.mask = std::uint64_t{1} << 63, a.group = b.mask;  // the highest bit counts too
  EXPECT_EQ(pairs({a, b}), (Pairs{{0, 1}}));
}

TEST_F(BasicSpace, UnboundedBodiesMeetEverything) {
  constexpr double kInfinity = std::numeric_limits<double>::infinity();
  BoundedBody ground{Vector3::Constant(-kInfinity), Vector3::Constant(kInfinity), kHasShape | kUnbounded};
  EXPECT_EQ(pairs({cube({0, 0, 0}, 1), ground, cube({1e300, 0, 0}, 1)}), (Pairs{{0, 1}, {1, 2}}));
  BoundedBody below = ground;
  below.upper.y() = 0.0;
  EXPECT_EQ(pairs({below, cube({0, 1, 0}, 1), cube({5, 1.1, 0}, 1)}), (Pairs{{0, 1}}));
}

TEST_F(BasicSpace, AnswersInOrder) {
  const BoundedBody here = cube({0, 0, 0}, 1);
  EXPECT_EQ(pairs({here, here, here, here}), (Pairs{{0, 1}, {0, 2}, {0, 3}, {1, 2}, {1, 3}, {2, 3}}));
}

TEST_F(BasicSpace, IsTheContractOnRandomBodies) {
  conformance::Draw random(1);
  for (int round = 0; round < 200; ++round) {
    std::vector<BoundedBody> bodies;
    for (int i = 0; i < 30; ++i) {
      BoundedBody body = cube(random.vector(3.0), random.uniform(0.1, 1.0));
      body.flags = random.below(32);
      body.group = random.below(8), body.mask = random.below(8);
      bodies.push_back(body);
    }
    ASSERT_EQ(pairs(bodies), expected_pairs(bodies)) << "round " << round;
  }
}

TEST_F(BasicSpace, MarksProgress) {
  pairs(std::vector<BoundedBody>(10, cube({0, 0, 0}, 1)));
  EXPECT_GE(space_.marks, 10);
}

}  // namespace
}  // namespace gravitas::test
