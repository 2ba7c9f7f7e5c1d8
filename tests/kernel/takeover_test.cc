// Who takes over in an awkward moment: between two steps, inside another call, while it is asked for the first time. The
// run that goes on from a saved state, or without the moment, has the same bits.
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <unistd.h>

#include <functional>
#include <memory>
#include <mutex>
#include <string>
#include <utility>
#include <vector>

#include "kernel/environment.h"
#include "plugin_sdk/slots.h"
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
using kernel::PluginChoice;
using kernel::SlotDescription;
using kernel::StageCall;
using kernel::StageFault;
using kernel::StepOutcome;
using kernel::SwapState;
using stage::Method;
using ::testing::ElementsAre;
using ::testing::IsEmpty;

// What happens in the calls of a host, by the number of its start and its first plugin.
struct Script {
  struct Host {
    std::size_t number;
    std::string plugin;
    Hosting hosting;
  };
  std::function<bool(const Host&)> starts = [](const Host&) { return true; };
  std::function<bool(const Host&, const StageCall&)> dies = [](const Host&, const StageCall&) { return false; };
  std::function<void(const Host&, const StageCall&, kernel::Arena*)> answers = {};
};

class Scripted final : public Carrier {
 public:
  Scripted(std::unique_ptr<Carrier> plugins, Script::Host host, const Script* script)
      : plugins_(std::move(plugins)), host_(std::move(host)), script_(*script) {}
  kernel::CallResult call(const StageCall& call, kernel::Arena* arena, kernel::DerivativeSource* derivatives) override {
    if (script_.dies(host_, call)) throw StageFault(FaultKind::kDeath, "test", "it died");
    kernel::CallResult result = plugins_->call(call, arena, derivatives);
    if (result.status == GRAVITAS_OK && script_.answers) script_.answers(host_, call, arena);
    return result;
  }
  int process_id() const override { return getpid(); }
  Hosting hosting() const override { return host_.hosting; }

 private:
  std::unique_ptr<Carrier> plugins_;
  Script::Host host_;
  const Script& script_;
};

class TakeOver : public ::testing::Test {
 protected:
  // Hosts that go by `script`, which must outlive them.
  kernel::HostStarter starter(const Script* script) {
    return [this, script](const SlotDescription& slot, std::uint32_t threads, std::stop_token) {
      const std::lock_guard lock(mutex_);
      const Script::Host host{starts_++, slot.plugins[0].declaration.name, slot.hosting};
      if (!script->starts(host)) throw StageFault(FaultKind::kHandshake, "test", "it does not start");
      return std::make_unique<Scripted>(kernel::make_direct_carrier(slot.plugins, threads), host, script);
    };
  }
  std::size_t starts() {
    const std::lock_guard lock(mutex_);
    return starts_;
  }

 private:
  std::mutex mutex_;
  std::size_t starts_ = 0;
};

PluginChoice named(PluginChoice plugin, const std::string& name) {
  plugin.declaration.name = name;
  plugin.fallback = nullptr;
  return plugin;
}

void fall_back(SlotDescription* slot, std::size_t row, const PluginChoice& fallback) {
  slot->plugins[row].fallback = std::make_shared<PluginChoice>(fallback);
}

void steps_to(Environment* world, std::uint32_t step_count) {
  while (world->step_count() < step_count) ASSERT_NO_FATAL_FAILURE(step(world));
}

void run_alike(Environment* one, Environment* other) {
  EXPECT_EQ(one->chain_hash(), other->chain_hash());
  while (one->step_count() < one->total_steps()) {
    ASSERT_NO_FATAL_FAILURE(step(one));
    ASSERT_NO_FATAL_FAILURE(step(other));
    ASSERT_EQ(one->chain_hash(), other->chain_hash()) << "step " << one->step_count();
    for (std::uint32_t body = 0; body < one->model().body_count; ++body)
      ASSERT_EQ(one->is_asleep(body), other->is_asleep(body)) << "step " << one->step_count() << ", body " << body;
  }
}

constexpr std::uint32_t kTakeOverSteps = 100, kSleepsBy = 70;

// A ball (1) that lies on the ground, and falls asleep, and one (2) that goes by.
WorldBuilder resting_ball() {
  WorldBuilder builder(Hosting::kSharedMemory);
  builder.steps(kTakeOverSteps, 0.01).ground().sphere(0.5, 1.0, Vector3(0, 0.5, 0)).gravity(Vector3(0, -9.81, 0));
  builder.body().flags |= kCanSleep;
  builder.sphere(0.5, 1.0, Vector3(5, 3, 0), Vector3(1, 0, 2)).force("Drag", "force_drag", {0.1, 0.5});
  for (const Slot slot : kSlots) builder.description().slot(slot).standbys = 0;
  return builder;
}

