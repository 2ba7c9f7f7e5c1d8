// Others in a slot while the simulation runs: the same plugin elsewhere changes no bit, another one loses no step, and
// one that fails leaves the run as it was.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <atomic>
#include <filesystem>
#include <string>
#include <thread>
#include <utility>
#include <vector>

#include "kernel/environment.h"
#include "tests/kernel/run_to_end.h"
#include "tests/kernel/world_builder.h"
#include "tests/paths.h"

namespace gravitas {
namespace {

using harness::busy_world;
using harness::faulty_plugin_path;
using harness::plugin_path;
using harness::WorldBuilder;
using kernel::Environment;
using kernel::Hosting;
using kernel::StepOutcome;
using kernel::SwapOrder;
using kernel::SwapRecord;
using kernel::SwapState;
using ::testing::Contains;
using ::testing::HasSubstr;
using ::testing::Not;
using ::testing::StartsWith;

constexpr std::uint32_t kSwapSteps = 40;

Hash chain_without_swaps() {
  Environment world(busy_world(Hosting::kDirect).steps(kSwapSteps, 1.0 / 120.0).description());
  run_to_end(&world);
  return world.chain_hash();
}

// Another plugin of the slot, as the builder would choose it.
kernel::PluginChoice other(Slot slot, const std::string& path) {
  WorldBuilder builder(Hosting::kDirect);
  builder.plugin(slot, path);
  return builder.description().slot(slot).plugins[0];
}

// What answers in the slot of the busy world.
kernel::PluginChoice plugin_of(Slot slot) { return busy_world(Hosting::kDirect).description().slot(slot).plugins[0]; }

class Swapped : public ::testing::TestWithParam<Hosting> {
 protected:
  WorldBuilder builder() const { return busy_world(GetParam()).steps(kSwapSteps, 1.0 / 120.0); }
};
INSTANTIATE_TEST_SUITE_P(In, Swapped, ::testing::Values(Hosting::kDirect, Hosting::kSharedMemory, Hosting::kGrpc),
                         [](const auto& one) { return std::string(kernel::hosting_name(one.param)); });

TEST_P(Swapped, AnotherInstanceInEverySlotChangesNoBit) {
  Environment world(builder().description());
  std::uint32_t step = 2;
  for (const Slot slot : kSlots) world.order_swap({slot, plugin_of(slot), std::nullopt, step += 3});
  run_to_end(&world);
  EXPECT_EQ(world.chain_hash(), chain_without_swaps());
  ASSERT_EQ(world.swaps().size(), std::size(kSlots));
  for (const SwapRecord& swap : world.swaps()) {
    EXPECT_EQ(swap.state, SwapState::kCommitted) << swap.reason;
    EXPECT_EQ(swap.from, swap.to);
    EXPECT_EQ(swap.shadow.differing_calls, 0U);
    EXPECT_GT(swap.pause_us, 0.0);
  }
}

TEST_P(Swapped, AnotherHostingChangesNoBit) {
  Environment world(builder().description());
  const Hosting next = GetParam() == Hosting::kDirect ? Hosting::kGrpc : Hosting::kDirect;
  world.order_swap({Slot::kSolver, plugin_of(Slot::kSolver), next, 5});
  world.order_swap({Slot::kSolver, plugin_of(Slot::kSolver), GetParam(), 25});
  run_to_end(&world);
  EXPECT_EQ(world.chain_hash(), chain_without_swaps());
  ASSERT_EQ(world.swaps().size(), 2U);
  EXPECT_EQ(world.swaps()[0].to, std::string("Sequential (") + kernel::hosting_name(next) + ")");
  EXPECT_EQ(world.swaps()[1].state, SwapState::kCommitted);
}

TEST_P(Swapped, AnotherIntegratorGoesOnFromTheSameState) {
  Environment world(builder().description());
  world.order_swap({Slot::kIntegrator, other(Slot::kIntegrator, plugin_path("integrator_euler")), std::nullopt, 11});
  while (world.step_count() < 10) ASSERT_EQ(world.step(), StepOutcome::kCommitted);
  Environment quiet(builder().description());
  while (quiet.step_count() < 10) ASSERT_EQ(quiet.step(), StepOutcome::kCommitted);
  EXPECT_EQ(world.chain_hash(), quiet.chain_hash());
  run_to_end(&world);
  ASSERT_EQ(world.swaps().size(), 1U);
  const SwapRecord swap = world.swaps()[0];
  EXPECT_EQ(swap.step, 11U);
  EXPECT_EQ(swap.from, "SemiImplicitEuler");
  EXPECT_EQ(swap.to, "Euler");
  EXPECT_EQ(swap.state, SwapState::kCommitted);
  // the shadow says how they differ: Euler moves by the old velocity
  EXPECT_EQ(swap.shadow.differing_calls, swap.shadow.calls);
  // as many as the preparation left time for
  EXPECT_LE(swap.shadow.calls, 8U);
  EXPECT_EQ(world.plan().slots[0].plugins[0], "Euler");
}

// It dies in the third call: in shadow.
TEST_P(Swapped, APluginThatFailsInShadowIsRefused) {
  if (GetParam() == Hosting::kDirect) GTEST_SKIP() << "it would end this process";
  const std::string library = faulty_plugin_path("integrator_killed");
  std::atomic<bool> is_prepared = false;
  const auto starter = [&](const kernel::SlotDescription& slot, std::uint32_t threads, std::stop_token stop) {
    std::unique_ptr<kernel::Carrier> host = kernel::start_host(slot, threads, std::move(stop));
    if (slot.plugins[0].library == library) is_prepared = true;
    return host;
  };
  Environment world(builder().description(), starter);
  world.order_swap({Slot::kIntegrator, other(Slot::kIntegrator, library), std::nullopt, 20});
  // the run does not wait for a shadow, so the test waits for the preparation
  ASSERT_EQ(world.step(), StepOutcome::kCommitted);
  while (!is_prepared) std::this_thread::yield();
  run_to_end(&world);
  EXPECT_EQ(world.chain_hash(), chain_without_swaps());
  ASSERT_EQ(world.swaps().size(), 1U);
  EXPECT_EQ(world.swaps()[0].state, SwapState::kRefused);
  EXPECT_THAT(world.swaps()[0].reason, HasSubstr("in shadow: its worker process"));
  EXPECT_TRUE(world.faults().empty());
}

TEST_P(Swapped, APluginThatCannotBePreparedIsRefused) {
  Environment world(builder().description());
  kernel::PluginChoice missing = plugin_of(Slot::kSolver);
  missing.library = in_source("/README.md");
  world.order_swap({Slot::kSolver, missing, std::nullopt, 7});
  run_to_end(&world);
  EXPECT_EQ(world.chain_hash(), chain_without_swaps());
  EXPECT_EQ(world.swaps()[0].state, SwapState::kRefused);
  EXPECT_THAT(world.swaps()[0].reason, HasSubstr("README.md"));
}

// Without time for a shadow it fails on probation, and the old worker answers.
TEST_P(Swapped, APluginThatFailsOnProbationIsRolledBack) {
  if (GetParam() == Hosting::kDirect) GTEST_SKIP() << "it would end this process";
  Environment world(builder().description());
  ASSERT_EQ(world.step(), StepOutcome::kCommitted);
  world.order_swap(
      {Slot::kIntegrator, other(Slot::kIntegrator, faulty_plugin_path("integrator_killed")), std::nullopt, 2});
  run_to_end(&world);
  ASSERT_EQ(world.swaps().size(), 1U);
  EXPECT_EQ(world.swaps()[0].state, SwapState::kRolledBack);
  EXPECT_EQ(world.swaps()[0].step, 2U);
  EXPECT_THAT(world.swaps()[0].reason, StartsWith("in step 4: "));
  ASSERT_EQ(world.faults().size(), 1U);
  EXPECT_EQ(world.faults()[0].step, 4U);
  EXPECT_EQ(world.faults()[0].recovered_by, "rollback");
  EXPECT_EQ(world.plan().slots[0].plugins[0], "SemiImplicitEuler");
}

TEST_P(Swapped, ALaterSwapEndsProbationAsCommitted) {
  Environment world(builder().description());
  for (std::uint32_t step = 3; step < 13; ++step)
    world.order_swap({Slot::kSolver, plugin_of(Slot::kSolver), std::nullopt, step});
  run_to_end(&world);
  EXPECT_EQ(world.chain_hash(), chain_without_swaps());
  ASSERT_EQ(world.swaps().size(), 10U);
  for (std::uint32_t i = 0; i < 10; ++i) {
    EXPECT_EQ(world.swaps()[i].step, 3 + i);
    EXPECT_EQ(world.swaps()[i].state, SwapState::kCommitted) << world.swaps()[i].reason;
  }
}

TEST_P(Swapped, TheSolverGetsOtherSettings) {
  Environment world(builder().description());
  kernel::PluginChoice weaker = plugin_of(Slot::kSolver);
  weaker.settings = {1.0, 0.5, 0.0, 1.0, 0.0, 1.0};
  world.order_swap({Slot::kSolver, weaker, std::nullopt, 10});
  run_to_end(&world);
  EXPECT_NE(world.chain_hash(), chain_without_swaps());
  EXPECT_EQ(world.swaps()[0].state, SwapState::kCommitted);
}

TEST_P(Swapped, ComparisonChangesNoBitAndNeverCutsOver) {
  Environment world(builder().description());
  world.order_swap({Slot::kIntegrator, other(Slot::kIntegrator, plugin_path("integrator_euler")), std::nullopt, 0},
                   true);
  world.set_rerun_every(Slot::kSolver, 4);
  run_to_end(&world);
  EXPECT_EQ(world.chain_hash(), chain_without_swaps());
  ASSERT_EQ(world.swaps().size(), 1U);
  EXPECT_TRUE(world.swaps()[0].only_compared);
  const Comparison compared = world.swaps()[0].shadow;
  EXPECT_EQ(compared.calls, kSwapSteps);
  EXPECT_EQ(compared.differing_calls, kSwapSteps);
  ASSERT_FALSE(compared.disagreements.empty());
  EXPECT_STREQ(compared.disagreements[0].column->name, "position");
  EXPECT_EQ(world.plan().slots[0].plugins[0], "SemiImplicitEuler");
  EXPECT_TRUE(world.faults().empty());
}

// It is counted, and the comparison goes on: what it could not do in one step it may in the next.
TEST_P(Swapped, ARefusalIsAnAnswerThatIsCompared) {
  Environment world(builder().description());
  kernel::PluginChoice strict = other(Slot::kIntegrator, plugin_path("integrator_dormand_prince54"));
  strict.settings = {1e-300, 0.0};  // Accuracy, which no step meets
  world.order_swap({Slot::kIntegrator, strict, std::nullopt, 0}, true);
  run_to_end(&world);
  EXPECT_EQ(world.chain_hash(), chain_without_swaps());
  EXPECT_THAT(world.faults(), ::testing::IsEmpty());
  ASSERT_EQ(world.swaps().size(), 1U);
  EXPECT_EQ(world.swaps()[0].state, SwapState::kShadow);
  const Comparison compared = world.swaps()[0].shadow;
  EXPECT_EQ(compared.calls, kSwapSteps);
  EXPECT_EQ(compared.differing_calls, kSwapSteps);
  EXPECT_EQ(compared.refused_calls, kSwapSteps);
  EXPECT_THAT(compared.first_refusal, HasSubstr("it refused: Accuracy cannot be met"));
  EXPECT_TRUE(compared.disagreements.empty());
}

// Euler, compared with it, and Euler in its place: before they differ in every step, then in none.
TEST_P(Swapped, AComparisonCountsAnewBesideWhoTakesOver) {
  Environment world(builder().description());
  const kernel::PluginChoice euler = other(Slot::kIntegrator, plugin_path("integrator_euler"));
  world.order_swap({Slot::kIntegrator, euler, std::nullopt, 0}, true);
  world.order_swap({Slot::kIntegrator, euler, std::nullopt, 11});
  run_to_end(&world);
  const std::vector<SwapRecord> records = world.swaps();
  ASSERT_EQ(records.size(), 3U);
  EXPECT_EQ(records[0].from, "Euler");
  EXPECT_EQ(records[0].to, "Euler");
  EXPECT_EQ(records[0].since, 11U);
  EXPECT_EQ(records[0].shadow.calls, kSwapSteps - 10);
  EXPECT_EQ(records[0].shadow.differing_calls, 0U);
  EXPECT_TRUE(records[1].only_compared);
  EXPECT_EQ(records[1].from, "SemiImplicitEuler");
  EXPECT_EQ(records[1].since, 0U);
  EXPECT_EQ(records[1].shadow.calls, 10U);
  EXPECT_EQ(records[1].shadow.differing_calls, 10U);
  EXPECT_FALSE(records[2].only_compared);
}

// Who takes over is the same plugin in the same place: no other pair.
TEST_P(Swapped, AComparisonCountsOnBesideTheSamePlugin) {
  Environment world(builder().description());
  world.order_swap({Slot::kIntegrator, other(Slot::kIntegrator, plugin_path("integrator_euler")), std::nullopt, 0},
                   true);
  world.order_swap({Slot::kIntegrator, plugin_of(Slot::kIntegrator), std::nullopt, 11});
  run_to_end(&world);
  ASSERT_EQ(world.swaps().size(), 2U);
  EXPECT_TRUE(world.swaps()[0].only_compared);
  EXPECT_EQ(world.swaps()[0].shadow.calls, kSwapSteps);
  EXPECT_EQ(world.swaps()[0].since, 0U);
}

TEST_P(Swapped, AComparisonBesideWhoIsRolledBackCountsAnewTwice) {
  if (GetParam() == Hosting::kDirect) GTEST_SKIP() << "it would end this process";
  Environment world(builder().description());
  world.order_swap({Slot::kIntegrator, plugin_of(Slot::kIntegrator), std::nullopt, 0}, true);
  ASSERT_EQ(world.step(), StepOutcome::kCommitted);
  world.order_swap(
      {Slot::kIntegrator, other(Slot::kIntegrator, faulty_plugin_path("integrator_killed")), std::nullopt, 2});
  run_to_end(&world);
  std::vector<SwapRecord> compared = world.swaps();
  std::erase_if(compared, [](const SwapRecord& one) { return !one.only_compared; });
  ASSERT_EQ(compared.size(), 3U);
  EXPECT_EQ(compared[0].from, "SemiImplicitEuler");
  EXPECT_EQ(compared[0].since, 4U);
  // the step in which it took over again was begun anew
  EXPECT_EQ(compared[0].shadow.calls, kSwapSteps - 3 + 1);
  EXPECT_EQ(compared[0].shadow.differing_calls, 0U);
  EXPECT_EQ(compared[1].shadow.calls, 1U);
  EXPECT_NE(compared[2].from, "SemiImplicitEuler");
  EXPECT_EQ(compared[2].since, 2U);
  EXPECT_EQ(compared[2].shadow.calls, 2U);
}

TEST_P(Swapped, WhatIsCalledOffLeavesNoTraceAndTheNextComesAllTheSame) {
  Environment world(builder().description());
  kernel::PluginChoice weaker = plugin_of(Slot::kSolver);
  weaker.settings = {1.0, 0.5, 0.0, 1.0, 0.0, 1.0};
  for (const kernel::PluginChoice& one : {weaker, plugin_of(Slot::kSolver)})
    world.order_swap({Slot::kSolver, one, std::nullopt, 10});
  world.order_swap({Slot::kIntegrator, other(Slot::kIntegrator, plugin_path("integrator_euler")), std::nullopt, 0},
                   true);
  for (int i = 0; i < 6; ++i) world.step();
  EXPECT_FALSE(world.call_off_swap(Slot::kSolver, 10, 2));
  EXPECT_FALSE(world.call_off_swap(Slot::kSolver, 9, 0));
  EXPECT_TRUE(world.call_off_swap(Slot::kSolver, 10, 0));
  EXPECT_FALSE(world.call_off_swap(Slot::kSolver, 10, 0)) << "twice";
  EXPECT_TRUE(world.call_off_swap(Slot::kIntegrator, 0, 0));
  run_to_end(&world);
  EXPECT_EQ(world.chain_hash(), chain_without_swaps());
  EXPECT_FALSE(world.call_off_swap(Slot::kSolver, 10, 1)) << "it has cut over";
  const std::vector<kernel::SwapRecord> swaps = world.swaps();
  ASSERT_EQ(swaps.size(), 3U);
  EXPECT_EQ(swaps[0].shadow.calls, 6U);
  EXPECT_EQ(swaps[0].reason, "called off");
  EXPECT_EQ(swaps[1].state, SwapState::kRefused);
  EXPECT_EQ(swaps[1].reason, "called off");
  EXPECT_EQ(swaps[2].state, SwapState::kCommitted) << swaps[2].reason;
}

TEST(Swap, WhatCannotTakeThePlaceIsRefusedAtOnce) {
  Environment world(busy_world(Hosting::kDirect).description());
  const auto why = [&](Slot slot, const kernel::PluginChoice& plugin) -> std::string {
    try {
      world.order_swap({slot, plugin, std::nullopt, 5});
    } catch (const std::invalid_argument& problem) {
      return problem.what();
    }
    return "accepted";
  };
  EXPECT_THAT(why(Slot::kSolver, other(Slot::kIntegrator, plugin_path("integrator_euler"))),
              HasSubstr("it is a plugin of slot integrator"));
  EXPECT_THAT(why(Slot::kForce, other(Slot::kForce, plugin_path("hello"))), HasSubstr("does not serve the type"));
  WorldBuilder free(Hosting::kDirect);
  free.point(1.0, Vector3::Ones(), Vector3::Zero());
  Environment alone(free.description());
  EXPECT_THROW(alone.order_swap({Slot::kSolver, plugin_of(Slot::kSolver), std::nullopt, 5}), std::invalid_argument);
}

// Who is asked again has the plugin that is in place, not the one of before.
TEST_P(Swapped, ARerunAsksTheNewPluginToo) {
  Environment world(builder().description());
  kernel::PluginChoice weaker = plugin_of(Slot::kSolver);
  weaker.settings = {1.0, 0.5, 0.0, 1.0, 0.0, 1.0};
  world.order_swap({Slot::kSolver, weaker, std::nullopt, 10});
  world.set_rerun_every(Slot::kSolver, 1);
  run_to_end(&world);
  EXPECT_EQ(world.swaps()[0].state, SwapState::kCommitted);
  for (const kernel::FaultRecord& fault : world.faults()) ADD_FAILURE() << fault.step << ": " << fault.fault.text();
  for (const std::string& warning : world.warnings()) EXPECT_THAT(warning, Not(HasSubstr("otherwise")));
}

// One process of three answers otherwise: it is outvoted, whichever it is.
TEST(Rerun, AWrongAnswerThatLooksRightIsOutvoted) {
  Environment world(busy_world(Hosting::kSharedMemory).steps(kSwapSteps, 1.0 / 120.0).description());
  world.set_rerun_every(Slot::kSolver, 1);
  world.inject({Slot::kSolver, "ulp", 9});
  run_to_end(&world);
  EXPECT_EQ(world.chain_hash(), chain_without_swaps());
  ASSERT_EQ(world.faults().size(), 1U);
  EXPECT_EQ(world.faults()[0].fault.kind, kernel::FaultKind::kDisagreement);
  EXPECT_EQ(world.faults()[0].step, 9U);
}

// What counts calls counts as many of them where it is asked again; another call there tells.
TEST(Rerun, APluginThatCountsItsCallsIsFound) {
  WorldBuilder builder(Hosting::kSharedMemory);
  builder.steps(160, 0.01).sphere(0.5, 1.0, Vector3::Zero());
  builder.plugin(Slot::kIntegrator, faulty_plugin_path("counts_calls"));
  Environment world(builder.description());
  world.set_rerun_every(Slot::kIntegrator, 1);
  run_to_end(&world);
  EXPECT_THAT(world.warnings(), Contains(HasSubstr("another process answered the same request otherwise")));
  // its own answer is otherwise for the first time, and two others agree that it was not
  ASSERT_FALSE(world.faults().empty());
  EXPECT_EQ(world.faults()[0].fault.kind, kernel::FaultKind::kDisagreement);
  EXPECT_EQ(world.faults()[0].step, 150U);
}

// Two libraries of one name are told apart by their files.
TEST(Swap, RecordsNameTheLibrariesOfTwoBuilds) {
  Environment world(busy_world(Hosting::kDirect).steps(kSwapSteps, 1.0 / 120.0).description());
  const std::string copy = testing::TempDir() + "another_build.so";
  std::filesystem::copy_file(plugin_path("solver_sequential"), copy, std::filesystem::copy_options::overwrite_existing);
  kernel::PluginChoice other_build = plugin_of(Slot::kSolver);
  other_build.library = copy;
  world.order_swap({Slot::kSolver, other_build, std::nullopt, 5});
  run_to_end(&world);
  std::filesystem::remove(copy);
  EXPECT_EQ(world.chain_hash(), chain_without_swaps());
  EXPECT_EQ(world.swaps()[0].from, "Sequential (" + plugin_path("solver_sequential") + ")");
  EXPECT_EQ(world.swaps()[0].to, "Sequential (" + copy + ")");
}

}  // namespace
}  // namespace gravitas
