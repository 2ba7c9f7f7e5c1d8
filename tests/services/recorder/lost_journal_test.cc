// Runs that go on from a checkpoint whose journal is missing, damaged or another's.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cstddef>
#include <filesystem>
#include <fstream>
#include <optional>
#include <string>
#include <vector>

#include "services/recorder/durable_file.h"
#include "services/recorder/journal.h"
#include "services/recorder/recorder.h"
#include "services/run/session.h"
#include "tests/paths.h"
#include "tests/run_quietly.h"
#include "tests/services/cli/program.h"

namespace gravitas {
namespace {

using harness::run_quietly;
using harness::ScratchFolder;
using kernel::Hosting;
using ::testing::Contains;
using ::testing::HasSubstr;
using ::testing::Not;

// A checkpoint of the middle of a run, an edit after it, and the journal that alone knows of that.
class LostJournal : public ::testing::Test {
 protected:
  static RunOptions bounce() {
    RunOptions options;
    options.scenes = {harness::shipped_scene("bounce")};
    options.hosting = {{std::nullopt, Hosting::kDirect}};
    options.steps = 120;
    return options;
  }
  void SetUp() override {
    RunOptions options = bounce();
    options.checkpoint = path_;
    options.checkpoint_every = 50;
    options.edits = {"set Body.RubberBall.LinearVelocity={1,0,0}@step=70"};
    std::vector<std::byte> middle;
    const RunResult result = run(
        options, [] { return false; },
        [&](const Progress& now) {
          if (now.step == 60) middle = read_whole_file(path_);
        });
    ASSERT_EQ(result.outcome, RunOutcome::kCompleted) << result.fault;
    chain_ = result.report.chain_hash();
    last_ = read_whole_file(path_);
    replace_file(path_, middle);
  }

  RunOptions go_on(bool despite_journal = false) const {
    RunOptions options = bounce();
    options.resume = path_;
    options.despite_journal = despite_journal;
    return options;
  }
  void expect_refusal(const std::string& why) const {
    try {
      run_quietly(go_on());
      ADD_FAILURE() << "it was not refused";
    } catch (const BadInput& problem) {
      EXPECT_THAT(problem.what(), HasSubstr(why));
      EXPECT_THAT(problem.what(), HasSubstr("edits, swaps and steps"));
      EXPECT_THAT(problem.what(), HasSubstr("--despite-journal"));
    }
  }

  const ScratchFolder folder_;
  const std::string path_ = folder_.path("checkpoint"), journal_ = journal_of(path_);
  std::string chain_;
  std::vector<std::byte> last_;  // of the run's end
};

TEST_F(LostJournal, KnowsTheEdit) { EXPECT_EQ(run_quietly(go_on()).report.chain_hash(), chain_); }

TEST_F(LostJournal, ThatIsMissingIsRefusedUnlessOneAsksForIt) {
  std::filesystem::remove(journal_);
  expect_refusal("it is missing");
  const RunResult result = run_quietly(go_on(true));
  EXPECT_EQ(result.outcome, RunOutcome::kCompleted) << result.fault;
  EXPECT_NE(result.report.chain_hash(), chain_);
  EXPECT_THAT(result.report.warnings(),
              Contains(HasSubstr("it is missing, and the run went on after the checkpoint; left aside")));
}

TEST_F(LostJournal, ThatIsDamagedInItsMiddleIsRefusedUnlessOneAsksForIt) {
  std::vector<std::byte> bytes = read_whole_file(journal_);
  bytes[bytes.size() / 2] ^= std::byte{16};
  replace_file(journal_, bytes);
  expect_refusal("is damaged, and whole ones stand behind it");
  EXPECT_EQ(run_quietly(go_on(true)).outcome, RunOutcome::kCompleted);
}

TEST_F(LostJournal, ThatIsOfAnotherRunIsRefusedUnlessOneAsksForIt) {
  std::ofstream(journal_) << "something else, long enough to be a header of a journal that it is not";
  expect_refusal("not a journal that this build reads");
  EXPECT_EQ(run_quietly(go_on(true)).outcome, RunOutcome::kCompleted);
}

// Nothing came after the checkpoint of a run's end.
TEST_F(LostJournal, AtTheEndOfARunIsNoLoss) {
  replace_file(path_, last_);
  std::filesystem::remove(journal_);
  const RunResult result = run_quietly(go_on());
  EXPECT_EQ(result.report.chain_hash(), chain_);
  EXPECT_THAT(result.report.warnings(), Not(Contains(HasSubstr("journal"))));
}

TEST_F(LostJournal, ThatIsDamagedAtTheEndOfARunIsNoLoss) {
  replace_file(path_, last_);
  std::vector<std::byte> bytes = read_whole_file(journal_);
  bytes[bytes.size() / 2] ^= std::byte{16};
  replace_file(journal_, bytes);
  EXPECT_EQ(run_quietly(go_on()).report.chain_hash(), chain_);
}

// A run that is resumed and ends before where it came before: the journal still knows more.
TEST_F(LostJournal, OfARunThatCameFurtherBeforeIsRefused) {
  RunOptions options = go_on();
  options.checkpoint = path_;
  options.steps = 60;
  ASSERT_EQ(run_quietly(options).outcome, RunOutcome::kCompleted);
  EXPECT_EQ(run_quietly(go_on()).report.chain_hash(), chain_);
  std::filesystem::remove(journal_);
  expect_refusal("it is missing");
}

}  // namespace
}  // namespace gravitas
