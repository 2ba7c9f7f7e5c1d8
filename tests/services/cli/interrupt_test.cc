// Ctrl-C as a terminal sends it: to the program and to all its workers at once.
#include <gmock/gmock.h>
#include <google/protobuf/util/json_util.h>
#include <gtest/gtest.h>
#include <signal.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <fstream>
#include <string>

#include "gravitas/report/v1/report.pb.h"
#include "tests/services/cli/program.h"

namespace gravitas {
namespace {

using testing::ProgramResult;
using testing::ScratchFolder;

struct Interrupted {
  ProgramResult result;
  report::v1::Report report;
  std::string last_row;
};

// Runs the sample in workers, in a process group of its own, and sends `number` to the whole group in the middle of it.
Interrupted interrupt_group(int number) {
  const ScratchFolder folder;
  const std::string pipe = folder.path("motion.csv");
  EXPECT_EQ(mkfifo(pipe.c_str(), 0600), 0);
  const pid_t process =
      testing::start_program({"run", testing::shipped_scene("two_spheres_motor"), "--duration", "1e6", "--trajectory",
                              pipe, "--report", folder.path("report.json")},
                             folder);
  // it waits for a reader of the pipe, so it has started no worker yet
  EXPECT_EQ(setpgid(process, process), 0);
  std::ifstream rows(pipe);
  std::string line;
  for (int i = 0; i < 100; ++i) EXPECT_TRUE(std::getline(rows, line));
  kill(-process, number);
  Interrupted seen;
  while (std::getline(rows, line)) seen.last_row = line;
  seen.result = testing::finish_program(process, folder);
  EXPECT_TRUE(
      google::protobuf::util::JsonStringToMessage(testing::read_file(folder.path("report.json")), &seen.report).ok());
  return seen;
}

class Signal : public ::testing::TestWithParam<int> {};

INSTANTIATE_TEST_SUITE_P(ToTheGroup, Signal, ::testing::Values(SIGINT, SIGTERM),
                         [](const auto& which) { return std::string(which.param == SIGINT ? "SIGINT" : "SIGTERM"); });

TEST_P(Signal, EndsTheRunAfterItsStepAndNotTheWorkersUnderIt) {
  const Interrupted seen = interrupt_group(GetParam());
  EXPECT_EQ(seen.result.exit_code, 130) << seen.result.err;
  EXPECT_EQ(seen.report.outcome(), "interrupted");
  EXPECT_EQ(seen.report.faults_size(), 0);
  EXPECT_THAT(seen.result.err, ::testing::HasSubstr("interrupted after step"));
  // the trajectory ends with a whole row of the state that the report is about
  EXPECT_NEAR(std::stod(seen.last_row), seen.report.simulated_seconds(), 1e-9);
  EXPECT_EQ(std::ranges::count(seen.last_row, ','), 14);
}

}  // namespace
}  // namespace gravitas
