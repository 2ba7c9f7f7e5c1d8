// Who decides about pairs: what is decided is what happens, and a listener that fails leaves the run as the scene has it.
#include "services/listeners/pair_decisions.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <atomic>
#include <cmath>
#include <future>
#include <limits>
#include <memory>
#include <set>
#include <stdexcept>
#include <string>
#include <vector>

#include "services/run/session.h"
#include "tests/kernel/run_to_end.h"
#include "tests/kernel/world_builder.h"
#include "tests/paths.h"
#include "tests/run_quietly.h"
#include "tests/services/cli/program.h"

namespace gravitas {
namespace {

using harness::run_quietly;
using harness::ScratchFolder;
using harness::WorldBuilder;
using kernel::Environment;
using kernel::Hosting;
using kernel::Simulator;
using ::testing::HasSubstr;
using ::testing::IsEmpty;

class Says final : public PairListener {
 public:
  explicit Says(std::function<void(PairQuestion*)> decide) : decide_(std::move(decide)) {}
  void on_pairs(std::span<PairQuestion> pairs) override {
    for (PairQuestion& pair : pairs) {
      was_new = was_new && asked.insert({pair.a, pair.b}).second;
      decide_(&pair);
    }
  }
  std::set<std::pair<std::uint32_t, std::uint32_t>> asked;
  bool was_new = true;

