// `gravitas check` as a script sees it: exit codes, and what it says.
#include <gmock/gmock.h>
#include <google/protobuf/util/json_util.h>
#include <gtest/gtest.h>

#include "gravitas/report/v1/check.pb.h"
#include "services/check/describe.h"
#include "services/check/examination.h"
#include "tests/paths.h"
#include "tests/services/cli/program.h"

namespace gravitas {
namespace {

using harness::ProgramResult;
using harness::run_program;
using harness::ScratchFolder;
using ::testing::HasSubstr;

const std::string kGood = in_build("/lib/gravitas/hello.so");
const std::string kBad = in_build("/lib/gravitas-faulty/wrong_magic.so");

TEST(Check, WhatIsNoPluginIsBadInput) {
  const ScratchFolder folder;
  for (const std::string& word : {folder.write("text.so", "no library"), folder.path("missing.so"), std::string("Nope"),
                                  std::string("ls -l"), std::string("/")}) {
    const ProgramResult result = run_program({"check", word, "--quick"}, folder);
    EXPECT_EQ(result.exit_code, 2) << word;
    EXPECT_THAT(result.err, HasSubstr("allowed: ")) << word;
    EXPECT_EQ(result.out, "") << word;
  }
}

TEST(Check, UnknownCasesAndLevelsAreBadInput) {
  const ScratchFolder folder;
  const ProgramResult result = run_program({"check", kGood, "--case", "purity/thrice"}, folder);
  EXPECT_EQ(result.exit_code, 2);
  EXPECT_THAT(result.err, HasSubstr("purity/twice"));
  EXPECT_EQ(run_program({"check", kGood, "--level", "C6"}, folder).exit_code, 2);
  EXPECT_EQ(run_program({"check"}, folder).exit_code, 2);
}

TEST(Check, ExitCodeAndLastLineAreTheVerdict) {
  const ScratchFolder folder;
  const ProgramResult good = run_program({"check", kGood, "--level", "C0"}, folder);
  EXPECT_EQ(good.exit_code, 0) << good.out << good.err;
  EXPECT_TRUE(good.out.ends_with("no finding in what was asked for: C0\n")) << good.out;
  const ProgramResult bad = run_program({"check", kBad, "--quick"}, folder);
  EXPECT_EQ(bad.exit_code, 4);
  EXPECT_THAT(bad.out, HasSubstr("again  gravitas check " + in_shell(kBad) + " --case"));
  EXPECT_TRUE(bad.out.ends_with("does not conform: fails C0\n")) << bad.out;
}

// In the middle of a case of 100,000 calls.
TEST(Check, EndsAtAnInterruptWithinACase) {
  check::Examinee examinee = check::find_examinee(kGood);
  check::complete(&examinee, false);
  check::Options options;
  options.level = "C4";
  int asked = 0;
  const report::v1::CheckReport report = check::examine(
      examinee, options, [](const check::Progress&) {}, [&] { return ++asked > 500; });
  EXPECT_LT(asked, 600);
  EXPECT_EQ(report.levels(4).why(), "interrupted");
  EXPECT_EQ(report.levels(4).verdict(), "not judged");
  EXPECT_EQ(report.findings_size(), 0);
  EXPECT_FALSE(report.conforms());
}

TEST(Check, JsonHasTheSameFindings) {
  const ScratchFolder folder;
  report::v1::CheckReport report;
  ASSERT_TRUE(
      google::protobuf::util::JsonStringToMessage(run_program({"check", kBad, "--json"}, folder).out, &report).ok());
  EXPECT_FALSE(report.conforms());
  EXPECT_EQ(report.levels_size(), 6);
  ASSERT_EQ(report.findings_size(), 1);
  EXPECT_EQ(report.findings(0).level(), "C0");
  EXPECT_THAT(report.findings(0).text(), HasSubstr("no table of this interface"));
}

}  // namespace
}  // namespace gravitas
