// Failures of a slot that a run had before it stopped count where it goes on, as if it had not stopped.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cstddef>
#include <string>
#include <vector>

#include "services/recorder/durable_file.h"
#include "services/run/session.h"
#include "tests/run_quietly.h"
#include "tests/services/cli/program.h"

namespace gravitas {
namespace {

using harness::CurrentFolder;
using harness::run_quietly;
using harness::ScratchFolder;

RunOptions in_workers(const std::string& scene, std::uint32_t steps) {
  RunOptions options;
  options.scenes = {scene};
  options.hosting = {{std::nullopt, kernel::Hosting::kSharedMemory}};
  options.steps = steps;
  return options;
}

// The third failure ends at the fallback, whenever the first two were; with enough good answers between them none does.
TEST(ResumedRun, CountsTheFailuresOfBefore) {
  const ScratchFolder folder;
  const std::string scene = folder.write(
      "scene.gravitas", harness::read_file(harness::shipped_scene("two_spheres_motor")) +
                            "Plugins { Plugin { Slot = \"solver\" Fallback = \"Newton\" Failures = 3 } }\n");
  for (const std::uint32_t last : {44U, 200U}) {
    RunOptions whole = in_workers(scene, 220);
    for (const std::uint32_t step : {40U, 42U, last})
      whole.faults.push_back("solver:kill@step=" + std::to_string(step));
    const RunResult expected = run_quietly(whole);
    ASSERT_EQ(expected.report.faults_size(), 3);
    EXPECT_EQ(expected.report.faults(2).recovered_by() == "fallback Newton", last == 44);
    for (const std::uint32_t stop : {41U, 43U}) {
      RunOptions part = whole;
      part.steps = stop;
      part.checkpoint = folder.path("checkpoint");
      ASSERT_EQ(run_quietly(part).outcome, RunOutcome::kCompleted);
      RunOptions rest = whole;
      rest.resume = part.checkpoint;
      EXPECT_EQ(run_quietly(rest).report.chain_hash(), expected.report.chain_hash()) << stop << ", " << last;
    }
    // nor does an edit begin to count anew
    RunOptions edited = whole;
    edited.edits = {"set Body.Ground.CanSleep=false@step=43"};
    const RunResult other = run_quietly(edited);
    ASSERT_EQ(other.report.faults_size(), 3);
    EXPECT_EQ(other.report.faults(2).recovered_by() == "fallback Newton", last == 44);
  }
}

// A fallback that the journal knows takes over where it did, and is no swap, however often the run goes on from there.
TEST(ResumedRun, AFallbackOfTheJournalIsNoSwap) {
  const ScratchFolder folder;
  const std::string scene = folder.write(
      "scene.gravitas", harness::read_file(harness::shipped_scene("two_spheres_motor")) +
                            "Plugins { Plugin { Slot = \"solver\" Fallback = \"Newton\" Failures = 1 } }\n");
  RunOptions part = in_workers(scene, 80);
  part.steps = 30;
  part.checkpoint = folder.path("checkpoint");
  ASSERT_EQ(run_quietly(part).outcome, RunOutcome::kCompleted);
  const std::vector<std::byte> early = read_whole_file(part.checkpoint);
  part.steps = 60;
  part.resume = part.checkpoint;
  part.faults = {"solver:kill@step=40"};
  ASSERT_EQ(run_quietly(part).outcome, RunOutcome::kCompleted);
  RunOptions whole = in_workers(scene, 80);
  whole.faults = part.faults;
  const RunResult expected = run_quietly(whole);
  // as if it had been killed after step 60; the fault is ordered again, or it came by itself and does not come again
  replace_file(part.checkpoint, early);
  RunOptions rest = part;
  for (const std::uint32_t steps : {65U, 70U, 80U}) {
    rest.steps = steps;
    if (steps > 65) rest.faults.clear();
    const RunResult resumed = run_quietly(rest);
    ASSERT_EQ(resumed.outcome, RunOutcome::kCompleted) << resumed.fault;
    EXPECT_EQ(resumed.report.swaps_size(), 0) << steps;
    if (steps == 80) EXPECT_EQ(resumed.report.chain_hash(), expected.report.chain_hash());
    if (steps == 65) {
      EXPECT_EQ(resumed.report.faults_size(), 0);
      replace_file(part.checkpoint, early);
    }
    if (steps < 80)
      EXPECT_THAT(resumed.report.warnings(),
                  ::testing::Contains(
                      "from step 40 on slot solver is answered by Newton, as the journal has it (fallback Newton)"));
  }
}

// It is on no probation there: what fails soon after is made again, as it was, and nobody is gone back to.
TEST(ResumedRun, AFallbackOfTheJournalBearsFailuresAsItDid) {
  const ScratchFolder folder;
  const std::string scene = folder.write(
      "scene.gravitas", harness::read_file(harness::shipped_scene("two_spheres_motor")) +
                            "Plugins { Plugin { Slot = \"solver\" Fallback = \"Newton\" Failures = 2 } }\n");
  RunOptions part = in_workers(scene, 60);
  part.steps = 30;
  part.checkpoint = folder.path("checkpoint");
  ASSERT_EQ(run_quietly(part).outcome, RunOutcome::kCompleted);
  const std::vector<std::byte> early = read_whole_file(part.checkpoint);
  part.steps = 42;
  part.resume = part.checkpoint;
  part.faults = {"solver:kill@step=38", "solver:kill@step=40"};
  ASSERT_EQ(run_quietly(part).outcome, RunOutcome::kCompleted);
  RunOptions whole = in_workers(scene, 60);
  whole.faults = {"solver:kill@step=38", "solver:kill@step=40", "solver:kill@step=44"};
  const RunResult expected = run_quietly(whole);
  ASSERT_EQ(expected.report.faults_size(), 3);
  ASSERT_EQ(expected.report.faults(1).recovered_by(), "fallback Newton");
  ASSERT_THAT(expected.report.faults(2).recovered_by(), ::testing::StartsWith("standby"));
  // as if it had been killed after step 42
  replace_file(part.checkpoint, early);
  part.steps = 60;
  part.faults = whole.faults;
  const RunResult resumed = run_quietly(part);
  ASSERT_EQ(resumed.outcome, RunOutcome::kCompleted) << resumed.fault;
  EXPECT_EQ(resumed.report.swaps_size(), 0);
  EXPECT_EQ(resumed.report.chain_hash(), expected.report.chain_hash());
  ASSERT_EQ(resumed.report.faults_size(), 2);
  EXPECT_THAT(resumed.report.faults(1).recovered_by(), ::testing::StartsWith("standby"));
}

// Who goes on after a pause has all of them again.
TEST(ResumedRun, BearsAsManyFailuresAfterAPauseByThem) {
  const CurrentFolder here;
  const ScratchFolder folder;
  RunOptions options = in_workers(harness::shipped_scene("two_spheres_motor"), 60);
  const RunResult whole = run_quietly(options);
  options.checkpoint = folder.path("checkpoint");
  for (const char* step : {"4", "8", "12", "16", "20"})
    options.faults.push_back(std::string("solver:kill@step=") + step);
  const RunResult paused = run_quietly(options);
  ASSERT_EQ(paused.outcome, RunOutcome::kPaused);
  ASSERT_EQ(paused.report.steps(), 19U);
  options.resume = options.checkpoint;
  const RunResult resumed = run_quietly(options);
  EXPECT_EQ(resumed.outcome, RunOutcome::kCompleted) << resumed.fault;
  EXPECT_EQ(resumed.report.chain_hash(), whole.report.chain_hash());
}

}  // namespace
}  // namespace gravitas