 private:
  std::function<void(PairQuestion*)> decide_;
};

// Two equal balls that meet head on at t = 0.4 s, each at 1 m/s; the scene says e = 0.5.
WorldBuilder head_on(Simulator simulator = Simulator::kBasic, Hosting hosting = Hosting::kDirect) {
  WorldBuilder builder(hosting);
  builder.steps(100, 0.01).material({.restitution = 0.5});
  builder.sphere(0.1, 1.0, Vector3(-0.5, 0, 0), Vector3(1, 0, 0));
  builder.sphere(0.1, 1.0, Vector3(0.5, 0, 0), Vector3(-1, 0, 0));
  builder.description().simulator = simulator;
  return builder;
}

struct Decided {
  double x, v;  // of the first ball, at the end
  std::string chain;
  std::vector<std::string> problems;
};

Decided decide(const WorldBuilder& builder, const std::shared_ptr<PairListener>& listener, double deadline = 10.0) {
  Decided decided;
  PairDecisions decisions([&](const std::string& why) { decided.problems.push_back(why); });
  if (listener) decisions.listen(listener, deadline);
  Environment world(builder.description());
  world.set_pair_arbiter(&decisions);
  run_to_end(&world);
  decided.x = world.state().position[0];
  decided.v = world.state().linear_velocity[0];
  decided.chain = world.chain_hash().text();
  return decided;
}

class InSimulator : public ::testing::TestWithParam<Simulator> {};

INSTANTIATE_TEST_SUITE_P(Each, InSimulator,
                         ::testing::Values(Simulator::kBasic, Simulator::kSubstepping, Simulator::kBisection,
                                           Simulator::kContinuous));

TEST_P(InSimulator, WhoIsForbiddenPassesThrough) {
  const auto denies = std::make_shared<Says>([](PairQuestion* pair) { pair->may_collide = false; });
  const Decided decided = decide(head_on(GetParam()), denies);
  EXPECT_NEAR(decided.x, 0.5, 1e-12);
  EXPECT_EQ(decided.v, 1.0);
  EXPECT_THAT(decided.problems, IsEmpty());
  EXPECT_EQ(denies->asked.size(), 1U);
}

TEST_P(InSimulator, AMaterialIsThatOfTheListener) {
  for (const double restitution : {0.0, 0.25, 1.0}) {
    const auto mixes = std::make_shared<Says>([&](PairQuestion* pair) {
      EXPECT_EQ(pair->material[kRestitution], 0.5);
      pair->material[kRestitution] = restitution;
    });
    EXPECT_NEAR(decide(head_on(GetParam()), mixes).v, -restitution, 1e-9);
    EXPECT_TRUE(mixes->was_new) << "a pair was asked about twice";
  }
  EXPECT_NEAR(decide(head_on(GetParam()), nullptr).v, -0.5, 1e-9);
}

TEST_P(InSimulator, WhoChangesNothingChangesNoBit) {
  const std::string quiet = decide(head_on(GetParam()), nullptr).chain;
  EXPECT_EQ(decide(head_on(GetParam()), std::make_shared<Says>([](PairQuestion*) {})).chain, quiet);
}

TEST(PairDecisions, DecideTheSameInAnyHosting) {
  const auto decides = [] {
    return std::make_shared<Says>([](PairQuestion* pair) { pair->material[kRestitution] = 0.75; });
  };
  EXPECT_EQ(decide(head_on(Simulator::kContinuous, Hosting::kSharedMemory), decides()).chain,
            decide(head_on(Simulator::kContinuous), decides()).chain);
}

// Only the pair that is decided about: three balls on the ground, one of which falls through it.
TEST(PairDecisions, AreAboutOnePairEach) {
  WorldBuilder builder;
  builder.steps(50, 0.01).material({}).ground();
  for (int i = 0; i < 3; ++i) builder.sphere(0.1, 1.0, Vector3(i, 0.1, 0));
  builder.gravity({0, -10, 0});
  PairDecisions decisions([](const std::string& why) { ADD_FAILURE() << why; });
  decisions.listen(std::make_shared<Says>([](PairQuestion* pair) { pair->may_collide = pair->b != 2; }), 10.0);
  Environment world(builder.description());
  world.set_pair_arbiter(&decisions);
  run_to_end(&world);
  EXPECT_NEAR(world.state().position[3 * 1 + 1], 0.1, 1e-9);
  EXPECT_LT(world.state().position[3 * 2 + 1], -1.0);
  EXPECT_NEAR(world.state().position[3 * 3 + 1], 0.1, 1e-9);
}

// What it decided before it failed holds; it is not asked again.
TEST(PairDecisions, OneThatThrowsIsLeftAside) {
  const std::string quiet = decide(head_on(), nullptr).chain;
  const auto throws = std::make_shared<Says>([](PairQuestion*) { throw std::runtime_error("no idea"); });
  const Decided decided = decide(head_on(), throws);
  EXPECT_EQ(decided.chain, quiet);
  ASSERT_EQ(decided.problems.size(), 1U);
  EXPECT_THAT(decided.problems[0], HasSubstr("it threw: no idea; the scene's own rules hold"));
  EXPECT_EQ(throws->asked.size(), 1U);
}

TEST(PairDecisions, AnImpossibleMaterialIsNotUsed) {
  const std::string quiet = decide(head_on(), nullptr).chain;
  for (const double number : {-1.0, std::numeric_limits<double>::quiet_NaN()}) {
    const auto wrong = std::make_shared<Says>([&](PairQuestion* pair) {
      pair->may_collide = false;
      pair->material[kRestitution] = number;
    });
    const Decided decided = decide(head_on(), wrong);
    EXPECT_EQ(decided.chain, quiet);
    ASSERT_EQ(decided.problems.size(), 1U);
    EXPECT_THAT(decided.problems[0], HasSubstr("allowed: finite ones >= 0"));
  }
  const auto bouncy = std::make_shared<Says>([](PairQuestion* pair) { pair->material[kRestitution] = 1.2; });
  const Decided decided = decide(head_on(), bouncy);
  EXPECT_EQ(decided.chain, quiet);
  ASSERT_EQ(decided.problems.size(), 1U);
  EXPECT_THAT(decided.problems[0], HasSubstr("the restitution 1.2; allowed: 0 to 1"));
}

// Waits until the test lets it go.
class Stalls final : public PairListener {
 public:
  explicit Stalls(std::shared_future<void> end, std::promise<void>* has_ended) : end_(end), has_ended_(*has_ended) {}
  void on_pairs(std::span<PairQuestion> pairs) override {
    end_.wait();
    for (PairQuestion& pair : pairs) pair.may_collide = false;
    has_ended_.set_value();
  }

