// Swaps that were made before an edit: they go on in the edited scene as if there had been none.
#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <filesystem>
#include <sstream>
#include <string>
#include <vector>

#include "services/run/session.h"
#include "tests/paths.h"
#include "tests/run_quietly.h"
#include "tests/services/cli/program.h"
#include "tests/services/edit/edited_run.h"

namespace gravitas::edited {
namespace {

using harness::read_file;
using harness::run_quietly;
using harness::ScratchFolder;
using kernel::Hosting;
using ::testing::ElementsAre;
using ::testing::HasSubstr;

const std::string kNothing = "set Body.Ground.CanSleep=false";

RunOptions swapped(const std::string& swap, const std::vector<std::string>& edits, const std::string& fault = "") {
  RunOptions options;
  options.scenes = {kSample};
  options.hosting = {{std::nullopt, Hosting::kSharedMemory}};
  options.steps = 80;
  options.swaps = {swap};
  options.edits = edits;
  if (!fault.empty()) options.faults = {fault};
  return options;
}

// What the events say of swaps, in their order.
std::vector<std::string> told(const RunResult& result, const RunOptions& options) {
  EXPECT_EQ(result.outcome, RunOutcome::kCompleted) << result.fault;
  std::vector<std::string> what;
  std::istringstream lines(read_file(options.events));
  for (std::string line; std::getline(lines, line);) {
    const std::size_t begin = line.find("\"what\":\"") + 8;
    what.push_back(line.substr(begin, line.find('"', begin) - begin));
  }
  return what;
}

// One of step 50 is on probation up to step 57, whatever is edited meanwhile, and whoever goes on from a checkpoint after it.
TEST(EditedSwap, IsOnProbationUntilItsEnd) {
  const ScratchFolder folder;
  for (const std::uint32_t at : {55U, 57U, 58U}) {
    RunOptions options = swapped("solver=Newton@step=50", {kNothing + "@step=51", kNothing + "@step=53"},
                                 fmt::format("solver:kill@step={}", at));
    options.events = folder.path("events");
    options.event_kinds = {"swap"};
    const RunResult whole = run_quietly(options);
    const std::string end = at < 58 ? "rolled back" : "committed";
    EXPECT_THAT(told(whole, options), ElementsAre("probation", end)) << at;
    ASSERT_EQ(whole.report.swaps_size(), 1);
    EXPECT_EQ(whole.report.swaps(0).from(), "Sequential");
    EXPECT_EQ(whole.report.swaps(0).outcome(), end) << at;
    EXPECT_GT(whole.report.swaps(0).pause_us(), 0.0);
    RunOptions part = options;
    part.steps = 54;
    part.faults.clear();
    part.checkpoint = folder.path("checkpoint");
    ASSERT_EQ(run_quietly(part).outcome, RunOutcome::kCompleted);
    options.resume = part.checkpoint;
    const RunResult resumed = run_quietly(options);
    EXPECT_THAT(told(resumed, options), ElementsAre(end)) << at;
    EXPECT_EQ(resumed.report.chain_hash(), whole.report.chain_hash()) << at;
    ASSERT_EQ(resumed.report.swaps_size(), 1);
    EXPECT_EQ(resumed.report.swaps(0).outcome(), end) << at;
  }
}

// A request that the new one cannot be asked again is answered by the one before, also long after the swap.
TEST(EditedSwap, LeavesThePreviousBuildToGoBackTo) {
  const RunResult result =
      run_quietly(swapped("solver=Newton@step=10", {kNothing + "@step=30"}, "solver:kill@step=40,times=2"));
  ASSERT_EQ(result.outcome, RunOutcome::kCompleted) << result.fault;
  ASSERT_EQ(result.report.faults_size(), 2);
  EXPECT_EQ(result.report.faults(1).recovered_by(), "previous build");
  ASSERT_EQ(result.report.swaps_size(), 1);
  EXPECT_EQ(result.report.swaps(0).outcome(), "committed");
}

// The other plugins of the slot are not exchanged.
TEST(EditedSwap, OfOnePluginOfSeveralIsTakenBack) {
  const ScratchFolder folder;
  const std::string copy = folder.path("force_copy.so");
  std::filesystem::copy(in_build("/lib/gravitas/force_basic.so"), copy);
  RunOptions options =
      swapped("force=" + copy + "@step=50", {"set Body.Floor.CanSleep=false@step=53"}, "force:kill@step=55");
  options.scenes = {in_source("/tests/determinism/callbacks.gravitas")};
  const RunResult result = run_quietly(options);
  ASSERT_EQ(result.outcome, RunOutcome::kCompleted) << result.fault;
  ASSERT_EQ(result.report.swaps_size(), 1);
  EXPECT_EQ(result.report.swaps(0).outcome(), "rolled back");
  EXPECT_THAT(result.report.swaps(0).to(), HasSubstr("force_copy.so"));
}

// The joint's plugin has nothing more to do.
TEST(EditedSwap, OfAnEmptiedSlotSaysThatItsProbationEnds) {
  const ScratchFolder folder;
  RunOptions options = swapped("constraint=AngularMotor@step=50", {"remove Constraint.MyAngularMotor@step=53"});
  options.events = folder.path("events");
  options.event_kinds = {"swap"};
  const RunResult result = run_quietly(options);
  EXPECT_THAT(told(result, options), ElementsAre("probation", "committed"));
  ASSERT_EQ(result.report.swaps_size(), 1);
  EXPECT_EQ(result.report.swaps(0).outcome(), "committed");
  EXPECT_EQ(result.report.swaps(0).reason(),
            "the edit before step 53 ended its probation: its slot has other plugins in the edited scene, or none");
}

// A scene that adds a mesh, which GjkOnly does not know.
std::string write_mesh(const ScratchFolder& folder) {
  folder.write("tetrahedron.obj", "v 0 0 0\nv 1 0 0\nv 0 1 0\nv 0 0 1\nf 1 3 2\nf 1 2 4\nf 1 4 3\nf 2 3 4\n");
  return folder.write("mesh.gravitas", R"(
    Geometries { Geometry { Type = "TriangleMesh" Id = "Rock" CustomProperties { File = "tetrahedron.obj" } } }
    Bodies { Body { Id = "Rock" GeometryId = "Rock" KineticProperties { Position = {9, 0, 0} } } })");
}

// Whoever goes on from what it kept has the scene of before.
TEST(EditedSwap, ThatIsToComeAndCannotBeInTheEditedSceneLeavesTheRunAsItWas) {
  const ScratchFolder folder;
  RunOptions options = swapped("collision=GjkOnly@step=60", {"add " + write_mesh(folder) + "@step=53"});
  options.checkpoint = folder.path("checkpoint");
  const RunResult stopped = run_quietly(options);
  EXPECT_EQ(stopped.outcome, RunOutcome::kFailed);
  EXPECT_TRUE(stopped.is_bad_input);
  EXPECT_THAT(stopped.fault, HasSubstr("does not serve the type 'TriangleMesh'"));
  EXPECT_EQ(stopped.report.edits_size(), 0);
  EXPECT_EQ(stopped.checkpoint_step, 52U);
  RunOptions rest = swapped("collision=GjkOnly@step=60", {});
  const std::string chain = run_quietly(rest).report.chain_hash();
  rest.resume = options.checkpoint;
  EXPECT_EQ(run_quietly(rest).report.chain_hash(), chain);
}

// Nobody goes back to who does not know what it has.
TEST(EditedSwap, IsNotTakenBackToWhoDoesNotServeTheEditedScene) {
  const ScratchFolder folder;
  const std::string mesh = write_mesh(folder);
  RunOptions options = swapped("collision=GjkOnly@step=10", {"add " + mesh + "@step=53"});
  options.swaps.push_back("collision=Standard@step=50");
  const RunResult result = run_quietly(options);
  ASSERT_EQ(result.outcome, RunOutcome::kCompleted) << result.fault;
  ASSERT_EQ(result.report.swaps_size(), 2);
  EXPECT_EQ(result.report.swaps(1).outcome(), "committed");
  const std::string why =
      "who answered before cannot be had in the edited scene: GjkOnly: it does not serve the type 'TriangleMesh'";
  EXPECT_EQ(result.report.swaps(1).reason(), "the edit before step 53 ended its probation: " + why);
  EXPECT_THAT(result.report.warnings(),
              ::testing::Contains("edit before step 53: after it no swap is taken back: " + why));
}

}  // namespace
}  // namespace gravitas::edited
