// `gravitas run` from outside: what it prints, what it writes, how it ends.
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <signal.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <fstream>
#include <set>
#include <sstream>

#include "gravitas/report/v1/report.pb.h"
#include "tests/paths.h"
#include "tests/services/cli/program.h"

namespace gravitas {
namespace {

using harness::ProgramResult;
using harness::read_file;
using harness::read_report;
using harness::run_program;
using harness::ScratchFolder;
using harness::shipped_scene;
using ::testing::HasSubstr;
using ::testing::StartsWith;

std::vector<std::vector<std::string>> read_csv(const std::string& path) {
  std::vector<std::vector<std::string>> rows;
  std::istringstream text(read_file(path));
  for (std::string line; std::getline(text, line);) {
    std::vector<std::string>& row = rows.emplace_back();
    std::istringstream cells(line);
    for (std::string cell; std::getline(cells, cell, ',');) row.push_back(cell);
  }
  return rows;
}

TEST(Run, TheSampleTellsItsStoryWithEverySlotInAProcessOfItsOwn) {
  const ScratchFolder folder;
  const ProgramResult result = run_program({"run", kSample, "--report", folder.path("report.json")}, folder);
  ASSERT_EQ(result.exit_code, 0) << result.err;
  EXPECT_THAT(result.out, HasSubstr("Ball01 met Ground"));
  EXPECT_THAT(result.out, HasSubstr("Ball02 met Ground"));
  EXPECT_THAT(result.out, HasSubstr("MyAngularMotor turns at 3.1412 rad/s"));
  EXPECT_THAT(result.err, HasSubstr("MassDensity 0"));

  const report::v1::Report report = read_report(read_file(folder.path("report.json")));
  EXPECT_EQ(report.steps(), 600U);
  EXPECT_EQ(report.bodies(), 3U);
  EXPECT_EQ(report.outcome(), "completed");
  // a busy machine's slow answers are warnings, too
  EXPECT_EQ(std::ranges::count_if(report.warnings(),
                                  [](const std::string& one) { return one.find("slow") == std::string::npos; }),
            2);
  ASSERT_EQ(report.plan().slots_size(), 5);
  std::set<int> processes;
  for (const report::v1::PlannedSlot& slot : report.plan().slots()) {
    EXPECT_EQ(slot.hosting(), "shm");
    processes.insert(slot.pid());
  }
  EXPECT_EQ(processes.size(), 5U);
  EXPECT_NEAR(report.drives(0).speed(), 3.1412, 1e-6);
  EXPECT_GE(report.events().collision_start(), 2U);
  EXPECT_EQ(report.events().break_(), 0U);
}

TEST(Run, TheReportHasTheKeysThatScriptsReadAndNoOthersAreMissing) {
  const ScratchFolder folder;
  const ProgramResult result = run_program({"run", kSample, "--steps", "3", "--hosting", "direct", "--json"}, folder);
  ASSERT_EQ(result.exit_code, 0) << result.err;
  for (const char* key : {"scene",
                          "simulated_seconds",
                          "steps",
                          "bodies",
                          "wall_seconds",
                          "microseconds_per_step",
                          "mean",
                          "median",
                          "p99",
                          "max",
                          "energy",
                          "initial",
                          "final",
                          "max_relative_drift",
                          "linear_momentum",
                          "angular_momentum",
                          "max_penetration",
                          "max_joint_error",
                          "state_hash",
                          "chain_hash",
                          "plan",
                          "slots",
                          "slot",
                          "plugin",
                          "hosting",
                          "pid",
                          "left_out",
                          "what",
                          "why",
                          "stages",
                          "stage",
                          "calls",
                          "median_us",
                          "p99_us",
                          "transport_median_us",
                          "faults",
                          "swaps",
                          "events",
                          "collision_start",
                          "collision_end",
                          "sleep",
                          "wake",
                          "break",
                          "warnings"})
    EXPECT_THAT(result.out, HasSubstr("\"" + std::string(key) + "\":")) << key;
}

TEST(Run, HostingAndThreadsChangeNoBit) {
  const ScratchFolder folder;
  const auto hash = [&](std::vector<std::string> options) {
    options.insert(options.begin(), {"run", kSample, "--steps", "120", "--json"});
    return read_report(run_program(options, folder).out).chain_hash();
  };
  const std::string reference = hash({"--hosting", "direct"});
  EXPECT_EQ(reference.size(), 32U);
  EXPECT_EQ(reference, hash({}));
  EXPECT_EQ(reference, hash({"--hosting", "direct", "--hosting", "solver=shm", "--threads", "2"}));
}

TEST(Run, TheTrajectoryHasARowPerMovingBodyAndSampleAndReadsBackExactly) {
  const ScratchFolder folder;
  const std::string file = folder.path("motion.csv");
  ASSERT_EQ(
      run_program({"run", kSample, "--steps", "10", "--hosting", "direct", "--trajectory", file}, folder).exit_code, 0);
  const auto rows = read_csv(file);
  ASSERT_EQ(rows.size(), 1U + 2 * 11);
  EXPECT_THAT(read_file(file),
              StartsWith("time,body,px,py,pz,qw,qx,qy,qz,vx,vy,vz,wx,wy,wz\n0,Ball01,0,1,0,1,0,0,0,0,0,0,0,0,0\n"));
  for (std::size_t i = 1; i < rows.size(); ++i) {
    ASSERT_EQ(rows[i].size(), 15U);
    EXPECT_NE(rows[i][1], "Ground");
  }
  // free fall with Euler: v = -g n h and y = 1 - g h^2 n (n - 1) / 2, summed as the integrator sums
  double v = 0.0, y = 1.0;
  for (int n = 0; n < 10; ++n) {
    y += v * (1.0 / 60.0);
    v = std::exp(-0.1 / 60.0) * (v - 5.0 / 60.0);
  }
  EXPECT_NEAR(std::stod(rows[21][3]), y, 1e-14);
  EXPECT_NEAR(std::stod(rows[21][10]), v, 1e-14);
}

// Without a Duration, which is 10 s then: more steps than can be counted.
TEST(Run, StepsAreCountedWhateverTheDuration) {
  const ScratchFolder folder;
  const std::string scene = folder.write(
      "short.gravitas", "Simulator { CustomProperties { TimeStep = 1e-9 } } Environment { Space { Bodies { } } }");
  const ProgramResult result = run_program({"run", scene, "--steps", "10", "--hosting", "direct"}, folder);
  EXPECT_EQ(result.exit_code, 0) << result.err;
  EXPECT_THAT(result.out, HasSubstr("1e-08 s in 10 steps"));
}

TEST(Run, SamplesAreTheFirstBoundariesAtOrAfterTheIntervalAndTheLast) {
  const ScratchFolder folder;
  const std::string file = folder.path("motion.csv");
  ASSERT_EQ(run_program({"run", kSample, "--steps", "10", "--dt", "0.1", "--hosting", "direct", "--trajectory", file,
                         "--sample-every", "0.25"},
                        folder)
                .exit_code,
            0);
  std::vector<double> times;
  for (const auto& row : read_csv(file))
    if (row[1] == "Ball01") times.push_back(std::stod(row[0]));
  const std::vector<double> expected = {0.0, 0.3, 0.5, 0.8, 1.0};
  ASSERT_EQ(times.size(), expected.size());
  for (std::size_t i = 0; i < times.size(); ++i) EXPECT_NEAR(times[i], expected[i], 1e-12);
}

TEST(Run, DurationStepsAndTimeStepOverrideTheScene) {
  const ScratchFolder folder;
  const auto run = [&](std::vector<std::string> options) {
    options.insert(options.begin(), {"run", kSample, "--hosting", "direct", "--json"});
    return read_report(run_program(options, folder).out);
  };
  EXPECT_EQ(run({"--duration", "0.5"}).steps(), 30U);
  EXPECT_EQ(run({"--duration", "1", "--dt", "0.3"}).steps(), 4U);
  EXPECT_DOUBLE_EQ(run({"--duration", "1", "--dt", "0.3"}).simulated_seconds(), 1.0);
  EXPECT_EQ(run({"--steps", "7"}).steps(), 7U);
  EXPECT_EQ(run({"--duration", "0"}).steps(), 0U);
}

TEST(Run, EventsAreJsonLinesInOrder) {
  const ScratchFolder folder;
  const std::string file = folder.path("events.jsonl");
  ASSERT_EQ(run_program({"run", kSample, "--hosting", "direct", "--duration", "1", "--events", file}, folder).exit_code,
            0);
  std::istringstream lines(read_file(file));
  std::string first;
  ASSERT_TRUE(std::getline(lines, first));
  EXPECT_THAT(first, HasSubstr("\"kind\":\"collision_start\",\"bodies\":[\"Ground\",\"Ball01\"]"));
  EXPECT_THAT(first, HasSubstr("\"step\":28"));
}

TEST(Run, QuietPrintsNothing) {
  const ScratchFolder folder;
  const ProgramResult result = run_program({"run", kSample, "--steps", "1", "--quiet"}, folder);
  EXPECT_EQ(result.exit_code, 0);
  EXPECT_EQ(result.out + result.err, "");
}

TEST(Run, AnInterruptKeepsWhatWasComputed) {
  const ScratchFolder folder;
  const std::string pipe = folder.path("motion.csv");
  ASSERT_EQ(mkfifo(pipe.c_str(), 0600), 0);
  const pid_t process = harness::start_program({"run", kSample, "--hosting", "direct", "--duration", "1e6",
                                                "--trajectory", pipe, "--report", folder.path("report.json")},
                                               folder);
  // rows come out: the run is under way
  std::ifstream rows(pipe);
  std::string line;
  for (int i = 0; i < 1000; ++i) ASSERT_TRUE(std::getline(rows, line));
  kill(process, SIGINT);
  std::string last;
  while (std::getline(rows, line)) last = line;
  const ProgramResult result = harness::finish_program(process, folder);
  EXPECT_EQ(result.exit_code, 130);
  const report::v1::Report report = read_report(read_file(folder.path("report.json")));
  EXPECT_EQ(report.outcome(), "interrupted");
  EXPECT_GE(report.steps(), 400U);
  // the trajectory ends with the state that the report is about
  EXPECT_NEAR(std::stod(last), report.simulated_seconds(), 1e-9);
}

// A scene whose integrator is one of the deliberately bad plugins.
ProgramResult run_with_bad_integrator(const std::string& library, const ScratchFolder& folder) {
  const std::string plugins =
      folder.write("plugins.gravitas", "Plugins { Plugin { Slot = \"integrator\" Deadline = 0.5 Library = \"" +
                                           in_build("/lib/gravitas-faulty/") + library + ".so\" } }");
  return run_program({"run", kSample, plugins, "--set", "Integrator=Faulty", "--report", folder.path("report.json"),
                      "--trajectory", folder.path("motion.csv"), "--checkpoint", folder.path("kept")},
                     folder);
}

// In every third call: each time it is replaced, until five failures are too many.
TEST(Run, AWorkerThatDiesAgainAndAgainPausesTheRunWithSlotCauseAndStep) {
  const ScratchFolder folder;
  const ProgramResult result = run_with_bad_integrator("integrator_killed", folder);
  EXPECT_EQ(result.exit_code, 3);
  EXPECT_THAT(result.err, HasSubstr("paused at step 11: slot integrator, plugin Faulty"));
  EXPECT_THAT(result.err, HasSubstr("killed by signal 9"));
  const report::v1::Report report = read_report(read_file(folder.path("report.json")));
  EXPECT_EQ(report.outcome(), "paused");
  EXPECT_EQ(report.steps(), 10U);
  ASSERT_EQ(report.faults_size(), 5);
  EXPECT_EQ(report.faults(0).step(), 3U);
  EXPECT_EQ(report.faults(0).slot(), "integrator");
  EXPECT_EQ(report.faults(0).kind(), "death");
  EXPECT_GT(report.faults(0).recovery_us(), 0.0);
  EXPECT_EQ(report.faults(4).recovered_by(), "none: paused");
  // initial state and ten steps of two bodies are kept
  EXPECT_EQ(read_csv(folder.path("motion.csv")).size(), 1U + 11 * 2);
}

// Who starts a run from a script tells a pause by its exit code, wherever it stands.
TEST(Run, APauseWhoseCheckpointCannotBeWrittenIsAPauseAndSaysBoth) {
  const ScratchFolder folder;
  // where the checkpoint is written before it gets its name, so that root cannot either
  std::filesystem::create_directory(folder.path("two_spheres_motor.paused.checkpoint.tmp"));
  const std::vector<std::string> words = {"run", kSample, "--fault", "solver:kill@step=5,times=2"};
  const ProgramResult result = run_program(words, folder);
  EXPECT_EQ(result.exit_code, 3);
  EXPECT_THAT(result.err, HasSubstr("paused at step 5: slot solver"));
  EXPECT_THAT(result.err,
              HasSubstr("no checkpoint could be written: checkpoint 'two_spheres_motor.paused.checkpoint'"));
}

// Nor is it another end where an output fails, too.
TEST(Run, APauseIsAPauseWhereAnOutputCannotBeWritten) {
  const ScratchFolder folder;
  const ProgramResult result =
      run_program({"run", kSample, "--fault", "solver:kill@step=5,times=2", "--report", "/dev/full"}, folder);
  EXPECT_EQ(result.exit_code, 3);
  EXPECT_THAT(result.err, HasSubstr("paused at step 5: slot solver"));
  EXPECT_THAT(result.err, HasSubstr("report '/dev/full': No space left on device"));
}

TEST(Run, AWorkerThatHangsIsReplacedAtItsDeadline) {
  const ScratchFolder folder;
  const ProgramResult result = run_with_bad_integrator("integrator_hangs", folder);
  EXPECT_EQ(result.exit_code, 3);
  EXPECT_THAT(result.err, HasSubstr("paused at step 11: slot integrator"));
  EXPECT_THAT(result.err, HasSubstr("within its deadline of 500 ms"));
}

TEST(Run, LooksForTheKindsOfEventsThatAreAskedFor) {
  const ScratchFolder folder;
  const auto run_with = [&](const std::string& kinds) {
    return run_program({"run", kSample, "--duration", "2", "--fault", "solver:kill@step=100", "--events",
                        folder.path("events"), "--report", folder.path("report.json"), "--event-kinds", kinds},
                       folder);
  };
  ProgramResult result = run_with("collision_start,fault");
  ASSERT_EQ(result.exit_code, 0) << result.err;
  const std::string text = read_file(folder.path("events"));
  EXPECT_THAT(text, HasSubstr("\"kind\":\"collision_start\""));
  EXPECT_THAT(text, HasSubstr("\"kind\":\"fault\""));
  EXPECT_EQ(text.find("collision_end"), std::string::npos);
  report::v1::Report report = read_report(read_file(folder.path("report.json")));
  EXPECT_THAT(report.event_kinds(), ::testing::ElementsAre("collision_start", "fault"));
  EXPECT_GT(report.events().collision_start(), 0U);
  EXPECT_EQ(report.events().collision_end(), 0U);

  result = run_with("none");
  ASSERT_EQ(result.exit_code, 0) << result.err;
  EXPECT_EQ(read_file(folder.path("events")), "");
  report = read_report(read_file(folder.path("report.json")));
  EXPECT_EQ(report.event_kinds_size(), 0);
  EXPECT_EQ(report.events().collision_start(), 0U);

  result = run_with("colision_start");
  EXPECT_EQ(result.exit_code, 2);
  EXPECT_THAT(result.err, HasSubstr("did you mean \"collision_start\"?"));
  result = run_program({"run", kSample, "--ongoing-rate", "0"}, folder);
  EXPECT_EQ(result.exit_code, 2);
  EXPECT_THAT(result.err, HasSubstr("--ongoing-rate 0"));
}

TEST(Run, TellsWhatHasNoNumber) {
  const ScratchFolder folder;
  const std::string scene = folder.write(
      "fast.gravitas",
      "Environment { Space { Bodies { Body { Id = \"A\" Mass = 1 PrincipalMoments = {1, 1, 1} KineticProperties { "
      "LinearVelocity = {1e200, 0, 0} } } Body { Id = \"B\" Mass = 1 PrincipalMoments = {1, 1, 1} KineticProperties { "
      "Position = {1, 0, 0} } } } } }\nSimulator { CustomProperties { Duration = 0.1 } }");
  const ProgramResult result = run_program({"run", scene, "--hosting", "direct"}, folder);
  EXPECT_EQ(result.exit_code, 0);
  EXPECT_THAT(result.out, HasSubstr("energy not finite -> not finite J"));
  EXPECT_THAT(result.err,
              HasSubstr("m in step 1, over a million times what the scene measures (2 m): that is the speed "
                        "which it was given"));
  // a checkpoint of it goes on
  EXPECT_EQ(run_program({"run", scene, "--hosting", "direct", "--steps", "2", "--checkpoint", "c"}, folder).exit_code,
            0);
  const ProgramResult resumed = run_program({"run", scene, "--hosting", "direct", "--resume", "c"}, folder);
  EXPECT_EQ(resumed.exit_code, 0) << resumed.err;
  EXPECT_THAT(resumed.err, HasSubstr("that is the speed which it was given"));
}

TEST(Run, WarnsOfOrdersBeyondItsEnd) {
  const ScratchFolder folder;
  const ProgramResult result =
      run_program({"run", kSample, "--steps", "3", "--hosting", "direct", "--hosting", "solver=shm", "--fault",
                   "solver:kill@step=9", "--swap", "solver=Newton@step=8", "--edit",
                   "set Body.Ball01.LinearVelocity={0,1,0}@step=7", "--report", "report.json"},
                  folder);
  EXPECT_EQ(result.exit_code, 0) << result.err;
  EXPECT_THAT(result.err, HasSubstr("--fault at step 9 never comes: the run has 3 steps"));
  EXPECT_THAT(result.err, HasSubstr("--swap at step 8 never comes: the run has 3 steps"));
  const std::string edit = "--edit at step 7 never comes: the run has 3 steps";
  EXPECT_THAT(result.err, HasSubstr(edit));
  EXPECT_THAT(read_file(folder.path("report.json")), HasSubstr(edit));
}

// A parent that ignores SIGCHLD passes that on, and Linux then forgets how children ended: what became of a worker was not
// told, and waiting for each took seconds.
TEST(Run, KnowsHowWorkersEndedUnderAParentThatIgnoresThem) {
  const ScratchFolder folder;
  const auto before = signal(SIGCHLD, SIG_IGN);
  const pid_t process =
      harness::start_program({"run", kSample, "--steps", "20", "--fault", "solver:kill@step=5", "--json"}, folder);
  signal(SIGCHLD, before);
  const ProgramResult result = harness::finish_program(process, folder);
  EXPECT_EQ(result.exit_code, 0);
  EXPECT_THAT(result.out, HasSubstr("was killed by signal 9 (Killed)"));
}

// A low soft limit is raised, as far as the hard one lets it be.
TEST(Run, ASmallStackIsRaisedOrRefused) {
  const ScratchFolder folder;
  const auto run = [&](const std::string& limit, const std::string& hosting) {
    const std::string command = "ulimit " + limit + " -s 64; " + in_shell(in_build("/bin/gravitas")) + " run " +
                                in_shell(shipped_scene("stack")) + " --steps 5 --quiet --hosting " + hosting +
                                " > /dev/null 2> " + folder.path("told");
    return WEXITSTATUS(std::system(command.c_str()));
  };
  for (const char* hosting : {"direct", "shm"})
    EXPECT_EQ(run("-S", hosting), 0) << hosting << harness::read_file(folder.path("told"));
  EXPECT_EQ(run("", "direct"), 1);
  EXPECT_THAT(harness::read_file(folder.path("told")),
              HasSubstr("it needs a stack of at least 512 KB, and Linux allows this program 64 (ulimit -s)"));
}

}  // namespace
}  // namespace gravitas
