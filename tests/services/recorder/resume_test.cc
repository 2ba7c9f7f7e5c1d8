// Runs that stop and go on: the chain is that of the run that never stopped, in any hosting, and the report too.
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <signal.h>
#include <sys/resource.h>

#include <algorithm>
#include <filesystem>
#include <fstream>
#include <string>
#include <utility>
#include <vector>

#include "services/recorder/checkpoint.h"
#include "services/recorder/durable_file.h"
#include "services/recorder/identity.h"
#include "services/recorder/journal.h"
#include "services/recorder/recorder.h"
#include "services/run/session.h"
#include "tests/paths.h"
#include "tests/run_quietly.h"
#include "tests/services/cli/program.h"

namespace gravitas {
namespace {

using harness::CurrentFolder;
using harness::run_quietly;
using harness::ScratchFolder;
using kernel::Hosting;
using ::testing::Contains;
using ::testing::HasSubstr;
using ::testing::Not;

struct Case {
  const char* scene;
  std::uint32_t steps, stop;
  std::vector<std::string> overrides = {};
  const char* suffix = "";
};

void PrintTo(const Case& one, std::ostream* out) { *out << one.scene; }

RunOptions options_of(const std::string& scene, Hosting hosting, std::uint32_t steps,
                      const std::vector<std::string>& overrides = {}) {
  RunOptions options;
  options.scenes = {scene.starts_with('/') ? scene : harness::shipped_scene(scene)};
  options.hosting = {{std::nullopt, hosting}};
  options.steps = steps;
  options.overrides = overrides;
  return options;
}

const std::string kCallbacks = in_source("/tests/determinism/callbacks.gravitas");
const std::string kPile = in_source("/tests/determinism/pile.gravitas");

class Resume : public ::testing::TestWithParam<Case> {};

INSTANTIATE_TEST_SUITE_P(
    Scene, Resume,
    ::testing::Values(Case{"bounce", 240, 100}, Case{"double_pendulum", 240, 77}, Case{"pendulum", 200, 100},
                      Case{"sliding_boxes", 240, 120}, Case{"slope", 200, 50}, Case{"stack", 300, 251},
                      Case{"stack", 260, 120, {}, "_asleep"}, Case{"thruster", 200, 99},
                      Case{"two_spheres_motor", 300, 130}, Case{kCallbacks.c_str(), 120, 60},
                      Case{kPile.c_str(), 120, 64}, Case{"bounce", 240, 101, {"Simulator=Continuous"}, "_continuous"},
                      Case{"stack", 60, 33, {"Simulator=Substepping", "Simulator.Substeps=3"}, "_substepping"}),
    [](const auto& which) {
      const std::string path = which.param.scene;
      const std::size_t slash = path.rfind('/');
      return (slash == std::string::npos ? path : path.substr(slash + 1, path.rfind('.') - slash - 1)) +
             which.param.suffix;
    });

TEST(ResumedRun, AJournalThatIsRemovedMeanwhileIsToldOnce) {
  const ScratchFolder folder;
  RunOptions options = options_of("bounce", Hosting::kDirect, 120);
  options.checkpoint = folder.path("kept");
  options.checkpoint_every = 20;
  const std::string journal = journal_of(options.checkpoint);
  const auto told = [&](std::uint32_t removed_at) {
    const RunResult result = run(
        options, [] { return false; },
        [&](const Progress& now) {
          if (now.step == removed_at) std::filesystem::remove(journal);
        });
    EXPECT_EQ(result.outcome, RunOutcome::kCompleted);
    return std::ranges::count_if(result.report.warnings(), [&](const std::string& warning) {
      return warning.starts_with("journal '" + journal + "' was removed or replaced");
    });
  };
  EXPECT_EQ(told(0), 0);
  EXPECT_EQ(told(50), 1);
  EXPECT_EQ(told(0), 0);
}

TEST_P(Resume, EndsWithTheChainAndTheReportOfTheRunThatNeverStopped) {
  const auto [scene, steps, stop, overrides, suffix] = GetParam();
  const ScratchFolder folder;
  const RunResult whole = run_quietly(options_of(scene, Hosting::kDirect, steps, overrides));
  for (const auto& [first, second] : {std::pair{Hosting::kDirect, Hosting::kDirect},
                                      {Hosting::kDirect, Hosting::kSharedMemory},
                                      {Hosting::kSharedMemory, Hosting::kDirect}}) {
    RunOptions part = options_of(scene, first, stop, overrides);
    part.checkpoint = folder.path("checkpoint");
    part.checkpoint_every = 25;
    const RunResult stopped = run_quietly(part);
    ASSERT_EQ(stopped.outcome, RunOutcome::kCompleted) << stopped.fault;
    EXPECT_EQ(stopped.checkpoint_step, stop);
    RunOptions rest = options_of(scene, second, steps, overrides);
    rest.resume = part.checkpoint;
    const RunResult resumed = run_quietly(rest);
    ASSERT_EQ(resumed.outcome, RunOutcome::kCompleted) << resumed.fault;
    EXPECT_EQ(resumed.report.steps(), steps);
    EXPECT_EQ(resumed.report.chain_hash(), whole.report.chain_hash());
    EXPECT_EQ(resumed.report.state_hash(), whole.report.state_hash());
    // the report counts from t = 0
    EXPECT_EQ(resumed.report.energy().initial(), whole.report.energy().initial());
    EXPECT_EQ(resumed.report.energy().final(), whole.report.energy().final());
    EXPECT_EQ(resumed.report.energy().max_relative_drift(), whole.report.energy().max_relative_drift());
    EXPECT_EQ(resumed.report.max_penetration(), whole.report.max_penetration());
    EXPECT_EQ(resumed.report.max_joint_error(), whole.report.max_joint_error());
    EXPECT_EQ(resumed.report.simulated_seconds(), whole.report.simulated_seconds());
    EXPECT_EQ(resumed.report.events().DebugString(), whole.report.events().DebugString());
    EXPECT_EQ(resumed.report.angular_momentum().DebugString(), whole.report.angular_momentum().DebugString());
  }
}

// A swap of step 50 is on probation up to step 57: whoever resumes within knows what a failure goes back to, and afterwards
// what a plugin that fails for good is replaced by.
TEST(ResumedSwap, IsRolledBackAsInTheRunThatNeverStopped) {
  const ScratchFolder folder;
  const auto options = [](std::uint32_t steps) {
    RunOptions options = options_of("two_spheres_motor", Hosting::kSharedMemory, steps);
    options.swaps = {"solver=Newton@step=50"};
    return options;
  };
  for (const std::uint32_t at : {55U, 57U, 58U}) {
    const std::string fault = "solver:kill@step=" + std::to_string(at);
    RunOptions whole = options(80);
    whole.faults = {fault};
    const RunResult expected = run_quietly(whole);
    ASSERT_EQ(expected.report.swaps_size(), 1);
    EXPECT_EQ(expected.report.swaps(0).outcome(), at < 58 ? "rolled back" : "committed");
    for (const std::uint32_t stop : {49U, 50U, 54U}) {
      RunOptions part = options(stop);
      part.checkpoint = folder.path("checkpoint");
      ASSERT_EQ(run_quietly(part).outcome, RunOutcome::kCompleted);
      RunOptions rest = options(80);
      rest.faults = {fault};
      rest.resume = part.checkpoint;
      const RunResult resumed = run_quietly(rest);
      ASSERT_EQ(resumed.outcome, RunOutcome::kCompleted) << resumed.fault;
      EXPECT_EQ(resumed.report.chain_hash(), expected.report.chain_hash()) << "kill at " << at << ", from " << stop;
      ASSERT_EQ(resumed.report.swaps_size(), 1);
      EXPECT_EQ(resumed.report.swaps(0).outcome(), expected.report.swaps(0).outcome());
    }
  }
}

// Its events were told before the checkpoint.
TEST(ResumedSwap, IsToldOnce) {
  const ScratchFolder folder;
  RunOptions part = options_of("two_spheres_motor", Hosting::kDirect, 60);
  part.swaps = {"solver=Newton@step=50"};
  part.checkpoint = folder.path("checkpoint");
  part.events = folder.path("events");
  part.event_kinds = {"swap"};
  ASSERT_EQ(run_quietly(part).outcome, RunOutcome::kCompleted);
  EXPECT_THAT(harness::read_file(part.events), HasSubstr("committed"));
  RunOptions rest = part;
  rest.checkpoint.clear();
  rest.resume = part.checkpoint;
  rest.steps = 80;
  rest.events = folder.path("more");
  ASSERT_EQ(run_quietly(rest).outcome, RunOutcome::kCompleted);
  EXPECT_EQ(harness::read_file(rest.events), "");
}

// To the plugin before it, which another swap had brought in, and not to the scene's.
TEST(ResumedSwap, GoesBackToTheSwapBefore) {
  const ScratchFolder folder;
  const auto options = [](std::uint32_t steps) {
    RunOptions options = options_of("bounce", Hosting::kSharedMemory, steps);
    options.swaps = {"integrator=Verlet@step=10", "integrator=RK4@step=50"};
    options.faults = {"integrator:kill@step=55"};
    return options;
  };
  const RunResult whole = run_quietly(options(80));
  RunOptions part = options(52);
  part.faults.clear();
  part.checkpoint = folder.path("checkpoint");
  ASSERT_EQ(run_quietly(part).outcome, RunOutcome::kCompleted);
  RunOptions rest = options(80);
  rest.resume = part.checkpoint;
  const RunResult resumed = run_quietly(rest);
  EXPECT_EQ(resumed.report.chain_hash(), whole.report.chain_hash());
  ASSERT_EQ(resumed.report.swaps_size(), 2);
  EXPECT_EQ(resumed.report.swaps(1).from(), "Verlet");
  EXPECT_EQ(resumed.report.swaps(1).outcome(), "rolled back");
}

// "before step 10: force BasicForce -> BasicForce, committed".
std::vector<std::string> told_swaps(const report::v1::Report& report) {
  std::vector<std::string> told;
  for (const report::v1::SwapRecord& one : report.swaps())
    told.push_back("before step " + std::to_string(one.step()) + ": " + one.slot() + " " + one.from() + " -> " +
                   one.to() + ", " + one.outcome());
  return told;
}

// Of slots with one plugin and with several, one after the other, rolled back and before an edit: those of a run that never
// stopped, once each.
TEST(ResumedSwap, IsReportedAsInTheRunThatNeverStopped) {
  const ScratchFolder folder;
  struct Story {
    std::string scene;
    std::vector<std::string> swaps, faults, edits;
  };
  for (const Story& story :
       {Story{kCallbacks, {"force=BasicForce@step=10", "force=Gravity@step=20", "force=BasicForce@step=45"}, {}, {}},
        Story{"two_spheres_motor",
              {"solver=Newton@step=10", "solver=Direct@step=22", "solver=Sequential@step=24", "solver=Newton@step=50"},
              {"solver:kill@step=26"},
              {}},
        Story{"two_spheres_motor", {"solver=Newton@step=10"}, {}, {"set Body.Ground.CanSleep=false@step=12"}}}) {
    RunOptions whole = options_of(story.scene, Hosting::kSharedMemory, 60);
    whole.swaps = story.swaps, whole.faults = story.faults, whole.edits = story.edits;
    const RunResult expected = run_quietly(whole);
    ASSERT_EQ(expected.outcome, RunOutcome::kCompleted) << expected.fault;
    ASSERT_EQ(told_swaps(expected.report).size(), story.swaps.size());
    for (const std::uint32_t stop : {9U, 15U, 25U, 40U}) {
      RunOptions part = whole;
      part.steps = stop;
      part.checkpoint = folder.path("checkpoint");
      ASSERT_EQ(run_quietly(part).outcome, RunOutcome::kCompleted);
      RunOptions rest = whole;
      rest.resume = part.checkpoint;
      // and once more, with what the second run has kept
      rest.steps = 55;
      rest.checkpoint = folder.path("next");
      ASSERT_EQ(run_quietly(rest).outcome, RunOutcome::kCompleted);
      rest = whole;
      rest.resume = folder.path("next");
      const RunResult resumed = run_quietly(rest);
      EXPECT_EQ(told_swaps(resumed.report), told_swaps(expected.report)) << story.scene << " from step " << stop;
      EXPECT_EQ(resumed.report.chain_hash(), expected.report.chain_hash()) << story.scene << " from step " << stop;
    }
  }
}

// The checkpoint that a paused run leaves knows of it, and so does the command that goes on.
TEST(ResumedSwap, OfAStepThatWasNotMadeIsMadeOnce) {
  const CurrentFolder here;
  const ScratchFolder folder;
  RunOptions options = options_of("two_spheres_motor", Hosting::kSharedMemory, 80);
  options.swaps = {"solver=Newton@step=50"};
  const RunResult whole = run_quietly(options);
  RunOptions part = options;
  part.checkpoint = folder.path("checkpoint");
  part.faults = {"integrator:kill@step=50,times=100"};
  const RunResult paused = run_quietly(part);
  ASSERT_EQ(paused.outcome, RunOutcome::kPaused);
  ASSERT_EQ(paused.report.steps(), 49U);
  options.resume = part.checkpoint;
  const RunResult resumed = run_quietly(options);
  EXPECT_EQ(resumed.report.chain_hash(), whole.report.chain_hash());
  ASSERT_EQ(resumed.report.swaps_size(), 1);
  EXPECT_EQ(resumed.report.swaps(0).outcome(), "committed");
}

// Nor is what a fallback took over in such a step, whether the checkpoint before is of the same state or not: it was told as a swap,
// from what had failed or from itself.
TEST(ResumedSwap, IsNoneOfAFallbackInAStepThatWasNotMade) {
  const CurrentFolder here;
  const ScratchFolder folder;
  const std::string scene = folder.write(
      "scene.gravitas", harness::read_file(harness::shipped_scene("two_spheres_motor")) +
                            "Plugins { Plugin { Slot = \"integrator\" Fallback = \"SemiImplicitEuler\" } }\n");
  RunOptions options = options_of(scene, Hosting::kSharedMemory, 80);
  RunOptions swapped = options;
  swapped.swaps = {"integrator=SemiImplicitEuler@step=50"};
  const RunResult whole = run_quietly(swapped);
  for (const std::uint32_t every : {1000U, 49U}) {
    RunOptions part = options;
    part.checkpoint = folder.path("checkpoint");
    part.checkpoint_every = every;
    part.faults = {"integrator:kill@step=50,times=100"};
    const RunResult paused = run_quietly(part);
    ASSERT_EQ(paused.outcome, RunOutcome::kPaused) << every;
    ASSERT_EQ(paused.report.steps(), 49U) << every;
    options.resume = part.checkpoint;
    const RunResult resumed = run_quietly(options);
    EXPECT_EQ(resumed.report.chain_hash(), whole.report.chain_hash()) << every;
    EXPECT_EQ(resumed.report.swaps_size(), 0) << every;
  }
}

// An instance of BasicVerlet or a solver's memory goes on, though the swap is made again.
TEST(ResumedSwap, KeepsTheStateOfThePluginThatCameIn) {
  const ScratchFolder folder;
  const auto options = [](std::uint32_t steps) {
    RunOptions options = options_of("pendulum", Hosting::kDirect, steps);
    options.swaps = {"integrator=BasicVerlet@step=20", "solver=Newton@step=24"};
    return options;
  };
  const RunResult whole = run_quietly(options(60));
  for (const std::uint32_t stop : {22U, 24U, 27U, 40U}) {
    RunOptions part = options(stop);
    part.checkpoint = folder.path("checkpoint");
    (void)run_quietly(part);
    RunOptions rest = options(60);
    rest.resume = part.checkpoint;
    EXPECT_EQ(run_quietly(rest).report.chain_hash(), whole.report.chain_hash()) << stop;
  }
}

// A run of the sample that ended at step 200 with checkpoints every 60 steps: the last one whose state is older than
// the journal's end stands for what a kill leaves.
class Killed : public ::testing::Test {
 protected:
  void SetUp() override {
    RunOptions options = options_of("two_spheres_motor", Hosting::kDirect, 120);
    options.checkpoint = path_;
    ASSERT_EQ(run_quietly(options).outcome, RunOutcome::kCompleted);
    const std::vector<std::byte> early = read_whole_file(path_);
    options = options_of("two_spheres_motor", Hosting::kDirect, 200);
    options.checkpoint = options.resume = path_;
    ASSERT_EQ(run_quietly(options).outcome, RunOutcome::kCompleted);
    replace_file(path_, early);
  }

