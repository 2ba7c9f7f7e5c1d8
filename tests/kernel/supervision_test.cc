// A run whose workers die, hang and lie ends bit for bit where the quiet run ends; what cannot be survived pauses it.
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <signal.h>

#include <cerrno>
#include <chrono>
#include <filesystem>
#include <iterator>
#include <string>
#include <system_error>
#include <thread>
#include <vector>

#include "kernel/environment.h"
#include "kernel/slot_host.h"
#include "tests/kernel/run_to_end.h"
#include "tests/kernel/world_builder.h"
#include "tests/sanitized.h"

namespace gravitas {
namespace {

using harness::busy_world;
using harness::faulty_plugin_path;
using harness::plugin_path;
using harness::WorldBuilder;
using kernel::Environment;
using kernel::FaultKind;
using kernel::Hosting;
using kernel::StepOutcome;
using ::testing::HasSubstr;

constexpr std::uint32_t kSteps = 20;

const Hash& quiet_chain() {
  static const Hash chain = [] {
    Environment world(busy_world(Hosting::kDirect).steps(kSteps, 0.01).description());
    run_to_end(&world);
    return world.chain_hash();
  }();
  return chain;
}

class Supervised : public ::testing::TestWithParam<Hosting> {
 protected:
  WorldBuilder builder() const { return busy_world(GetParam()).steps(kSteps, 0.01); }
};
INSTANTIATE_TEST_SUITE_P(Of, Supervised, ::testing::Values(Hosting::kSharedMemory, Hosting::kGrpc),
                         [](const auto& one) { return std::string(kernel::hosting_name(one.param)); });

TEST_P(Supervised, AKillInEverySlotChangesNoBit) {
  Environment world(builder().description());
  std::uint32_t step = 1;
  for (const Slot slot : kSlots) world.inject({slot, "kill", step += 2});
  run_to_end(&world);
  EXPECT_EQ(world.chain_hash(), quiet_chain());
  ASSERT_EQ(world.faults().size(), std::size(kSlots));
  for (std::size_t i = 0; i < std::size(kSlots); ++i) {
    EXPECT_EQ(world.faults()[i].fault.slot, kSlots[i]);
    EXPECT_EQ(world.faults()[i].step, 3 + 2 * i);
    EXPECT_EQ(world.faults()[i].fault.kind, FaultKind::kDeath);
    EXPECT_THAT(world.faults()[i].recovered_by, HasSubstr("standby"));
  }
}

TEST_P(Supervised, WithoutAStandbyANewWorkerIsStarted) {
  WorldBuilder cold = builder();
  cold.description().solver.standbys = 0;
  Environment world(cold.description());
  world.inject({Slot::kSolver, "abort", 5});
  run_to_end(&world);
  EXPECT_EQ(world.chain_hash(), quiet_chain());
  ASSERT_EQ(world.faults().size(), 1U);
  EXPECT_EQ(world.faults()[0].recovered_by, "cold start");
}

// How a worker ended is told only to who asks, and kept until then.
TEST_P(Supervised, DeathsThatNobodyAsksAboutHoldNoDescriptor) {
  constexpr std::uint32_t kDeaths = harness::unless_sanitized(12, 3), kBetween = kernel::SlotHost::kGoodAnswers + 1;
  WorldBuilder cold = busy_world(GetParam()).steps((kDeaths + 1) * kBetween, 1e-4);
  cold.description().solver.standbys = 0;
  Environment world(cold.description());
  for (std::uint32_t i = 1; i <= kDeaths; ++i) world.inject({Slot::kSolver, "kill", i * kBetween});
  const auto descriptors = [] {
    return std::distance(std::filesystem::directory_iterator("/proc/self/fd"), std::filesystem::directory_iterator());
  };
  while (world.step_count() < kBetween) ASSERT_EQ(world.step(), StepOutcome::kCommitted);
  const auto before = descriptors();
  run_to_end(&world);
  EXPECT_EQ(world.faults().size(), kDeaths);
  // what has died is put away in threads of their own
  for (int i = 0; i < 1000 && descriptors() > before; ++i) std::this_thread::sleep_for(std::chrono::milliseconds(10));
  EXPECT_LE(descriptors(), before);
}

// Whatever ends the start of a worker, it is told, and ends nothing else.
TEST_P(Supervised, AHostThatCannotBeStartedForWantOfFilesIsAFault) {
  const kernel::HostStarter starter = [](const kernel::SlotDescription&, std::uint32_t,
                                         std::stop_token) -> std::unique_ptr<kernel::Carrier> {
    throw std::system_error(EMFILE, std::generic_category(), "memfd_create");
  };
  try {
    Environment world(builder().description(), starter);
    FAIL();
  } catch (const kernel::StageFault& fault) {
    EXPECT_THAT(fault.text(), HasSubstr("memfd_create: Too many open files"));
  }
}

TEST_P(Supervised, AHangingWorkerIsReplacedAtItsDeadline) {
  WorldBuilder hanging = builder();
  hanging.description().collision.deadline = 1.0;
  Environment world(hanging.description());
  world.inject({Slot::kCollision, "hang", 4});
  run_to_end(&world);
  EXPECT_EQ(world.chain_hash(), quiet_chain());
  ASSERT_EQ(world.faults().size(), 1U);
  EXPECT_EQ(world.faults()[0].fault.kind, FaultKind::kDeadline);
}

TEST_P(Supervised, WrongAnswersAreNotUsed) {
  Environment world(builder().description());
  world.inject({Slot::kSolver, "nan", 3});
  world.inject({Slot::kIntegrator, "inf", 5});
  world.inject({Slot::kSpace, "double", 7});
  run_to_end(&world);
  EXPECT_EQ(world.chain_hash(), quiet_chain());
  ASSERT_EQ(world.faults().size(), 3U);
  EXPECT_EQ(world.faults()[0].fault.kind, FaultKind::kBadNumbers);
  EXPECT_EQ(world.faults()[1].fault.kind, FaultKind::kBadNumbers);
  EXPECT_EQ(world.faults()[2].fault.kind, FaultKind::kBadStructure);
}

// The asker and whom it asks, at once and one after the other.
TEST_P(Supervised, DeathsInsideANestedCallAreRecoveredThere) {
  Environment world(builder().description());
  world.inject({Slot::kForce, "kill", 4});
  world.inject({Slot::kIntegrator, "kill", 4});
  world.inject({Slot::kForce, "kill,at=read", 8});
  world.inject({Slot::kIntegrator, "kill,at=read", 12});
  run_to_end(&world);
  EXPECT_EQ(world.chain_hash(), quiet_chain());
  EXPECT_EQ(world.faults().size(), 4U);
  for (const kernel::FaultRecord& record : world.faults()) EXPECT_FALSE(record.recovered_by.empty());
}

// Room is made for them, so the arena moves while the asker, a library of the kernel's process, reads it.
TEST_P(Supervised, TooManyRowsInANestedCallSpareItsAsker) {
  WorldBuilder mixed = builder();
  mixed.description().integrator.hosting = Hosting::kDirect;
  Environment world(mixed.description());
  world.inject({Slot::kForce, "double", 4});
  run_to_end(&world);
  EXPECT_EQ(world.chain_hash(), quiet_chain());
  ASSERT_EQ(world.faults().size(), 1U);
  EXPECT_EQ(world.faults()[0].fault.kind, FaultKind::kBadStructure);
}

TEST_P(Supervised, ActiveAndStandbyMayDieTogether) {
  Environment world(builder().description());
  world.inject({Slot::kSolver, "kill", 6, 2});
  // the same request kills two workers: it is to blame, and no fallback is named
  while (world.step_count() < 5) ASSERT_EQ(world.step(), StepOutcome::kCommitted);
  EXPECT_EQ(world.step(), StepOutcome::kPaused);
  ASSERT_EQ(world.faults().size(), 2U);
  EXPECT_THAT(world.faults()[0].recovered_by, HasSubstr("standby"));
  EXPECT_EQ(world.faults()[1].recovered_by, "");
  EXPECT_EQ(world.step_count(), 5U);
}

TEST_P(Supervised, ADeadlineAloneNeverMakesARequestPoison) {
  WorldBuilder slow = builder();
  slow.description().solver.deadline = 1.0;
  Environment world(slow.description());
  world.inject({Slot::kSolver, "hang", 6, 3});
  run_to_end(&world);
  EXPECT_EQ(world.chain_hash(), quiet_chain());
  EXPECT_EQ(world.faults().size(), 3U);
}

// Hears of what a recorder keeps.
class Witness final : public kernel::CommitListener {
 public:
  void on_commit(const Environment&) override {}
  void on_decision(const Environment&, const kernel::Decision& decision) override {
    decisions.push_back(decision.why + " at " + std::to_string(decision.step));
  }
  void on_poison(const Environment&, const kernel::PoisonedCall& poisoned) override {
    poison.push_back(poisoned.plugin.declaration.name + ": " + poisoned.call.info().name);
  }
  std::vector<std::string> decisions, poison;
};

// Its body is above 0 after step 6: -0.055 + 6 * 0.01.
WorldBuilder poisoned_world(Hosting hosting) {
  WorldBuilder builder(hosting);
  builder.steps(kSteps, 0.1).sphere(0.5, 1.0, Vector3(0, -0.055, 0), Vector3(0, 0.1, 0));
  builder.plugin(Slot::kIntegrator, faulty_plugin_path("integrator_poisoned"));
  return builder;
}

TEST_P(Supervised, ARequestThatKillsTwoWorkersPausesTheEnvironment) {
  WorldBuilder builder = poisoned_world(GetParam());
  Environment world(builder.description());
  Witness witness;
  world.set_commit_listener(&witness);
  while (world.step() == StepOutcome::kCommitted) {
  }
  EXPECT_EQ(world.step_count(), 6U);
  EXPECT_EQ(world.fault()->fault.kind, FaultKind::kDeath);
  EXPECT_THAT(witness.poison, ::testing::ElementsAre("Poisoned: Integrator.Integrate"));
  EXPECT_TRUE(witness.decisions.empty());
}

TEST_P(Supervised, TheDeclaredFallbackTakesOverFromPoison) {
  WorldBuilder builder = poisoned_world(GetParam());
  WorldBuilder other(GetParam());
  builder.description().integrator.plugins[0].fallback =
      std::make_shared<const kernel::PluginChoice>(other.description().integrator.plugins[0]);
  Environment world(builder.description());
  Witness witness;
  world.set_commit_listener(&witness);
  run_to_end(&world);
  EXPECT_EQ(witness.decisions, std::vector<std::string>{"fallback SemiImplicitEuler at 7"});
  EXPECT_EQ(witness.poison.size(), 1U);
  EXPECT_EQ(world.faults().back().recovered_by, "fallback SemiImplicitEuler");
  EXPECT_EQ(world.plan().slots[0].plugins[0], "SemiImplicitEuler");
  EXPECT_NEAR(world.state().position[1], -0.055 + kSteps * 0.01, 1e-12);
}

TEST(Supervision, AFallbackThatDoesNotServeTheSceneIsRefused) {
  WorldBuilder builder = busy_world(Hosting::kDirect);
  WorldBuilder other(Hosting::kDirect);
  builder.description().solver.plugins[0].fallback =
      std::make_shared<const kernel::PluginChoice>(other.description().integrator.plugins[0]);
  EXPECT_THROW(Environment world(builder.description()), std::invalid_argument);
}

TEST(Supervision, FaultsAreRefusedWhereTheyWouldHitTheKernelOrNobody) {
  Environment direct(busy_world(Hosting::kDirect).description());
  EXPECT_THROW(direct.inject({Slot::kSolver, "kill", 3}), std::invalid_argument);
  WorldBuilder free(Hosting::kSharedMemory);
  free.point(1.0, Vector3::Ones(), Vector3::Zero());
  Environment alone(free.description());
  EXPECT_THROW(alone.inject({Slot::kSolver, "kill", 3}), std::invalid_argument);
}

// Whoever kills from outside, whenever: idle actives and standbys too.
TEST_P(Supervised, WorkersKilledBetweenStepsAreReplaced) {
  Environment world(builder().description());
  while (world.step_count() < kSteps) {
    ASSERT_EQ(world.step(), StepOutcome::kCommitted) << world.fault()->fault.text();
    if (world.step_count() % 5 != 0 || world.step_count() == kSteps) continue;
    for (const kernel::PlannedSlot& slot : world.plan().slots) kill(slot.process_id, SIGKILL);
  }
  EXPECT_EQ(world.chain_hash(), quiet_chain());
  EXPECT_EQ(world.faults().size(), 3 * std::size(kSlots));
}

// A force that takes its time while an integrator asks for derivatives is slow itself, and not the integrator, whatever else a
// busy machine makes of it.
TEST_P(Supervised, WhoIsSlowInADerivativeIsNamed) {
  Environment world(builder().description());
  world.inject({Slot::kForce, "slow,seconds=0.3", 15});
  run_to_end(&world);
  EXPECT_EQ(world.chain_hash(), quiet_chain());
  const std::vector<std::string> warnings = world.warnings();
  EXPECT_THAT(warnings, ::testing::Contains(HasSubstr("worker of slot force: it was slow")));
  for (const std::string& one : warnings) {
    const std::size_t longest = one.find("up to ");
    if (one.find("slot integrator: it was slow") == std::string::npos) continue;
    ASSERT_NE(longest, std::string::npos) << one;
    EXPECT_LT(std::stoi(one.substr(longest + 6)), 300) << one;
  }
}

}  // namespace
}  // namespace gravitas
