// Inner steps: what every simulator promises of its committed states, and where events are located.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <string>
#include <vector>

#include "kernel/environment.h"
#include "services/events/event_source.h"
#include "tests/kernel/world_builder.h"
#include "tests/sanitized.h"

namespace gravitas {
namespace {

using harness::busy_world;
using harness::plugin_path;
using harness::WorldBuilder;
using kernel::Environment;
using kernel::Hosting;
using kernel::Simulator;
using kernel::StepOutcome;

constexpr double kGravity = 9.81;

class Listener final : public EventListener {
 public:
  void on_event(const Event& event) override { events.push_back(event); }
  std::vector<Event> events;
};

struct Way {
  Simulator simulator;
  double accuracy;
};

// Exact in free flight, and a solver that closes contacts to rounding.
WorldBuilder accurate(Simulator simulator, std::uint32_t steps, double time_step, double accuracy = 0.0) {
  WorldBuilder builder;
  builder.description().accuracy = accuracy;
  builder.steps(steps, time_step).integrator("integrator_verlet");
  builder.plugin(Slot::kSolver, plugin_path("solver_newton"), {1e-12, 100});
  builder.description().simulator = simulator;
  return builder;
}

WorldBuilder bouncing(Simulator simulator, double restitution, std::uint32_t steps, double time_step,
                      double accuracy = 0.0) {
  WorldBuilder builder = accurate(simulator, steps, time_step, accuracy);
  builder.material({restitution, 0.0, 0.0, 0.0}).ground().sphere(0.1, 1.0, Vector3(0, 1.1, 0));
  builder.gravity(Vector3(0, -kGravity, 0));
  return builder;
}

void run(Environment* world) {
  while (world->step_count() < world->total_steps())
    ASSERT_EQ(world->step(), StepOutcome::kCommitted) << world->fault()->fault.text();
}

Hash chain_of(const WorldBuilder& builder) {
  Environment world(builder.description());
  run(&world);
  return world.chain_hash();
}

TEST(Simulators, SubsteppingIsBasicWithAsManySubsteps) {
  for (const std::uint32_t substeps : {1U, 2U, 7U}) {
    WorldBuilder builder = busy_world(Hosting::kDirect).steps(90, 0.02);
    builder.description().substeps = substeps;
    const Hash basic = chain_of(builder);
    builder.description().simulator = Simulator::kSubstepping;
    EXPECT_EQ(chain_of(builder), basic) << substeps;
  }
}

TEST(Simulators, SubstepsAreStepsThatAreNotCommitted) {
  WorldBuilder coarse = busy_world(Hosting::kDirect).steps(30, 0.02),
               fine = busy_world(Hosting::kDirect).steps(60, 0.01);
  coarse.description().substeps = 2;
  coarse.description().material_pairs[kSurfacePerturbation] = 0.0;
  fine.description().material_pairs[kSurfacePerturbation] = 0.0;
  Environment a(coarse.description()), b(fine.description());
  run(&a), run(&b);
  for (std::size_t i = 0; i < a.state().position.size(); ++i)
    EXPECT_NEAR(a.state().position[i], b.state().position[i], 1e-12) << i;  // times n dt are rounded otherwise
}

TEST(Simulators, SubsteppingAsksTheSpaceOnceAStepWhereNothingRunsOutOfItsBounds) {
  WorldBuilder builder = bouncing(Simulator::kSubstepping, 0.0, 20, 0.01);
  builder.description().substeps = 5;
  Environment world(builder.description());
  run(&world);
  EXPECT_EQ(world.stage_time(kernel::Stage::kBroadPhase).count(), 20U);
  EXPECT_EQ(world.stage_time(kernel::Stage::kNarrowPhase).count(), 100U);
}

// A ram, which goes 83 mm a step, meets a cube at rest 50 mm before another one: what is pushed does not end in that.
TEST(Simulators, WhatARamPushesMeetsWhatStandsBehind) {
  const Vector3 half(0.5, 0.5, 0.5);
  for (const Simulator simulator : {Simulator::kBasic, Simulator::kSubstepping}) {
    WorldBuilder builder = accurate(simulator, 10, 1.0 / 60.0);
    builder.box(half, 1.0, Vector3(-1.0001, 0, 0), Vector3(5, 0, 0)).body().flags = kKinematic | kHasShape;
    builder.box(half, 1.0, Vector3::Zero()).box(half, 1.0, Vector3(1.05, 0, 0));
    Environment world(builder.description());
    for (int i = 0; i < 10; ++i) {
      ASSERT_EQ(world.step(), StepOutcome::kCommitted);
      const auto x = [&](std::size_t body) { return world.state().position[3 * body]; };
      EXPECT_GT(x(1) - x(0), 1.0 - 1e-9) << i;
      EXPECT_GT(x(2) - x(1), 1.0 - 1e-9) << i;
    }
  }
}

TEST(Simulators, AKilledWorkerChangesNoBitOfInnerSteps) {
  for (const auto [simulator, accuracy] : {Way{Simulator::kSubstepping, 0.0}, Way{Simulator::kBisection, 0.0},
                                           Way{Simulator::kContinuous, 0.0}, Way{Simulator::kContinuous, 1e-9}}) {
    WorldBuilder builder = bouncing(simulator, 0.9, 60, 0.02, accuracy);
    builder.description().substeps = 2;
    const Hash quiet = chain_of(builder);
    for (const Slot slot : {Slot::kSpace, Slot::kCollision, Slot::kSolver, Slot::kIntegrator})
      builder.hosting(slot, Hosting::kSharedMemory);
    Environment world(builder.description());
    std::uint32_t step = 20;
    for (const Slot slot : {Slot::kIntegrator, Slot::kCollision, Slot::kSolver}) {
      step += 3;
      world.inject({slot, "kill", step, 1});
    }
    run(&world);
    EXPECT_EQ(world.chain_hash(), quiet);
    EXPECT_EQ(world.faults().size(), 3U);
  }
}

// Inner steps end at 0.055 s, at the end of a step, and twice in the step of 0.26 s.
TEST(Simulators, StepsCutByJumpsAreTheSameAfterARestoreAndAKill) {
  for (const auto [simulator, accuracy] :
       {Way{Simulator::kBasic, 0.0}, Way{Simulator::kSubstepping, 0.0}, Way{Simulator::kBisection, 0.0},
        Way{Simulator::kContinuous, 0.0}, Way{Simulator::kContinuous, 1e-9}}) {
    SCOPED_TRACE(testing::Message() << static_cast<int>(simulator) << ' ' << accuracy);
    WorldBuilder builder = simulator >= Simulator::kBisection ? bouncing(simulator, 0.9, 40, 0.01)
                                                              : busy_world(Hosting::kDirect).steps(40, 0.01);
    builder.force("Drag", "force_drag", {0.1, 0.0});
    builder.description().simulator = simulator;
    builder.description().accuracy = accuracy;
    builder.description().substeps = 2;
    const Hash uncut = chain_of(builder);
    builder.description().switches = {0.055, 0.1, 0.252, 0.2571};
    const Hash whole = chain_of(builder);
    EXPECT_NE(whole, uncut);
    for (const std::uint32_t stop : {4U, 5U, 6U, 9U, 10U, 11U, 25U, 26U}) {
      if (harness::kSanitized && stop % 5 != 0) continue;
      Environment first(builder.description()), second(builder.description());
      while (first.step_count() < stop) ASSERT_EQ(first.step(), StepOutcome::kCommitted);
      ASSERT_EQ(second.restore(first.saved_state()), "");
      run(&second);
      EXPECT_EQ(second.chain_hash(), whole) << stop;
    }
    for (const Slot slot : {Slot::kForce, Slot::kSolver, Slot::kIntegrator})
      builder.hosting(slot, Hosting::kSharedMemory);
    Environment world(builder.description());
    world.inject({Slot::kIntegrator, "kill", 6, 1});
    world.inject({Slot::kForce, "kill", 10, 1});
    world.inject({Slot::kSolver, "kill", 26, 1});
    run(&world);
    EXPECT_EQ(world.chain_hash(), whole);
    EXPECT_EQ(world.faults().size(), 3U);
  }
}

TEST(Simulators, TimesOfJumpsMustRise) {
  WorldBuilder builder = busy_world(Hosting::kDirect);
  builder.description().switches = {0.1, 0.1};
  EXPECT_EQ(builder.description().validate(), "times of switches must rise");
}

// Serves so many calls, and fails at all others.
class Weary final : public kernel::Carrier {
 public:
  Weary(std::unique_ptr<Carrier> plugins, int* calls_left) : plugins_(std::move(plugins)), calls_left_(calls_left) {}
  kernel::CallResult call(const kernel::StageCall& call, kernel::Arena* arena,
                          kernel::DerivativeSource* derivatives) override {
    if (--*calls_left_ < 0) throw kernel::StageFault(kernel::FaultKind::kFailure, "test", "it is weary");
    return plugins_->call(call, arena, derivatives);
  }
  int process_id() const override { return 0; }
  Hosting hosting() const override { return Hosting::kDirect; }

