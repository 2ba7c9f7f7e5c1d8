// The ladder that a failed call climbs, with hosts that die as they are told to: no process, no chance.
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <unistd.h>

#include <mutex>
#include <string>
#include <utility>
#include <vector>

#include "kernel/environment.h"
#include "tests/kernel/world_builder.h"

namespace gravitas {
namespace {

using harness::busy_world;
using harness::plugin_path;
using harness::WorldBuilder;
using kernel::Carrier;
using kernel::Environment;
using kernel::FaultKind;
using kernel::Hosting;
using kernel::SlotDescription;
using kernel::StageFault;
using kernel::StepOutcome;
using ::testing::Contains;
using ::testing::HasSubstr;

constexpr std::uint32_t kLadderSteps = 12, kManySteps = 20'000;

enum class Fate {
  kServes,
  kDiesAtFourthCall,
  kDiesOfItsFirstCall,
  kDiesUnread,  // before it looks at its first request
  kDoesNotStart
};

[[noreturn]] void die(bool is_unread) {
  StageFault fault(FaultKind::kDeath, "test", "it died");
  fault.is_unread = is_unread;
  throw StageFault(fault);
}

class Mortal final : public Carrier {
 public:
  Mortal(std::unique_ptr<Carrier> plugins, Hosting hosting, Fate fate)
      : plugins_(std::move(plugins)), hosting_(hosting), fate_(fate) {}
  kernel::CallResult call(const kernel::StageCall& call, kernel::Arena* arena,
                          kernel::DerivativeSource* derivatives) override {
    ++calls_;
    if (fate_ == Fate::kDiesUnread) die(true);
    if (fate_ == Fate::kDiesOfItsFirstCall || (fate_ == Fate::kDiesAtFourthCall && calls_ == 4)) die(false);
    return plugins_->call(call, arena, derivatives);
  }
  int process_id() const override { return getpid(); }
  Hosting hosting() const override { return hosting_; }

 private:
  std::unique_ptr<Carrier> plugins_;
  Hosting hosting_;
  Fate fate_;
  int calls_ = 0;
};

// The solver's hosts meet these fates in the order of their starts, and serve after that; all others serve.
class Ladder : public ::testing::Test {
 protected:
  // Standbys are started side by side with the run, so their order holds where a slot has one.
  kernel::HostStarter starter(std::vector<Fate> fates) {
    return [this, fates = std::move(fates)](const SlotDescription& slot, std::uint32_t threads, std::stop_token) {
      Fate fate = Fate::kServes;
      if (slot.plugins[0].declaration.slot == Slot::kSolver) {
        const std::lock_guard lock(mutex_);
        if (starts_ < fates.size()) fate = fates[starts_];
        ++starts_;
      }
      if (fate == Fate::kDoesNotStart) throw StageFault(FaultKind::kHandshake, "test", "it does not start");
      return std::make_unique<Mortal>(kernel::make_direct_carrier(slot.plugins, threads), slot.hosting, fate);
    };
  }
  static WorldBuilder world(std::uint32_t standbys) {
    WorldBuilder builder = busy_world(Hosting::kSharedMemory).steps(kLadderSteps, 0.01);
    builder.description().solver.standbys = standbys;
    return builder;
  }
  static Hash quiet_chain() {
    Environment quiet(busy_world(Hosting::kDirect).steps(kLadderSteps, 0.01).description());
    while (quiet.step_count() < kLadderSteps) EXPECT_EQ(quiet.step(), StepOutcome::kCommitted);
    return quiet.chain_hash();
  }
  static void run(Environment* world) {
    while (world->step_count() < kLadderSteps)
      ASSERT_EQ(world->step(), StepOutcome::kCommitted) << world->fault()->fault.text();
  }

  std::size_t starts() {
    const std::lock_guard lock(mutex_);
    return starts_;
  }
  // Standbys are started in threads of their own, which take their time.
  void step_until_started(Environment* world, std::size_t count) {
    while (starts() < count && world->step_count() < kManySteps - 300)
      ASSERT_EQ(world->step(), StepOutcome::kCommitted);
    ASSERT_EQ(starts(), count);
  }