TEST_F(TakeOver, BetweenStepsWakesInTheRunThatGoesOnFromThereToo) {
  WorldBuilder builder = resting_ball();
  SlotDescription& force = builder.description().force;
  const PluginChoice other = named(force.plugins[1], "Other");
  fall_back(&force, 1, other);
  int deaths = 0;
  Script script;
  script.dies = [&](const Script::Host&, const StageCall& call) {
    return call.method == Method::kForceWrenches && deaths > 0 && deaths-- > 0;
  };
  Environment whole(builder.description(), starter(&script));
  steps_to(&whole, kSleepsBy);
  ASSERT_TRUE(whole.is_asleep(1));
  EXPECT_THAT(whole.wake_orders(), IsEmpty());
  deaths = 2;
  whole.potential_energy();
  ASSERT_EQ(whole.faults().size(), 2U);
  EXPECT_THAT(whole.wake_orders(), ElementsAre(1));
  force.plugins[1] = other;
  Environment resumed(builder.description(), starter(&script));
  ASSERT_EQ(resumed.restore(whole.saved_state()), "");
  ASSERT_NO_FATAL_FAILURE(step(&whole));
  ASSERT_NO_FATAL_FAILURE(step(&resumed));
  EXPECT_FALSE(whole.is_asleep(1));
  run_alike(&whole, &resumed);
}

// In a step that another slot's failure ends: the run that goes on from there is the one in which that did not fail.
TEST_F(TakeOver, InAStepThatPausesIsThatOfTheRunThatDoesNot) {
  for (const Slot slot : {Slot::kIntegrator, Slot::kCollision, Slot::kForce}) {
    SCOPED_TRACE(slot_name(slot));
    WorldBuilder builder = resting_ball();
    builder.plugin(Slot::kIntegrator, plugin_path("integrator_dormand_prince54"), {1e-9, 1});
    builder.sphere(0.5, 1.0, Vector3(-9, 0.49, 0), Vector3(0.3, 0, 0));
    SlotDescription& changed = builder.description().slot(slot);
    const std::size_t row = changed.plugins.size() - 1;
    const PluginChoice other = named(changed.plugins[row], "Other");
    fall_back(&changed, row, other);
    const Method method = slot == Slot::kIntegrator  ? Method::kIntegratorIntegrate
                          : slot == Slot::kCollision ? Method::kCollisionManifolds
                                                     : Method::kForceWrenches;
    const auto falls_back_in_next_step = [&](Script* script, bool solver_dies) {
      auto deaths = std::make_shared<int>(2);
      script->dies = [=](const Script::Host&, const StageCall& call) {
        if (call.method == method && *deaths > 0) return --*deaths, true;
        return solver_dies && call.method == Method::kSolverSolve;
      };
    };
    Script script, failing;
    Environment whole(builder.description(), starter(&script)), paused(builder.description(), starter(&failing));
    steps_to(&whole, kSleepsBy);
    steps_to(&paused, kSleepsBy);
    ASSERT_TRUE(paused.is_asleep(1));
    falls_back_in_next_step(&script, false);
    falls_back_in_next_step(&failing, true);
    ASSERT_EQ(paused.step(), StepOutcome::kPaused);
    EXPECT_EQ(paused.faults()[1].recovered_by, "fallback Other");
    changed.plugins[row] = other;
    Script quiet;
    Environment resumed(builder.description(), starter(&quiet));
    ASSERT_EQ(resumed.restore(paused.saved_state()), "");
    run_alike(&whole, &resumed);
    EXPECT_EQ(whole.faults().size(), 2U);
  }
}

