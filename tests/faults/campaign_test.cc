// The fault campaign, in short: over both process carriers, in virtual time, and with each defence off, which it has to
// notice.
#include <gmock/gmock.h>
#include <google/protobuf/util/json_util.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <filesystem>
#include <map>
#include <sstream>
#include <string>
#include <utility>
#include <vector>

#include "gravitas/campaign/v1/campaign.pb.h"
#include "services/campaign/scenes.h"
#include "services/campaign/table.h"
#include "services/campaign/trial_plan.h"
#include "tests/services/cli/program.h"

namespace gravitas {
namespace {

using campaign::v1::Table;
using campaign::v1::Trial;
using harness::ProgramResult;
using harness::read_file;
using harness::run_program;
using harness::ScratchFolder;
using ::testing::HasSubstr;

struct Outcome {
  ProgramResult program;
  Table table;
};

Outcome campaign_of(std::vector<std::string> words, const ScratchFolder& folder) {
  words.insert(words.begin(), {"campaign", "--json"});
  Outcome outcome{run_program(words, folder), {}};
  const auto status = google::protobuf::util::JsonStringToMessage(outcome.program.out, &outcome.table);
  EXPECT_TRUE(status.ok()) << outcome.program.out << outcome.program.err;
  return outcome;
}

std::string failures(const Table& table) {
  std::string text;
  for (const std::string& one : table.failures()) text += one + "\n";
  return text;
}

const campaign::v1::Row* find_row(const Table& table, const std::string& group) {
  for (const campaign::v1::Row& row : table.rows())
    if (row.group() == group) return &row;
  return nullptr;
}

// What any check of the form finds is not counted as a wrong value, so that the share which escapes is of those alone
// that may escape.
TEST(CampaignCounts, WrongValuesAreDrawnOfTheRightForm) {
  const std::vector<campaign::Scene> scenes = campaign::load_scenes({}, 1);
  std::map<std::string, int> drawn;
  for (std::uint64_t i = 0; i < 2000; ++i)
    for (const campaign::PlannedFault& fault :
         campaign::draw_trial(campaign::trial_seed(7, i), scenes, {.tier = campaign::Tier::kSimulated}).faults) {
      ++drawn[fault.group];
      const bool is_no_number = fault.order.starts_with("nan") || fault.order.starts_with("inf");
      const bool has_ids = fault.slot == Slot::kSpace || fault.slot == Slot::kCollision;
      const bool is_out_of_order = has_ids && (fault.order == "permute" || fault.order == "double");
      if (is_no_number || is_out_of_order) {
        EXPECT_THAT(fault.group, ::testing::AnyOf("malformed", "poison")) << fault.order;
      }
      EXPECT_EQ(fault.group == "values", fault.duty == campaign::Duty::kWrong && !fault.rerun) << fault.order;
    }
  EXPECT_GT(drawn["values"], 100);
  EXPECT_GT(drawn["malformed"], 100);
}

TEST(CampaignCounts, WrongValuesAreThoseOfTheirGroupThatSomethingFoundOrNothingDid) {
  Trial trial;
  for (const auto& [group, outcome] : {std::pair{"values", "B"},
                                       {"values", "not caught"},
                                       {"values", "M"},
                                       {"malformed", "B"},
                                       {"poison", "B"},
                                       {"re-run", "B"},
                                       {"tolerance", "needs re-run"}}) {
    campaign::v1::Fault* fault = trial.add_faults();
    fault->set_group(group);
    fault->set_outcome(outcome);
  }
  campaign::Tally tally;
  tally.add(trial, "gravitas campaign --trial 1");
  EXPECT_EQ(tally.table().wrong_values(), 2U);
  EXPECT_EQ(tally.table().not_caught(), 1U);
}

// Real worker processes: part N of 4, 500 faults each.
class RealFaults : public ::testing::TestWithParam<int> {};
INSTANTIATE_TEST_SUITE_P(Part, RealFaults, ::testing::Range(1, 5));

TEST_P(RealFaults, AreSurvivedBitForBit) {
  const ScratchFolder folder;
  const Outcome outcome =
      campaign_of({"--faults", "2000", "--seed", "2026", "--shard", std::to_string(GetParam()) + "/4", "--per-trial",
                   "20", "--jobs", "2", "--deadline", "0.5"},
                  folder);
  EXPECT_EQ(outcome.program.exit_code, 0) << outcome.program.err << failures(outcome.table);
  EXPECT_GE(outcome.table.injected(), 500U);
  EXPECT_GT(outcome.table.manifested(), outcome.table.injected() / 2);
  EXPECT_GT(outcome.table.standby().count(), 0U);
}

// A busy machine lets three in a hundred more of them pass unseen.
TEST(SimulatedFaults, AreSurvivedBitForBit) {
  const ScratchFolder folder;
  const Outcome outcome = campaign_of({"--tier", "simulated", "--faults", "12700", "--seed", "2026"}, folder);
  EXPECT_EQ(outcome.program.exit_code, 0) << outcome.program.err << failures(outcome.table);
  EXPECT_GE(outcome.table.injected(), 12000U);
  EXPECT_EQ(outcome.table.forbidden(), 0U);
  EXPECT_LT(outcome.table.forbidden_bound(), 3e-4);
  for (const char* group : {"process", "hang", "wire", "values", "malformed", "re-run", "start", "poison", "swap"}) {
    const campaign::v1::Row* row = find_row(outcome.table, group);
    ASSERT_NE(row, nullptr) << group;
    EXPECT_GT(row->injected(), 50U) << group;
  }
}

// All that a trial does comes from its seed.
TEST(SimulatedFaults, AreTheSameAgain) {
  const ScratchFolder folder;
  // as a campaign draws them, of 64 bits
  const std::vector<std::string> words = {"campaign", "--tier", "simulated", "--trial", "6791897765849424158"};
  const ProgramResult first = run_program(words, folder), second = run_program(words, folder);
  EXPECT_EQ(first.exit_code, 0) << first.err;
  Trial trials[2];
  ASSERT_TRUE(google::protobuf::util::JsonStringToMessage(first.out, &trials[0]).ok());
  ASSERT_TRUE(google::protobuf::util::JsonStringToMessage(second.out, &trials[1]).ok());
  ASSERT_GT(trials[0].faults_size(), 0);
  for (Trial& trial : trials) {
    // times, and whether a standby was ready yet, are the machine's
    trial.clear_standby_us();
    trial.clear_cold_start_us();
    trial.clear_swap_pause_us();
    for (campaign::v1::Fault& fault : *trial.mutable_faults()) fault.clear_recovered_by();
  }
  EXPECT_EQ(trials[0].SerializeAsString(), trials[1].SerializeAsString());
}

// A worker that is dead before it is asked is the fault of its start: a machine that is busy has no part in virtual time.
TEST(SimulatedFaults, AFailedStartExplainsTheCallThatMissesTheWorker) {
  const ScratchFolder folder;
  const ProgramResult result =
      run_program({"campaign", "--tier", "simulated", "--trial", "8706025257686048087"}, folder);
  ASSERT_EQ(result.exit_code, 0) << result.err;
  Trial trial;
  ASSERT_TRUE(google::protobuf::util::JsonStringToMessage(result.out, &trial).ok());
  EXPECT_EQ(trial.unprovoked_size(), 0);
  const campaign::v1::Fault& start = *std::ranges::find(trial.faults(), "start", &campaign::v1::Fault::group);
  EXPECT_EQ(start.order(), "a start dies after its handshake");
  EXPECT_EQ(start.outcome(), "B");
}

TEST(SimulatedFaults, TheLogSaysWhatItHolds) {
  const ScratchFolder folder;
  const std::string out = folder.path("out");
  const Outcome outcome = campaign_of({"--tier", "simulated", "--faults", "2000", "--seed", "7", "--out", out}, folder);
  EXPECT_EQ(outcome.table.unprovoked(), 0U);
  const std::string log = read_file(out + "/trials.jsonl");
  EXPECT_EQ(static_cast<std::uint64_t>(std::ranges::count(log, '\n')), outcome.table.logged());
  EXPECT_LT(outcome.table.logged(), outcome.table.trials());
  EXPECT_THAT(read_file(out + "/table.txt"), HasSubstr("trials.jsonl holds " + std::to_string(outcome.table.logged()) +
                                                       " of " + std::to_string(outcome.table.trials()) + " trials"));
}

// A campaign that cannot fail would prove nothing.
class WithoutADefence : public ::testing::TestWithParam<const char*> {};
INSTANTIATE_TEST_SUITE_P(Of, WithoutADefence,
                         ::testing::Values("structure", "numbers", "physics", "confirmation", "replay", "digest",
                                           "epoch", "deadline"),
                         [](const auto& one) { return std::string(one.param); });

TEST_P(WithoutADefence, TheCampaignFails) {
  const ScratchFolder folder;
  const Outcome outcome = campaign_of(
      {"--tier", "simulated", "--faults", "1000", "--seed", "7", "--patience", "2", "--without", GetParam()}, folder);
  EXPECT_EQ(outcome.program.exit_code, 4) << outcome.program.err;
  EXPECT_GT(outcome.table.forbidden() + outcome.table.not_caught(), 0U);
  ASSERT_GT(outcome.table.failures_size(), 0);
  EXPECT_THAT(outcome.table.failures(0), HasSubstr(std::string("--without ") + GetParam() + " --trial "));
}

// The switches reach the real carrier, too.
class WithoutADefenceOfSharedMemory : public ::testing::TestWithParam<const char*> {};
INSTANTIATE_TEST_SUITE_P(Of, WithoutADefenceOfSharedMemory, ::testing::Values("numbers", "replay"),
                         [](const auto& one) { return std::string(one.param); });

TEST_P(WithoutADefenceOfSharedMemory, TheCampaignFails) {
  const ScratchFolder folder;
  const Outcome outcome = campaign_of(
      {"--hosting", "shm", "--faults", "400", "--seed", "7", "--jobs", "2", "--without", GetParam()}, folder);
  EXPECT_EQ(outcome.program.exit_code, 4) << outcome.program.err;
  EXPECT_GT(outcome.table.forbidden(), 0U);
}

TEST(CampaignFiles, TellTheSameStory) {
  const ScratchFolder folder;
  const std::string out = folder.path("out");
  const Outcome outcome = campaign_of({"--faults", "40", "--seed", "3", "--hosting", "shm", "--out", out}, folder);
  EXPECT_EQ(outcome.program.exit_code, 0) << outcome.program.err << failures(outcome.table);
  std::uint64_t trials = 0, injected = 0;
  std::istringstream log(read_file(out + "/trials.jsonl"));
  for (std::string line; std::getline(log, line); ++trials) {
    Trial trial;
    ASSERT_TRUE(google::protobuf::util::JsonStringToMessage(line, &trial).ok()) << line;
    EXPECT_NE(trial.seed(), 0U);
    EXPECT_EQ(trial.carrier(), "shm");
    injected += static_cast<std::uint64_t>(trial.faults_size());
    for (const campaign::v1::Fault& fault : trial.faults()) {
      EXPECT_FALSE(fault.outcome().empty());
      EXPECT_FALSE(fault.group().empty());
    }
  }
  EXPECT_EQ(trials, outcome.table.trials());
  EXPECT_EQ(injected, outcome.table.injected());
  Table table;
  EXPECT_TRUE(google::protobuf::util::JsonStringToMessage(read_file(out + "/table.json"), &table).ok());
  EXPECT_EQ(table.SerializeAsString(), outcome.table.SerializeAsString());
  EXPECT_THAT(read_file(out + "/table.txt"), HasSubstr("nothing forbidden happened"));
  const std::string page = read_file(out + "/index.html");
  EXPECT_THAT(page, HasSubstr("<svg"));
  EXPECT_THAT(page, HasSubstr("</html>"));
  // needs nothing else
  EXPECT_EQ(page.find("http"), std::string::npos);
  EXPECT_EQ(page.find("<script"), std::string::npos);
}

TEST(CampaignInput, IsCheckedFirst) {
  const ScratchFolder folder;
  const auto refusal = [&](std::vector<std::string> words) {
    words.insert(words.begin(), "campaign");
    const ProgramResult result = run_program(words, folder);
    EXPECT_EQ(result.exit_code, 2) << result.err;
    return result.err;
  };
  EXPECT_THAT(refusal({"--without", "digst"}), HasSubstr("digest"));
  EXPECT_THAT(refusal({"nowhere"}), HasSubstr("there is no scene 'nowhere'"));
  EXPECT_THAT(refusal({"--shard", "3/2"}), HasSubstr("I from 1 to K"));
  EXPECT_THAT(refusal({"--tier", "unreal"}), HasSubstr("unreal"));
}

TEST(Endurance, ThreeSecondsAtOneKilohertzWithAKillInEverySlotEverySecond) {
  const ScratchFolder folder;
  const ProgramResult result = run_program({"campaign", "--endurance", "3"}, folder);
  EXPECT_EQ(result.exit_code, 0) << result.out << result.err;
  EXPECT_THAT(result.out, HasSubstr("3000 steps at 1 kHz with 18 kills"));
  EXPECT_THAT(result.out, HasSubstr("the chain of hashes is that of the quiet run"));
}

}  // namespace
}  // namespace gravitas