 private:
  std::shared_future<void> end_;
  std::promise<void>& has_ended_;
};

TEST(PairDecisions, OneThatStallsIsLeftAsideAtTheDeadlineAndItsLateAnswerIsNotUsed) {
  const std::string quiet = decide(head_on(), nullptr).chain;
  std::promise<void> end, has_ended;
  const Decided decided = decide(head_on(), std::make_shared<Stalls>(end.get_future().share(), &has_ended), 0.05);
  EXPECT_EQ(decided.chain, quiet);
  ASSERT_EQ(decided.problems.size(), 1U);
  EXPECT_THAT(decided.problems[0], HasSubstr("no answer within 0.05 s about 1 pair"));
  end.set_value();
  has_ended.get_future().wait();
}

// ---- a whole run

RunOptions listened(const ScratchFolder& folder, std::function<void(PairQuestion*)> decide) {
  RunOptions options;
  options.scenes = {harness::shipped_scene("bounce")};
  options.steps = 240;
  options.hosting = {{std::nullopt, Hosting::kDirect}};
  options.listener = std::make_shared<Says>(std::move(decide));
  options.listener_deadline = 10.0;
  options.events = folder.path("events");
  options.event_kinds = {"all"};
  return options;
}

TEST(ListenedRun, AFailureIsAWarningAndAnEventAndTheRunGoesOn) {
  const ScratchFolder folder;
  RunOptions options = listened(folder, [](PairQuestion*) { throw std::runtime_error("no idea"); });
  const RunResult result = run_quietly(options);
  EXPECT_EQ(result.outcome, RunOutcome::kCompleted);
  EXPECT_THAT(result.report.warnings(), ::testing::Contains(HasSubstr("it threw: no idea")));
  EXPECT_THAT(harness::read_file(options.events), HasSubstr("\"kind\":\"listener\""));
  options.listener = nullptr;
  EXPECT_EQ(run_quietly(options).report.chain_hash(), result.report.chain_hash());
}

// A body that comes first by its row, one of other pairs that changes, and one whose material does.
TEST(ListenedRun, DecisionsHoldOverEditsButOfMaterialsThatChange) {
  const ScratchFolder folder;
  const std::string scene = folder.write("scene.gravitas", R"(
Geometries { Geometry { Type = "Sphere" Id = "Unit" CustomProperties { Radius = 0.1 } }
             Geometry { Type = "Halfspace" Id = "Flat" } }
Materials { Material { Id = "Rubber" RestitutionCoefficient = 0.5 } }
Forces { Force { Type = "Gravity" Id = "Down" CustomProperties { Acceleration = {0, -10, 0} } } }
Simulator { CustomProperties { TimeStep = 0.01 Duration = 1 } }
Environment { Space { Bodies {
  Body { Id = "First" GeometryId = "Unit" Mass = 1 KineticProperties { Position = {50, 90, 0} } }
  Body { Id = "A" GeometryId = "Unit" Mass = 1 Material = "Rubber" KineticProperties { Position = {0, 0.3, 0} } Forces = { "Down" } }
  Body { Id = "Ground" GeometryId = "Flat" }
} } })");
  const auto asks = [&](const std::vector<std::string>& edits, double* momentum) {
    std::vector<std::string> asked;
    RunOptions options;
    options.scenes = {scene};
    options.edits = edits;
    options.hosting = {{std::nullopt, Hosting::kDirect}};
    options.listener_deadline = 10.0;
    options.listener = std::make_shared<Says>([&](PairQuestion* pair) {
      asked.push_back(pair->id_a + " " + pair->id_b);
      pair->may_collide = false;
    });
    const RunResult result = run_quietly(options);
    EXPECT_EQ(result.outcome, RunOutcome::kCompleted) << result.fault;
    *momentum = result.report.linear_momentum().final(1);
    return asked;
  };
  double falls = 0.0;
  EXPECT_THAT(asks({}, &falls), ::testing::ElementsAre("First Ground", "A Ground"));
  EXPECT_NEAR(falls, -10.0, 1e-12);
  EXPECT_THAT(asks({"set Body.First.Mass=2@step=60", "remove Body.First@step=70"}, &falls),
              ::testing::ElementsAre("First Ground", "A Ground"));
  EXPECT_NEAR(falls, -10.0, 1e-12) << "it falls on through the ground";
  EXPECT_THAT(asks({"set Material.Rubber.RestitutionCoefficient=0.7@step=60"}, &falls),
              ::testing::ElementsAre("First Ground", "A Ground", "A Ground"));
}

TEST(ListenedRun, IsNotResumed) {
  const ScratchFolder folder;
  RunOptions options = listened(folder, [](PairQuestion*) {});
  options.checkpoint = folder.path("checkpoint");
  ASSERT_EQ(run_quietly(options).outcome, RunOutcome::kCompleted);
  options.listener = nullptr;
  options.resume = options.checkpoint;
  options.steps = 250;
  try {
    run_quietly(options);
    FAIL() << "it was resumed";
  } catch (const BadInput& problem) {
    EXPECT_THAT(problem.what(), HasSubstr("a listener decided about pairs of bodies in that run"));
  }
}

}  // namespace
}  // namespace gravitas
