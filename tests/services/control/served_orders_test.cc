// What was ordered of a served run outlives edits, crashes and the server: several orders before one step, too.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <filesystem>
#include <string>
#include <vector>

#include "tests/paths.h"
#include "tests/run_quietly.h"
#include "tests/services/control/served.h"

namespace gravitas::control {
namespace {

using harness::parse_set_request;
using harness::parse_swap_request;
using harness::refusal;
using harness::sample;
using harness::Served;
using ::testing::HasSubstr;
using ::testing::Not;

std::string resumed_end(const std::string& checkpoint, std::vector<std::string>* warnings) {
  RunOptions resumed = sample("direct").run;
  resumed.resume = checkpoint;
  const RunResult result = harness::run_quietly(resumed);
  EXPECT_EQ(result.outcome, RunOutcome::kCompleted) << result.fault;
  warnings->assign(result.report.warnings().begin(), result.report.warnings().end());
  return result.report.chain_hash();
}

// The checkpoint is of step 0, so that the journal alone knows them; it knows them once, however often they are made again.
TEST(ServedOrders, SeveralBeforeOneStepAreMadeAgain) {
  const auto begin = [](Served* one) {
    one->client.step(10);
    one->edit({"set Body.Ball01.LinearVelocity={0,1,0}"});
    one->edit({"set Body.Ball02.LinearVelocity={0,0,1}"});
    one->client.step(10);
    one->client.set_property(parse_set_request("Solver.Iterations=3"));
    one->client.set_property(parse_set_request("Solver.RelaxationFactor=0.9"));
    one->client.step(20);
  };
  const gravitas::harness::ScratchFolder folder;
  ServeOptions options = sample();
  options.run.checkpoint = folder.path("served.ck");
  Served quiet(sample());
  begin(&quiet);
  const std::string middle = quiet.client.status().chain_hash(), chain = quiet.to_the_end().chain_hash();
  {
    Served served(options);
    begin(&served);
    EXPECT_EQ(served.client.status().chain_hash(), middle);
  }
  std::vector<std::string> warnings;
  EXPECT_EQ(resumed_end(options.run.checkpoint, &warnings), chain);
  ServeOptions again = sample("direct");
  again.run.resume = again.run.checkpoint = options.run.checkpoint;
  for (int i = 0; i < 2; ++i) {
    Served resumed(again);
    EXPECT_EQ(resumed.client.status().edit_count(), 2U);
    if (i == 1) {
      EXPECT_EQ(resumed.to_the_end().chain_hash(), chain);
    }
  }
  EXPECT_EQ(resumed_end(options.run.checkpoint, &warnings), chain);
}

// A swap to the plugin that answers brings what was set for the same step.
TEST(ServedOrders, ASwapKeepsWhatWasSetBeforeIt) {
  const auto end = [](bool swaps) {
    Served served;
    served.client.step(10);
    served.client.set_property(parse_set_request("Solver.Iterations=3"));
    if (swaps) served.client.swap(parse_swap_request("solver=Sequential"));
    return served.to_the_end().chain_hash();
  };
  EXPECT_EQ(end(true), end(false));
}

TEST(ServedOrders, AFaultForLaterOutlivesAnEdit) {
  Served served;
  served.client.inject("solver:kill@step=30");
  served.client.step(10);
  served.edit({"set Body.Ball01.LinearVelocity={0,1,0}"});
  served.client.step(20);
  const api::Status status = served.client.status();
  ASSERT_EQ(status.fault_count(), 1U);
  EXPECT_EQ(status.faults(0).step(), 30U);
  EXPECT_THAT(status.last_warning(), Not(HasSubstr("injected")));
}

// A library that was built anew has the settings of the moment.
TEST(ServedOrders, ASwapByPathKeepsWhatWasSet) {
  Served served(sample("direct"));
  served.set("Solver.Iterations=7");
  served.swap("solver=" + in_build("/lib/gravitas/solver_sequential.so"));
  std::string settings;
  const api::Status status = served.client.status();
  for (const api::PlannedSlot& slot : status.plan().slots())
    for (const api::Setting& setting : slot.settings())
      if (slot.slot() == "solver") settings += setting.name() + "=" + setting.value() + " ";
  EXPECT_THAT(settings, HasSubstr("Iterations=7 "));
}

TEST(ServedOrders, TheCommandThatGoesOnHasThem) {
  const gravitas::harness::ScratchFolder folder;
  const std::string built = folder.path("solver.so");
  std::filesystem::copy_file(in_build("/lib/gravitas/solver_newton.so"), built);
  ServeOptions options = sample();
  options.run.checkpoint = folder.path("served.ck");
  Served served(options);
  served.client.step(10);
  served.client.swap(parse_swap_request("space=Grid,hosting=direct"));
  served.client.swap(parse_swap_request("solver=" + built + "@step=40"));
  served.client.swap(parse_swap_request("integrator=Euler", true));
  const std::optional<ServedRun::Saved> saved = served.run.save_checkpoint();
  ASSERT_TRUE(saved);
  EXPECT_EQ(saved->step, 10U);
  EXPECT_THAT(saved->go_on_by, HasSubstr(" --swap space=Grid@step=11,hosting=direct "));
  EXPECT_THAT(saved->go_on_by, HasSubstr(" --swap solver=" + built + "@step=40 "));
  EXPECT_THAT(saved->go_on_by, HasSubstr(" --compare integrator=Euler "));
  EXPECT_THAT(served.client.status().last_warning(), Not(HasSubstr("what was set")));
  served.client.set_property(parse_set_request("Solver.Iterations=7"));
  EXPECT_THAT(served.run.save_checkpoint()->go_on_by, Not(HasSubstr("Iterations")));
  // the journal beside the checkpoint has it
  EXPECT_THAT(served.client.status().last_warning(), Not(HasSubstr("what was set")));
}

// As by the server, which would have refused it, too.
TEST(ServedOrders, AnEditThatLeavesOutTheirSlotIsRefusedBeforeTheRunGoesOn) {
  const gravitas::harness::ScratchFolder folder;
  ServeOptions options = sample("direct");
  options.run.checkpoint = folder.path("served.ck");
  {
    Served served(options);
    served.client.swap(parse_swap_request("constraint=AngularMotor@step=60"));
    served.client.step(10);
  }
  options.run.resume = options.run.checkpoint;
  options.run.checkpoint.clear();
  options.run.edits = {"remove Constraint.MyAngularMotor@step=60"};
  std::string problem;
  try {
    harness::run_quietly(options.run);
  } catch (const BadInput& refused) {
    problem = refused.what();
  }
  EXPECT_THAT(problem, HasSubstr("swap constraint=AngularMotor at step 60: after the edit before step 60 the plan "
                                 "leaves the slot out: "));
  // before that edit it is there
  options.run.edits = {"remove Constraint.MyAngularMotor@step=61"};
  EXPECT_EQ(harness::run_quietly(options.run).report.swaps_size(), 1);
}

// The command that goes on has the scene's settings, the journal those that were set.
TEST(ServedOrders, ASwapOfTheCommandAndTheJournalIsMadeOnce) {
  const gravitas::harness::ScratchFolder folder;
  ServeOptions options = sample("direct");
  options.run.checkpoint = folder.path("served.ck");
  const auto begin = [](Served* one) {
    one->client.set_property(parse_set_request("Solver.Iterations=3"));
    one->client.step(10);
    one->client.swap(parse_swap_request("solver=Sequential@step=60"));
    one->run.save_checkpoint();
  };
  Served quiet(sample("direct"));
  begin(&quiet);
  const std::string chain = quiet.to_the_end().chain_hash();
  {
    Served served(options);
    begin(&served);
  }
  RunOptions again = sample("direct").run;
  again.resume = options.run.checkpoint;
  again.swaps = {"solver=Sequential@step=60"};
  const RunResult result = harness::run_quietly(again);
  EXPECT_EQ(result.report.chain_hash(), chain);
  std::vector<std::uint32_t> steps;
  for (const report::v1::SwapRecord& swap : result.report.swaps()) steps.push_back(swap.step());
  EXPECT_THAT(steps, ::testing::ElementsAre(1, 60));
}

// One whose plugin is not to be had is told once, and is none of a journal that is begun then.
TEST(ServedOrders, AJournalThatIsBegunAnewHasThoseThatStand) {
  const gravitas::harness::ScratchFolder folder;
  const std::string copy = folder.path("copy.so");
  std::filesystem::copy(in_build("/lib/gravitas/solver_newton.so"), copy);
  ServeOptions options = sample("direct");
  options.run.checkpoint = folder.path("served.ck");
  {
    Served served(options);
    served.client.swap(parse_swap_request("solver=" + copy + "@step=50"));
    served.client.swap(parse_swap_request("integrator=RK4@step=60"));
  }
  ServeOptions again = sample("direct");
  again.run.resume = options.run.checkpoint;
  again.run.checkpoint = folder.path("by_serve.ck");
  { const Served resumed(again); }
  again.run.checkpoint = folder.path("by_run.ck");
  EXPECT_THAT(harness::run_quietly([&] {
                RunOptions some = again.run;
                some.steps = 10;
                return some;
              }())
                  .report.warnings(),
              ::testing::Contains(HasSubstr("is not ordered again")));
  for (const char* kept : {"by_serve.ck", "by_run.ck"}) {
    RunOptions rest = sample("direct").run;
    rest.resume = folder.path(kept);
    const RunResult result = harness::run_quietly(rest);
    EXPECT_THAT(result.report.warnings(), Not(::testing::Contains(HasSubstr("is not ordered again")))) << kept;
    ASSERT_EQ(result.report.swaps_size(), 1) << kept;
    EXPECT_EQ(result.report.swaps(0).step(), 60U) << kept;
  }
}

TEST(ServedOrders, ACaptureWritesOverNoCheckpoint) {
  const gravitas::harness::ScratchFolder folder;
  ServeOptions options = sample("direct");
  options.run.checkpoint = folder.path("served.ck");
  Served served(options);
  api::CaptureRequest request;
  request.set_slot("solver");
  request.set_steps(5);
  request.set_path(options.run.checkpoint);
  EXPECT_THAT(refusal([&] { served.client.capture(request, [] { return false; }); }),
              HasSubstr("it is the same file as --checkpoint"));
  EXPECT_THAT(served.client.status().files(), ::testing::Contains(options.run.checkpoint));
}

}  // namespace
}  // namespace gravitas::control