// One whose wrench changed is followed by one whose wrench is constant: it is asked all the same, here and there.
TEST_F(TakeOver, ByAConstantForceIsAskedInTheRunThatGoesOnFromThereToo) {
  WorldBuilder builder(Hosting::kSharedMemory);
  builder.steps(kTakeOverSteps, 0.01).ground().sphere(0.5, 1.0, Vector3(0, 0.5, 0)).gravity(Vector3(0, -9.81, 0));
  builder.body().flags |= kCanSleep;
  SlotDescription& force = builder.description().force;
  force.standbys = 0;
  const PluginChoice other = named(force.plugins[0], "Other");
  fall_back(&force, 0, other);
  int deaths = 0;
  Script script;
  script.dies = [&](const Script::Host&, const StageCall& call) {
    return call.method == Method::kForceWrenches && deaths > 0 && deaths-- > 0;
  };
  script.answers = [](const Script::Host& host, const StageCall& call, kernel::Arena* arena) {
    if (call.method == Method::kForceWrenches && host.plugin != "Other")
      *reinterpret_cast<std::uint32_t*>(arena->data(call.reply[3])) &= ~std::uint32_t{kConstantWrench};
  };
  Environment whole(builder.description(), starter(&script));
  steps_to(&whole, 10);
  deaths = 2;
  steps_to(&whole, kSleepsBy);
  EXPECT_EQ(whole.faults().size(), 2U);
  EXPECT_TRUE(whole.asks_forces());
  force.plugins[0] = other;
  {
    Environment fresh(builder.description(), starter(&script));
    EXPECT_FALSE(fresh.asks_forces());
  }
  builder.description().asks_forces = whole.asks_forces();
  Environment resumed(builder.description(), starter(&script));
  ASSERT_EQ(resumed.restore(whole.saved_state()), "");
  run_alike(&whole, &resumed);
}

TEST_F(TakeOver, OfAConstraintOutlastsAComparisonThatRefusesToBind) {
  WorldBuilder builder = busy_world(Hosting::kSharedMemory);
  const PluginChoice joints = builder.description().constraint.plugins[0];
  builder.description().constraint.standbys = 0;
  Environment quiet(builder.description());
  run_to_end(&quiet);
  Script script;
  script.dies = [](const Script::Host& host, const StageCall& call) {
    return host.plugin == "Compared" && call.method == Method::kConstraintBind;
  };
  Environment world(builder.description(), starter(&script));
  world.order_swap({Slot::kConstraint, named(joints, "Compared"), std::nullopt, 1}, true);
  world.order_swap({Slot::kConstraint, joints, std::nullopt, 20});
  run_to_end(&world);
  EXPECT_EQ(world.chain_hash(), quiet.chain_hash());
  ASSERT_EQ(world.swaps().size(), 2U);
  EXPECT_EQ(world.swaps()[1].state, SwapState::kCommitted);
  EXPECT_EQ(world.swaps()[1].step, 20U);
  // it is asked what it answers, on either side
  EXPECT_EQ(world.swaps()[0].state, SwapState::kShadow);
  EXPECT_GT(world.swaps()[0].shadow.calls, 40U);
  EXPECT_TRUE(world.faults().empty());
}

// Blocks are counted by what those say who answer now, be it that another plugin of their host failed.
TEST_F(TakeOver, OfAForceHasItsOwnBlocksCounted) {
  for (const bool is_alone : {true, false}) {
    SCOPED_TRACE(is_alone);
    WorldBuilder builder(Hosting::kSharedMemory);
    builder.steps(12, 0.01).plugin(Slot::kIntegrator, plugin_path("integrator_rosenbrock"), {1e-3});
    builder.sphere(0.5, 1.0, Vector3::Zero(), Vector3(3, 2, 1)).force("Drag", "force_drag", {0.1, 0.5});
    if (!is_alone) builder.force("Basic", "force_basic", {0.1, 0, 0, 0, 0.1, 0, 0, 0, 0, 1, 0, 0});
    builder.description().asks_forces = true;
    SlotDescription& force = builder.description().force;
    force.standbys = 0;
    PluginChoice other = named(force.plugins[0], "Other");
    if (!is_alone) other.declaration.capabilities.clear();
    fall_back(&force, 0, other);
    int deaths = 0;
    std::vector<std::string> asked;
    Script script;
    script.dies = [&](const Script::Host& host, const StageCall& call) {
      if (call.method == Method::kForceJacobians) asked.push_back(host.plugin);
      return call.method == Method::kForceWrenches && call.target + 1 == force.plugins.size() && deaths > 0 &&
             deaths-- > 0;
    };
    script.answers = [](const Script::Host& host, const StageCall& call, kernel::Arena* arena) {
      if (call.method == Method::kForceWrenches && call.target == 0 && host.plugin != "Other")
        *reinterpret_cast<std::uint32_t*>(arena->data(call.reply[3])) |= kConstantWrench;
    };
    Environment whole(builder.description(), starter(&script));
    steps_to(&whole, 4);
    EXPECT_EQ(asked.empty(), is_alone);
    deaths = 2;
    ASSERT_NO_FATAL_FAILURE(step(&whole));
    ASSERT_EQ(whole.faults().size(), 2U);
    asked.clear();
    force.plugins[0] = other;
    Environment resumed(builder.description(), starter(&script));
    ASSERT_EQ(resumed.restore(whole.saved_state()), "");
    run_alike(&whole, &resumed);
    EXPECT_EQ(asked.empty(), !is_alone);
    for (const std::string& plugin : asked) EXPECT_EQ(plugin, "Other");
    EXPECT_EQ(whole.faults().size(), 2U);
  }
}