 private:
  std::unique_ptr<Carrier> plugins_;
  int* calls_left_;
};

TEST(Simulators, AStepThatFailsHalfwayLeavesTheLastCommit) {
  WorldBuilder builder = bouncing(Simulator::kSubstepping, 0.0, 20, 0.01);
  builder.description().substeps = 4;
  Environment quiet(builder.description());
  for (int i = 0; i < 7; ++i) ASSERT_EQ(quiet.step(), StepOutcome::kCommitted);
  int calls_left = 4 * 7 + 2;
  Environment world(builder.description(),
                    [&](const kernel::SlotDescription& slot, std::uint32_t threads,
                        std::stop_token) -> std::unique_ptr<kernel::Carrier> {
                      auto plugins = kernel::make_direct_carrier(slot.plugins, threads);
                      if (slot.plugins[0].declaration.slot != Slot::kCollision) return plugins;
                      return std::make_unique<Weary>(std::move(plugins), &calls_left);
                    });
  while (world.step() == StepOutcome::kCommitted && world.step_count() < 20) {
  }
  ASSERT_TRUE(world.fault());
  EXPECT_EQ(world.step_count(), 7U);
  const auto bits = [](const Environment& of) {
    const kernel::StateView state = of.state();
    std::vector<double> all(state.position.begin(), state.position.end());
    all.insert(all.end(), state.linear_velocity.begin(), state.linear_velocity.end());
    return all;
  };
  EXPECT_EQ(bits(world), bits(quiet));
  EXPECT_EQ(world.chain_hash(), quiet.chain_hash());
}

// Lets the integrator fail for good after every number of calls of its first step, until it makes the step: each time it has to be
// that of the fallback alone. Returns how often it failed.
int expect_whole_step(WorldBuilder builder, const std::string& fallback) {
  WorldBuilder other = builder;
  other.integrator(fallback);
  const Hash alone = chain_of(other);
  EXPECT_NE(alone, chain_of(builder));
  kernel::PluginChoice& integrator = builder.description().integrator.plugins[0];
  integrator.fallback = std::make_shared<kernel::PluginChoice>(other.description().integrator.plugins[0]);
  const std::string name = integrator.declaration.name;
  int failures = 0;
  for (int calls = 0; calls < 12; ++calls) {
    int calls_left = calls;
    Environment world(builder.description(),
                      [&](const kernel::SlotDescription& slot, std::uint32_t threads,
                          std::stop_token) -> std::unique_ptr<kernel::Carrier> {
                        auto plugins = kernel::make_direct_carrier(slot.plugins, threads);
                        if (slot.plugins[0].declaration.name != name) return plugins;
                        return std::make_unique<Weary>(std::move(plugins), &calls_left);
                      });
    run(&world);
    if (calls_left >= 0) continue;
    ++failures;
    EXPECT_EQ(world.chain_hash(), alone) << calls;
  }
  return failures;
}

// Whatever call of a step it is that nobody answers: who takes over makes the whole step.
TEST(Simulators, AFallbackMakesTheWholeStep) {
  for (const auto [simulator, accuracy] : {Way{Simulator::kSubstepping, 0.0}, Way{Simulator::kBisection, 0.0},
                                           Way{Simulator::kContinuous, 0.0}, Way{Simulator::kContinuous, 0.5}}) {
    SCOPED_TRACE(testing::Message() << static_cast<int>(simulator) << ' ' << accuracy);
    WorldBuilder builder = accurate(simulator, 1, 0.6, accuracy);
    builder.material({0.9, 0.0, 0.0, 0.0}).ground().box({0.1, 0.2, 0.3}, 1.0, Vector3(0, 1.3, 0));
    builder.gravity(Vector3(0, -kGravity, 0)).body().twist.angular = Vector3(1, 2, 3);
    builder.description().substeps = 2;
    EXPECT_GE(expect_whole_step(std::move(builder), "integrator_rk4"), 2);
  }
}

// The torque would turn what is jointed by 2 rad within the step of SemiImplicitEuler, which makes it finer; Euler, which turns
// by the velocity before, does not.
TEST(Simulators, AFallbackInheritsNoFinerStep) {
  WorldBuilder builder = accurate(Simulator::kBasic, 1, 0.1);
  builder.integrator("integrator_semi_implicit_euler").point(1.0, Vector3::Constant(1e-3), Vector3::Zero());
  builder.force("Basic", "force_basic", {0, 0, 0, 0, 0, 0, 0, 0, 0.2, 0, 0, 0});
  builder.joint("Spherical", "constraint_spherical", kNone, 0, {0, 0, 0});
  EXPECT_GE(expect_whole_step(std::move(builder), "integrator_euler"), 2);
}

// Its first plugin knows no Jacobians, and all answer a multiple of their first column.
class Plain final : public kernel::Carrier {
 public:
  explicit Plain(std::unique_ptr<Carrier> plugins, double factor = 1.0)
      : plugins_(std::move(plugins)), factor_(factor) {}
  kernel::CallResult call(const kernel::StageCall& call, kernel::Arena* arena,
                          kernel::DerivativeSource* derivatives) override {
    const bool is_about_jacobians =
        call.method == stage::Method::kForceJacobians || call.method == stage::Method::kSolverReactionJacobians;
    if (is_about_jacobians && call.target == 0) return {.status = GRAVITAS_UNKNOWN_METHOD, .text = "no"};
    const kernel::CallResult result = plugins_->call(call, arena, derivatives);
    auto* first = reinterpret_cast<double*>(arena->data(call.reply[0]));
    for (std::uint64_t i = 0; i < arena->count(call.reply[0]); ++i) first[i] *= factor_;
    return result;
  }
  int process_id() const override { return 0; }
  Hosting hosting() const override { return Hosting::kDirect; }

