#include "kernel/plan.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <limits>
#include <string>

#include "kernel/environment.h"
#include "tests/kernel/run_to_end.h"
#include "tests/kernel/world_builder.h"

namespace gravitas::kernel {
namespace {

using harness::WorldBuilder;

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
  ASSERT_EQ(plan.left_out.size(), 6U);
  for (const LeftOut& left_out : plan.left_out) EXPECT_FALSE(left_out.why.empty()) << left_out.what;
  EXPECT_TRUE(builder.description().solver.plugins.empty());
  EXPECT_TRUE(builder.description().collision.plugins.empty());
}

std::string why_none_sleeps(EnvironmentDescription* description) {
  const Plan plan = make_plan(description);
  const auto left_out = std::ranges::find(plan.left_out, "sleep", &LeftOut::what);
  EXPECT_EQ(description->sleep.energy > 0.0, left_out == plan.left_out.end());
  return left_out == plan.left_out.end() ? "" : left_out->why;
}

TEST(Plan, SleepIsLeftOutWhereNothingCanFallAsleep) {
  const auto why = [](const auto& change) {
    WorldBuilder builder;
    builder.ground().sphere(1, 1, Vector3(0, 1, 0)).body().flags |= kCanSleep;
    change(&builder);
    return why_none_sleeps(&builder.description());
  };
  EXPECT_EQ(why([](WorldBuilder*) {}), "");
  EXPECT_EQ(why([](WorldBuilder* builder) { builder->description().sleep.energy = 0.0; }), "SleepEnergy is 0");
  EXPECT_EQ(why([](WorldBuilder* builder) { builder->body().flags &= ~std::uint32_t{kCanSleep}; }),
            "no body may sleep");
  EXPECT_EQ(why([](WorldBuilder* builder) { builder->body().filter_mask = 0; }),
            "there are neither contacts nor joints that could hold a body");
  const auto make_smooth = [](WorldBuilder* builder) {
    builder->body().filter_mask = 0;
    builder->description().simulator = Simulator::kSmooth;
  };
  EXPECT_EQ(why(make_smooth), "the simulator Smooth stops no motion");
}

// Two bodies turn and drift, and a third rests far away: it alone has a use for what is left out, or all of it.
enum class Use { kNothing, kConstantForce, kForce, kJoint, kContacts, kSleep, kAll };

WorldBuilder in_flight(Use use, const std::string& integrator) {
  const auto has = [&](Use one) { return use == one || use == Use::kAll; };
  WorldBuilder builder;
  builder.steps(200, 0.01).integrator(integrator);
  builder.box(Vector3(0.5, 0.4, 0.3), 2.0, Vector3(0.1, 0.2, 0.3), Vector3(1, -2, 0.5));
  builder.body().twist.angular = Vector3(0.3, 2, -0.7);
  builder.body().damping = 0.1;
  builder.box(Vector3(0.2, 0.4, 0.6), 3.0, Vector3(50, 0.2, 0.3), Vector3(1, 2, 0.5));
  builder.body().twist.angular = Vector3(-4, 1, 0.7);
  builder.sphere(0.5, 1.0, Vector3(1000, 0, 0));
  const bool can_touch = has(Use::kContacts) || has(Use::kSleep);
  for (BodyDescription& body : builder.description().bodies) body.filter_mask = can_touch ? ~std::uint64_t{0} : 0;
  builder.description().sleep.energy = has(Use::kSleep) ? 1e-6 : 0.0;
  if (has(Use::kSleep)) builder.body().flags |= kCanSleep;
  if (has(Use::kConstantForce)) builder.force("Gravity", "force_gravity", {0, 0, 0});
  const double absent = std::numeric_limits<double>::quiet_NaN();
  if (has(Use::kForce)) builder.force("Spring", "force_spring", {9, 1, 1, 0, 0, 0, absent, 1001, 0, 0});
  if (has(Use::kJoint)) builder.joint("Spherical", "constraint_spherical", kNone, 2, {1000, 0, 0});
  return builder;
}

TEST(Plan, WhatIsLeftOutChangesNoBit) {
  for (const char* integrator : {"integrator_euler", "integrator_semi_implicit_euler", "integrator_verlet",
                                 "integrator_basic_verlet", "integrator_rk4", "integrator_rkmk4"}) {
    Environment shortest(in_flight(Use::kNothing, integrator).description());
    EXPECT_EQ(shortest.plan().slots.size(), 1U);
    run_to_end(&shortest);
    struct Row {
      Use use;
      std::size_t slots, left_out;
    };
    // of seven: six slots and sleep; a constant force is asked once, before the first step
    for (const Row& row : {Row{Use::kConstantForce, 1, 6}, Row{Use::kForce, 2, 5}, Row{Use::kJoint, 3, 4},
                           Row{Use::kContacts, 4, 3}, Row{Use::kSleep, 4, 2}, Row{Use::kAll, 6, 0}}) {
      Environment longer(in_flight(row.use, integrator).description());
      EXPECT_EQ(longer.plan().slots.size(), row.slots);
      EXPECT_EQ(longer.plan().left_out.size(), row.left_out);
      run_to_end(&longer);
      EXPECT_EQ(longer.chain_hash(), shortest.chain_hash()) << integrator << ", use " << static_cast<int>(row.use);
    }
  }
}

// Two balls fly towards each other and touch after 0.5 s; a third flies elsewhere.
WorldBuilder meeting(Hosting hosting, Simulator simulator) {
  WorldBuilder builder(hosting);
  builder.steps(60, 1.0 / 60.0).integrator("integrator_basic_verlet");
  builder.sphere(0.5, 1.0, Vector3::Zero(), Vector3(2, 0, 0))
      .sphere(0.5, 1.0, Vector3(3, 0, 0), Vector3(-2, 0.0, -0.0));
  builder.sphere(0.5, 1.0, Vector3(0, 9, 0), Vector3(0, 0, 1)).gravity(Vector3(0, -9.81, 0));
  builder.description().simulator = simulator;
  return builder;
}

TEST(Plan, AQuestionAboutNothingIsNotAskedAndChangesNoBit) {
  for (const Simulator simulator : {Simulator::kBasic, Simulator::kContinuous}) {
    Environment spared(meeting(Hosting::kDirect, simulator).description());
    run_to_end(&spared);
    Environment asked(meeting(Hosting::kSharedMemory, simulator).description());
    for (const Slot slot : {Slot::kCollision, Slot::kSolver}) asked.set_rerun_every(slot, 1);
    run_to_end(&asked);
    EXPECT_EQ(spared.chain_hash(), asked.chain_hash());
    EXPECT_TRUE(asked.faults().empty());
    for (const Stage stage : {Stage::kNarrowPhase, Stage::kSolve}) {
      EXPECT_GT(spared.stage_time(stage).count(), 0U);
      EXPECT_LT(spared.stage_time(stage).count(), asked.stage_time(stage).count());
    }
  }
}

// So that its end is noticed where it comes.
TEST(Plan, AWorkerIsAskedAboutNothing) {
  Environment world(meeting(Hosting::kSharedMemory, Simulator::kBasic).description());
  world.inject({Slot::kSolver, "kill", 3});
  world.inject({Slot::kCollision, "kill", 4});
  run_to_end(&world);
  ASSERT_EQ(world.faults().size(), 2U);
  EXPECT_EQ(world.faults()[0].step, 3U);
  EXPECT_EQ(world.faults()[1].step, 4U);
}

}  // namespace
}  // namespace gravitas::kernel
