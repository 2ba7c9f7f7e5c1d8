// Faults that were ordered: each is told as what it is, in the step it was ordered for, and what may fail is told before it
// ends a run.
#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <string>
#include <vector>

#include "tests/services/cli/program.h"

namespace gravitas {
namespace {

using harness::ProgramResult;
using harness::read_report;
using harness::run_program;
using harness::ScratchFolder;
using ::testing::Contains;
using ::testing::HasSubstr;
using ::testing::Not;

struct OrderedRun {
  ProgramResult program;
  report::v1::Report report;
};

OrderedRun ordered_run(std::vector<std::string> words, std::vector<int> solver_kills = {}) {
  const ScratchFolder folder;
  words.insert(words.begin(), {"run", kSample, "--steps", "40", "--checkpoint", folder.path("run.ck"), "--report",
                               folder.path("report.json")});
  for (const int step : solver_kills) words.insert(words.end(), {"--fault", fmt::format("solver:kill@step={}", step)});
  OrderedRun done{run_program(words, folder), {}};
  done.report = read_report(harness::read_file(folder.path("report.json")));
  return done;
}

const std::vector<int> kFiveKills = {4, 8, 12, 16, 20};

TEST(OrderedFaults, WhatEndsAWorkerAfterItsReplyIsToldAsOrdered) {
  const OrderedRun run = ordered_run({"--fault", "solver:kill@step=5,at=reply"});
  ASSERT_EQ(run.program.exit_code, 0) << run.program.err;
  ASSERT_EQ(run.report.faults_size(), 1);
  // the next call misses it, which is of the next step unless its end is known at once
  EXPECT_GE(run.report.faults(0).step(), 5U);
  EXPECT_LE(run.report.faults(0).step(), 6U);
  EXPECT_EQ(run.report.faults(0).kind(), "kill");
  EXPECT_EQ(run.report.faults(0).ordered(), "solver:kill,at=reply@step=5");
}

TEST(OrderedFaults, WhatNobodyMissedIsToldToo) {
  const OrderedRun run = ordered_run({"--fault", "solver:kill@step=40,at=reply"});
  ASSERT_EQ(run.program.exit_code, 0) << run.program.err;
  EXPECT_EQ(run.report.faults_size(), 0);
  EXPECT_THAT(run.report.warnings(), Contains(HasSubstr("fault solver:kill,at=reply@step=40 shows in no failed call")));
}

TEST(OrderedFaults, WhatLiesBeforeACheckpointIsToldAsThat) {
  const ScratchFolder folder;
  const std::string kept = folder.path("kept"), report = folder.path("report.json");
  const std::vector<std::string> part = {"run", kSample, "--steps", "20", "--checkpoint", kept};
  ASSERT_EQ(run_program(part, folder).exit_code, 0);
  const std::vector<std::string> rest = {"run",      kSample,
                                         "--steps",  "40",
                                         "--resume", kept,
                                         "--report", report,
                                         "--fault",  "solver:kill@step=15",
                                         "--fault",  "solver:kill@step=20",
                                         "--fault",  "solver:kill@step=21"};
  ASSERT_EQ(run_program(rest, folder).exit_code, 0);
  const report::v1::Report told = read_report(harness::read_file(report));
  for (const char* step : {"15", "20"})
    EXPECT_THAT(told.warnings(), Contains(std::string("fault solver:kill@step=") + step +
                                          " is left out: that step lies before the checkpoint of step 20"));
  EXPECT_THAT(told.warnings(), Not(Contains(HasSubstr("shows in no failed call"))));
  EXPECT_EQ(told.faults_size(), 1);
}

TEST(OrderedFaults, APauseByTheNumberOfFailuresSaysSo) {
  const OrderedRun run = ordered_run({}, kFiveKills);
  EXPECT_EQ(run.program.exit_code, 3);
  EXPECT_EQ(run.report.steps(), 19U);
  EXPECT_THAT(run.program.err, HasSubstr("paused at step 20: slot solver, plugin Sequential: "));
  EXPECT_THAT(run.program.err, HasSubstr("slot solver has used up its Failures = 5 (failed calls and starts, each with "
                                         "fewer than 100 good answers after the one before)"));
}

TEST(OrderedFaults, APauseByARequestSaysNothingOfIt) {
  const OrderedRun run = ordered_run({"--fault", "solver:kill@step=5,times=2"});
  EXPECT_EQ(run.program.exit_code, 3);
  EXPECT_THAT(run.program.err, HasSubstr("paused at step 5"));
  EXPECT_THAT(run.program.err, Not(HasSubstr("Failures")));
}

TEST(OrderedFaults, ASceneSaysHowManyFailuresItBears) {
  const ScratchFolder folder;
  const auto with = [&](int failures) {
    return folder.write(fmt::format("bears{}.gravitas", failures),
                        fmt::format("Plugins {{ Plugin {{ Slot = \"solver\" Failures = {} }} }}", failures));
  };
  const OrderedRun quiet = ordered_run({}), more = ordered_run({with(6)}, kFiveKills),
                   fewer = ordered_run({with(2)}, {4, 8});
  ASSERT_EQ(more.program.exit_code, 0) << more.program.err;
  EXPECT_EQ(more.report.faults_size(), 5);
  EXPECT_EQ(more.report.chain_hash(), quiet.report.chain_hash());
  EXPECT_EQ(fewer.program.exit_code, 3);
  EXPECT_EQ(fewer.report.steps(), 7U);
  EXPECT_THAT(fewer.program.err, HasSubstr("Failures = 2"));
  // slots of one process have one
  const std::string shared = folder.write("shared.gravitas",
                                          "Plugins { Plugin { Slot = \"solver\" Process = \"p\" Failures = 2 } Plugin "
                                          "{ Slot = \"space\" Process = \"p\" Failures = 3 } }");
  const ProgramResult refused = run_program({"run", kSample, shared}, folder);
  EXPECT_EQ(refused.exit_code, 2);
  EXPECT_THAT(refused.err, HasSubstr("Failures differs from that at "));
}

TEST(OrderedFaults, AFallbackIsToldByNameAndStep) {
  const ScratchFolder folder;
  const std::string fallback =
      folder.write("fallback.gravitas", "Plugins { Plugin { Slot = \"solver\" Fallback = \"Newton\" } }");
  const OrderedRun run = ordered_run({fallback}, kFiveKills);
  ASSERT_EQ(run.program.exit_code, 0) << run.program.err;
  const std::string warning = "from step 20 on slot solver is answered by the fallback Newton instead of Sequential";
  EXPECT_THAT(run.report.warnings(), Contains(HasSubstr(warning)));
  EXPECT_THAT(run.program.err, HasSubstr(warning));
  // not one of those that are only counted
  EXPECT_THAT(run.program.out, HasSubstr("another plugin from step 20 on: solver, Newton instead of Sequential"));
}

}  // namespace
}  // namespace gravitas
