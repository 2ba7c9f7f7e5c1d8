// Slots that share one worker process: whoever's call it fails in, that slot is charged, and the others lose nothing.
#include <gtest/gtest.h>
#include <unistd.h>

#include <algorithm>
#include <memory>
#include <set>
#include <stdexcept>
#include <string>
#include <vector>

#include "kernel/environment.h"
#include "kernel/slot_host.h"
#include "plugin_sdk/slots.h"
#include "tests/kernel/run_to_end.h"
#include "tests/kernel/world_builder.h"

namespace gravitas {
namespace {

using harness::busy_world;
using harness::plugin_path;
using harness::WorldBuilder;
using kernel::Environment;
using kernel::FaultKind;
using kernel::FaultRecord;
using kernel::Hosting;
using kernel::StepOutcome;
using kernel::SwapRecord;
using kernel::SwapState;

constexpr std::uint32_t kSharedSteps = 40;

// RK4 asks for forces four times in each call, so that two calls to a process that holds both are open at a time.
WorldBuilder apart(Hosting hosting) {
  return busy_world(hosting).steps(kSharedSteps, 1.0 / 120.0).integrator("integrator_rk4");
}

WorldBuilder together(Hosting hosting, const std::vector<Slot>& slots) {
  WorldBuilder builder = apart(hosting);
  for (const Slot slot : slots) builder.description().slot(slot).process = "one";
  return builder;
}

const std::vector<Slot> kAll(kSlots.begin(), kSlots.end());
const std::vector<Slot> kTwo = {Slot::kCollision, Slot::kSolver};

Hash chain_of_own_processes() {
  static const Hash chain = [] {
    Environment world(apart(Hosting::kDirect).description());
    run_to_end(&world);
    return world.chain_hash();
  }();
  return chain;
}

int process_of(const Environment& world, Slot slot) {
  for (const kernel::PlannedSlot& planned : world.plan().slots)
    if (planned.slot == slot) return planned.process_id;
  return 0;
}

std::set<int> processes_of(const Environment& world, const std::vector<Slot>& slots) {
  std::set<int> processes;
  for (const Slot slot : slots) processes.insert(process_of(world, slot));
  return processes;
}

class SharedProcess : public ::testing::TestWithParam<Hosting> {};
INSTANTIATE_TEST_SUITE_P(On, SharedProcess, ::testing::Values(Hosting::kSharedMemory, Hosting::kGrpc),
                         [](const auto& one) { return std::string(kernel::hosting_name(one.param)); });

TEST_P(SharedProcess, HoldsTheSlotsThatNameItAndNoOthers) {
  Environment world(together(GetParam(), kTwo).description());
  EXPECT_EQ(process_of(world, Slot::kCollision), process_of(world, Slot::kSolver));
  EXPECT_EQ(processes_of(world, kAll).size(), 5U);
  for (const kernel::PlannedSlot& planned : world.plan().slots)
    EXPECT_EQ(planned.plugins.size(), planned.slot == Slot::kForce ? 2U : 1U);
  run_to_end(&world);
  EXPECT_EQ(world.chain_hash(), chain_of_own_processes());
}

// The forces are asked of the process that waits for their answer.
TEST_P(SharedProcess, MayHoldAllSlots) {
  Environment world(together(GetParam(), kAll).description());
  EXPECT_EQ(processes_of(world, kAll).size(), 1U);
  run_to_end(&world);
  EXPECT_EQ(world.chain_hash(), chain_of_own_processes());
  EXPECT_TRUE(world.faults().empty());
}

TEST_P(SharedProcess, IsNotSharedByWhatIsHostedElsewhere) {
  WorldBuilder builder = together(GetParam(), kAll);
  builder.hosting(Slot::kSolver, Hosting::kDirect);
  Environment world(builder.description());
  EXPECT_EQ(process_of(world, Slot::kSolver), getpid());
  EXPECT_EQ(processes_of(world, kAll).size(), 2U);
  run_to_end(&world);
  EXPECT_EQ(world.chain_hash(), chain_of_own_processes());
}

// Its death, at any moment of a call of any slot, is a failure of that slot.
TEST_P(SharedProcess, DiesInACallOfAnySlot) {
  for (const char* order :
       {"kill,at=read", "kill,at=compute", "kill,at=write", "segv", "abort", "nan", "duplicate", "stale", "truncate"}) {
    SCOPED_TRACE(order);
    WorldBuilder builder = together(GetParam(), kAll);
    // a stale answer is waited for
    for (const Slot slot : kSlots)
      builder.description().slot(slot).deadline = std::string(order) == "stale" ? 0.5 : 30.0;
    Environment world(builder.description());
    std::uint32_t step = 0;
    for (const Slot slot : kSlots) world.inject({slot, order, step += 6});
    run_to_end(&world);
    EXPECT_EQ(world.chain_hash(), chain_of_own_processes());
    std::vector<Slot> charged;
    for (const FaultRecord& fault : world.faults()) {
      charged.push_back(fault.fault.slot);
      EXPECT_NE(fault.recovered_by, "");
    }
    std::vector<Slot> expected = std::string(order) != "duplicate" ? kAll : std::vector<Slot>();
    // whose reply has no numbers
    if (std::string(order) == "nan") std::erase(expected, Slot::kSpace);
    EXPECT_EQ(charged, expected);
    EXPECT_EQ(processes_of(world, kAll).size(), 1U);
  }
}

// Two may be open: the integrator's, and within it one of the forces.
TEST_P(SharedProcess, HangsInsideANestedCall) {
  WorldBuilder builder = together(GetParam(), kAll);
  for (const Slot slot : kSlots) builder.description().slot(slot).deadline = 1.0;
  Environment world(builder.description());
  world.inject({Slot::kForce, "hang", 5});
  world.inject({Slot::kIntegrator, "hang", 9});
  run_to_end(&world);
  EXPECT_EQ(world.chain_hash(), chain_of_own_processes());
  ASSERT_EQ(world.faults().size(), 2U);
  EXPECT_EQ(world.faults()[0].fault.slot, Slot::kForce);
  EXPECT_EQ(world.faults()[0].fault.kind, FaultKind::kDeadline);
  EXPECT_EQ(world.faults()[1].fault.slot, Slot::kIntegrator);
}

// Each slot has a budget of its own: all together fail more often than one may.
TEST_P(SharedProcess, ChargesTheSlotThatWasCalled) {
  WorldBuilder builder = together(GetParam(), kTwo);
  for (const Slot slot : kTwo) {
    kernel::PluginChoice& plugin = builder.description().slot(slot).plugins[0];
    plugin.fallback = std::make_shared<kernel::PluginChoice>(plugin);
  }
  Environment world(builder.description());
  constexpr std::uint32_t kEach = kernel::SlotDescription::kBudget - 1;
  for (std::uint32_t i = 0; i < kEach; ++i)
    for (std::uint32_t k = 0; k < kTwo.size(); ++k) world.inject({kTwo[k], "kill", 3 + 4 * i + 2 * k});
  run_to_end(&world);
  EXPECT_EQ(world.chain_hash(), chain_of_own_processes());
  ASSERT_EQ(world.faults().size(), 2 * kEach);
  for (const FaultRecord& fault : world.faults()) EXPECT_EQ(fault.recovered_by.find("fallback"), std::string::npos);
}

TEST_P(SharedProcess, FallsBackInTheSlotThatFailedAlone) {
  WorldBuilder builder = together(GetParam(), kTwo);
  builder.description().solver.plugins[0].fallback = std::make_shared<kernel::PluginChoice>(
      WorldBuilder()
          .plugin(Slot::kSolver, plugin_path("solver_sequential"), {100.0, 1.0, 0.0, 1.0, 0.0, 1.0})
          .description()
          .solver.plugins[0]);
  builder.description().collision.plugins[0].fallback = std::make_shared<kernel::PluginChoice>(
      WorldBuilder().plugin(Slot::kCollision, plugin_path("collision_gjk_only")).description().collision.plugins[0]);
  Environment world(builder.description());
  world.inject({Slot::kSolver, "segv", 5, 2});
  run_to_end(&world);
  ASSERT_EQ(world.faults().size(), 2U);
  EXPECT_EQ(world.faults()[1].recovered_by, "fallback Sequential");
  const kernel::Plan plan = world.plan();
  const auto collision = std::ranges::find(plan.slots, Slot::kCollision, &kernel::PlannedSlot::slot);
  EXPECT_EQ(collision->plugins[0], "Standard");
  EXPECT_EQ(processes_of(world, kTwo).size(), 1U);
}

TEST_P(SharedProcess, IsExchangedForEachOfItsSlots) {
  Environment world(together(GetParam(), kAll).description());
  // two before the same step, and one while another is on probation
  const std::uint32_t steps[] = {9, 9, 14, 20, 30, 30};
  for (std::size_t i = 0; i < kSlots.size(); ++i)
    world.order_swap({kSlots[i], apart(GetParam()).description().slot(kSlots[i]).plugins[0], std::nullopt, steps[i]});
  world.inject({Slot::kConstraint, "kill", 22});
  run_to_end(&world);
  EXPECT_EQ(world.chain_hash(), chain_of_own_processes());
  ASSERT_EQ(world.swaps().size(), kSlots.size());
  for (const SwapRecord& swap : world.swaps()) {
    // the death in probation, though of another slot's call, brings the old process back
    EXPECT_EQ(swap.state, swap.step == 20 ? SwapState::kRolledBack : SwapState::kCommitted) << swap.reason;
    EXPECT_EQ(swap.shadow.differing_calls, 0U);
  }
  ASSERT_EQ(world.faults().size(), 1U);
  EXPECT_EQ(world.faults()[0].recovered_by, "rollback");
  EXPECT_EQ(processes_of(world, kAll).size(), 1U);
}

// A swap that was prepared keeps what a neighbour has become meanwhile.
TEST_P(SharedProcess, KeepsTheOtherSlotsSwap) {
  Environment world(together(GetParam(), kTwo).description());
  const kernel::PluginChoice solver = apart(GetParam()).description().solver.plugins[0];
  const kernel::PluginChoice collision =
      WorldBuilder().plugin(Slot::kCollision, plugin_path("collision_gjk_only")).description().collision.plugins[0];
  world.order_swap({Slot::kSolver, solver, std::nullopt, 20});
  world.order_swap({Slot::kCollision, collision, std::nullopt, 12});
  run_to_end(&world);
  ASSERT_EQ(world.swaps().size(), 2U);
  EXPECT_EQ(world.swaps()[0].step, 12U);
  EXPECT_EQ(world.swaps()[1].step, 20U);
  const kernel::Plan plan = world.plan();
  const auto now = std::ranges::find(plan.slots, Slot::kCollision, &kernel::PlannedSlot::slot);
  EXPECT_EQ(now->plugins[0], "GjkOnly");
}

// A swap that hosts one of its slots elsewhere takes all of them along.
TEST_P(SharedProcess, IsLeftByAllOfItsSlots) {
  Environment world(together(GetParam(), kTwo).description());
  const kernel::PluginChoice solver = apart(GetParam()).description().solver.plugins[0];
  const Hosting elsewhere = GetParam() == Hosting::kGrpc ? Hosting::kSharedMemory : Hosting::kGrpc;
  const auto hostings = [&] {
    std::set<Hosting> all;
    for (const kernel::PlannedSlot& planned : world.plan().slots)
      if (planned.slot == Slot::kCollision || planned.slot == Slot::kSolver) all.insert(planned.hosting);
    return all;
  };
  world.order_swap({Slot::kSolver, solver, elsewhere, 10});
  world.order_swap({Slot::kCollision, apart(GetParam()).description().collision.plugins[0], GetParam(), 25});
  while (world.step_count() < 20) ASSERT_EQ(world.step(), StepOutcome::kCommitted);
  EXPECT_EQ(hostings(), std::set<Hosting>{elsewhere});
  EXPECT_EQ(processes_of(world, kTwo).size(), 1U);
  run_to_end(&world);
  EXPECT_EQ(world.chain_hash(), chain_of_own_processes());
  EXPECT_EQ(hostings(), std::set<Hosting>{GetParam()});
  EXPECT_EQ(processes_of(world, kTwo).size(), 1U);
}

TEST_P(SharedProcess, IsNotLeftForThisProcess) {
  Environment world(together(GetParam(), kTwo).description());
  const kernel::PluginChoice solver = apart(GetParam()).description().solver.plugins[0];
  try {
    world.order_swap({Slot::kSolver, solver, Hosting::kDirect, 10});
    ADD_FAILURE() << "it was taken";
  } catch (const std::invalid_argument& problem) {
    EXPECT_STREQ(problem.what(),
                 "swap solver=Sequential: its worker process is shared (Process = \"one\"), and what is hosted direct "
                 "shares none");
  }
}

// The force's host is let go where all forces are constant; who shares it stays.
TEST_P(SharedProcess, GoesOnWithoutASlotThatIsNotAskedAnyMore) {
  const auto falling = [](Hosting hosting) {
    WorldBuilder builder(hosting);
    builder.steps(kSharedSteps, 1.0 / 120.0)
        .ground()
        .sphere(0.5, 1.0, Vector3(0, 0.6, 0))
        .gravity(Vector3(0, -9.81, 0));
    return builder;
  };
  Environment quiet(falling(Hosting::kDirect).description());
  run_to_end(&quiet);
  WorldBuilder builder = falling(GetParam());
  for (const Slot slot : kSlots) builder.description().slot(slot).process = "one";
  Environment world(builder.description());
  world.inject({Slot::kSolver, "kill", 20});
  run_to_end(&world);
  EXPECT_EQ(world.chain_hash(), quiet.chain_hash());
  EXPECT_EQ(process_of(world, Slot::kForce), 0);
}

}  // namespace
}  // namespace gravitas