 private:
  std::mutex mutex_;
  std::size_t starts_ = 0;
};

TEST_F(Ladder, ARequestThatKillsTwoHostsIsPoison) {
  Environment poisoned(world(1).description(),
                       starter({Fate::kDiesAtFourthCall, Fate::kDiesOfItsFirstCall, Fate::kServes}));
  while (poisoned.step() == StepOutcome::kCommitted && poisoned.step_count() < kLadderSteps) {
  }
  ASSERT_TRUE(poisoned.fault());
  EXPECT_EQ(poisoned.step_count(), 3U);
}

TEST_F(Ladder, AStandbyThatDiesBeforeItReadsTheRequestIsNoWitnessAgainstIt) {
  Environment world(Ladder::world(1).description(),
                    starter({Fate::kDiesAtFourthCall, Fate::kDiesUnread, Fate::kServes}));
  run(&world);
  EXPECT_EQ(world.chain_hash(), quiet_chain());
  ASSERT_EQ(world.faults().size(), 2U);
  EXPECT_NE(world.faults()[1].recovered_by, "");
}

TEST_F(Ladder, AFallbackWhoseWorkerDiesUnreadIsAskedAgain) {
  WorldBuilder builder = world(0);
  SlotDescription& solver = builder.description().solver;
  solver.plugins[0].fallback = std::make_shared<kernel::PluginChoice>(solver.plugins[0]);
  Environment world(builder.description(),
                    starter({Fate::kDiesAtFourthCall, Fate::kDiesOfItsFirstCall, Fate::kDiesUnread, Fate::kServes}));
  run(&world);
  // here the fallback is the same plugin, so the bits are the same, too
  EXPECT_EQ(world.chain_hash(), quiet_chain());
  EXPECT_EQ(world.faults().size(), 3U);
}

// Counts the verdicts.
class PoisonWitness final : public kernel::CommitListener {
 public:
  void on_poison(const Environment&, const kernel::PoisonedCall&) override { ++verdicts; }
  void on_commit(const Environment&) override {}
  int verdicts = 0;
};

TEST_F(Ladder, PoisonStaysPoisonWhenTheFallbackDoesNotStart) {
  WorldBuilder builder = world(0);
  SlotDescription& solver = builder.description().solver;
  solver.plugins[0].fallback = std::make_shared<kernel::PluginChoice>(solver.plugins[0]);
  std::vector<Fate> fates(100, Fate::kDoesNotStart);
  fates[0] = Fate::kDiesAtFourthCall;
  fates[1] = Fate::kDiesOfItsFirstCall;
  Environment world(builder.description(), starter(fates));
  PoisonWitness witness;
  world.set_commit_listener(&witness);
  while (world.step() == StepOutcome::kCommitted && world.step_count() < kLadderSteps) {
  }
  ASSERT_TRUE(world.fault());
  EXPECT_EQ(witness.verdicts, 1);
}

TEST_F(Ladder, AStandbyThatCannotBeStartedIsSaidAndTriedAgain) {
  Environment world(Ladder::world(1).steps(kManySteps, 0.001).description(),
                    starter({Fate::kServes, Fate::kDoesNotStart, Fate::kServes}));
  step_until_started(&world, 3);
  EXPECT_TRUE(world.faults().empty());
  EXPECT_THAT(world.warnings(), Contains(HasSubstr("a standby could not be started: it does not start")));
}

TEST_F(Ladder, StandbysThatNeverStartAreNotTriedForEver) {
  std::vector<Fate> fates(100, Fate::kDoesNotStart);
  fates[0] = Fate::kServes;
  Environment world(Ladder::world(1).steps(kManySteps, 0.001).description(), starter(fates));
  step_until_started(&world, 6);
  for (int i = 0; i < 200; ++i) ASSERT_EQ(world.step(), StepOutcome::kCommitted);
  EXPECT_EQ(starts(), 6U);
}

}  // namespace
}  // namespace gravitas
