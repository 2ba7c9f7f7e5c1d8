#include "kernel/plan.h"

#include <gtest/gtest.h>

#include <algorithm>

#include "tests/kernel/world_builder.h"

namespace gravitas::kernel {
namespace {

using testing::WorldBuilder;

std::vector<Slot> planned(WorldBuilder builder) {
  std::vector<Slot> slots;
  for (const PlannedSlot& slot : make_plan(&builder.description()).slots) slots.push_back(slot.slot);
  std::ranges::sort(slots);
  return slots;
}

TEST(Plan, NothingNeedsNothing) { EXPECT_TRUE(planned(WorldBuilder()).empty()); }

TEST(Plan, OneBodyWithoutForcesNeedsTheIntegrator) {
  EXPECT_EQ(planned(WorldBuilder().sphere(1, 1, Vector3::Zero())), std::vector{Slot::kIntegrator});
}

TEST(Plan, TwoShapesNeedSpaceCollisionAndSolver) {
  const std::vector<Slot> expected = {Slot::kSpace, Slot::kCollision, Slot::kSolver, Slot::kIntegrator};
  EXPECT_EQ(planned(WorldBuilder().ground().sphere(1, 1, Vector3(0, 5, 0))), expected);
}

TEST(Plan, BodiesThatCannotBePushedCannotTouch) {
  WorldBuilder builder;
  builder.ground().sphere(1, 1, Vector3::Zero());
  builder.body().flags = (builder.body().flags & ~std::uint32_t{kMovable}) | kKinematic;
  EXPECT_EQ(planned(builder), std::vector{Slot::kIntegrator});
}

TEST(Plan, BodiesWhoseFiltersForbidItCannotTouch) {
  WorldBuilder builder;
  builder.ground().sphere(1, 1, Vector3(0, 5, 0));
  builder.body().filter_group = 2;
  builder.description().bodies[0].filter_mask = 1;
  EXPECT_EQ(planned(builder), std::vector{Slot::kIntegrator});
}

TEST(Plan, AJointNeedsConstraintAndSolver) {
  WorldBuilder builder;
  builder.point(1, Vector3::Ones(), Vector3(1, 0, 0)).joint("Spherical", "constraint_spherical", kNone, 0, {0, 0, 0});
  const std::vector<Slot> expected = {Slot::kConstraint, Slot::kSolver, Slot::kIntegrator};
  EXPECT_EQ(planned(builder), expected);
}

TEST(Plan, WhatIsLeftOutHasAReasonAndNoPlugins) {
  WorldBuilder builder;
  builder.sphere(1, 1, Vector3::Zero());
  const Plan plan = make_plan(&builder.description());
  ASSERT_EQ(plan.left_out.size(), 5U);
  for (const LeftOut& left_out : plan.left_out) EXPECT_FALSE(left_out.why.empty()) << left_out.what;
  EXPECT_TRUE(builder.description().solver.plugins.empty());
  EXPECT_TRUE(builder.description().collision.plugins.empty());
}

TEST(Plan, TheMarginIsAHundredthOfTheSmallestShape) {
  WorldBuilder builder;
  EXPECT_EQ(contact_margin(builder.ground().description()), 0.0);
  builder.sphere(2, 1, Vector3::Zero()).box(Vector3(3, 0.5, 1), 1, Vector3::Zero());
  EXPECT_DOUBLE_EQ(contact_margin(builder.description()), 0.005);
}

}  // namespace
}  // namespace gravitas::kernel
