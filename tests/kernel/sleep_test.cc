// Sleep and wake in worlds made by hand: what is kept, what it costs, and that no fault or stop changes a bit of it.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <string>
#include <utility>
#include <vector>

#include "kernel/environment.h"
#include "services/events/event_source.h"
#include "tests/kernel/world_builder.h"

namespace gravitas {
namespace {

using harness::plugin_path;
using harness::WorldBuilder;
using kernel::Environment;
using kernel::Hosting;
using kernel::Simulator;
using kernel::Stage;
using kernel::StepOutcome;
using ::testing::ElementsAre;
using ::testing::IsEmpty;

const Vector3 kWeight(0, -9.81, 0);
constexpr double kTimeStep = 0.01;
constexpr std::uint32_t kAsleepBy = 60;  // the default is half a second

class SleepListener final : public EventListener {
 public:
  void on_event(const Event& event) override { events.push_back(event); }
  std::vector<std::uint32_t> bodies(EventKind kind) const {
    std::vector<std::uint32_t> all;
    for (const Event& event : events)
      if (event.kind == kind) all.push_back(event.a);
    return all;
  }
  std::vector<Event> events;
};

WorldBuilder& may_sleep(WorldBuilder* builder) {
  for (kernel::BodyDescription& body : builder->description().bodies)
    if ((body.flags & kMovable) != 0) body.flags |= kCanSleep;
  return *builder;
}

void run(Environment* world, std::uint32_t steps) {
  for (std::uint32_t i = 0; i < steps; ++i)
    ASSERT_EQ(world->step(), StepOutcome::kCommitted) << world->fault()->fault.text();
}

Vector3 place_of(const Environment& world, std::uint32_t body) { return vector_at(world.state().position, body); }
Vector3 velocity_of(const Environment& world, std::uint32_t body) {
  return vector_at(world.state().linear_velocity, body);
}

// Two boxes upon each other (1, 2), another far away (3), and a ball (4) that comes down on the two after a second.
WorldBuilder boxes_and_ball(Hosting hosting = Hosting::kDirect) {
  WorldBuilder builder(hosting);
  builder.steps(200, kTimeStep).material({.restitution = 0.2}).ground();
  builder.box(Vector3(0.5, 0.25, 0.5), 2.0, Vector3(0, 0.25, 0)).box(Vector3(0.4, 0.2, 0.4), 1.0, Vector3(0, 0.7, 0));
  builder.box(Vector3(0.5, 0.25, 0.5), 2.0, Vector3(50, 0.25, 0));
  builder.sphere(0.2, 1.0, Vector3(0, 6.0, 0));
  return may_sleep(&builder).gravity(kWeight);
}

TEST(Sleep, WhatRestsFallsAsleepAndStaysBitForBit) {
  Environment world(boxes_and_ball().description());
  SleepListener listener;
  EventSource listener_source(&listener);
  world.set_commit_listener(&listener_source);
  run(&world, kAsleepBy);
  EXPECT_THAT(listener.bodies(EventKind::kSleep), ElementsAre(1, 2, 3));
  EXPECT_FALSE(world.is_asleep(0));
  EXPECT_FALSE(world.is_asleep(4));
  const std::vector<double> before(world.state().position.begin(), world.state().position.begin() + 12);
  run(&world, 30);
  EXPECT_EQ(std::vector<double>(world.state().position.begin(), world.state().position.begin() + 12), before);
  for (const std::uint32_t body : {1U, 2U, 3U}) {
    EXPECT_TRUE(world.is_asleep(body));
    EXPECT_EQ(velocity_of(world, body), Vector3::Zero());
  }
  // what touched goes on touching
  for (const Event& event : listener.events) EXPECT_NE(event.kind, EventKind::kCollisionEnd);
}

TEST(Sleep, AContactWakesTheIslandAndNoOther) {
  Environment world(boxes_and_ball().description());
  SleepListener listener;
  EventSource listener_source(&listener);
  world.set_commit_listener(&listener_source);
  run(&world, 200);
  EXPECT_THAT(listener.bodies(EventKind::kWake), ElementsAre(1, 2));
  EXPECT_TRUE(world.is_asleep(3));
  for (const Event& event : listener.events) {
    if (event.kind != EventKind::kWake) continue;
    // the ball falls 4.9 m: within a step of its arrival
    EXPECT_NEAR(event.time, std::sqrt(2.0 * 4.9 / 9.81), kTimeStep);
    EXPECT_EQ(event.time, kTimeStep * event.step);
  }
}

// A ball at rest (1) and one of equal mass that comes and takes (1 + e)/2 of its speed, asleep or not.
void expect_an_impact_upon_a_sleeper(Simulator simulator, const std::string& integrator,
                                     const std::vector<double>& settings = {}) {
  WorldBuilder builder;
  builder.steps(150, kTimeStep).material({0.5, 0.0, 0.0, 0.0}).ground();
  builder.plugin(Slot::kIntegrator, plugin_path(integrator), settings);
  builder.sphere(0.5, 1.0, Vector3(0, 0.5, 0)).sphere(0.5, 1.0, Vector3(-3, 0.5, 0), Vector3(2, 0, 0));
  may_sleep(&builder).gravity(kWeight);
  builder.description().simulator = simulator;
  builder.description().substeps = 2;
  Environment world(builder.description());
  run(&world, kAsleepBy);
  EXPECT_TRUE(world.is_asleep(1));
  EXPECT_FALSE(world.is_asleep(2));
  run(&world, 90);
  EXPECT_FALSE(world.is_asleep(1));
  EXPECT_NEAR(velocity_of(world, 1).x(), 1.5, 1e-9);
  EXPECT_NEAR(velocity_of(world, 2).x(), 0.5, 1e-9);
  EXPECT_NEAR(place_of(world, 1).y(), 0.5, 1e-6);
}

TEST(Sleep, ASleeperTakesAnImpactAsOneThatIsAwake) {
  for (const Simulator simulator :
       {Simulator::kBasic, Simulator::kSubstepping, Simulator::kBisection, Simulator::kContinuous})
    expect_an_impact_upon_a_sleeper(simulator, "integrator_semi_implicit_euler");
}

TEST(Sleep, EveryIntegratorLeavesSleepersAloneAndTakesThemUpAgain) {
  const std::vector<std::pair<std::string, std::vector<double>>> integrators = {{"euler", {}},
                                                                                {"verlet", {}},
                                                                                {"basic_verlet", {}},
                                                                                {"rk4", {}},
                                                                                {"rkmk4", {}},
                                                                                {"implicit_midpoint", {}},
                                                                                {"symplectic_splitting", {4}},
                                                                                {"dormand_prince54", {1e-8, 1}},
                                                                                {"dormand_prince853", {1e-8}},
                                                                                {"rosenbrock", {1e-6}},
                                                                                {"radau", {1e-6}}};
  for (const auto& [integrator, settings] : integrators) {
    SCOPED_TRACE(integrator);
    expect_an_impact_upon_a_sleeper(Simulator::kBasic, "integrator_" + integrator, settings);
  }
}

// Each ball is an island of its own, woken by the one before.
TEST(Sleep, AChainWakesOneAfterTheOther) {
  WorldBuilder builder;
  builder.steps(400, kTimeStep).material({1.0, 0.0, 0.0, 0.0}).ground();
  for (int i = 0; i < 5; ++i) builder.sphere(0.5, 1.0, Vector3(1.5 * i, 0.5, 0));
  builder.sphere(0.5, 1.0, Vector3(-4, 0.5, 0), Vector3(3, 0, 0));
  may_sleep(&builder).gravity(kWeight);
  Environment world(builder.description());
  SleepListener listener;
  EventSource listener_source(&listener);
  world.set_commit_listener(&listener_source);
  run(&world, 400);
  EXPECT_THAT(listener.bodies(EventKind::kWake), ElementsAre(1, 2, 3, 4, 5));
  EXPECT_NEAR(velocity_of(world, 5).x(), 3.0, 1e-9);
  for (std::uint32_t i = 1; i <= 4; ++i) EXPECT_TRUE(world.is_asleep(i)) << i;
}

TEST(Sleep, AJointMakesAnIsland) {
  WorldBuilder builder;
  builder.steps(200, kTimeStep).ground();
  builder.box(Vector3(0.5, 0.25, 0.5), 1.0, Vector3(0, 0.25, 0))
      .box(Vector3(0.5, 0.25, 0.5), 1.0, Vector3(1.2, 0.25, 0));
  builder.sphere(0.2, 1.0, Vector3(1.2, 6.0, 0));
  builder.joint("Spherical", "constraint_spherical", 1, 2, {0.6, 0.25, 0});
  may_sleep(&builder).gravity(kWeight);
  Environment world(builder.description());
  SleepListener listener;
  EventSource listener_source(&listener);
  world.set_commit_listener(&listener_source);
  run(&world, kAsleepBy);
  EXPECT_THAT(listener.bodies(EventKind::kSleep), ElementsAre(1, 2));
  run(&world, 60);
  EXPECT_THAT(listener.bodies(EventKind::kWake), ElementsAre(1, 2));
  EXPECT_TRUE(world.is_intact(0));
}

TEST(Sleep, AHangingBodyFallsAsleepAndOneThatMayNotKeepsItsIslandAwake) {
  for (const bool may : {true, false}) {
    WorldBuilder builder;
    builder.steps(100, kTimeStep)
        .point(1.0, Vector3::Ones(), Vector3(0, -1, 0))
        .point(1.0, Vector3::Ones(), Vector3(0, -2, 0));
    builder.joint("Spherical", "constraint_spherical", 0, kNone, {0, 0, 0});
    builder.joint("Spherical", "constraint_spherical", 1, 0, {0, -1, 0});
    may_sleep(&builder).gravity(kWeight);
    if (!may) builder.body().flags &= ~std::uint32_t{kCanSleep};
    Environment world(builder.description());
    run(&world, 100);
    EXPECT_EQ(world.is_asleep(0), may);
    EXPECT_EQ(world.is_asleep(1), may);
    EXPECT_LT((place_of(world, 1) - Vector3(0, -2, 0)).norm(), 1e-9);
  }
}

TEST(Sleep, WhereAllSleepNothingIsAskedAndTimeGoesOn) {
  WorldBuilder builder;
  builder.steps(300, kTimeStep).ground().box(Vector3(0.5, 0.25, 0.5), 2.0, Vector3(0, 0.25, 0));
  may_sleep(&builder).gravity(kWeight);
  Environment world(builder.description());
  run(&world, kAsleepBy);
  ASSERT_TRUE(world.is_asleep(1));
  const auto calls = [&] {
    std::uint64_t sum = 0;
    for (const Stage stage : {Stage::kIntegrate, Stage::kBroadPhase, Stage::kNarrowPhase, Stage::kSolve})
      sum += world.stage_time(stage).count();
    return sum;
  };
  const std::uint64_t before = calls();
  const Hash state = world.state_hash(), chain = world.chain_hash();
  run(&world, 240);
  EXPECT_EQ(calls(), before);
  EXPECT_EQ(world.time(), 3.0);
  EXPECT_EQ(world.state_hash(), state);
  EXPECT_NE(world.chain_hash(), chain);
}

TEST(Sleep, AUserWakes) {
  Environment world(boxes_and_ball().description());
  SleepListener listener;
  EventSource listener_source(&listener);
  world.set_commit_listener(&listener_source);
  run(&world, kAsleepBy);
  world.wake(2);
  world.wake(4);  // is awake
  world.wake(0);  // cannot be woken
  EXPECT_TRUE(world.is_asleep(2));
  run(&world, 1);
  EXPECT_THAT(listener.bodies(EventKind::kWake), ElementsAre(1, 2));
  EXPECT_FALSE(world.is_asleep(2));
  EXPECT_TRUE(world.is_asleep(3));
}

// Steps in which all sleep look at nobody; what comes up then is seen all the same, and gives the bits of a run that was
// restored there.
TEST(Sleep, WhoHasSleptForLongWakesAsWell) {
  WorldBuilder builder;
  builder.steps(300, kTimeStep).ground().box(Vector3(0.5, 0.25, 0.5), 2.0, Vector3(0, 0.25, 0));
  may_sleep(&builder).gravity(kWeight);
  Environment world(builder.description());
  run(&world, kAsleepBy + 50);
  ASSERT_TRUE(world.is_asleep(1));
  Environment restored(builder.description());
  ASSERT_EQ(restored.restore(world.saved_state()), "");
  for (Environment* one : {&world, &restored}) {
    one->wake(1);
    EXPECT_EQ(one->step(), StepOutcome::kCommitted);
    EXPECT_FALSE(one->is_asleep(1));
    run(one, 100);
    EXPECT_TRUE(one->is_asleep(1));
  }
  EXPECT_EQ(world.chain_hash(), restored.chain_hash());

  kernel::SwapOrder order;
  order.slot = Slot::kSolver;
  WorldBuilder other;
  other.plugin(Slot::kSolver, plugin_path("solver_newton"), {1e-12, 100});
  order.plugin = other.description().solver.plugins[0];
  order.step = world.step_count() + 1;
  world.order_swap(order);
  run(&world, 1);
  EXPECT_FALSE(world.is_asleep(1));
}

TEST(Sleep, AnotherPluginWakesAll) {
  Environment world(boxes_and_ball().description());
  run(&world, kAsleepBy);
  WorldBuilder other;
  other.plugin(Slot::kSolver, plugin_path("solver_newton"), {1e-12, 100});
  kernel::SwapOrder order;
  order.slot = Slot::kSolver;
  order.plugin = other.description().solver.plugins[0];
  order.step = kAsleepBy + 1;
  world.order_swap(order);
  run(&world, 1);
  for (const std::uint32_t body : {1U, 2U, 3U}) EXPECT_FALSE(world.is_asleep(body));
}

// Two boxes on a table that begins to rise after a second.
TEST(Sleep, AKinematicBodyThatBeginsToMoveWakesWhatStandsOnIt) {
  WorldBuilder builder;
  builder.steps(150, kTimeStep).box(Vector3(2, 0.25, 2), 1.0, Vector3(0, -0.25, 0));
  kernel::BodyDescription& table = builder.body();
  table.flags = kKinematic | kHasShape;
  for (const double t : {0.0, 0.5, 1.0, 1.5, 2.0})
    for (const double number : {t, 0.0, -0.25 + (t > 1.0 ? 2.0 * (t - 1.0) : 0.0), 0.0, 1.0, 0.0, 0.0, 0.0})
      table.motion.rows.push_back(number);
  builder.box(Vector3(0.5, 0.25, 0.5), 2.0, Vector3(0, 0.25, 0)).box(Vector3(0.4, 0.2, 0.4), 1.0, Vector3(0, 0.7, 0));
  may_sleep(&builder).gravity(kWeight);
  Environment world(builder.description());
  run(&world, 100);
  EXPECT_TRUE(world.is_asleep(1));
  EXPECT_TRUE(world.is_asleep(2));
  run(&world, 50);
  EXPECT_FALSE(world.is_asleep(1));
  EXPECT_NEAR(place_of(world, 1).y() - place_of(world, 0).y(), 0.5, 1e-3);
  EXPECT_NEAR(place_of(world, 2).y() - place_of(world, 1).y(), 0.45, 1e-3);
}

// The box hangs on nothing: the ball, and what it rests on, are the same without the sleepers.
TEST(Sleep, ChangesNoBitOfThoseAwake) {
  const auto motion_of_ball = [](bool has_pile) {
    WorldBuilder builder;
    builder.steps(250, kTimeStep).material({.restitution = 0.6}).ground();
    // in the air until the others sleep
    builder.sphere(0.2, 1.0, Vector3(0, 5.0, 0), Vector3(1, 0, 0)).box(Vector3(0.3, 0.2, 0.4), 1.0, Vector3(0, 7, 3));
    if (has_pile)
      for (int i = 0; i < 6; ++i) builder.box(Vector3(0.5, 0.25, 0.5), 2.0, Vector3(100, 0.25 + 0.5 * i, 0));
    may_sleep(&builder);
    builder.gravity(kWeight);
    Environment world(builder.description());
    std::vector<double> motion;
    for (int i = 0; i < 250; ++i) {
      run(&world, 1);
      motion.insert(motion.end(), world.state().position.data() + 3, world.state().position.data() + 9);
      motion.insert(motion.end(), world.state().linear_velocity.data() + 3, world.state().linear_velocity.data() + 9);
    }
    for (std::uint32_t body = 3; has_pile && body < 9; ++body) EXPECT_TRUE(world.is_asleep(body)) << body;
    return motion;
  };
  const std::vector<double> alone = motion_of_ball(false);
  EXPECT_EQ(motion_of_ball(true), alone);
}

// A scene in which all three kinds of call are made while somebody sleeps, forces included.
WorldBuilder pushed_boxes(Hosting hosting) {
  WorldBuilder builder = boxes_and_ball(hosting);
  builder.force("Drag", "force_drag", {0.1, 0.0});
  return builder;
}

TEST(Sleep, HasTheSameBitsInEveryHostingAndAfterKills) {
  Environment direct(pushed_boxes(Hosting::kDirect).description());
  SleepListener quiet;
  EventSource quiet_source(&quiet);
  direct.set_commit_listener(&quiet_source);
  run(&direct, 150);
  EXPECT_THAT(quiet.bodies(EventKind::kSleep), ElementsAre(1, 2, 3));
  EXPECT_THAT(quiet.bodies(EventKind::kWake), ElementsAre(1, 2));
  for (const Hosting hosting : {Hosting::kSharedMemory, Hosting::kGrpc}) {
    Environment world(pushed_boxes(hosting).threads(2).description());
    SleepListener heard;
    EventSource heard_source(&heard);
    world.set_commit_listener(&heard_source);
    std::uint32_t step = 70;
    for (const Slot slot : {Slot::kIntegrator, Slot::kForce, Slot::kSpace, Slot::kCollision, Slot::kSolver})
      world.inject({slot, "kill", slot == Slot::kCollision || slot == Slot::kSolver ? 101U : step++, 1});
    run(&world, 150);
    EXPECT_EQ(world.chain_hash(), direct.chain_hash());
    EXPECT_EQ(world.faults().size(), 5U);
    EXPECT_EQ(heard.events.size(), quiet.events.size());
  }
}

TEST(Sleep, ALyingIntegratorWakesNobody) {
  Environment quiet(pushed_boxes(Hosting::kDirect).description());
  run(&quiet, 80);
  Environment world(pushed_boxes(Hosting::kSharedMemory).description());
  world.inject({Slot::kIntegrator, "nan", 70, 1});
  world.inject({Slot::kForce, "nan", 74, 1});
  run(&world, 80);
  EXPECT_EQ(world.faults().size(), 2U);
  EXPECT_EQ(world.chain_hash(), quiet.chain_hash());
}

TEST(Sleep, ARestoreInItsMiddleChangesNoBit) {
  for (const std::uint32_t stop : {30U, 52U, 80U, 99U, 101U, 130U}) {
    Environment whole(pushed_boxes(Hosting::kDirect).description());
    run(&whole, stop);
    Environment again(pushed_boxes(Hosting::kDirect).description());
    ASSERT_EQ(again.restore(whole.saved_state()), "");
    for (const std::uint32_t body : {1U, 2U, 3U, 4U}) EXPECT_EQ(again.is_asleep(body), whole.is_asleep(body));
    run(&whole, 150 - stop), run(&again, 150 - stop);
    EXPECT_EQ(again.chain_hash(), whole.chain_hash()) << stop;
  }
}

// An integrator that asks what would act at other velocities, to learn what a force depends on, does not push by that.
TEST(Sleep, AQuestionAboutOtherVelocitiesWakesNobody) {
  WorldBuilder builder;
  builder.steps(150, kTimeStep).ground().box(Vector3(0.5, 0.25, 0.5), 2.0, Vector3(0, 0.25, 0));
  builder.plugin(Slot::kIntegrator, plugin_path("integrator_symplectic_splitting"), {4});
  builder.force("Drag", "force_drag", {0.1, 0.0});
  may_sleep(&builder).gravity(kWeight);
  Environment world(builder.description());
  SleepListener listener;
  EventSource listener_source(&listener);
  world.set_commit_listener(&listener_source);
  run(&world, 150);
  EXPECT_TRUE(world.is_asleep(1));
  EXPECT_THAT(listener.bodies(EventKind::kSleep), ElementsAre(1));
  EXPECT_THAT(listener.bodies(EventKind::kWake), IsEmpty());
  EXPECT_EQ(world.stage_time(Stage::kIntegrate).count(), 150U);  // no step is made again
}

// A push on a box that begins after a second: one that friction holds, and one that it does not.
TEST(Sleep, AForceThatChangesWakes) {
  for (const double push : {5.0, 30.0}) {
    WorldBuilder builder;
    builder.steps(200, kTimeStep).ground().box(Vector3(0.5, 0.25, 0.5), 2.0, Vector3(0, 0.25, 0));
    may_sleep(&builder).gravity(kWeight);
    builder.force("Basic", "force_basic", {0,   0,    0, 0, 0,   0, 0, 0, 0,    0,    4,     //
                                           0.0, 0,    0, 0, 1.0, 0, 0, 0, 1.01, push, 0, 0,  //
                                           9.0, push, 0, 0, 0});
    Environment world(builder.description());
    SleepListener listener;
    EventSource listener_source(&listener);
    world.set_commit_listener(&listener_source);
    run(&world, 100);
    EXPECT_TRUE(world.is_asleep(1));
    run(&world, 100);
    EXPECT_THAT(listener.bodies(EventKind::kWake), ElementsAre(1));
    if (push < 0.5 * 2.0 * 9.81) {
      EXPECT_TRUE(world.is_asleep(1));
      EXPECT_LT((place_of(world, 1) - Vector3(0, 0.25, 0)).norm(), 1e-12);
    } else {
      EXPECT_NEAR(velocity_of(world, 1).x(), push / 2.0 - 0.5 * 9.81,
                  0.15);  // after a second; the push takes a step to grow
    }
  }
}

// In the middle of a step, and from there on as if it had never slept.
TEST(Sleep, AForceThatJumpsWakesAtItsTime) {
  constexpr double kJump = 1.004, kPush = 3.0;
  WorldBuilder builder;
  builder.steps(200, kTimeStep)
      .material({0.0, 0.0, 0.0, 0.0})
      .ground()
      .box(Vector3(0.5, 0.25, 0.5), 2.0, Vector3(0, 0.25, 0));
  may_sleep(&builder).gravity(kWeight);
  builder.force("Basic", "force_basic", {0,   0,     0, 0, 0,     0, 0, 0, 0,     0,     4,     //
                                         0.0, 0,     0, 0, kJump, 0, 0, 0, kJump, kPush, 0, 0,  //
                                         9.0, kPush, 0, 0, 0});
  builder.description().switches = {kJump};
  Environment world(builder.description());
  run(&world, 100);
  EXPECT_TRUE(world.is_asleep(1));
  run(&world, 100);
  EXPECT_NEAR(velocity_of(world, 1).x(), (2.0 - kJump) * kPush / 2.0, 1e-12);
}

// The stages are asked there for its sake, which changes no bit.
TEST(Sleep, AFaultOrderedIntoAStepInWhichAllSleepIsInjectedThere) {
  WorldBuilder builder(Hosting::kSharedMemory);
  builder.steps(100, kTimeStep).ground().box(Vector3(0.5, 0.25, 0.5), 2.0, Vector3(0, 0.25, 0));
  may_sleep(&builder).gravity(kWeight);
  Environment quiet(builder.description()), world(builder.description());
  world.inject({Slot::kSolver, "kill", 90});
  run(&quiet, 100);
  run(&world, 100);
  EXPECT_TRUE(world.is_asleep(1));
  EXPECT_TRUE(quiet.faults().empty());
  ASSERT_EQ(world.faults().size(), 1U);
  EXPECT_EQ(world.faults()[0].step, 90U);
  EXPECT_EQ(world.chain_hash(), quiet.chain_hash());
}

// A pull that grows all the time, however slowly, is no rest.
TEST(Sleep, NothingSleepsUnderAForceThatKeepsChanging) {
  WorldBuilder builder;
  builder.steps(300, kTimeStep).ground().box(Vector3(0.5, 0.25, 0.5), 2.0, Vector3(0, 0.25, 0));
  may_sleep(&builder).gravity(kWeight);
  builder.force("Basic", "force_basic", {0, 0, 0, 0, 0, 0, 0, 0, 0, 0, 2, 0.0, 0, 0, 0, 100.0, 0.1, 0, 0, 0});
  Environment world(builder.description());
  SleepListener listener;
  EventSource listener_source(&listener);
  world.set_commit_listener(&listener_source);
  run(&world, 300);
  EXPECT_THAT(listener.bodies(EventKind::kSleep), IsEmpty());
  EXPECT_LT((place_of(world, 1) - Vector3(0, 0.25, 0)).norm(), 1e-9);
}

// What drifts beside a wall is held by nothing, though others are so fast that its contact is looked for far ahead.
TEST(Sleep, NothingIsHeldByAWallThatItDoesNotTouch) {
  WorldBuilder builder;
  builder.steps(200, kTimeStep).ground().box(Vector3(0.5, 0.5, 0.5), 1.0, Vector3(0, 0.6, 0), Vector3(1e-6, 0, 0));
  builder.sphere(0.5, 1.0, Vector3(0, 50, 0), Vector3(40, 0, 0));
  may_sleep(&builder);
  Environment world(builder.description());
  run(&world, 200);
  EXPECT_FALSE(world.is_asleep(1));
  EXPECT_NEAR(place_of(world, 1).x(), 200 * kTimeStep * 1e-6, 1e-18);
}

// What is slow and goes somewhere: a drift without hold, a pendulum at its turning points, a slide.
TEST(Sleep, StopsNoMotion) {
  WorldBuilder builder;
  builder.steps(1000, kTimeStep).material({.static_friction = 0.0, .dynamic_friction = 0.0}).ground();
  builder.sphere(0.5, 1.0, Vector3(0, 5, 0), Vector3(1e-9, 0, 0));
  builder.box(Vector3(0.5, 0.25, 0.5), 2.0, Vector3(0, 0.25, 0), Vector3(1e-4, 0, 0));
  builder.description().forces.push_back({"gravity", "Gravity", {0, -9.81, 0}, 0});
  builder.description().force.plugins =
      WorldBuilder().sphere(1, 1, kWeight).gravity(kWeight).description().force.plugins;
  builder.body().forces.push_back(0);
  builder.point(1.0, Vector3::Constant(1e-3), Vector3(10.01, 4, 0)).body().forces.push_back(0);
  builder.joint("Spherical", "constraint_spherical", 3, kNone, {10, 5, 0});
  may_sleep(&builder);
  Environment world(builder.description());
  run(&world, 1000);
  EXPECT_NEAR(place_of(world, 1).x(), 1e-8, 1e-20);
  EXPECT_NEAR(place_of(world, 2).x(), 1e-3, 1e-9);
  for (const std::uint32_t body : {1U, 2U, 3U}) EXPECT_FALSE(world.is_asleep(body)) << body;
}

// All spaces give the same pairs, so who rests is not disturbed by another one; other plugins answer otherwise.
TEST(Sleep, AnotherSpaceWakesNobodyAndAnotherSolverAll) {
  const auto other = [](Slot slot, const std::string& library) {
    WorldBuilder builder;
    builder.plugin(slot, plugin_path(library));
    return builder.description().slot(slot).plugins[0];
  };
  Environment quiet(boxes_and_ball().description()), world(boxes_and_ball().description());
  run(&quiet, 200);
  world.order_swap({Slot::kSpace, other(Slot::kSpace, "space_kd_tree"), std::nullopt, kAsleepBy + 1});
  run(&world, kAsleepBy + 1);
  EXPECT_EQ(world.swaps()[0].to, "KDTree");
  for (const std::uint32_t body : {1U, 2U, 3U}) EXPECT_TRUE(world.is_asleep(body));
  run(&world, 200 - kAsleepBy - 1);
  EXPECT_EQ(world.chain_hash(), quiet.chain_hash());

  Environment woken(boxes_and_ball().description());
  woken.order_swap({Slot::kIntegrator, other(Slot::kIntegrator, "integrator_verlet"), std::nullopt, kAsleepBy + 1});
  run(&woken, kAsleepBy + 1);
  for (const std::uint32_t body : {1U, 2U, 3U}) EXPECT_FALSE(woken.is_asleep(body));
}

}  // namespace
}  // namespace gravitas
