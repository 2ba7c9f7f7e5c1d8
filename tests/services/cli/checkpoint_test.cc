// `gravitas run` with checkpoints from outside: how it pauses, stops, is killed and goes on.
#include <fmt/format.h>
#include <gmock/gmock.h>
#include <google/protobuf/util/json_util.h>
#include <gtest/gtest.h>
#include <poll.h>
#include <signal.h>
#include <sys/stat.h>
#include <sys/syscall.h>
#include <unistd.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <random>
#include <string>
#include <vector>

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
using ::testing::AllOf;
using ::testing::HasSubstr;
using ::testing::Not;

std::string chain_of(const std::string& report_file) {
  report::v1::Report report;
  EXPECT_TRUE(google::protobuf::util::JsonStringToMessage(read_file(report_file), &report).ok());
  return report.chain_hash();
}

// Runs to the end with these words added; the chain hash.
std::string chain_after(std::vector<std::string> words, const ScratchFolder& folder) {
  const std::string report = folder.path("chain.json");
  words.insert(words.end(), {"--quiet", "--report", report});
  const ProgramResult result = run_program(words, folder);
  EXPECT_EQ(result.exit_code, 0) << result.err;
  return chain_of(report);
}

TEST(Checkpoints, APausedRunNamesTheOneItWroteAndTheCommandThatGoesOn) {
  const ScratchFolder folder;
  const std::string plugins =
      folder.write("plugins.gravitas", "Plugins { Plugin { Slot = \"integrator\" Library = \"" +
                                           in_build("/lib/gravitas-faulty/integrator_killed.so") + "\" } }");
  const std::string kept = folder.path("kept file");
  const ProgramResult result = run_program(
      {"run", kSample, plugins, "--set", "Integrator=Faulty", "--checkpoint", kept, "--duration", "1.5", "--hosting",
       "shm", "--hosting", "solver=direct", "--threads", "2", "--swap", "solver=Newton@step=90"},
      folder);
  EXPECT_EQ(result.exit_code, 3);
  EXPECT_THAT(
      result.err,
      HasSubstr("checkpoint '" + kept + "' holds step 10; to go on: gravitas run " + in_shell(kSample) + " " + plugins +
                " --duration 1.5 --set Integrator=Faulty --hosting shm --hosting solver=direct --threads 2 " +
                "--swap solver=Newton@step=90 --resume '" + kept + "'"));
  // it resumes: the same plugin dies again, and uses up a budget of its own
  const ProgramResult again = run_program(
      {"run", kSample, plugins, "--set", "Integrator=Faulty", "--resume", kept, "--checkpoint", kept}, folder);
  EXPECT_EQ(again.exit_code, 3);
  EXPECT_THAT(again.err, HasSubstr("paused at step 21"));
  EXPECT_THAT(again.err, HasSubstr("holds step 20"));
}

// The first that it does with the restored state is to ask for its potential energy.
TEST(Checkpoints, AForceThatFailsWhereARunGoesOnIsToldAsThat) {
  const harness::CurrentFolder current;  // of the capsules
  const ScratchFolder folder;
  const std::string scene = folder.write("rising ball.gravitas", R"(
    Forces { Force { Type = "Push" Id = "Wind" CustomProperties { Push = {1, 0, 0} } } }
    Simulator { CustomProperties { TimeStep = 0.1 Duration = 2 } }
    Environment { Space { Bodies { Body { Id = "Ball" Mass = 1 PrincipalMoments = {1, 1, 1} Forces = {"Wind"}
      KineticProperties { Position = {0, -0.055, 0} LinearVelocity = {0, 0.1, 0} } } } } }
    Plugins { Plugin { Slot = "force" Library = ")" + in_build("/lib/gravitas-faulty/force_poisoned.so") +
                                                                     R"(" } })");
  const std::string kept = folder.path("kept"), report = folder.path("report.json");
  const auto paused = [&](std::vector<std::string> words) {
    words.insert(words.begin(), {"run", scene, "--checkpoint", kept, "--report", report});
    const ProgramResult result = run_program(words, folder);
    EXPECT_EQ(result.exit_code, 3) << result.err;
    EXPECT_THAT(result.err,
                AllOf(HasSubstr("paused at step 6: slot force, plugin PoisonedForce: it failed: it never "
                                "was so high"),
                      HasSubstr("gravitas replay 'rising ball.force.step7.capsule'"), Not(HasSubstr("Failures"))));
    EXPECT_THAT(result.out, HasSubstr("-> not known J"));
    const report::v1::Energy energy = read_report(read_file(report)).energy();
    EXPECT_DOUBLE_EQ(energy.initial(), 0.5 * 0.1 * 0.1);
    EXPECT_TRUE(std::isnan(energy.final()));
  };
  paused({});
  paused({"--resume", kept});
}

