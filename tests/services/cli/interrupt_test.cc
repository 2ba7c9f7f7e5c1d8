// Ctrl-C as a terminal sends it: to everything in the program's process group, which the workers must not be in.
#include <gmock/gmock.h>
#include <google/protobuf/util/json_util.h>
#include <gtest/gtest.h>
#include <signal.h>
#include <string.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <filesystem>
#include <fstream>
#include <string>
#include <vector>

#include "gravitas/report/v1/report.pb.h"
#include "tests/services/cli/program.h"

namespace gravitas {
namespace {

using harness::ProgramResult;
using harness::ScratchFolder;

// Processes that a process has started and that are still there.
std::vector<pid_t> children_of(pid_t process) {
  std::vector<pid_t> children;
  for (const auto& thread : std::filesystem::directory_iterator("/proc/" + std::to_string(process) + "/task")) {
    std::ifstream list(thread.path() / "children");
    for (pid_t child; list >> child;) children.push_back(child);
  }
  return children;
}

struct Interrupted {
  ProgramResult result;
  report::v1::Report report;
  std::string last_row;
  std::vector<pid_t> groups;  // of the program, then of its workers, while it ran
};

// Runs the sample in workers and sends `number` to the program in the middle of it.
Interrupted interrupt(int number) {
  const ScratchFolder folder;
  const std::string pipe = folder.path("motion.csv");
  EXPECT_EQ(mkfifo(pipe.c_str(), 0600), 0);
  const pid_t process = harness::start_program({"run", harness::shipped_scene("two_spheres_motor"), "--duration", "500",
                                                "--trajectory", pipe, "--report", folder.path("report.json")},
                                               folder);
  std::ifstream rows(pipe);
  std::string line;
  for (int i = 0; i < 100; ++i) EXPECT_TRUE(std::getline(rows, line));
  Interrupted seen;
  seen.groups.push_back(getpgid(process));
  for (const pid_t worker : children_of(process)) seen.groups.push_back(getpgid(worker));
  kill(process, number);
  while (std::getline(rows, line)) seen.last_row = line;
  seen.result = harness::finish_program(process, folder);
  EXPECT_TRUE(
      google::protobuf::util::JsonStringToMessage(harness::read_file(folder.path("report.json")), &seen.report).ok());
  return seen;
}

// Waits until the program listens to SIGTERM, as Linux tells it.
void await_listening(pid_t process) {
  for (int i = 0; i < 30'000; ++i) {
    std::ifstream status("/proc/" + std::to_string(process) + "/status");
    for (std::string line; std::getline(status, line);)
      if (line.starts_with("SigCgt:") && (std::stoull(line.substr(7), nullptr, 16) >> (SIGTERM - 1) & 1) != 0) return;
    usleep(1000);
  }
  ADD_FAILURE() << "it does not listen";
}

class Signal : public ::testing::TestWithParam<int> {};

INSTANTIATE_TEST_SUITE_P(Each, Signal, ::testing::Values(SIGINT, SIGTERM, SIGHUP),
                         [](const auto& which) { return "SIG" + std::string(sigabbrev_np(which.param)); });

TEST_P(Signal, EndsTheRunAfterItsStepAndDoesNotReachTheWorkers) {
  const Interrupted seen = interrupt(GetParam());
  ASSERT_GE(seen.groups.size(), 6U);  // five slots and the program
  for (std::size_t i = 1; i < seen.groups.size(); ++i) EXPECT_NE(seen.groups[i], seen.groups[0]);
  EXPECT_EQ(seen.result.exit_code, 130) << seen.result.err;
  EXPECT_EQ(seen.report.outcome(), "interrupted");
  EXPECT_EQ(seen.report.faults_size(), 0);
  EXPECT_LT(seen.report.steps(), 30000U);
  EXPECT_THAT(seen.result.err, ::testing::HasSubstr("interrupted after step"));
  // the trajectory ends with a whole row of the state that the report is about
  EXPECT_NEAR(std::stod(seen.last_row), seen.report.simulated_seconds(), 1e-9);
  EXPECT_EQ(std::ranges::count(seen.last_row, ','), 14);
}

TEST(Interrupt, EndsWhatWaitsForAPipe) {
  const ScratchFolder folder;
  const std::string pipe = folder.path("pipe");
  ASSERT_EQ(mkfifo(pipe.c_str(), 0600), 0);
  const std::string sample = harness::shipped_scene("two_spheres_motor");
  for (const std::vector<std::string>& words : {std::vector<std::string>{"run", pipe},
                                                {"run", sample, "--hosting", "direct", "--trajectory", pipe},
                                                {"run", sample, "--hosting", "direct", "--events", pipe},
                                                {"run", sample, "--hosting", "direct", "--report", pipe},
                                                {"run", sample, "--edit", "add " + pipe + "@step=1"},
                                                {"capture", sample, "--slot", "solver", "--out", pipe},
                                                {"serve", pipe, "--headless"}}) {
    const pid_t process = harness::start_program(words, folder);
    await_listening(process);
    kill(process, SIGTERM);
    const ProgramResult result = harness::finish_program(process, folder);
    EXPECT_EQ(result.exit_code, 130) << words[0];
    EXPECT_THAT(result.err, ::testing::HasSubstr("gravitas: interrupted before it began"));
  }
}

}  // namespace
}  // namespace gravitas
