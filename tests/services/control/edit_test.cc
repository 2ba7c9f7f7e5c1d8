// The scene of a served run changes while it goes on: the chain is that of `gravitas run --edit`.
#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/stat.h>

#include <chrono>
#include <filesystem>
#include <map>
#include <memory>
#include <string>
#include <vector>

#include "services/control/status_text.h"
#include "services/run/edit_spec.h"
#include "services/run/summary.h"
#include "tests/paths.h"
#include "tests/run_quietly.h"
#include "tests/services/control/served.h"

namespace gravitas::control {
namespace {

using harness::quiet_chain;
using harness::refusal;
using harness::run_quietly;
using harness::Served;
using ::testing::HasSubstr;

api::EditMade edit(Served* served, const std::vector<std::string>& changes) {
  api::EditRequest request;
  for (const std::string& change : changes) *request.add_changes() = parse_change(change);
  return served->client.edit(request);
}

TEST(ServedEdit, HasTheChainOfARunWithTheSameEdits) {
  Served served;
  const std::string more =
      served.folder.write("more.gravitas",
                          "Bodies { Body { Id = \"New\" Mass = 1 PrincipalMoments = {1, 1, 1} KineticProperties { "
                          "Position = {9, 9, 9} LinearVelocity = {1, 0, 0} } } }");
  const std::string move = "set Body.Ball01.LinearVelocity={0,1,0}";
  served.client.swap(parse_swap_request("solver=Sequential,hosting=direct"));
  served.client.inject("integrator:kill@step=20");
  served.client.step(30);
  const api::EditMade made = edit(&served, {"add " + more, move});
  EXPECT_EQ(made.step(), 31U);
  EXPECT_GT(made.pause_us(), 0.0);
  api::Status status = served.client.status();
  EXPECT_EQ(status.step(), 30U);
  // what was before is not forgotten, and who took over stays
  EXPECT_EQ(status.fault_count(), 1U);
  EXPECT_THAT(status_page(status),
              HasSubstr("edits: 1\n  edit before step 31: 2 changes: add " + more + ", " + move + "\n"));
  ASSERT_EQ(status.swaps_size(), 1);
  EXPECT_EQ(status.swaps(0).outcome(), "committed");
  for (const api::PlannedSlot& slot : status.plan().slots()) {
    if (slot.slot() == "solver") {
      EXPECT_EQ(slot.hosting(), "direct");
    }
  }
  served.client.step(30);
  edit(&served, {"remove Body.New"});
  status = served.to_the_end();

  RunOptions options = harness::sample("direct").run;
  options.edits = {"add " + more + "@step=31", move + "@step=31", "remove Body.New@step=61"};
  const RunResult result = run_quietly(options);
  EXPECT_EQ(status.chain_hash(), result.report.chain_hash());
  EXPECT_THAT(summarize(result.report, {}),
              HasSubstr("  edit before step 31: 2 changes\n  edit before step 61: 1 change\n"));
  EXPECT_THAT(refusal([&] { edit(&served, {move}); }), HasSubstr("the run has made its last step"));

  served.client.reset();
  EXPECT_EQ(served.client.status().fault_count(), 0U);
  EXPECT_EQ(served.client.status().edit_count(), 0U);
  EXPECT_EQ(served.to_the_end().chain_hash(), quiet_chain());
}

// One on probation stays so; one of a later step goes on waiting, under its number, whatever is edited or set before it.
TEST(ServedEdit, SwapsThatAreToComeGoAlong) {
  Served served(harness::sample("direct"));
  const std::string move = "set Body.Ball01.LinearVelocity={0,1,0}", push = "set Body.Ball01.LinearVelocity={1,0,0}";
  const auto solver = [&] {
    const api::Status status = served.client.status();
    for (const api::PlannedSlot& slot : status.plan().slots())
      if (slot.slot() == "solver") return slot;
    return api::PlannedSlot();
  };
  const auto iterations = [&] {
    const api::PlannedSlot slot = solver();
    for (const api::Setting& one : slot.settings())
      if (one.name() == "Iterations") return one.value();
    return std::string();
  };
  served.client.step(10);
  const api::SwapOrdered newton = served.client.swap(parse_swap_request("solver=Newton@step=40"));
  edit(&served, {move});
  served.client.step(2);
  // of who answers now, and not of who will
  const api::SwapOrdered set = served.client.set_property(parse_set_request("Solver.Iterations=" + iterations()));
  EXPECT_EQ(set.number(), newton.number() + 1);
  served.client.step(10);
  EXPECT_EQ(solver().plugin(), "Sequential");
  edit(&served, {push});
  served.client.step(20);
  EXPECT_EQ(solver().plugin(), "Newton");
  edit(&served, {move});  // in its probation
  const auto ends = [&] {
    std::map<std::uint32_t, std::string> ends;
    const api::Status status = served.client.status();
    EXPECT_EQ(status.swaps_size(), 2);
    for (const api::ServedSwap& swap : status.swaps())
      ends[swap.number()] = fmt::format("{} -> {} {} {}", swap.from(), swap.to(), swap.step(), swap.outcome());
    return ends;
  };
  EXPECT_EQ(ends()[newton.number()], "Sequential -> Newton 40 probation");
  EXPECT_EQ(ends()[set.number()], "Sequential -> Sequential 13 committed");
  RunOptions options = harness::sample("direct").run;
  options.edits = {move + "@step=11", push + "@step=23", move + "@step=43"};
  options.swaps = {"solver=Newton@step=40"};
  EXPECT_EQ(served.to_the_end().chain_hash(), run_quietly(options).report.chain_hash());
  EXPECT_EQ(ends()[newton.number()], "Sequential -> Newton 40 committed");
}

// The catalogue of the run does not know the library.
TEST(ServedEdit, ASwapOnProbationIsTakenBack) {
  Served served(harness::sample("shm"));
  const std::string copy = served.folder.path("newton_copy.so");
  std::filesystem::copy(in_build("/lib/gravitas/solver_newton.so"), copy);
  served.client.step(10);
  served.client.swap(parse_swap_request("solver=" + copy + "@step=12"));
  api::EventsRequest request;
  request.add_kinds("swap");
  const std::shared_ptr<Subscription> events = served.run.subscribe(request);
  served.client.step(3);
  edit(&served, {"set Body.Ball01.LinearVelocity={0,1,0}"});
  served.client.step(1);
  edit(&served, {"set Body.Ball01.LinearVelocity={1,0,0}"});
  served.client.inject("solver:kill@step=16");
  served.client.step(5);
  const api::Status status = served.client.status();
  ASSERT_EQ(status.swaps_size(), 1);
  EXPECT_EQ(status.swaps(0).outcome(), "rolled back");
  EXPECT_EQ(status.fault_count(), 1U);
  std::vector<std::string> told;
  while (const auto event = events->next(std::chrono::milliseconds(0))) told.push_back(event->incident().what());
  EXPECT_THAT(told, ::testing::ElementsAre("probation", "rolled back"));
}

// It stays broken, and says so.
TEST(ServedEdit, OfAJointThatBrokeIsWarnedOf) {
  ServeOptions options = harness::sample("direct");
  options.run.overrides = {"Constraint.MyAngularMotor.BreakingForce=1e-6"};
  Served served(options);
  served.client.step(60);
  const api::EditMade made = edit(&served, {"set Constraint.MyAngularMotor.BreakingForce=100"});
  ASSERT_GE(made.warnings_size(), 1);
  EXPECT_THAT(made.warnings(made.warnings_size() - 1),
              HasSubstr("set Constraint.MyAngularMotor.BreakingForce=100: the joint is broken"));
  // what was told is not told again
  EXPECT_EQ(edit(&served, {"set Body.Ball01.LinearVelocity={0,1,0}"}).warnings_size(), 0);
}

TEST(ServedEdit, WhatCannotBeChangesNothing) {
  Served served(harness::sample("direct"));
  served.client.step(10);
  EXPECT_THAT(refusal([&] { edit(&served, {"remove Body.Ball03"}); }), HasSubstr("did you mean"));
  EXPECT_THAT(refusal([&] {
                edit(&served, {"set Body.Ball01.Mass=3", "remove Body.Ball01"});
              }),
              HasSubstr("names no Body: \"Ball01\""));
  EXPECT_THAT(refusal([&] { edit(&served, {}); }), HasSubstr("nothing to change"));
  EXPECT_THAT(refusal([&] { served.client.wake("Ball03"); }), HasSubstr("wake: no body \"Ball03\""));
  // the server would wait for who writes it
  ASSERT_EQ(mkfifo(served.folder.path("pipe").c_str(), 0600), 0);
  const std::string mesh = served.folder.write(
      "mesh.gravitas",
      "Geometries { Geometry { Type = \"TriangleMesh\" Id = \"X\" CustomProperties { File = \"pipe\" } } }");
  EXPECT_THAT(refusal([&] { edit(&served, {"add " + mesh}); }),
              HasSubstr("pipe: cannot be read: it is not an ordinary"));
  EXPECT_EQ(served.client.wake("Ball01").step(), 10U);
  EXPECT_EQ(served.to_the_end().chain_hash(), quiet_chain());
}

}  // namespace
}  // namespace gravitas::control