  RunOptions go_on() const {
    RunOptions options = options_of("two_spheres_motor", Hosting::kDirect, 250);
    options.checkpoint = options.resume = path_;
    return options;
  }

  Hash run_identity() const {
    std::vector<std::string> warnings;
    return digest_of(identity_of(load(go_on(), &warnings)));
  }

  const ScratchFolder folder_;
  const std::string path_ = folder_.path("checkpoint"), journal_ = journal_of(path_);
};

TEST_F(Killed, TheStepsThatTheJournalKnowsAreComparedAndNotRepeatedInIt) {
  const JournalReading before = read_journal(read_whole_file(journal_), run_identity(), 120);
  ASSERT_EQ(before.commits.size(), 80U);
  const RunResult result = run_quietly(go_on());
  EXPECT_EQ(result.outcome, RunOutcome::kCompleted) << result.fault;
  EXPECT_EQ(result.report.chain_hash(),
            run_quietly(options_of("two_spheres_motor", Hosting::kDirect, 250)).report.chain_hash());
  const JournalReading after = read_journal(read_whole_file(journal_), run_identity(), 0);
  EXPECT_EQ(after.note, "");
  ASSERT_EQ(after.commits.size(), 250U);
  for (std::uint32_t i = 0; i < 250; ++i) EXPECT_EQ(after.commits[i].step, i + 1);
  EXPECT_EQ(after.commits.back().chain.text(), result.report.chain_hash());
}

TEST_F(Killed, AStepThatComesOutDifferentlyEndsTheRunAndKeepsTheCheckpoint) {
  // a journal of this very run that knows another chain at step 170
  JournalReading known = read_journal(read_whole_file(journal_), run_identity(), 0);
  {
    JournalWriter writer(journal_, run_identity(), {});
    for (JournalEntry& entry : known.commits) {
      if (entry.step == 170) entry.chain.low ^= 1;
      writer.append(entry);
    }
    writer.flush();
  }
  const std::vector<std::byte> checkpoint = read_whole_file(path_);
  RunOptions options = go_on();
  options.checkpoint.clear();
  const RunResult result = run_quietly(options);
  EXPECT_EQ(result.outcome, RunOutcome::kFailed);
  EXPECT_THAT(result.fault, HasSubstr("step 170 came out differently"));
  EXPECT_THAT(result.fault, HasSubstr(known.commits[169].chain.text()));
  EXPECT_THAT(result.fault, HasSubstr(result.report.chain_hash()));
  EXPECT_EQ(result.report.outcome(), "failed");
  EXPECT_EQ(read_whole_file(path_), checkpoint);
}

TEST_F(Killed, ATornJournalIsUsedAsFarAsItGoes) {
  std::vector<std::byte> bytes = read_whole_file(journal_);
  bytes.resize(bytes.size() - 500);
  replace_file(journal_, bytes);
  const RunResult result = run_quietly(go_on());
  EXPECT_EQ(result.outcome, RunOutcome::kCompleted) << result.fault;
  EXPECT_THAT(result.report.warnings(), ::testing::Contains(HasSubstr("are no whole record")));
  EXPECT_EQ(read_journal(read_whole_file(journal_), run_identity(), 0).commits.size(), 250U);
}

// By whatever name the checkpoint is known: over a symbolic link, or spelt otherwise.
TEST_F(Killed, TheJournalIsThatOfTheFileItself) {
  const std::string link = folder_.path("latest");
  std::filesystem::create_symlink("checkpoint", link);
  const std::string spelt = folder_.path("./checkpoint");
  const std::vector<std::byte> checkpoint = read_whole_file(path_), journal = read_whole_file(journal_);
  for (const auto& [resume, target] : {std::pair{link, link}, {path_, spelt}, {spelt, path_}, {link, path_}}) {
    replace_file(path_, checkpoint);
    replace_file(journal_, journal);
    RunOptions options = go_on();
    options.resume = resume;
    options.checkpoint = target;
    const RunResult result = run_quietly(options);
    EXPECT_EQ(result.outcome, RunOutcome::kCompleted) << result.fault;
    EXPECT_EQ(read_journal(read_whole_file(journal_), run_identity(), 0).commits.size(), 250U) << resume << target;
  }
}

TEST_F(Killed, AForeignJournalIsLeftAsideWithAWarning) {
  std::ofstream(journal_) << "something else, long enough to be a header of a journal that it is not";
  const RunResult result = run_quietly(go_on());
  EXPECT_EQ(result.outcome, RunOutcome::kCompleted) << result.fault;
  EXPECT_THAT(result.report.warnings(), ::testing::Contains(HasSubstr("not a journal that this build reads")));
}

TEST_F(Killed, AtItsEndARunIsDoneAtOnce) {
  RunOptions options = options_of("two_spheres_motor", Hosting::kDirect, 120);
  options.resume = path_;
  const RunResult result = run_quietly(options);
  EXPECT_EQ(result.outcome, RunOutcome::kCompleted);
  EXPECT_EQ(result.report.steps(), 120U);
  EXPECT_EQ(result.report.microseconds_per_step().max(), 0.0);
  EXPECT_EQ(result.report.chain_hash(),
            run_quietly(options_of("two_spheres_motor", Hosting::kDirect, 120)).report.chain_hash());
}

TEST_F(Killed, ATrajectoryBeginsWithTheResumedState) {
  RunOptions options = go_on();
  options.trajectory = folder_.path("motion.csv");
  ASSERT_EQ(run_quietly(options).outcome, RunOutcome::kCompleted);
  std::istringstream text(harness::read_file(options.trajectory));
  std::string header, first;
  std::getline(text, header), std::getline(text, first);
  EXPECT_EQ(std::stod(first), 120 * (1.0 / 60.0));
}

TEST(Recorder, AShortenedLastStepReplacesNoCheckpointThatGoesFurther) {
  const ScratchFolder folder;
  RunOptions options = options_of("two_spheres_motor", Hosting::kDirect, 0);
  options.steps.reset();
  options.duration = 100.4 / 60.0;
  options.checkpoint = folder.path("checkpoint");
  options.checkpoint_every = 10;
  const RunResult result = run_quietly(options);
  EXPECT_EQ(result.report.steps(), 101U);
  EXPECT_EQ(result.checkpoint_step, 100U);
  RunOptions further = options_of("two_spheres_motor", Hosting::kDirect, 150);
  further.resume = options.checkpoint;
  EXPECT_EQ(run_quietly(further).report.chain_hash(),
            run_quietly(options_of("two_spheres_motor", Hosting::kDirect, 150)).report.chain_hash());
}

// A limit on the size of files stands for a disk that fills up: set after a step, lifted at the end.
class FullDisk : public ::testing::Test {
 protected:
  FullDisk() : handler_(signal(SIGXFSZ, SIG_IGN)) { getrlimit(RLIMIT_FSIZE, &before_); }
  ~FullDisk() override {
    setrlimit(RLIMIT_FSIZE, &before_);
    signal(SIGXFSZ, handler_);
  }

