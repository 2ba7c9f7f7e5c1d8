// The verdicts of `gravitas check`: every plugin of the tree conforms, every one that misbehaves on purpose fails at the
// level that stands beside it. No plugin is named here.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <filesystem>
#include <fstream>
#include <string>
#include <vector>

#include "kernel/carrier/carrier.h"
#include "services/check/describe.h"
#include "services/check/examination.h"
#include "tests/paths.h"

namespace gravitas::check {
namespace {

namespace files = std::filesystem;

const std::string kPlugins = in_build("/lib/gravitas");
const std::string kFaulty = in_build("/lib/gravitas-faulty");
const std::string kHonest = in_build("/lib/gravitas-honest");
// Fewer calls than a full check makes, which takes minutes: `gravitas check PLUGIN` by hand makes them all.
constexpr std::uint32_t kFewCalls = 300;

std::vector<std::string> libraries_of(const std::string& folder) {
  std::vector<std::string> names;
  if (!files::is_directory(folder)) return names;
  for (const files::directory_entry& entry : files::directory_iterator(folder))
    if (entry.path().extension() == ".so") names.push_back(entry.path().stem().string());
  std::ranges::sort(names);
  return names;
}

// Names begin with their slot's.
std::vector<std::string> one_of_each_slot(std::vector<std::string> names) {
  const auto slot_of = [](const std::string& name) { return name.substr(0, name.find('_')); };
  names.erase(
      std::unique(names.begin(), names.end(), [&](const auto& a, const auto& b) { return slot_of(a) == slot_of(b); }),
      names.end());
  return names;
}

report::v1::CheckReport check_library(const std::string& path, const Options& options) {
  kernel::set_worker_program(in_build("/bin/gravitas-worker"));
  Examinee examinee = find_examinee(path);
  complete(&examinee, options.quick);
  return examine(
      examinee, options, [](const Progress&) {}, [] { return false; });
}

bool fails(const report::v1::CheckReport& report, const std::string& level) {
  return std::ranges::any_of(report.levels(), [&](const report::v1::CheckLevel& one) {
    return one.level() == level && one.verdict() == "failed";
  });
}

// The level at which a bad plugin fails, as its folder says.
std::string level_of(const std::string& name) {
  std::ifstream file(in_source("/tests/faulty/") + name + "/level");
  std::string level;
  file >> level;
  return level;
}

void expect_failure(const report::v1::CheckReport& report, const std::string& level) {
  EXPECT_FALSE(report.conforms());
  ASSERT_FALSE(level.empty()) << "there is no file `level` beside its plugin.cc";
  EXPECT_TRUE(fails(report, level)) << report.DebugString();
  // and at no level before: the time of a quick check ends with the first finding
  ASSERT_GT(report.findings_size(), 0);
  EXPECT_EQ(report.findings(0).level(), level) << report.DebugString();
  // a finding says how to see it again
  for (const report::v1::CheckFinding& finding : report.findings()) {
    EXPECT_FALSE(finding.text().empty());
    EXPECT_NE(finding.again().find("--case"), std::string::npos);
  }
}

// A quick check asks what a full one does, less often: one plugin of each slot shows that it stays quick.
class QuickCheckOfTheTree : public ::testing::TestWithParam<std::string> {};

TEST_P(QuickCheckOfTheTree, Conforms) {
  const auto report = check_library(kPlugins + "/" + GetParam() + ".so", {.quick = true, .level = {}, .only_case = {}});
  EXPECT_TRUE(report.conforms()) << report.DebugString();
}

class CheckOfTheTree : public ::testing::TestWithParam<std::string> {};

TEST_P(CheckOfTheTree, ConformsInAFullCheckOfFewCalls) {
  const auto report =
      check_library(kPlugins + "/" + GetParam() + ".so", {.calls = kFewCalls, .level = {}, .only_case = {}});
  EXPECT_TRUE(report.conforms()) << report.DebugString();
  for (const report::v1::CheckLevel& level : report.levels()) EXPECT_EQ(level.verdict(), "passed") << level.level();
}

class CheckOfTheHonest : public ::testing::TestWithParam<std::string> {};

TEST_P(CheckOfTheHonest, Conforms) {
  const std::string library = kHonest + "/" + GetParam() + ".so";
  const auto report = check_library(library, {.quick = true, .level = {}, .only_case = {}});
  EXPECT_TRUE(report.conforms()) << report.DebugString();
  // a quick check tries one forbidden value of each setting
  const auto settings = check_library(library, {.level = {}, .only_case = "handshake/settings"});
  EXPECT_EQ(settings.findings_size(), 0) << settings.DebugString();
}

class CheckOfFaults : public ::testing::TestWithParam<std::string> {};

TEST_P(CheckOfFaults, FailsAtItsLevelInAQuickCheck) {
  const auto report = check_library(kFaulty + "/" + GetParam() + ".so", {.quick = true, .level = {}, .only_case = {}});
  expect_failure(report, level_of(GetParam()));
}

class CheckOfSlowFaults : public ::testing::TestWithParam<std::string> {};

TEST_P(CheckOfSlowFaults, FailsAtItsLevelInAFullCheck) {
  const std::string level = level_of("long/" + GetParam());
  expect_failure(check_library(kFaulty + "/long/" + GetParam() + ".so", {.level = level, .only_case = {}}), level);
}

std::string name_of(const ::testing::TestParamInfo<std::string>& info) { return info.param; }

INSTANTIATE_TEST_SUITE_P(All, QuickCheckOfTheTree, ::testing::ValuesIn(one_of_each_slot(libraries_of(kPlugins))),
                         name_of);
INSTANTIATE_TEST_SUITE_P(All, CheckOfTheTree, ::testing::ValuesIn(libraries_of(kPlugins)), name_of);
INSTANTIATE_TEST_SUITE_P(All, CheckOfTheHonest, ::testing::ValuesIn(libraries_of(kHonest)), name_of);
INSTANTIATE_TEST_SUITE_P(All, CheckOfFaults, ::testing::ValuesIn(libraries_of(kFaulty)), name_of);
INSTANTIATE_TEST_SUITE_P(All, CheckOfSlowFaults, ::testing::ValuesIn(libraries_of(kFaulty + "/long")), name_of);

// A slow plugin is not decided by a quick check, which does not go on for minutes.
TEST(QuickCheck, EndsAtItsLimit) {
  kernel::set_worker_program(in_build("/bin/gravitas-worker"));
  Examinee examinee = find_examinee(kPlugins + "/" + libraries_of(kPlugins).front() + ".so");
  complete(&examinee, true);
  const auto report = examine(
      examinee, {.quick = true, .quick_limit = 1e-3, .level = {}, .only_case = {}}, [](const Progress&) {},
      [] { return false; });
  EXPECT_FALSE(report.conforms());
  EXPECT_EQ(report.findings_size(), 0);
  for (const report::v1::CheckLevel& level : report.levels()) {
    EXPECT_EQ(level.verdict(), "not judged");
    EXPECT_EQ(level.why(), "its calls take too long for --quick, which ends after 0.001 s");
  }
}

TEST(CheckOfDirectHosting, TellsWhatDependsOnIt) {
  const auto report =
      check_library(kFaulty + "/depends_on_program.so", {.quick = true, .level = {}, .only_case = "purity/direct"});
  ASSERT_EQ(report.findings_size(), 1) << report.DebugString();
  EXPECT_NE(report.findings(0).text().find("hosted direct: number 0 of column error_estimate was 1, then 0"),
            std::string::npos)
      << report.findings(0).text();
}

TEST(CheckOfPurity, AnAnswerThatDoesNotComeInTimeIsNoOtherAnswer) {
  const auto report = check_library(kFaulty + "/slow_with_threads.so", {.quick = true, .level = {}, .only_case = {}});
  ASSERT_GE(report.findings_size(), 1) << report.DebugString();
  EXPECT_EQ(report.findings(0).case_(), "purity/threads");
  EXPECT_THAT(report.findings(0).text(), testing::StartsWith("too slow to be judged: "));
  EXPECT_THAT(report.findings(0).text(), testing::HasSubstr("its limit here is 1 s, 2 s whatever it marks (--quick"));
  for (const report::v1::CheckLevel& level : report.levels())
    EXPECT_THAT(level.why(), testing::Not(testing::HasSubstr("do not repeat"))) << level.level();
}

// Who gives the check longer gives each call longer.
TEST(QuickCheck, ThatMayTakeLongerWaitsLonger) {
  const auto report = check_library(kFaulty + "/slow_with_threads.so",
                                    {.quick = true, .quick_limit = 30.0, .level = {}, .only_case = "purity/threads"});
  ASSERT_GE(report.findings_size(), 1) << report.DebugString();
  EXPECT_THAT(report.findings(0).text(), testing::HasSubstr("its limit here is 1.5 s, 3 s whatever it marks (--quick"));
}

// A command is judged as a library is, over the one carrier that it has.
TEST(CheckOfACommand, ThatServesAGoodPluginConforms) {
  const std::vector<std::string> good = libraries_of(kPlugins);
  ASSERT_FALSE(good.empty());
  std::string command =
      in_shell(in_build("/bin/gravitas-worker")) + " " + in_shell(kPlugins + "/" + good.front() + ".so");
  const auto report = check_library(command, {.quick = true, .level = {}, .only_case = {}});
  EXPECT_TRUE(report.conforms()) << report.DebugString();
  EXPECT_EQ(report.command(), command);
}

TEST(CheckOfOneCase, ThatIsNamedIsJudgedAlone) {
  const std::vector<std::string> good = libraries_of(kPlugins);
  ASSERT_FALSE(good.empty());
  const auto report = check_library(kPlugins + "/" + good.front() + ".so", {.level = {}, .only_case = "purity/twice"});
  for (const report::v1::CheckLevel& level : report.levels()) EXPECT_EQ(level.cases(), level.level() == "C2" ? 1U : 0U);
  // which says nothing about the rest
  EXPECT_EQ(report.badge(), "no finding in what was asked for: C2");
}

// What depends on how often a process was asked is blamed on that, and not on the case in which it showed.
TEST(Check, ManyCallsAreACaseOfTheirOwn) {
  for (const char* name : {"counts_calls", "force_tires"}) {
    const auto report = check_library(kFaulty + "/" + name + ".so", {.quick = true, .level = {}, .only_case = {}});
    ASSERT_GT(report.findings_size(), 0) << name;
    EXPECT_EQ(report.findings(0).case_(), "purity/many-calls") << report.DebugString();
    const auto again = check_library(kFaulty + "/" + name + ".so", {.level = {}, .only_case = "purity/many-calls"});
    EXPECT_EQ(again.findings_size(), 1) << name;
  }
  const auto numbers = check_library(kFaulty + "/force_tires.so", {.level = "C5", .only_case = {}});
  ASSERT_GT(numbers.findings_size(), 0);
  EXPECT_THAT(numbers.findings(0).text(), ::testing::HasSubstr("calls in one process: alone this case passes"));
  // and that is so
  const auto alone =
      check_library(kFaulty + "/force_tires.so", {.level = {}, .only_case = numbers.findings(0).case_()});
  EXPECT_TRUE(alone.conforms()) << alone.DebugString();
}

}  // namespace
}  // namespace gravitas::check