 private:
  std::unique_ptr<Carrier> plugins_;
  double factor_;
};

// One of the derivatives of a step is another's first: it makes them all. The other has no Jacobians, which implicit methods
// ask for.
TEST(Simulators, AForceThatTakesOverMakesTheWholeStep) {
  const std::pair<const char*, std::vector<double>> integrators[] = {
      {"integrator_rk4", {}}, {"integrator_rosenbrock", {1e-3}}, {"integrator_radau", {1e-3}}};
  for (const auto& [integrator, settings] : integrators) {
    WorldBuilder builder = WorldBuilder().steps(1, 0.1);
    builder.plugin(Slot::kIntegrator, plugin_path(integrator), settings);
    builder.sphere(0.1, 1.0, Vector3::Zero(), Vector3(3, 2, 1)).force("Drag", "force_drag", {0.1, 0.5});
    kernel::PluginChoice other = builder.description().force.plugins[0];
    other.declaration.name = "Other";
    std::erase(other.declaration.capabilities, "jacobians");
    builder.description().force.plugins[0].fallback = std::make_shared<kernel::PluginChoice>(other);
    const auto speed_after = [&](int calls_left) {
      Environment world(builder.description(),
                        [&](const kernel::SlotDescription& slot, std::uint32_t threads,
                            std::stop_token) -> std::unique_ptr<kernel::Carrier> {
                          auto plugins = kernel::make_direct_carrier(slot.plugins, threads);
                          if (slot.plugins[0].declaration.slot != Slot::kForce) return plugins;
                          if (slot.plugins[0].declaration.name == "Other")
                            return std::make_unique<Plain>(std::move(plugins), 2.0);
                          return std::make_unique<Weary>(std::move(plugins), &calls_left);
                        });
      run(&world);
      return world.state().linear_velocity[0];
    };
    const double quiet = speed_after(100), other_alone = speed_after(0);
    EXPECT_LT(other_alone, quiet);
    int calls = 1;
    for (; calls < 100 && speed_after(calls) != quiet; ++calls)
      EXPECT_EQ(speed_after(calls), other_alone) << integrator << " after " << calls;
    EXPECT_GE(calls, 5) << integrator;
    EXPECT_LT(calls, 100) << integrator;
  }
}

// A solver that takes over knows no Jacobians of reactions: the step is that of one who never did.
TEST(Simulators, ASolverThatTakesOverMakesTheWholeStep) {
  for (const char* integrator : {"integrator_rosenbrock", "integrator_radau"}) {
    WorldBuilder builder = WorldBuilder().steps(1, 0.1);
    builder.description().simulator = Simulator::kSmooth;
    builder.plugin(Slot::kIntegrator, plugin_path(integrator), {1e-6});
    builder.plugin(Slot::kSolver, plugin_path("solver_newton"), {1e-12, 100.0});
    builder.sphere(0.1, 1.0, Vector3(1, 0, 0), Vector3(0, 3, 0)).force("Drag", "force_drag", {0.1, 0.5});
    builder.joint("ConstantVelocity", "constraint_constant_velocity", kNone, 0, {0, 0, 0, 1, 0, 0, 1, 0, 0});
    kernel::PluginChoice other = builder.description().solver.plugins[0];
    std::erase(other.declaration.capabilities, "reaction_jacobians");
    other.settings[0] = 1e-11;
    builder.description().solver.plugins[0].fallback = std::make_shared<kernel::PluginChoice>(other);
    const auto chain_after = [&](int calls_left) {
      Environment world(builder.description(),
                        [&](const kernel::SlotDescription& slot, std::uint32_t threads,
                            std::stop_token) -> std::unique_ptr<kernel::Carrier> {
                          auto plugins = kernel::make_direct_carrier(slot.plugins, threads);
                          if (slot.plugins[0].declaration.slot != Slot::kSolver) return plugins;
                          if (!has_capability(slot.plugins[0].declaration, "reaction_jacobians"))
                            return std::make_unique<Plain>(std::move(plugins));
                          return std::make_unique<Weary>(std::move(plugins), &calls_left);
                        });
      run(&world);
      return world.chain_hash();
    };
    const auto quiet = chain_after(10000), other_alone = chain_after(0);
    EXPECT_NE(other_alone, quiet) << integrator;
    int calls = 1;
    for (auto chain = chain_after(calls); calls < 10000 && chain != quiet; chain = chain_after(++calls))
      EXPECT_EQ(chain, other_alone) << integrator << " after " << calls;
    EXPECT_GE(calls, 3) << integrator;
    EXPECT_LT(calls, 10000) << integrator;
  }
}

// Whatever it is called: with the blocks of the other forces alone an implicit method would go by half a Jacobian.
TEST(Simulators, ASwapToAForceWithoutJacobiansIsNoticed) {
  WorldBuilder builder = WorldBuilder().steps(6, 0.1);
  builder.plugin(Slot::kIntegrator, plugin_path("integrator_rosenbrock"), {1e-3});
  builder.sphere(0.1, 1.0, Vector3(1, 0, 0), Vector3(3, 2, 1)).force("Drag", "force_drag", {0.1, 0.5});
  builder.force("Spring", "force_spring", {50, 1, 0.5, 0, 0, 0, std::nan(""), 0, 0, 0});
  const auto chain_with = [&](const std::string& name) {
    Environment world(builder.description(),
                      [&](const kernel::SlotDescription& slot, std::uint32_t threads,
                          std::stop_token) -> std::unique_ptr<kernel::Carrier> {
                        auto plugins = kernel::make_direct_carrier(slot.plugins, threads);
                        const PluginDeclaration& first = slot.plugins[0].declaration;
                        if (first.slot != Slot::kForce || has_capability(first, "jacobians")) return plugins;
                        return std::make_unique<Plain>(std::move(plugins));
                      });
    kernel::PluginChoice other = builder.description().force.plugins[0];
    other.declaration.name = name;
    std::erase(other.declaration.capabilities, "jacobians");
    world.order_swap({Slot::kForce, other, std::nullopt, 2});
    run(&world);
    return world.chain_hash();
  };
  EXPECT_EQ(chain_with(builder.description().force.plugins[0].declaration.name), chain_with("Other"));
}

// The impulses of the inner steps that listeners hear of are what changes the momentum; their lengths are the step.
TEST(Simulators, ExtrapolatedPartsAreInnerStepsForListeners) {
  class Sum final : public kernel::CommitListener {
   public:
    void on_inner_step(const Environment&, const kernel::InnerStep& inner) override {
      numbers.push_back(inner.number);
      length += inner.data.time_step[0];
      for (std::size_t i = 0; i < inner.data.contact_key.size(); ++i)
        impulse += vector_at(inner.data.contact_impulse.span(), i);
    }
    void on_commit(const Environment&) override {}
    std::vector<std::uint32_t> numbers;
    double length = 0.0;
    Vector3 impulse = Vector3::Zero();
  };
  WorldBuilder builder = accurate(Simulator::kContinuous, 10, 0.01, 1e-9);
  builder.material({0.0, 0.3, 0.3, 0.0}).ground().sphere(0.1, 2.0, Vector3(0, 0.1, 0), Vector3(1.0, 0, 0));
  builder.gravity(Vector3(0, -kGravity, 0));
  Environment world(builder.description());
  Sum sum;
  world.set_commit_listener(&sum);
  run(&world);
  EXPECT_NEAR(sum.length, 0.1, 1e-15);
  EXPECT_EQ(sum.numbers[0], 0U);
  EXPECT_NEAR(sum.impulse.y(), 2.0 * kGravity * 0.1, 1e-12);
  EXPECT_NEAR(sum.impulse.x(), 2.0 * (world.state().linear_velocity[3] - 1.0), 1e-12);
  EXPECT_NEAR(world.state().linear_velocity[3], 5.0 / 7.0, 1e-12);  // it has come to roll

  // an impact on a surface that is not even: all attempts and what stands draw one normal
  WorldBuilder uneven = accurate(Simulator::kContinuous, 60, 0.01, 1e-9);
  uneven.material({.restitution = 0.5, .perturbation = 0.1})
      .ground()
      .sphere(0.1, 2.0, Vector3(0, 3.1, 0), Vector3(0, -20, 0));
  uneven.gravity(Vector3(0, -kGravity, 0));
  Environment dropped(uneven.description());
  Sum met;
  dropped.set_commit_listener(&met);
  run(&dropped);
  const Vector3 gained =
      2.0 * vector_at(dropped.state().linear_velocity, 1) + Vector3(0, 2.0 * kGravity * 0.6 + 40.0, 0);
  EXPECT_GT(std::fabs(met.impulse.x()), 1e-3);
  EXPECT_NEAR((met.impulse - gained).norm(), 0.0, 1e-6);
}

// An instantaneous impulse acts once, however often the first part is made; others fall, slide and are held beside it.
TEST(Simulators, ExtrapolationAgreesWithManySmallSteps) {
  const auto end = [](const WorldBuilder& builder) {
    Environment world(builder.description());
    run(&world);
    const auto view = world.state().position;
    return std::vector<double>(view.begin(), view.end());
  };
  WorldBuilder coarse = busy_world(Hosting::kDirect).steps(4, 0.01),
               fine = busy_world(Hosting::kDirect).steps(4000, 1e-5);
  for (WorldBuilder* builder : {&coarse, &fine})
    builder->integrator("integrator_verlet").plugin(Slot::kSolver, plugin_path("solver_newton"), {1e-13, 100});
  const std::vector<double> reference = end(fine), plain = end(coarse);
  coarse.description().simulator = Simulator::kContinuous;
  coarse.description().accuracy = 1e-9;
  const std::vector<double> accurate = end(coarse);
  double plain_error = 0.0, accurate_error = 0.0;
  for (std::size_t i = 0; i < reference.size(); ++i) {
    plain_error = std::max(plain_error, std::fabs(plain[i] - reference[i]));
    accurate_error = std::max(accurate_error, std::fabs(accurate[i] - reference[i]));
  }
  EXPECT_LT(accurate_error, 1e-6);  // of the reference
  EXPECT_GT(plain_error, 20.0 * accurate_error);
}

// The end of a slide lies in the first inner step, in the last, or between, of whatever part holds it.
TEST(Simulators, ASlideThatEndsInAPartEndsWhereItDoes) {
  const double speed = 5.0, friction = 0.3, way = speed * speed / (2.0 * friction * kGravity);
  for (const double time_step : {0.125, 0.1, 0.0625, 0.05, 0.02}) {
    const auto steps = static_cast<std::uint32_t>(std::lround(2.0 / time_step));
    WorldBuilder builder = accurate(Simulator::kContinuous, steps, time_step, 1e-9);
    builder.material({0.0, friction, friction, 0.0}).ground();
    builder.box({0.5, 0.5, 0.5}, 1.0, {0, 0.5, 0}, {0.8 * speed, 0, 0.6 * speed});
    builder.gravity(Vector3(0, -kGravity, 0));
    Environment world(builder.description());
    run(&world);
    EXPECT_NEAR(world.state().position[3], 0.8 * way, 1e-9) << time_step;
    EXPECT_NEAR(world.state().position[5], 0.6 * way, 1e-9) << time_step;
  }
}

TEST(Simulators, OnlyContinuousHasAnAccuracyOfItsOwn) {
  WorldBuilder builder = bouncing(Simulator::kBisection, 1.0, 1, 0.01, 1e-6);
  EXPECT_EQ(builder.description().validate(), "the accuracy must be positive, and is of Continuous alone");
  builder.description().accuracy = -1.0;
  EXPECT_EQ(builder.description().validate(), "the accuracy must be positive, and is of Continuous alone");
}

class Located : public ::testing::TestWithParam<Way> {};

// Impacts of a ball that falls 1 m and keeps its energy: at t0, 3 t0, 5 t0, …
TEST_P(Located, ImpactsOfABallAreWhereTheyAre) {
  const auto [simulator, accuracy] = GetParam();
  Environment world(bouncing(simulator, 1.0, 150, 1.0 / 60.0, accuracy).description());
  Listener listener;
  EventSource listener_source(&listener);
  world.set_commit_listener(&listener_source);
  run(&world);
  const double first = std::sqrt(2.0 / kGravity);
  std::vector<double> starts;
  for (const Event& event : listener.events) {
    if (event.kind != EventKind::kCollisionStart) continue;
    starts.push_back(event.time);
    EXPECT_NEAR(event.impulse, 2.0 * kGravity * first, 1e-9);
  }
  ASSERT_EQ(starts.size(), 3U);
  for (std::size_t i = 0; i < starts.size(); ++i)
    EXPECT_NEAR(starts[i], (2.0 * static_cast<double>(i) + 1.0) * first, 1e-9) << i;
  // height and speed of the flight after the last impact
  const double fall = std::remainder(world.time(), 2.0 * first);
  EXPECT_NEAR(world.state().position[4], 1.1 - 0.5 * kGravity * fall * fall, 1e-9);
  EXPECT_NEAR(world.state().linear_velocity[4], -kGravity * fall, 1e-9);
}

// Bounces that halve in time add up to a finite time, after which the ball rests.
TEST_P(Located, AZenoSequenceEndsAtRest) {
  const double restitution = 0.5, first = std::sqrt(2.0 / kGravity);
  const double rests = first * (1.0 + restitution) / (1.0 - restitution);
  const auto [simulator, accuracy] = GetParam();
  Environment world(bouncing(simulator, restitution, 200, 0.01, accuracy).description());
  while (world.step_count() < 200) {
    ASSERT_EQ(world.step(), StepOutcome::kCommitted);
    const bool is_at_rest = world.state().linear_velocity[4] == 0.0;
    if (std::fabs(world.time() - rests) > 0.011) {
      EXPECT_EQ(is_at_rest, world.time() > rests) << world.time();
    }
  }
  EXPECT_NEAR(world.state().position[4], 0.1, 1e-12);
}

// Equal balls in a row hand on their velocity one after the other.
TEST_P(Located, ACradleHandsOnWhatItGets) {
  WorldBuilder builder = accurate(GetParam().simulator, 10, 0.01, GetParam().accuracy);
  builder.material({1.0, 0.0, 0.0, 0.0});
  for (int i = 0; i < 5; ++i)
    builder.sphere(0.1, 1.0, Vector3(i == 0 ? -0.05 : 0.2 * i + 1e-6 * i, 0, 0), Vector3(i == 0 ? 1.0 : 0.0, 0, 0));
  Environment world(builder.description());
  run(&world);
  for (std::size_t i = 0; i < 5; ++i) EXPECT_NEAR(world.state().linear_velocity[3 * i], i == 4 ? 1.0 : 0.0, 1e-10) << i;
}

std::string name_of_way(const ::testing::TestParamInfo<Way>& info) {
  if (info.param.accuracy > 0.0) return "ContinuousWithAccuracy";
  return info.param.simulator == Simulator::kBisection ? "Bisection" : "Continuous";
}

INSTANTIATE_TEST_SUITE_P(By, Located,
                         ::testing::Values(Way{Simulator::kBisection, 0.0}, Way{Simulator::kContinuous, 0.0},
                                           Way{Simulator::kContinuous, 1e-9}),
                         name_of_way);

// 10 m a step, through a plate of 3 cm.
TEST(Continuous, NothingPassesThroughAPlate) {
  WorldBuilder builder = accurate(Simulator::kContinuous, 5, 0.01);
  builder.material({0.0, 0.0, 0.0, 0.0}).box(Vector3(1.0, 1.0, 0.015), 1.0, Vector3::Zero());
  builder.body().flags &= ~static_cast<std::uint32_t>(kMovable);
  builder.body().mass = 0.0;
  builder.body().inertia.setZero();
  builder.box(Vector3(0.1, 0.1, 0.1), 1.0, Vector3(0.02, 0.01, -12.345), Vector3(0, 0, 1000.0));
  Environment world(builder.description());
  Listener listener;
  EventSource listener_source(&listener);
  world.set_commit_listener(&listener_source);
  for (int i = 0; i < 5; ++i) {
    ASSERT_EQ(world.step(), StepOutcome::kCommitted);
    EXPECT_LE(world.state().position[5], -0.115 + 1e-9);
  }
  ASSERT_FALSE(listener.events.empty());
  EXPECT_NEAR(listener.events[0].time, (12.345 - 0.115) / 1000.0, 1e-9);
  EXPECT_NEAR(world.state().linear_velocity[5], 0.0, 1e-9);
}

TEST(Continuous, TwoBodiesMeetHeadOn) {
  WorldBuilder builder = accurate(Simulator::kContinuous, 3, 0.01);
  builder.material({1.0, 0.0, 0.0, 0.0});
  builder.sphere(0.05, 1.0, Vector3(-4.0, 0, 0), Vector3(500, 0, 0));
  builder.sphere(0.05, 1.0, Vector3(3.0, 0, 0), Vector3(-500, 0, 0));
  Environment world(builder.description());
  run(&world);
  EXPECT_NEAR(world.state().linear_velocity[0], -500.0, 1e-9);
  EXPECT_NEAR(world.state().linear_velocity[3], 500.0, 1e-9);
  // 6.9 m at 1000 m/s, then back
  EXPECT_NEAR(world.state().position[0], -4.0 + 500.0 * (2.0 * 0.0069 - 0.03), 1e-7);
}

// A grid of rails meets another one, every rail of it every rail of that, beside two balls that touch all the time: more pairs
// begin to touch than there was ever room for.
TEST(Simulators, MorePairsThanBeforeTouchAtOnce) {
  constexpr std::uint32_t kRails = 18;
  WorldBuilder builder;
  builder.steps(3, 0.01);
  for (std::uint32_t i = 0; i < kRails; ++i) builder.box({20.0, 0.1, 0.1}, 1.0, Vector3(0, 0, i - 8.5));
  for (std::uint32_t i = 0; i < kRails; ++i)
    builder.box({0.1, 0.1, 20.0}, 1.0, Vector3(i - 8.5, 0.215, 0), Vector3(0, -1, 0));
  // the last pair of all
  builder.sphere(1.0, 1.0, Vector3(99, 0, 0)).sphere(1.0, 1.0, Vector3(101, 0, 0));
  Environment world(builder.description());
  run(&world);
  // 200 sweeps leave that
  for (std::uint32_t i = 0; i < 2 * kRails; ++i)
    EXPECT_NEAR(world.state().linear_velocity[3 * i + 1], -0.5, 1e-6) << "rail " << i;
}

}  // namespace
}  // namespace gravitas