  // Runs a pile with a checkpoint every 50 steps, and files limited to `size` bytes from step 60 on.
  RunResult run_into_limit(rlim_t size) {
    RunOptions options = options_of(kPile, Hosting::kDirect, 120);
    options.checkpoint = path_;
    options.checkpoint_every = 50;
    RunResult result = run(
        options, [] { return false; },
        [&](const Progress& now) {
          const rlimit small = {size, before_.rlim_max};
          if (now.step == 60) setrlimit(RLIMIT_FSIZE, &small);
        });
    setrlimit(RLIMIT_FSIZE, &before_);
    return result;
  }

  void expect_the_checkpoint_of_step_50_resumes() const {
    RunOptions rest = options_of(kPile, Hosting::kDirect, 120);
    rest.resume = path_;
    const RunResult result = run_quietly(rest);
    EXPECT_EQ(result.outcome, RunOutcome::kCompleted) << result.fault;
    EXPECT_EQ(result.report.chain_hash(), run_quietly(options_of(kPile, Hosting::kDirect, 120)).report.chain_hash());
  }

  const ScratchFolder folder_;
  const std::string path_ = folder_.path("checkpoint");

 private:
  rlimit before_ = {};
  sighandler_t handler_;
};

TEST_F(FullDisk, UnderACheckpointStopsTheRunAtThatCommitAndKeepsTheOneBefore) {
  // between the journal of a hundred steps, 3640 bytes, and a checkpoint of thirty bodies
  constexpr rlim_t kLimit = 5000;
  const RunResult result = run_into_limit(kLimit);
  ASSERT_GT(read_whole_file(path_).size(), kLimit);
  EXPECT_EQ(result.outcome, RunOutcome::kFailed);
  EXPECT_EQ(result.report.steps(), 100U);
  EXPECT_EQ(result.fault, "checkpoint '" + path_ + "': File too large");
  EXPECT_EQ(result.checkpoint, path_);
  EXPECT_EQ(result.checkpoint_step, 50U);
  expect_the_checkpoint_of_step_50_resumes();
}

TEST_F(FullDisk, UnderTheJournalStopsTheRunAndKeepsTheCheckpoint) {
  const RunResult result = run_into_limit(1000);
  EXPECT_EQ(result.outcome, RunOutcome::kFailed);
  EXPECT_THAT(result.fault, HasSubstr("journal '" + journal_of(path_) + "': File too large"));
  EXPECT_GE(result.report.steps(), 60U);
  EXPECT_LE(result.report.steps(), 100U);
  expect_the_checkpoint_of_step_50_resumes();
}

TEST(Recorder, ARunWithoutCheckpointsWritesNoFile) {
  const ScratchFolder folder;
  const RunResult result = run_quietly(options_of("bounce", Hosting::kDirect, 10));
  EXPECT_EQ(result.checkpoint, "");
}

// Goes on from options.checkpoint, which a run to its steps leaves, with another build of a library; name and version are those of
// before.
RunResult with_another_build(const std::string& library, RunOptions options) {
  EXPECT_EQ(run_quietly(options).outcome, RunOutcome::kCompleted);
  options.resume = std::exchange(options.checkpoint, "");
  options.steps = 60;
  EXPECT_THAT(run_quietly(options).report.warnings(), Not(Contains(HasSubstr("built anew"))));
  // what stands behind an ELF file's sections changes nothing but the file
  std::ofstream(library, std::ios::app) << "another build";
  return run_quietly(options);
}

TEST(ResumedRun, ALibraryThatWasBuiltAnewIsTold) {
  const ScratchFolder folder;
  const std::string library = folder.path("mine.so");
  std::filesystem::copy_file(in_build("/lib/gravitas/integrator_verlet.so"), library);
  const std::string plugins =
      folder.write("plugins.gravitas", "Plugins { Plugin { Slot = \"integrator\" Library = \"" + library + "\" } }");
  RunOptions options = options_of("bounce", Hosting::kSharedMemory, 40, {"Integrator=Verlet"});
  options.scenes.push_back(plugins);
  options.checkpoint = folder.path("kept");
  const RunResult result = with_another_build(library, options);
  EXPECT_EQ(result.outcome, RunOutcome::kCompleted) << result.fault;
  EXPECT_THAT(result.report.warnings(),
              Contains(HasSubstr("plugin Verlet: '" + library + "' was built anew since the checkpoint")));
}

// The same of one that was swapped in.
TEST(ResumedRun, ALibraryThatWasSwappedInAndBuiltAnewIsTold) {
  const ScratchFolder folder;
  const std::string library = folder.path("mine.so");
  std::filesystem::copy_file(in_build("/lib/gravitas/integrator_verlet.so"), library);
  RunOptions options = options_of("bounce", Hosting::kSharedMemory, 40);
  options.swaps = {"integrator=" + library + "@step=20"};
  options.checkpoint = folder.path("kept");
  EXPECT_THAT(with_another_build(library, options).report.warnings(),
              Contains(HasSubstr("was built anew since the checkpoint")));
}

}  // namespace
}  // namespace gravitas
