// Every scene that ships runs to its end, and in this process and in workers to the same bits, without a fault.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <fstream>
#include <string>
#include <vector>

#include "services/run/session.h"
#include "tests/paths.h"

namespace gravitas {
namespace {

const std::string kFolder = in_source("/deploy/scenes");

std::vector<std::string> shipped_scenes() {
  std::vector<std::string> names;
  for (const std::filesystem::directory_entry& entry : std::filesystem::directory_iterator(kFolder))
    if (entry.path().extension() == ".gravitas") names.push_back(entry.path().stem());
  std::ranges::sort(names);
  return names;
}

RunResult run_in(const std::string& scene, kernel::Hosting hosting, const std::vector<std::string>& overrides = {}) {
  RunOptions options;
  options.overrides = overrides;
  options.scenes = {kFolder + '/' + scene + ".gravitas"};
  options.hosting = {{std::nullopt, hosting}};
  return run(
      options, [] { return false; }, [](const Progress&) {});
}

class Shipped : public ::testing::TestWithParam<std::string> {};

INSTANTIATE_TEST_SUITE_P(Scene, Shipped, ::testing::ValuesIn(shipped_scenes()),
                         [](const auto& which) { return which.param; });

TEST_P(Shipped, RunsToItsEnd) {
  const RunResult whole = run_in(GetParam(), kernel::Hosting::kDirect);
  ASSERT_EQ(whole.outcome, RunOutcome::kCompleted) << whole.fault;
  EXPECT_TRUE(std::isfinite(whole.report.energy().final()));
  EXPECT_LE(whole.report.max_penetration(), 1e-3);
  EXPECT_LE(whole.report.max_joint_error(), 1e-3);
}

// Of large scenes half a second.
TEST_P(Shipped, RunsAlikeInThisProcessAndInWorkers) {
  std::vector<std::string> overrides;
  if (GetParam() == "pile1000") overrides = {"Simulator.Duration=0.5"};
  const RunResult direct = run_in(GetParam(), kernel::Hosting::kDirect, overrides);
  const RunResult workers = run_in(GetParam(), kernel::Hosting::kSharedMemory, overrides);
  const RunResult messages = run_in(GetParam(), kernel::Hosting::kGrpc, overrides);
  ASSERT_EQ(workers.outcome, RunOutcome::kCompleted) << workers.fault;
  EXPECT_EQ(direct.report.state_hash(), workers.report.state_hash());
  EXPECT_EQ(direct.report.chain_hash(), workers.report.chain_hash());
  EXPECT_EQ(direct.report.chain_hash(), messages.report.chain_hash());
  EXPECT_EQ(workers.report.faults_size(), 0);
  EXPECT_GT(workers.report.steps(), 0U);
}

TEST_P(Shipped, SaysAtItsHeadWhatHappens) {
  std::ifstream file(kFolder + '/' + GetParam() + ".gravitas");
  std::string line;
  int comments = 0;
  while (std::getline(file, line) && line.starts_with("//")) comments += line.size() > 20 ? 1 : 0;
  EXPECT_GE(comments, 2);
}

}  // namespace
}  // namespace gravitas