TEST(Checkpoints, AnInterruptedRunGoesOn) {
  const ScratchFolder folder;
  const std::string pipe = folder.path("motion.csv"), kept = folder.path("kept");
  ASSERT_EQ(mkfifo(pipe.c_str(), 0600), 0);
  const pid_t process = harness::start_program(
      {"run", kSample, "--hosting", "direct", "--duration", "500", "--trajectory", pipe, "--checkpoint", kept}, folder);
  std::ifstream rows(pipe);
  std::string line;
  for (int i = 0; i < 100; ++i) ASSERT_TRUE(std::getline(rows, line));
  kill(process, SIGTERM);
  while (std::getline(rows, line)) continue;
  const ProgramResult result = harness::finish_program(process, folder);
  EXPECT_EQ(result.exit_code, 130) << result.err;
  EXPECT_THAT(result.err, HasSubstr("checkpoint '" + kept + "' holds step "));
  const int step = std::stoi(result.err.substr(result.err.find("holds step ") + 11));
  const std::string further = std::to_string(step + 50);
  EXPECT_EQ(chain_after({"run", kSample, "--steps", further, "--resume", kept, "--hosting", "direct"}, folder),
            chain_after({"run", kSample, "--steps", further, "--hosting", "direct"}, folder));
}

TEST(Checkpoints, WhatCannotBeUsedIsBadInputWithTheReason) {
  const ScratchFolder folder;
  const std::string kept = folder.path("kept"), motion = folder.write("motion.csv", "of an earlier run");
  ASSERT_EQ(
      run_program({"run", kSample, "--hosting", "direct", "--steps", "50", "--checkpoint", kept}, folder).exit_code, 0);
  const auto refusal = [&](std::vector<std::string> words) {
    words.insert(words.begin(), {"run", kSample, "--hosting", "direct", "--trajectory", motion});
    const ProgramResult result = run_program(words, folder);
    EXPECT_EQ(result.exit_code, 2) << result.err;
    // what is there is not lost to a run that does not start
    EXPECT_EQ(read_file(motion), "of an earlier run");
    return result.err;
  };
  EXPECT_THAT(refusal({"--resume", folder.path("none")}), HasSubstr("none': No such file"));
  EXPECT_THAT(refusal({"--resume", kSample}), HasSubstr("not a checkpoint of Gravitas"));
  EXPECT_THAT(refusal({"--resume", "/dev/zero"}), HasSubstr("not an ordinary file"));
  EXPECT_THAT(refusal({"--resume", kept, "--steps", "49"}), HasSubstr("after step 50, beyond the end of this run"));
  EXPECT_THAT(refusal({"--resume", kept, "--duration", "0.83"}), HasSubstr("shortened last step"));
  EXPECT_THAT(refusal({"--resume", kept, "--dt", "0.01"}), HasSubstr("differs in: time step"));
  EXPECT_THAT(refusal({"--checkpoint", "/dev/full"}), HasSubstr("not an ordinary file"));
  EXPECT_THAT(refusal({"--checkpoint", folder.path("none/kept")}), HasSubstr("No such file"));
  EXPECT_THAT(refusal({"--checkpoint-every", "5"}), HasSubstr("requires --checkpoint"));
  const std::string before = read_file(kept);
  EXPECT_THAT(refusal({"--checkpoint", kept, "--report", folder.path("none/x")}), HasSubstr("No such file"));
  EXPECT_EQ(read_file(kept), before);
  EXPECT_THAT(refusal({"--checkpoint", kept, "--checkpoint-every", "0"}), HasSubstr("--checkpoint-every"));
  std::string bytes = read_file(kept);
  bytes[bytes.size() / 2] = static_cast<char>(bytes[bytes.size() / 2] + 1);
  EXPECT_THAT(refusal({"--resume", folder.write("edited", bytes)}), HasSubstr("damaged or was edited"));
}

