// Every scene that ships runs to its end; in this process and in workers to the same bits, as determinism_test.cc shows.
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
#include "tests/run_quietly.h"

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

class Shipped : public ::testing::TestWithParam<std::string> {};

INSTANTIATE_TEST_SUITE_P(Scene, Shipped, ::testing::ValuesIn(shipped_scenes()),
                         [](const auto& which) { return which.param; });

TEST_P(Shipped, RunsToItsEnd) {
  RunOptions options;
  options.scenes = {kFolder + '/' + GetParam() + ".gravitas"};
  options.hosting = {{std::nullopt, kernel::Hosting::kDirect}};
  const RunResult whole = harness::run_quietly(options);
  ASSERT_EQ(whole.outcome, RunOutcome::kCompleted) << whole.fault;
  EXPECT_TRUE(std::isfinite(whole.report.energy().final()));
  EXPECT_LE(whole.report.max_penetration(), 1e-3);
  EXPECT_LE(whole.report.max_joint_error(), 1e-3);
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