// A rollback in the compared call takes the process of the integrator that is compared with it elsewhere.
TEST_F(TakeOver, InAComparedCallLeavesTheAnswerThatWasPutAside) {
  WorldBuilder builder(Hosting::kSharedMemory);
  builder.steps(20, 0.01).integrator("integrator_rk4");
  builder.sphere(0.5, 1.0, Vector3::Zero(), Vector3(3, 2, 1)).force("Drag", "force_drag", {0.1, 0.5});
  Environment quiet(builder.description());
  run_to_end(&quiet);
  for (const Slot slot : {Slot::kForce, Slot::kIntegrator}) {
    builder.description().slot(slot).process = "one";
    builder.description().slot(slot).standbys = 0;
  }
  // the host that is compared is asked when the one that was swapped in has answered
  bool is_compared = false, has_died = false;
  Script script;
  script.dies = [&](const Script::Host& host, const StageCall& call) {
    if (call.method == Method::kIntegratorIntegrate) is_compared = call.is_compared;
    if (!is_compared || has_died || host.hosting != Hosting::kGrpc || call.method != Method::kForceWrenches)
      return false;
    return has_died = true;
  };
  Environment world(builder.description(), starter(&script));
  world.order_swap({Slot::kIntegrator, builder.description().integrator.plugins[0], std::nullopt, 1}, true);
  steps_to(&world, 2);
  world.order_swap({Slot::kForce, builder.description().force.plugins[0], Hosting::kGrpc, 3});
  run_to_end(&world);
  EXPECT_TRUE(has_died);
  ASSERT_EQ(world.faults().size(), 1U);
  EXPECT_EQ(world.faults()[0].recovered_by, "rollback");
  EXPECT_EQ(world.chain_hash(), quiet.chain_hash());
  for (const kernel::SwapRecord& swap : world.swaps()) EXPECT_EQ(swap.shadow.differing_calls, 0U);
}

class Decisions final : public kernel::CommitListener {
 public:
  void on_decision(const Environment&, const kernel::Decision& decision) override {
    told.push_back(decision.why + " of " + std::to_string(decision.target));
  }
  void on_commit(const Environment&) override {}
  std::vector<std::string> told;
};

// Both plugins of a host are rolled back when the first is bound: the second has not come in.
TEST_F(TakeOver, ThatFailsWhenItIsBoundEndsThere) {
  WorldBuilder builder = busy_world(Hosting::kSharedMemory);
  builder.joint("Rigid", "constraint_rigid", 1, 2, {1.5, 0.6, 0});
  SlotDescription& constraint = builder.description().constraint;
  constraint.standbys = 0;
  Environment quiet(builder.description());
  run_to_end(&quiet);
  Script script;
  script.dies = [](const Script::Host& host, const StageCall& call) {
    return host.plugin == "New" && call.method == Method::kConstraintBind;
  };
  Environment world(builder.description(), starter(&script));
  Decisions decisions;
  world.set_commit_listener(&decisions);
  world.order_swap({Slot::kConstraint, named(constraint.plugins[0], "New"), std::nullopt, 20});
  run_to_end(&world);
  EXPECT_EQ(world.chain_hash(), quiet.chain_hash());
  EXPECT_EQ(world.swaps()[0].state, SwapState::kRolledBack);
  EXPECT_THAT(decisions.told, ElementsAre("swap of 0", "rollback of 0", "rollback of 1"));
}

TEST_F(TakeOver, RerunsEndWhereNoOtherProcessCanBeHad) {
  WorldBuilder builder = busy_world(Hosting::kSharedMemory);
  for (const Slot slot : kSlots) builder.description().slot(slot).standbys = 0;
  bool others_start = true;
  Script script;
  script.starts = [&](const Script::Host&) { return others_start; };
  Environment world(builder.description(), starter(&script));
  const std::size_t begun = starts();
  others_start = false;
  world.set_rerun_every(Slot::kSolver, 1);
  run_to_end(&world);
  EXPECT_LE(starts(), begun + 2);
  EXPECT_THAT(
      warnings_but_of_slow_calls(&world),
      ElementsAre(
          "worker of slot solver: no other process for a re-run, and none is looked for any more: it does not start"));
}

}  // namespace
}  // namespace gravitas