TEST(Checkpoints, AFullDiskUnderTheTrajectoryStopsTheRunAtACommitThatGoesOn) {
  const ScratchFolder folder;
  const std::string kept = folder.path("kept");
  const ProgramResult result =
      run_program({"run", kSample, "--hosting", "direct", "--checkpoint", kept, "--trajectory", "/dev/full"}, folder);
  EXPECT_EQ(result.exit_code, 1);
  EXPECT_THAT(result.err, HasSubstr("trajectory '/dev/full': No space left on device"));
  // the last commit, though what was told of it could not be written
  EXPECT_THAT(result.err, HasSubstr("checkpoint '" + kept + "' holds step "));
  EXPECT_THAT(result.err, Not(HasSubstr("holds step 0;")));
  EXPECT_EQ(chain_after({"run", kSample, "--hosting", "direct", "--resume", kept}, folder),
            chain_after({"run", kSample, "--hosting", "direct"}, folder));
}

// What fails to be written before a checkpoint is put in place does not keep the last one from it.
TEST(Checkpoints, OutputsThatCannotBeWrittenCostNoCommit) {
  const ScratchFolder folder;
  const std::string kept = folder.path("kept");
  const ProgramResult result = run_program({"run", kSample, "--hosting", "direct", "--steps", "12", "--checkpoint",
                                            kept, "--sample-every", "100", "--trajectory", "/dev/full"},
                                           folder);
  EXPECT_EQ(result.exit_code, 1);
  EXPECT_THAT(result.err, HasSubstr("checkpoint '" + kept + "' holds step 12;"));
}

TEST(Checkpoints, APipeThatIsReadNoMoreStopsTheRunAtACommitThatGoesOn) {
  const ScratchFolder folder;
  const std::string pipe = folder.path("motion.csv"), kept = folder.path("kept");
  ASSERT_EQ(mkfifo(pipe.c_str(), 0600), 0);
  const pid_t process = harness::start_program(
      {"run", kSample, "--hosting", "direct", "--trajectory", pipe, "--checkpoint", kept, "--report", "report.json"},
      folder);
  std::string line;
  EXPECT_TRUE(std::getline(std::ifstream(pipe), line));
  const ProgramResult result = harness::finish_program(process, folder);
  EXPECT_EQ(result.exit_code, 1);
  EXPECT_THAT(result.err, HasSubstr("trajectory '" + pipe + "': Broken pipe"));
  EXPECT_THAT(result.err, HasSubstr("checkpoint '" + kept + "' holds step "));
  EXPECT_EQ(read_report(read_file(folder.path("report.json"))).outcome(), "failed");
}

// A kill loses what the program had not written yet; but nothing of the time before the checkpoint, which the run that goes on
// from it does not write again. Before, all of a few samples was lost.
TEST(Checkpoints, WhatCameBeforeThemIsInTheFilesWhenTheProgramIsKilled) {
  const ScratchFolder folder;
  const std::string kept = folder.path("kept"), motion = folder.path("motion.csv"),
                    reactions = folder.path("reactions");
  const pid_t process = harness::start_program(
      {"run", kSample, "--hosting", "direct", "--steps", "10000000", "--dt", "0.01", "--quiet", "--checkpoint", kept,
       "--checkpoint-every", "50", "--sample-every", "0.5", "--trajectory", motion, "--reactions", reactions},
      folder);
  std::string before = read_file(kept);
  for (int seen = 0; seen < 5;) {
    std::string now = read_file(kept);
    if (now != before) before = std::move(now), ++seen;
    ASSERT_EQ(kill(process, 0), 0);
  }
  kill(process, SIGKILL);
  EXPECT_EQ(harness::finish_program(process, folder).exit_code, 137);
  // the refusal tells which step the checkpoint holds
  const std::string refusal =
      run_program({"run", kSample, "--dt", "0.01", "--steps", "1", "--resume", kept}, folder).err;
  const std::string words = "after step ";
  ASSERT_THAT(refusal, HasSubstr(words));
  const double time = 0.01 * std::stoi(refusal.substr(refusal.find(words) + words.size()));
  for (double sample = 0.5; sample < time + 1e-9; sample += 0.5) {
    EXPECT_THAT(read_file(motion), HasSubstr(fmt::format("\n{},", sample)));
    EXPECT_THAT(read_file(reactions), HasSubstr(fmt::format("\"time\":{},", sample)));
  }
}

