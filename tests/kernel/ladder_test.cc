// The ladder that a failed call climbs, with hosts that die as they are told to: no process, no chance.
#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <unistd.h>

#include <cerrno>
#include <limits>
#include <memory>
#include <mutex>
#include <optional>
#include <stdexcept>
#include <string>
#include <system_error>
#include <utility>
#include <vector>

#include "kernel/environment.h"
#include "tests/kernel/run_to_end.h"
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
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::IsEmpty;

constexpr std::uint32_t kLadderSteps = 12, kManySteps = 20'000;

enum class Fate {
  kServes,
  kDiesAtFourthCall,
  kDiesAtTenthCall,
  kDiesOfItsFirstCall,
  kDiesUnread,  // before it looks at its first request
  kHangsAtFourthCall,
  kHangs,
  kDoesNotStart,
  kLacksThreads  // to start
};

[[noreturn]] void die(bool is_unread) {
  StageFault fault(FaultKind::kDeath, "test", "it died");
  fault.is_unread = is_unread;
  throw StageFault(fault);
}

[[noreturn]] void hang() { throw StageFault(FaultKind::kDeadline, "test", "it hung"); }

class Mortal final : public Carrier {
 public:
  Mortal(std::unique_ptr<Carrier> plugins, Hosting hosting, Fate fate)
      : plugins_(std::move(plugins)), hosting_(hosting), fate_(fate) {}
  kernel::CallResult call(const kernel::StageCall& call, kernel::Arena* arena,
                          kernel::DerivativeSource* derivatives) override {
    ++calls_;
    if (fate_ == Fate::kDiesUnread) die(true);
    if (fate_ == Fate::kHangs || (fate_ == Fate::kHangsAtFourthCall && calls_ == 4)) hang();
    if (fate_ == Fate::kDiesOfItsFirstCall || (fate_ == Fate::kDiesAtFourthCall && calls_ == 4) ||
        (fate_ == Fate::kDiesAtTenthCall && calls_ == 10))
      die(false);
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

// The hosts of a slot meet these fates in the order of their starts, and serve after that; all others serve.
class Ladder : public ::testing::Test {
 protected:
  // Standbys are started side by side with the run, so their order holds where a slot has one.
  kernel::HostStarter starter(std::vector<Fate> fates, Slot of = Slot::kSolver) {
    starts_ = 0;
    started_.clear();
    return [this, of, fates = std::move(fates)](const SlotDescription& slot, std::uint32_t threads, std::stop_token) {
      Fate fate = Fate::kServes;
      if (slot.plugins[0].declaration.slot == of) {
        const std::lock_guard lock(mutex_);
        if (starts_ < fates.size()) fate = fates[starts_];
        ++starts_;
        started_.push_back(slot);
      }
      if (fate == Fate::kDoesNotStart) throw StageFault(FaultKind::kHandshake, "test", "it does not start");
      if (fate == Fate::kLacksThreads) throw std::system_error(EAGAIN, std::generic_category(), "thread");
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
    for (std::uint32_t step = 0; step < kLadderSteps; ++step) EXPECT_EQ(quiet.step(), StepOutcome::kCommitted);
    return quiet.chain_hash();
  }
  static void run(Environment* world) {
    while (world->step_count() < kLadderSteps)
      ASSERT_EQ(world->step(), StepOutcome::kCommitted) << world->fault()->fault.text();
  }

  // Where, and with which deadline.
  std::vector<std::string> started() {
    const std::lock_guard lock(mutex_);
    std::vector<std::string> all;
    for (const SlotDescription& slot : started_)
      all.push_back(std::string(kernel::hosting_name(slot.hosting)) +
                    (slot.attached ? ", attached" : ", not attached") +
                    (slot.call_deadline() < kernel::kAttachedDeadline ? fmt::format(", {:g} s", slot.deadline) : ""));
    return all;
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
  std::vector<SlotDescription> started_;
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

TEST_F(Ladder, AColdStartForWhichThereIsNoThreadIsTriedAgain) {
  Environment world(Ladder::world(0).description(),
                    starter({Fate::kDiesAtFourthCall, Fate::kLacksThreads, Fate::kServes}));
  run(&world);
  EXPECT_EQ(world.chain_hash(), quiet_chain());
  EXPECT_EQ(world.faults().size(), 1U);
}

// Counts the verdicts, and keeps who answers from when on.
class PoisonWitness final : public kernel::CommitListener {
 public:
  void on_poison(const Environment&, const kernel::PoisonedCall&) override { ++verdicts; }
  void on_decision(const Environment&, const kernel::Decision& decision) override {
    decisions.push_back(decision.why + " at " + std::to_string(decision.step) + ": " +
                        decision.plugin->declaration.name + ", " + kernel::hosting_name(decision.host->hosting));
  }
  void on_commit(const Environment&) override {}
  int verdicts = 0;
  std::vector<std::string> decisions;
};

// Forces are asked before anybody can listen, and those that are constant are let go.
TEST_F(Ladder, AFallbackThatTakesOverAtTheStartIsToldToWhoListensLater) {
  for (const bool is_constant : {false, true}) {
    WorldBuilder builder(Hosting::kSharedMemory);
    builder.steps(kLadderSteps, 0.01).sphere(0.5, 1.0, Vector3::Zero());
    if (is_constant) {
      builder.gravity(Vector3(0, -9.81, 0));
    } else {
      builder.force("Drag", "force_drag", {0.1, 0.5});
    }
    SlotDescription& force = builder.description().force;
    force.standbys = 0;
    kernel::PluginChoice other = force.plugins[0];
    other.declaration.name = "Other";
    force.plugins[0].fallback = std::make_shared<kernel::PluginChoice>(other);
    Environment world(builder.description(),
                      starter({Fate::kDiesOfItsFirstCall, Fate::kDiesOfItsFirstCall, Fate::kServes}, Slot::kForce));
    PoisonWitness witness, late;
    world.set_commit_listener(&witness);
    EXPECT_THAT(witness.decisions, ElementsAre("fallback Other at 1: Other, shm"));
    run(&world);
    world.set_commit_listener(&late);
    EXPECT_EQ(witness.decisions.size(), 1U);
    EXPECT_THAT(late.decisions, IsEmpty());
  }
}

// It serves no other plugin, so the one that it may have to follow is alone from the start.
TEST_F(Ladder, AFallbackThatIsACommandTakesOverByGrpc) {
  for (const Hosting hosting : {Hosting::kDirect, Hosting::kSharedMemory, Hosting::kGrpc}) {
    SCOPED_TRACE(kernel::hosting_name(hosting));
    WorldBuilder builder(hosting);
    builder.steps(kLadderSteps, 0.01).sphere(0.5, 1.0, Vector3::Zero()).gravity(Vector3(0, -9.81, 0));
    builder.force("Drag", "force_drag", {0.1, 0.5});
    SlotDescription& force = builder.description().force;
    force.standbys = 0;
    force.process = builder.description().integrator.process = "one";
    kernel::PluginChoice other = force.plugins[1];
    other.declaration.name = "Other";
    other.command = "a worker of its own";
    force.plugins[1].fallback = std::make_shared<kernel::PluginChoice>(other);
    std::vector<Fate> fates = {Fate::kDiesAtFourthCall, Fate::kDiesOfItsFirstCall};
    Environment world(builder.description(), [&](const SlotDescription& slot, std::uint32_t threads, std::stop_token) {
      Fate fate = Fate::kServes;
      const std::string& name = slot.plugins[0].declaration.name;
      if (name == "Drag" || name == "Other") {
        EXPECT_EQ(slot.plugins.size(), 1U);
      }
      if (name == "Drag" && !fates.empty()) fate = fates[0], fates.erase(fates.begin());
      return std::make_unique<Mortal>(kernel::make_direct_carrier(slot.plugins, threads), slot.hosting, fate);
    });
    PoisonWitness witness;
    world.set_commit_listener(&witness);
    run(&world);
    EXPECT_THAT(witness.decisions, ElementsAre("fallback Other at 3: Other, grpc"));
  }
}

TEST_F(Ladder, AFallbackThatItsHostCannotHoldIsRefused) {
  WorldBuilder builder(Hosting::kSharedMemory);
  builder.steps(kLadderSteps, 0.01).sphere(0.5, 1.0, Vector3::Zero()).gravity(Vector3(0, -9.81, 0));
  builder.force("Drag", "force_drag", {0.1, 0.5});
  std::vector<kernel::PluginChoice>& plugins = builder.description().force.plugins;
  std::vector<std::shared_ptr<kernel::PluginChoice>> libraries;
  for (kernel::PluginChoice& plugin : plugins) {
    libraries.push_back(std::make_shared<kernel::PluginChoice>(plugin));
    plugin.address = "unix:/of/one/worker";
  }
  plugins[1].fallback = libraries[1];
  const auto why = [&]() -> std::string {
    try {
      Environment world(builder.description(), starter({}));
    } catch (const std::invalid_argument& problem) {
      return problem.what();
    }
    return "accepted";
  };
  EXPECT_EQ(
      why(),
      "fallback Drag of Drag: a command or an address serves one plugin, and this process would hold others besides");
  plugins[0].fallback = libraries[0];
  EXPECT_EQ(why(), "accepted");
}

// Answers a Jacobian that is none, or knows of none.
class WrongJacobians final : public Carrier {
 public:
  WrongJacobians(std::unique_ptr<Carrier> plugins, bool knows) : plugins_(std::move(plugins)), knows_(knows) {}
  kernel::CallResult call(const kernel::StageCall& call, kernel::Arena* arena,
                          kernel::DerivativeSource* derivatives) override {
    const bool is_asked = call.method == stage::Method::kForceJacobians;
    if (is_asked && !knows_) return {GRAVITAS_UNKNOWN_METHOD, "", 0, 0};
    kernel::CallResult result = plugins_->call(call, arena, derivatives);
    if (is_asked && result.status == GRAVITAS_OK)
      *reinterpret_cast<double*>(arena->data(call.reply[1])) = std::numeric_limits<double>::quiet_NaN();
    return result;
  }
  int process_id() const override { return getpid(); }
  Hosting hosting() const override { return Hosting::kSharedMemory; }

 private:
  std::unique_ptr<Carrier> plugins_;
  bool knows_;
};

TEST_F(Ladder, AWrongJacobianIsNotThatOfAFallbackWithoutAny) {
  WorldBuilder builder(Hosting::kSharedMemory);
  builder.steps(kLadderSteps, 0.01).plugin(Slot::kIntegrator, plugin_path("integrator_rosenbrock"), {1e-3});
  builder.sphere(0.5, 1.0, Vector3::Zero(), Vector3(3, 2, 1)).force("Drag", "force_drag", {0.1, 0.5});
  SlotDescription& force = builder.description().force;
  force.standbys = 0;
  kernel::PluginChoice other = force.plugins[0];
  other.declaration.name = "Other";
  other.declaration.capabilities.clear();
  force.plugins[0].fallback = std::make_shared<kernel::PluginChoice>(other);
  Environment world(builder.description(), [&](const SlotDescription& slot, std::uint32_t threads, std::stop_token) {
    return std::make_unique<WrongJacobians>(kernel::make_direct_carrier(slot.plugins, threads),
                                            slot.plugins[0].declaration.name != "Other");
  });
  run(&world);
  ASSERT_EQ(world.faults().size(), 2U);
  for (const kernel::FaultRecord& fault : world.faults()) EXPECT_EQ(fault.fault.plugin, "Drag");
  EXPECT_EQ(world.faults()[1].recovered_by, "fallback Other");
}

// A worker that was started by hand has no deadline; who takes over has, until it has to come back.
TEST_F(Ladder, WhoTakesOverFromAnAttachedWorkerHasADeadline) {
  WorldBuilder builder = world(0);
  SlotDescription& solver = builder.description().solver;
  const kernel::PluginChoice library = solver.plugins[0];
  solver.hosting = Hosting::kGrpc;
  solver.attached = true;
  solver.deadline = 7.0;
  solver.plugins[0].address = "unix:/of/one/worker";
  const std::string attached = "grpc, attached", ours = "grpc, not attached, 7 s";

  Environment swapped(builder.description(),
                      starter({Fate::kServes, Fate::kDiesAtTenthCall, Fate::kDiesOfItsFirstCall}));
  swapped.order_swap({Slot::kSolver, library, std::nullopt, 1});
  run(&swapped);
  EXPECT_THAT(started(), ElementsAre(attached, ours, ours, attached));
  ASSERT_EQ(swapped.faults().size(), 2U);
  EXPECT_EQ(swapped.faults()[1].recovered_by, "previous build");

  solver.plugins[0].fallback = std::make_shared<kernel::PluginChoice>(library);
  Environment fallen(builder.description(), starter({Fate::kDiesAtFourthCall, Fate::kDiesOfItsFirstCall}));
  run(&fallen);
  EXPECT_THAT(started(), ElementsAre(attached, attached, ours));
}

// Between two steps it is the next one that others make.
TEST_F(Ladder, AFallbackThatTakesOverBetweenStepsMakesTheNext) {
  WorldBuilder builder(Hosting::kSharedMemory);
  builder.steps(kLadderSteps, 0.01).sphere(0.5, 1.0, Vector3::Zero()).force("Drag", "force_drag", {0.1, 0.5});
  SlotDescription& force = builder.description().force;
  force.standbys = 0;
  force.plugins[0].fallback = std::make_shared<kernel::PluginChoice>(force.plugins[0]);
  Environment world(builder.description(),
                    starter({Fate::kDiesAtFourthCall, Fate::kDiesOfItsFirstCall, Fate::kServes}, Slot::kForce));
  PoisonWitness witness;
  world.set_commit_listener(&witness);
  // asked at the start and once in each step
  for (int i = 0; i < 2; ++i) ASSERT_EQ(world.step(), StepOutcome::kCommitted);
  world.potential_energy();
  EXPECT_THAT(witness.decisions, ElementsAre("fallback Drag at 3: Drag, shm"));
}

TEST_F(Ladder, FailuresGoAlongWithTheState) {
  Environment failing(world(0).description(), starter({Fate::kDiesAtFourthCall, Fate::kServes}));
  EXPECT_THAT(failing.saved_state().budgets, IsEmpty());
  run(&failing);
  const kernel::SavedState saved = failing.saved_state();
  ASSERT_EQ(saved.budgets.size(), 1U);
  EXPECT_EQ(saved.budgets[0].slot, Slot::kSolver);
  EXPECT_EQ(saved.budgets[0].target, 0U);
  EXPECT_EQ(saved.budgets[0].budget.failures, 1U);
  EXPECT_GE(saved.budgets[0].budget.good_answers, kLadderSteps - 3);
  // one more is one too many in whoever takes the state
  WorldBuilder builder = world(0).steps(2 * kLadderSteps, 0.01);
  builder.description().solver.failures = 2;
  Environment resumed(builder.description(), starter({Fate::kDiesAtFourthCall, Fate::kServes}));
  ASSERT_EQ(resumed.restore(saved), "");
  ASSERT_EQ(resumed.saved_state().budgets.size(), 1U);
  EXPECT_EQ(resumed.saved_state().budgets[0].budget.failures, 1U);
  while (resumed.step() == StepOutcome::kCommitted && resumed.step_count() < 2 * kLadderSteps) {
  }
  EXPECT_TRUE(resumed.fault());
  // after that they are counted anew
  EXPECT_THAT(resumed.saved_state().budgets, IsEmpty());
}

TEST_F(Ladder, WhoIsAskedAfterItsEndSaysSo) {
  WorldBuilder builder = world(0);
  builder.description().force.standbys = 0;
  std::vector<Fate> fates(100, Fate::kDoesNotStart);
  fates[0] = Fate::kDiesAtFourthCall;
  Environment world(builder.description(), starter(fates, Slot::kForce));
  while (world.step() == StepOutcome::kCommitted && world.step_count() < kLadderSteps) {
  }
  ASSERT_TRUE(world.fault());
  const std::size_t faults = world.faults().size();
  try {
    world.potential_energy();
    FAIL();
  } catch (const StageFault& fault) {
    EXPECT_EQ(fault.text(), "nobody is left to ask");
    EXPECT_EQ(fault.slot, Slot::kForce);
  }
  EXPECT_EQ(world.faults().size(), faults);
}

// A question about nothing is asked of who is compared with others, and of nobody once the other one is refused.
TEST_F(Ladder, AComparisonThatIsRefusedLeavesNothingBehind) {
  WorldBuilder builder(Hosting::kDirect);
  builder.steps(kLadderSteps, 0.01).sphere(0.5, 1.0, Vector3::Zero()).sphere(0.5, 1.0, Vector3(9, 0, 0));
  Environment world(builder.description(), starter({Fate::kServes, Fate::kDiesOfItsFirstCall}));
  world.order_swap({Slot::kSolver, builder.description().solver.plugins[0], std::nullopt, 1}, true);
  run(&world);
  ASSERT_EQ(world.swaps().size(), 1U);
  EXPECT_EQ(world.swaps()[0].state, kernel::SwapState::kRefused);
  EXPECT_EQ(world.stage_time(kernel::Stage::kSolve).count(), 1U);
}

struct Rerun {
  int starts = 0;
  bool is_open = false;     // the second host is being asked
  bool was_let_go = false;  // meanwhile
};

// Hosts of two slots that share a process. The first and the third die when the integrator of the second asks for forces.
class Checked final : public Carrier {
 public:
  Checked(std::unique_ptr<Carrier> plugins, Rerun* rerun)
      : plugins_(std::move(plugins)), rerun_(*rerun), number_(rerun->starts++) {}
  kernel::CallResult call(const kernel::StageCall& call, kernel::Arena* arena,
                          kernel::DerivativeSource* derivatives) override {
    if (rerun_.is_open && (number_ == 0 || number_ == 2)) die(false);
    if (number_ != 1) return plugins_->call(call, arena, derivatives);
    rerun_.is_open = true;
    kernel::CallResult result = plugins_->call(call, arena, derivatives);
    rerun_.is_open = false;
    return result;
  }
  void drain() override { rerun_.was_let_go |= number_ == 1 && rerun_.is_open; }
  int process_id() const override { return getpid(); }
  Hosting hosting() const override { return Hosting::kSharedMemory; }

 private:
  std::unique_ptr<Carrier> plugins_;
  Rerun& rerun_;
  int number_;
};

TEST_F(Ladder, WhoIsAskedForComparisonOutlastsAFallbackInItsCall) {
  WorldBuilder builder(Hosting::kSharedMemory);
  builder.steps(kLadderSteps, 0.01).integrator("integrator_rk4");
  builder.sphere(0.5, 1.0, Vector3::Zero(), Vector3(3, 2, 1)).force("Drag", "force_drag", {0.1, 0.5});
  Environment quiet(builder.description(), starter({}));
  run(&quiet);
  for (const Slot slot : {Slot::kForce, Slot::kIntegrator}) {
    builder.description().slot(slot).process = "one";
    builder.description().slot(slot).standbys = 0;
  }
  kernel::PluginChoice& drag = builder.description().force.plugins[0];
  drag.fallback = std::make_shared<kernel::PluginChoice>(drag);
  Rerun rerun;
  Environment world(builder.description(), [&](const SlotDescription& slot, std::uint32_t threads, std::stop_token) {
    return std::make_unique<Checked>(kernel::make_direct_carrier(slot.plugins, threads), &rerun);
  });
  world.set_rerun_every(Slot::kIntegrator, 1);
  run(&world);
  EXPECT_FALSE(rerun.was_let_go);
  EXPECT_EQ(rerun.starts, 5);  // the last one is asked for comparison from then on
  EXPECT_EQ(world.faults().size(), 2U);
  EXPECT_EQ(world.faults().back().recovered_by, "fallback Drag");
  EXPECT_EQ(world.chain_hash(), quiet.chain_hash());
  EXPECT_THAT(warnings_but_of_slow_calls(&world), IsEmpty());
}

// Nor does it say anything of who answered first.
TEST_F(Ladder, WhoDiesWhileItIsAskedForComparisonDoesNotAnswerOtherwise) {
  std::vector<Fate> fates(100, Fate::kDiesOfItsFirstCall);
  fates[0] = Fate::kServes;
  Environment world(Ladder::world(0).description(), starter(fates));
  world.set_rerun_every(Slot::kSolver, 1);
  run(&world);
  EXPECT_EQ(world.chain_hash(), quiet_chain());
  EXPECT_TRUE(world.faults().empty());
  EXPECT_THAT(world.warnings(), Contains(HasSubstr("a re-run came to nothing: it died")));
}

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

// It may be the machine that stands still, so the slot fails as often as it may; then what it was asked is kept.
TEST_F(Ladder, ARequestThatHangsToTheEndIsKept) {
  for (const bool has_fallback : {false, true}) {
    WorldBuilder builder = world(0);
    SlotDescription& solver = builder.description().solver;
    if (has_fallback) solver.plugins[0].fallback = std::make_shared<kernel::PluginChoice>(solver.plugins[0]);
    std::vector<Fate> fates(SlotDescription::kBudget, Fate::kHangs);
    fates[0] = Fate::kHangsAtFourthCall;
    Environment world(builder.description(), starter(fates));
    PoisonWitness witness;
    world.set_commit_listener(&witness);
    while (world.step_count() < kLadderSteps && world.step() == StepOutcome::kCommitted) {
    }
    EXPECT_EQ(world.step_count(), has_fallback ? kLadderSteps : 3U);
    EXPECT_EQ(world.faults().size(), SlotDescription::kBudget);
    EXPECT_EQ(witness.verdicts, 1);
  }
}

TEST_F(Ladder, DeathsFromOutsideSayNothingOfTheRequestInTheEnd) {
  std::vector<Fate> fates(SlotDescription::kBudget, Fate::kDiesUnread);
  Environment world(Ladder::world(0).description(), starter(fates));
  PoisonWitness witness;
  world.set_commit_listener(&witness);
  EXPECT_EQ(world.step(), StepOutcome::kPaused);
  EXPECT_EQ(witness.verdicts, 0);
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
