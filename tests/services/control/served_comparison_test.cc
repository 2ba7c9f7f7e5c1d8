// Two plugins that are asked the same while a run goes on, and how their answers differ.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <string>

#include "services/control/status_text.h"
#include "services/run/session.h"
#include "services/run/summary.h"
#include "tests/run_quietly.h"
#include "tests/services/control/served.h"

namespace gravitas::control {
namespace {

using harness::kSteps;
using harness::parse_swap_request;
using harness::refusal;
using harness::run_quietly;
using harness::sample;
using harness::Served;
using ::testing::HasSubstr;
using ::testing::Not;

TEST(ServedComparison, LeavesNoTrace) {
  Served quiet, served;
  const auto compare = [&](const std::string& text) {
    return served.client.swap(parse_swap_request(text, true)).number();
  };
  const std::uint32_t same = compare("solver=Sequential"), other = compare("solver=Newton");
  EXPECT_THAT(refusal([&] { compare("solver=Newtn"); }), HasSubstr("compare solver=Newtn: no solver plugin"));
  served.client.step(30);
  EXPECT_EQ(served.client.call_off(same).shadow().calls(), 30U);
  const api::Status status = served.to_the_end();
  EXPECT_EQ(status.chain_hash(), quiet.to_the_end().chain_hash());
  ASSERT_EQ(status.swaps_size(), 2);
  EXPECT_TRUE(status.swaps(0).compares());
  EXPECT_EQ(status.swaps(0).shadow().differing_calls(), 0U);
  EXPECT_GT(status.swaps(0).shadow().from_us(), 0.0);
  EXPECT_GT(status.swaps(0).shadow().to_us(), 0.0);
  EXPECT_EQ(status.swaps(1).number(), other);
  EXPECT_EQ(status.swaps(1).shadow().calls(), kSteps);
  EXPECT_GT(status.swaps(1).shadow().differing_calls(), 0U);
  EXPECT_THAT(
      status_page(status),
      HasSubstr("  1 ended: solver Sequential beside Sequential, from step 1 on: 0 of 30 answers differ; Sequential "));
  EXPECT_THAT(status_page(status), HasSubstr("  2 comparing: solver Newton beside Sequential, from step 1 on: "));
  EXPECT_THAT(status_page(status), HasSubstr("      Solver.Solve linear_velocity: "));
}

// An edit may give rows to other bodies: how they differed before it says nothing about what comes.
TEST(ServedComparison, IsCountedAnewAfterAnEdit) {
  Served served;
  const std::uint32_t number = served.client.swap(parse_swap_request("solver=Newton", true)).number();
  served.client.step(20);
  served.edit({"set Body.Ball01.LinearVelocity={0,1,0}"});
  const std::uint32_t second = served.client.swap(parse_swap_request("solver=Direct", true)).number();
  served.client.step(30);
  const std::string page = status_page(served.client.status());
  EXPECT_THAT(page, HasSubstr("comparing: solver Newton beside Sequential, from step 21 on: "));
  EXPECT_THAT(page, HasSubstr("comparing: solver Direct beside Sequential, from step 21 on: "));
  for (const std::uint32_t one : {number, second}) {
    const api::ServedSwap ended = served.client.call_off(one);
    EXPECT_EQ(ended.number(), one);
    EXPECT_EQ(ended.step(), 21U);
    EXPECT_EQ(ended.shadow().calls(), 30U);
    EXPECT_THAT(refusal([&] { served.client.call_off(one); }), HasSubstr("this comparison has ended already"));
  }
}

TEST(ServedComparison, NamesWhoAnswersAfterASwapAndCountsAnew) {
  Served served;
  const std::uint32_t number = served.client.swap(parse_swap_request("solver=Newton", true)).number();
  served.client.step(20);
  EXPECT_EQ(served.swap("solver=Newton").outcome(), "committed");
  served.client.step(10);
  const api::Status status = served.client.status();
  EXPECT_THAT(status_page(status),
              HasSubstr("comparing: solver Newton beside Newton, from step 21 on: 0 of 30 answers differ"));
  const api::ServedSwap ended = served.client.call_off(number);
  EXPECT_EQ(ended.step(), 21U);
  EXPECT_EQ(ended.shadow().calls(), 30U);
}

// As `run` takes it; a reset begins it anew, and what is called off is not part of the command that goes on.
TEST(ServedComparison, OfTheCommandLineLastsAsLongAsTheRun) {
  const harness::ScratchFolder folder;
  ServeOptions options = sample("direct");
  options.run.comparisons = {"solver=Newton", "integrator=Euler"};
  options.run.checkpoint = folder.path("served.ck");
  Served served(options);
  served.client.step(30);
  api::Status status = served.client.status();
  ASSERT_EQ(status.swaps_size(), 2);
  EXPECT_TRUE(status.swaps(0).compares());
  EXPECT_EQ(status.swaps(0).to(), "Newton");
  EXPECT_EQ(status.swaps(0).shadow().calls(), 30U);
  EXPECT_EQ(status.swaps(1).to(), "Euler");
  served.client.call_off(status.swaps(1).number());
  const std::string goes_on = served.run.save_checkpoint().value().go_on_by;
  EXPECT_THAT(goes_on, HasSubstr(" --compare solver=Newton --resume "));
  EXPECT_THAT(goes_on, Not(HasSubstr("Euler")));
  served.client.reset();
  EXPECT_EQ(served.to_the_end().chain_hash(), harness::quiet_chain());
  status = served.client.status();
  ASSERT_EQ(status.swaps_size(), 2);
  EXPECT_EQ(status.swaps(0).shadow().calls(), kSteps);
  EXPECT_EQ(status.swaps(1).shadow().calls(), kSteps);
}

TEST(ServedComparison, OfTheCommandLineGoesOnFromACheckpoint) {
  const harness::ScratchFolder folder;
  ServeOptions options = sample("direct");
  options.run.checkpoint = folder.path("served.ck");
  {
    Served served(options);
    served.client.step(30);
    served.run.save_checkpoint();
  }
  options.run.resume = options.run.checkpoint;
  options.run.comparisons = {"solver=Newton"};
  Served resumed(options);
  EXPECT_EQ(resumed.client.status().step(), 30U);
  const api::Status status = resumed.to_the_end();
  EXPECT_EQ(status.chain_hash(), harness::quiet_chain());
  ASSERT_EQ(status.swaps_size(), 1);
  EXPECT_EQ(status.swaps(0).step(), 31U);
  EXPECT_EQ(status.swaps(0).shadow().calls(), kSteps - 30U);
}

TEST(ServedComparison, OfAPluginWithoutAPlaceIsRefusedAsWhatItIs) {
  Served served;
  const std::string why = refusal([&] { served.client.swap(parse_swap_request("collision=SweepAndPrune", true)); });
  EXPECT_THAT(why, HasSubstr("compare collision=SweepAndPrune: "));
  EXPECT_THAT(why, Not(HasSubstr("swap")));
}

TEST(Comparison, OfARunWithEditsSaysFromWhereItCounts) {
  RunOptions options = sample("direct").run;
  options.comparisons = {"solver=Newton"};
  options.edits = {"set Body.Ball01.LinearVelocity={0,1,0}@step=41"};
  const RunResult result = run_quietly(options);
  ASSERT_EQ(result.report.comparisons_size(), 2);
  EXPECT_EQ(result.report.comparisons(0).shadow().calls(), 40U);
  EXPECT_EQ(result.report.comparisons(1).shadow().calls(), kSteps - 40U);
  EXPECT_EQ(result.report.comparisons(1).step(), 41U);
  const std::string text = summarize(result.report, {});
  EXPECT_THAT(text, HasSubstr("  compared: solver Sequential with Newton: "));
  EXPECT_THAT(text, HasSubstr("  compared from step 41 on: solver Sequential with Newton: "));
}

TEST(Comparison, OfARunWithASwapTellsEachPair) {
  RunOptions options = sample("direct").run;
  options.comparisons = {"solver=Newton"};
  options.swaps = {"solver=Newton@step=41"};
  const RunResult result = run_quietly(options);
  ASSERT_EQ(result.report.comparisons_size(), 2);
  EXPECT_EQ(result.report.comparisons(0).shadow().calls(), 40U);
  EXPECT_EQ(result.report.comparisons(1).shadow().calls(), kSteps - 40U);
  EXPECT_EQ(result.report.comparisons(1).shadow().differing_calls(), 0U);
  const std::string text = summarize(result.report, {});
  EXPECT_THAT(text, HasSubstr("  compared: solver Sequential with Newton: "));
  EXPECT_THAT(text, HasSubstr("  compared from step 41 on: solver Newton with Newton: 0 of 80 answers differ"));
}

// A call of a plugin that is hosted in the process takes time, too.
TEST(Comparison, TellsTimesInAnyHosting) {
  RunOptions options = sample("direct").run;
  options.comparisons = {"solver=Newton"};
  const RunResult result = run_quietly(options);
  ASSERT_EQ(result.report.comparisons_size(), 1);
  EXPECT_GT(result.report.comparisons(0).shadow().from_us(), 0.0);
  EXPECT_GT(result.report.comparisons(0).shadow().to_us(), 0.0);
}

}  // namespace
}  // namespace gravitas::control