// Kills the program at moments left to chance, again and again, and resumes from what is there: every file can be read,
// and every run ends with the same chain. GRAVITAS_KILLS sets how many kills each variant gets.
struct Variant {
  const char* name;
  const char* hosting;
  std::vector<std::string> swaps;
};

class Kills : public ::testing::TestWithParam<Variant> {};

// the swaps are in preparation, in shadow, on probation and done when the kernel dies
INSTANTIATE_TEST_SUITE_P(
    Hosting, Kills,
    ::testing::Values(Variant{"direct", "direct", {}}, Variant{"shm", "shm", {}}, Variant{"grpc", "grpc", {}},
                      Variant{"swaps",
                              "shm",
                              {"--swap", "solver=Sequential@step=30", "--swap", "integrator=Euler@step=60", "--swap",
                               "integrator=SemiImplicitEuler@step=85", "--swap", "space=Basic@step=62"}}),
    [](const auto& which) { return std::string(which.param.name); });

TEST_P(Kills, AtAnyMomentLeaveWhatResumesToTheSameChain) {
  constexpr int kUsual = 10, kKillsPerRun = 5;
  const char* wanted = std::getenv("GRAVITAS_KILLS");
  const int kills = wanted == nullptr ? kUsual : std::atoi(wanted);
  const ScratchFolder folder;
  const std::string scene = in_source("/tests/determinism/pile.gravitas"), kept = folder.path("kept");
  std::vector<std::string> quiet = {"run", scene, "--hosting", GetParam().hosting, "--steps", "120"};
  quiet.insert(quiet.end(), GetParam().swaps.begin(), GetParam().swaps.end());
  std::vector<std::string> words = quiet;
  words.insert(words.end(), {"--checkpoint", kept, "--checkpoint-every", "3", "--quiet"});
  const auto with_resume = [&] {
    std::vector<std::string> all = words;
    if (std::filesystem::exists(kept)) all.insert(all.end(), {"--resume", kept});
    return all;
  };
  // a moment is any within the time that a whole run takes here
  const auto start = std::chrono::steady_clock::now();
  const std::string chain = chain_after(quiet, folder);
  const auto whole = std::chrono::duration_cast<std::chrono::microseconds>(std::chrono::steady_clock::now() - start);

  std::mt19937 chance(20261120);
  std::uniform_int_distribution<long> microseconds(0, std::min<long>(whole.count(), 900'000));
  int killed = 0, ended = 0, mismatches = 0, got_on = 0;
  while (killed < kills) {
    for (int i = 0; i < kKillsPerRun && killed < kills; ++i) {
      const std::string before = read_file(kept);
      const pid_t process = harness::start_program(with_resume(), folder);
      // the end of the program or a moment by chance, whichever is first
      pollfd end = {static_cast<int>(syscall(SYS_pidfd_open, process, 0)), POLLIN, 0};
      const timespec moment = {0, 1000 * microseconds(chance)};
      const bool ends_by_itself = ppoll(&end, 1, &moment, nullptr) > 0;
      if (!ends_by_itself) kill(process, SIGKILL);
      close(end.fd);
      const ProgramResult result = harness::finish_program(process, folder);
      if (result.exit_code == 137) {
        ++killed;
        got_on += read_file(kept) == before ? 0 : 1;
      } else {
        ASSERT_EQ(result.exit_code, 0) << result.err;
        ++ended;
      }
    }
    mismatches += chain_after(with_resume(), folder) == chain ? 0 : 1;
    std::filesystem::remove(kept);
    std::filesystem::remove(kept + ".journal");
  }
  EXPECT_EQ(mismatches, 0);
  if (wanted != nullptr)
    fmt::print("{} kills, {} of them after a new checkpoint, {} runs that ended before theirs, {} chains that differ\n",
               killed, got_on, ended, mismatches);
}

}  // namespace
}  // namespace gravitas
