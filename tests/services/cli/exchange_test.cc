// Faults, swaps and comparisons from the command line: the report tells the story, and the bits are those of the quiet
// run.
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <signal.h>
#include <unistd.h>

#include <algorithm>
#include <cstdio>
#include <filesystem>
#include <string>
#include <vector>

#include "tests/paths.h"
#include "tests/services/cli/program.h"

namespace gravitas {
namespace {

using harness::ProgramResult;
using harness::read_file;
using harness::read_report;
using harness::run_program;
using harness::ScratchFolder;
using ::testing::Contains;
using ::testing::ContainsRegex;
using ::testing::HasSubstr;

struct Outcome {
  ProgramResult program;
  report::v1::Report report;
};

Outcome run_sample(std::vector<std::string> words) {
  const ScratchFolder folder;
  words.insert(words.begin(), {"run", kSample, "--steps", "120", "--report", folder.path("report.json")});
  Outcome outcome{run_program(words, folder), {}};
  if (outcome.program.exit_code == 0) outcome.report = read_report(read_file(folder.path("report.json")));
  return outcome;
}

const std::string& quiet_chain() {
  static const std::string chain = run_sample({}).report.chain_hash();
  return chain;
}

TEST(Exchange, AFaultInEverySlotIsSurvivedBitForBit) {
  const Outcome run =
      run_sample({"--fault", "solver:kill@step=10", "--fault", "integrator:segv@step=20", "--fault",
                  "integrator:nan@step=30", "--fault", "space:flip@step=40", "--fault", "constraint:exit@step=50"});
  ASSERT_EQ(run.program.exit_code, 0) << run.program.err;
  EXPECT_EQ(run.report.chain_hash(), quiet_chain());
  ASSERT_EQ(run.report.faults_size(), 5);
  for (int i = 0; i < 5; ++i) {
    EXPECT_EQ(run.report.faults(i).step(), 10U * static_cast<unsigned>(i + 1));
    EXPECT_GT(run.report.faults(i).recovery_us(), 0.0);
  }
  EXPECT_EQ(run.report.faults(1).slot(), "integrator");
  EXPECT_EQ(run.report.faults(1).kind(), "segv");
  EXPECT_EQ(run.report.faults(1).detected_by(), "pidfd");
  EXPECT_EQ(run.report.faults(2).kind(), "nan");
  EXPECT_EQ(run.report.faults(2).detected_by(), "numbers");
  EXPECT_THAT(run.program.out, HasSubstr("survived: step 10, solver Sequential: kill; standby"));
}

TEST(Exchange, AFaultThatCannotBeInjectedIsToldAsThat) {
  const Outcome run = run_sample({"--fault", "solver:nan@step=5,row=99999"});
  ASSERT_EQ(run.program.exit_code, 0) << run.program.err;
  EXPECT_THAT(run.program.err, HasSubstr("worker of slot solver: fault nan of step 5 was not injected: column "));
  // nor does it cost a worker
  EXPECT_EQ(run.report.faults_size(), 0);
  EXPECT_EQ(run.report.chain_hash(), quiet_chain());
}

// They were hundreds, and hid all others.
TEST(Exchange, LinesOfAFloodAreOneWarningWithTheirCount) {
  const Outcome run = run_sample({"--fault", "solver:flood,bytes=1e6@step=5"});
  ASSERT_EQ(run.program.exit_code, 0) << run.program.err;
  EXPECT_EQ(run.report.chain_hash(), quiet_chain());
  // beside those of slow calls, which a busy machine makes of any
  const auto is_no_slow_call = [](const std::string& one) { return one.find(": it was slow ") == std::string::npos; };
  EXPECT_LT(std::ranges::count_if(run.report.warnings(), is_no_slow_call), 5);
  EXPECT_THAT(run.report.warnings(),
              Contains(ContainsRegex("^worker of slot solver: stdout: \\.{79} \\([0-9]+ times\\)$")));
  EXPECT_THAT(run.report.warnings(), Contains(HasSubstr(" more bytes dropped")));
}

TEST(Exchange, ASwapToTheSamePluginOrAnotherHostingChangesNoBit) {
  const Outcome run = run_sample({"--swap", "solver=Sequential@step=10", "--swap", "collision=Standard@step=20",
                                  "--swap", "solver=Sequential@step=60,hosting=direct"});
  ASSERT_EQ(run.program.exit_code, 0) << run.program.err;
  EXPECT_EQ(run.report.chain_hash(), quiet_chain());
  ASSERT_EQ(run.report.swaps_size(), 3);
  EXPECT_EQ(run.report.swaps(0).step(), 10U);
  EXPECT_EQ(run.report.swaps(0).slot(), "solver");
  EXPECT_EQ(run.report.swaps(2).to(), "Sequential (direct)");
  for (const report::v1::SwapRecord& swap : run.report.swaps()) {
    EXPECT_EQ(swap.outcome(), "committed");
    EXPECT_GT(swap.pause_us(), 0.0);
  }
}

TEST(Exchange, ASwapToAnotherPluginLosesNoStep) {
  const Outcome run = run_sample({"--swap", "integrator=SemiImplicitEuler@step=60"});
  ASSERT_EQ(run.program.exit_code, 0) << run.program.err;
  EXPECT_EQ(run.report.steps(), 120U);
  EXPECT_NE(run.report.chain_hash(), quiet_chain());
  EXPECT_EQ(run.report.swaps(0).from(), "Euler");
  // after the swap the run is that of the other plugin, not a mixture
  EXPECT_EQ(run.report.chain_hash(),
            run_sample({"--swap", "integrator=SemiImplicitEuler@step=60", "--hosting", "direct"}).report.chain_hash());
}

TEST(Exchange, ComparisonAndRerunChangeNoBit) {
  const Outcome run = run_sample({"--compare", "integrator=SemiImplicitEuler", "--rerun", "solver=10"});
  ASSERT_EQ(run.program.exit_code, 0) << run.program.err;
  EXPECT_EQ(run.report.chain_hash(), quiet_chain());
  ASSERT_EQ(run.report.comparisons_size(), 1);
  EXPECT_EQ(run.report.comparisons(0).shadow().calls(), 120U);
  EXPECT_GT(run.report.comparisons(0).shadow().disagreements_size(), 0);
  EXPECT_EQ(run.report.comparisons(0).shadow().disagreements(0).quantity(), "Integrator.Integrate position");
}

// Whoever kills a worker while it starts says nothing about its plugin: the scene is as good as it was.
TEST(Exchange, AWorkerThatIsKilledWhileItStartsIsStartedOnceMore) {
  const ScratchFolder folder;
  const std::string worker = folder.write("worker.sh",
                                          "[ \"$1\" = --describe ] && start=describe || start=$(cat start)\n"
                                          "[ -e killed.$start ] || { touch killed.$start; kill -9 $$; }\n"
                                          "exec " +
                                              in_shell(in_build("/bin/gravitas-worker")) + " \"$@\" " +
                                              in_shell(in_build("/lib/gravitas/solver_sequential.so")) + "\n");
  const std::string plugins =
      folder.write("plugins.gravitas", "Plugins { Plugin { Slot = \"solver\" Command = \"sh worker.sh\" } }");
  folder.write("start", "run");
  const std::vector<std::string> run = {"run", kSample, plugins, "--steps", "20", "--no-sandbox", "--json"};
  const ProgramResult first = run_program(run, folder);
  ASSERT_EQ(first.exit_code, 0) << first.err;
  EXPECT_TRUE(std::filesystem::exists(folder.path("killed.describe")));
  EXPECT_TRUE(std::filesystem::exists(folder.path("killed.run")));
  EXPECT_EQ(read_report(first.out).chain_hash(), read_report(run_program(run, folder).out).chain_hash());
}

// With Smooth joints answer inside the derivative: what breaks them, and what is told of them, is the derivative of the plugin
// that answers, not of the one that is compared.
TEST(Exchange, AComparedIntegratorAsksJointsWithoutATrace) {
  const ScratchFolder folder;
  const std::string scene = folder.write("pendulum.gravitas", R"(
Forces { Force { Type = "Gravity" Id = "Down" CustomProperties { Acceleration = {0, -9.81, 0} } } }
Simulator { Type = "Smooth" CustomProperties { TimeStep = 0.02 Duration = 0.4 } }
Environment {
  Space { Bodies { Body { Id = "Bar" Mass = 1 PrincipalMoments = {0.002, 0.08, 0.08} Forces = {"Down"}
    KineticProperties { Position = {0.5, 0, 0} } } } }
  Constraints { Constraint { Type = "Revolute" Id = "Hinge" Body2 = "Bar"
    CustomProperties { BindAxisPoint1 = {0, 0, 0} BindAxisPoint2 = {0, 0, 1} } } }
  KineticIntegrator = "RK4"
  ConstraintSolver = "Direct"
}
)");
  const auto run = [&](const std::string& force, const std::vector<std::string>& more) {
    const std::string reactions = folder.path("reactions.jsonl");
    std::vector<std::string> words = {
        "run",         scene,    "--hosting", "direct", "--json", "--set", "Constraint.Hinge.BreakingForce=" + force,
        "--reactions", reactions};
    words.insert(words.end(), more.begin(), more.end());
    const ProgramResult result = run_program(words, folder);
    EXPECT_EQ(result.exit_code, 0) << result.err;
    return read_report(result.out).chain_hash() + '\n' + read_file(reactions);
  };
  for (const std::string force : {"2.64", "3.31", "5.70593", "11", "15.8", "1000"})
    EXPECT_EQ(run(force, {}), run(force, {"--compare", "integrator=Euler"})) << force;
}

// A resumed run knows who answered, and that a swap of the past is done.
TEST(Exchange, AResumedRunGoesOnWithWhoeverAnswered) {
  const ScratchFolder folder;
  const std::string kept = folder.path("kept"), report = folder.path("report.json");
  const std::vector<std::string> swap = {"--swap", "integrator=SemiImplicitEuler@step=60"};
  const auto go = [&](std::vector<std::string> words) {
    words.insert(words.begin(), {"run", kSample, "--quiet", "--report", report});
    words.insert(words.end(), swap.begin(), swap.end());
    const ProgramResult result = run_program(words, folder);
    EXPECT_EQ(result.exit_code, 0) << result.err;
    return read_report(read_file(report)).chain_hash();
  };
  const std::string whole = go({"--steps", "120"});
  for (const char* steps : {"40", "59", "60", "90"}) {
    go({"--steps", steps, "--checkpoint", kept});
    EXPECT_EQ(go({"--steps", "120", "--resume", kept}), whole) << steps;
    EXPECT_EQ(go({"--steps", "120", "--resume", kept, "--hosting", "direct"}), whole) << steps;
  }
}

// Swaps before the checkpoint that it does not know are told, also where it knows others of the slot.
TEST(Exchange, AResumedRunTellsSwapsThatItsCheckpointDoesNotKnow) {
  const ScratchFolder folder;
  const std::string kept = folder.path("kept"), report = folder.path("report.json");
  const auto unknown = [&](const std::vector<std::string>& swaps) {
    std::vector<std::string> words = {"run", kSample, "--hosting", "direct", "--report", report};
    if (std::filesystem::exists(kept))
      words.insert(words.end(), {"--steps", "40", "--resume", kept});
    else
      words.insert(words.end(), {"--steps", "30", "--checkpoint", kept});
    for (const std::string& swap : swaps) words.insert(words.end(), {"--swap", swap});
    EXPECT_EQ(run_program(words, folder).exit_code, 0);
    std::vector<std::string> told;
    const report::v1::Report resumed = read_report(read_file(report));
    for (const std::string& warning : resumed.warnings())
      if (warning.find("knows of none there") != std::string::npos)
        told.push_back(warning.substr(0, warning.find(':')));
    return told;
  };
  const std::vector<std::string> ordered = {"solver=Newton@step=10", "solver=Direct@step=12",
                                            "solver=Sequential@step=20"};
  EXPECT_THAT(unknown(ordered), ::testing::IsEmpty());
  EXPECT_THAT(unknown(ordered), ::testing::IsEmpty());
  EXPECT_THAT(unknown({"solver=Direct@step=10", "solver=Newton@step=15", "integrator=RK4@step=30"}),
              ::testing::ElementsAre("--swap solver=Direct at step 10", "--swap solver=Newton at step 15",
                                     "--swap integrator=RK4 at step 30"));
}

// Nobody asked for a checkpoint; what a pause leaves knows it all the same.
TEST(Exchange, APauseRemembersWhoAnswered) {
  const ScratchFolder folder;
  const std::string report = folder.path("report.json");
  const auto go = [&](std::vector<std::string> words, int code) {
    words.insert(words.begin(), {"run", kSample, "--quiet", "--steps", "120", "--report", report});
    const ProgramResult result = run_program(words, folder);
    EXPECT_EQ(result.exit_code, code) << result.err;
    return read_report(read_file(report)).chain_hash();
  };
  const std::string whole = go({"--swap", "integrator=SemiImplicitEuler@step=40"}, 0);
  const std::string journal = folder.write("two_spheres_motor.paused.checkpoint.journal", "of another run");
  go({"--swap", "integrator=SemiImplicitEuler@step=40", "--fault", "solver:kill@step=80,times=100"}, 3);
  EXPECT_FALSE(std::filesystem::exists(journal));
  EXPECT_EQ(go({"--resume", folder.path("two_spheres_motor.paused.checkpoint")}, 0), whole);
}

TEST(Exchange, ASlowWorkerIsFlaggedAndChangesNoBit) {
  const Outcome run = run_sample({"--fault", "solver:slow,seconds=0.1@step=50"});
  ASSERT_EQ(run.program.exit_code, 0) << run.program.err;
  EXPECT_EQ(run.report.chain_hash(), quiet_chain());
  EXPECT_EQ(run.report.faults_size(), 0);
  EXPECT_THAT(run.program.err, HasSubstr("worker of slot solver: it was slow"));
}

// Far less than what is told of calls that nobody ordered to be slow.
TEST(Exchange, SlownessThatWasOrderedIsFlaggedHoweverLittleItIs) {
  const Outcome run =
      run_sample({"--fault", "solver:slow,factor=2@step=50", "--fault", "integrator:jitter,seconds=0.001@step=60"});
  ASSERT_EQ(run.program.exit_code, 0) << run.program.err;
  EXPECT_EQ(run.report.chain_hash(), quiet_chain());
  EXPECT_THAT(
      run.report.warnings(),
      Contains(HasSubstr("worker of slot solver: it was slow by fault slow,factor=2 of step 50: the call took ")));
  EXPECT_THAT(run.report.warnings(),
              Contains(HasSubstr("slot integrator: it was slow by fault jitter,seconds=0.001 of")));
}

TEST(Exchange, TheReportSaysWhatIsEnforcedOnEveryWorker) {
  const Outcome run = run_sample({});
  for (const report::v1::PlannedSlot& slot : run.report.plan().slots()) {
    EXPECT_GT(slot.sandbox_size(), 2) << slot.slot();
    EXPECT_EQ(slot.standby(), 1U);
    EXPECT_FALSE(slot.attached());
  }
  const Outcome open = run_sample({"--no-sandbox"});
  EXPECT_EQ(open.report.plan().slots(0).sandbox_size(), 0);
}

// The solver of the sample as a worker of somebody's own.
class OwnWorker {
 public:
  OwnWorker() {
    const std::string command = in_shell(in_build("/bin/gravitas-worker")) + " --listen " + address_ + " " +
                                in_shell(in_build("/lib/gravitas/solver_sequential.so")) + " >/dev/null 2>&1 & echo $!";
    FILE* const shell = popen(command.c_str(), "r");
    EXPECT_EQ(fscanf(shell, "%d", &process_), 1);
    pclose(shell);
    for (int i = 0; i < 500 && access(folder_.path("worker").c_str(), F_OK) != 0; ++i) usleep(10'000);
  }
  ~OwnWorker() {
    if (process_ > 0) kill(process_, SIGKILL);
  }
  OwnWorker(const OwnWorker&) = delete;
  OwnWorker& operator=(const OwnWorker&) = delete;

  std::string solver() const { return "solver=" + address_; }

 private:
  const ScratchFolder folder_;
  const std::string address_ = "unix:" + folder_.path("worker");
  int process_ = 0;
};

// It serves one kernel at a time, and goes on with the edited scene.
TEST(Exchange, AnAttachedWorkerAnswersAfterAnEdit) {
  std::vector<std::string> words = {"--edit", "set Body.Ground.CanSleep=false@step=30", "--edit",
                                    "set Body.Ground.CanSleep=true@step=40"};
  const Outcome expected = run_sample(words);
  ASSERT_EQ(expected.program.exit_code, 0) << expected.program.err;
  const OwnWorker worker;
  words.insert(words.end(), {"--attach", worker.solver()});
  const Outcome run = run_sample(words);
  ASSERT_EQ(run.program.exit_code, 0) << run.program.err;
  EXPECT_EQ(run.report.chain_hash(), expected.report.chain_hash());
  EXPECT_EQ(run.report.faults_size(), 0);
}

// A worker of somebody's own, stopped for longer than any deadline.
TEST(Exchange, AnAttachedWorkerHasNoDeadline) {
  const OwnWorker worker;
  const Outcome run = run_sample({"--attach", worker.solver(), "--fault", "solver:slow,seconds=3@step=50"});
  ASSERT_EQ(run.program.exit_code, 0) << run.program.err;
  EXPECT_EQ(run.report.chain_hash(), quiet_chain());
  EXPECT_EQ(run.report.faults_size(), 0);
  int attached = 0;
  for (const report::v1::PlannedSlot& slot : run.report.plan().slots()) attached += slot.attached() ? 1 : 0;
  EXPECT_EQ(attached, 1);
}

TEST(Exchange, WhatCannotBeIsRefusedWithWhatIsAllowed) {
  const auto refusal = [](std::vector<std::string> words) {
    const Outcome run = run_sample(std::move(words));
    EXPECT_EQ(run.program.exit_code, 2);
    return run.program.err;
  };
  EXPECT_THAT(refusal({"--swap", "solver=Sequentail@step=5"}), HasSubstr("did you mean \"Sequential\"?"));
  EXPECT_THAT(refusal({"--swap", "solver=Sequential"}), HasSubstr("SLOT=PLUGIN@step=N"));
  EXPECT_THAT(refusal({"--swap", "solver=Sequential@step=0"}), HasSubstr("a whole number from 1"));
  EXPECT_THAT(refusal({"--swap", "sovler=Sequential@step=5"}), HasSubstr("unknown slot 'sovler'; allowed: space"));
  EXPECT_THAT(refusal({"--swap", "force=Gravity@step=5"}), HasSubstr("the plan leaves the slot out"));
  EXPECT_THAT(refusal({"--fault", "force:kill@step=5"}), HasSubstr("the plan leaves the slot out"));
  EXPECT_THAT(refusal({"--fault", "solver:kill@step=5", "--hosting", "direct"}), HasSubstr("direct"));
  EXPECT_THAT(refusal({"--fault", "solver:kil@step=5"}), HasSubstr("kill"));
  EXPECT_THAT(refusal({"--compare", "solver=Euler"}), HasSubstr("no solver plugin 'Euler' is installed"));
  EXPECT_THAT(refusal({"--rerun", "solver"}), HasSubstr("SLOT=N"));
  EXPECT_THAT(refusal({"--rerun", "force=10"}),
              HasSubstr("--rerun force=10: the plan leaves the slot out: all forces"));
  EXPECT_THAT(refusal({"--attach", "solver=10.0.0.1:1"}), HasSubstr("a worker of this machine"));
}

// Nothing was compared with who failed or was refused, and silence would read like agreement.
TEST(Exchange, AComparisonThatEndsIsToldWithItsReason) {
  const Outcome failed =
      run_sample({"--compare", "integrator=" + in_build("/lib/gravitas-faulty/integrator_throws.so")});
  ASSERT_EQ(failed.program.exit_code, 0) << failed.program.err;
  EXPECT_EQ(failed.report.chain_hash(), quiet_chain());
  EXPECT_THAT(failed.program.out, HasSubstr("compared: integrator Euler with Faulty: "));
  EXPECT_THAT(failed.program.out, HasSubstr("; it ended: in shadow: it failed: "));
}

// Ordered faults are known; what a plugin says itself is not.
TEST(Exchange, TheSummaryHasTheWordsOfAPluginThatFailed) {
  const ScratchFolder folder;
  const std::string plugins =
      folder.write("plugins.gravitas", "Plugins { Plugin { Slot = \"integrator\" Failures = 100 Library = \"" +
                                           in_build("/lib/gravitas-faulty/integrator_throws.so") + "\" } }");
  const ProgramResult result =
      run_program({"run", kSample, plugins, "--set", "Integrator=Faulty", "--steps", "5"}, folder);
  EXPECT_EQ(result.exit_code, 0) << result.err;
  EXPECT_THAT(result.out, HasSubstr("survived: step 3, integrator Faulty: failure (it failed: "));
}

// Hosted direct a plugin that ends its process ends this program: never with the exit code of work that is done.
TEST(Exchange, APluginThatCallsExitEndsNoRunAsDone) {
  const ScratchFolder folder;
  for (const std::string name : {"integrator_calls_exit", "integrator_exits_in_a_thread"}) {
    const std::string library = in_build("/lib/gravitas-faulty/") + name + ".so";
    const std::string plugins =
        folder.write("plugins.gravitas", "Plugins { Plugin { Slot = \"integrator\" Library = \"" + library + "\" } }");
    for (const std::vector<std::string>& words :
         {std::vector<std::string>{"run", kSample, plugins, "--set", "Integrator=Faulty", "--hosting", "direct"},
          {"run", kSample, "--swap", "integrator=" + library + "@step=20,hosting=direct"},
          {"run", kSample, "--compare", "integrator=" + library + ",hosting=direct"},
          {"serve", kSample, plugins, "--set", "Integrator=Faulty", "--headless", "--hosting", "direct"},
          {"capture", kSample, plugins, "--set", "Integrator=Faulty", "--hosting", "direct", "--slot", "integrator",
           "--out", folder.path("capsule")}}) {
      const ProgramResult result = run_program(words, folder);
      EXPECT_EQ(result.exit_code, 1) << words[0] << result.err;
      EXPECT_THAT(result.err, HasSubstr("gravitas: plugin Faulty called exit()")) << words[0] << name;
    }
    // a worker is replaced
    const ProgramResult worker = run_program(
        {"run", kSample, plugins, "--set", "Integrator=Faulty", "--steps", "3", "--hosting", "shm"}, folder);
    EXPECT_EQ(worker.exit_code, 0) << worker.err;
    EXPECT_THAT(worker.out, HasSubstr("survived: step 3, integrator Faulty: death"));
  }
}

}  // namespace
}  // namespace gravitas
