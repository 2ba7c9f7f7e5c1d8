// Slots that share a process, from a scene to its report: bits, faults, swaps, checkpoints.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <set>
#include <string>
#include <vector>

#include "tests/services/cli/program.h"

namespace gravitas {
namespace {

using harness::read_file;
using harness::read_report;
using harness::run_program;
using harness::ScratchFolder;
using ::testing::Contains;
using ::testing::HasSubstr;
using ::testing::Not;

// All slots of a scene whose force is asked in every step, in one process.
constexpr const char* kTogether = R"(Plugins {
  Plugin { Slot = "space" Process = "one" }
  Plugin { Slot = "collision" Process = "one" }
  Plugin { Slot = "force" Process = "one" }
  Plugin { Slot = "solver" Process = "one" }
  Plugin { Slot = "integrator" Process = "one" }
  Plugin { Slot = "constraint" Process = "one" }
})";

class SharedProcessRun : public ::testing::Test {
 protected:
  report::v1::Report go(std::vector<std::string> words, bool together = true) {
    const std::string report = folder_.path("report.json");
    std::vector<std::string> all = {"run", harness::shipped_scene("thruster")};
    if (together) all.push_back(folder_.write("together.gravitas", kTogether));
    all.insert(all.end(), {"--report", report});
    all.insert(all.end(), words.begin(), words.end());
    const harness::ProgramResult result = run_program(all, folder_);
    EXPECT_EQ(result.exit_code, 0) << result.err;
    said_ = result.err;
    return result.exit_code == 0 ? read_report(read_file(report)) : report::v1::Report();
  }
  static std::set<std::int64_t> processes(const report::v1::Report& report) {
    std::set<std::int64_t> all;
    for (const report::v1::PlannedSlot& slot : report.plan().slots()) all.insert(slot.pid());
    return all;
  }

  const ScratchFolder folder_;
  std::string said_;
};

TEST_F(SharedProcessRun, GivesTheBitsOfSlotsApart) {
  const report::v1::Report apart = go({"--steps", "60"}, false);
  EXPECT_GE(processes(apart).size(), 2U);
  for (const char* hosting : {"shm", "grpc"}) {
    const report::v1::Report together = go({"--steps", "60", "--hosting", hosting});
    EXPECT_EQ(together.chain_hash(), apart.chain_hash()) << hosting;
    EXPECT_EQ(processes(together).size(), 1U) << hosting;
    EXPECT_THAT(together.warnings(), Not(Contains(HasSubstr("Process"))));
  }
  EXPECT_EQ(go({"--steps", "60", "--hosting", "direct"}).chain_hash(), apart.chain_hash());
}

TEST_F(SharedProcessRun, SurvivesFaultsAndSwapsInItsSlots) {
  const std::string quiet = go({"--steps", "60"}).chain_hash();
  for (const char* hosting : {"shm", "grpc"}) {
    const report::v1::Report hurt =
        go({"--steps", "60", "--hosting", hosting, "--fault", "force:kill@step=10", "--fault",
            "integrator:segv@step=20", "--swap", "force=BasicForce@step=30", "--fault", "force:abort@step=50"});
    EXPECT_EQ(hurt.chain_hash(), quiet) << hosting;
    ASSERT_EQ(hurt.faults_size(), 3) << hosting;
    EXPECT_EQ(hurt.faults(0).slot(), "force");
    EXPECT_EQ(hurt.faults(1).slot(), "integrator");
    EXPECT_EQ(hurt.faults(2).slot(), "force");
    ASSERT_EQ(hurt.swaps_size(), 1);
    EXPECT_EQ(hurt.swaps(0).outcome(), "committed");
    EXPECT_EQ(processes(hurt).size(), 1U);
  }
}

TEST_F(SharedProcessRun, IsResumed) {
  const std::vector<std::string> swap = {"--swap", "integrator=RK4@step=20"};
  const auto with_swap = [&](std::vector<std::string> words) {
    words.insert(words.end(), swap.begin(), swap.end());
    return go(words).chain_hash();
  };
  const std::string whole = with_swap({"--steps", "60"}), kept = folder_.path("kept");
  for (const char* steps : {"10", "25"}) {
    with_swap({"--steps", steps, "--checkpoint", kept});
    EXPECT_EQ(with_swap({"--steps", "60", "--resume", kept}), whole) << steps;
    EXPECT_EQ(with_swap({"--steps", "60", "--resume", kept, "--hosting", "grpc"}), whole) << steps;
  }
}

TEST_F(SharedProcessRun, IsSaidToBeLeftByASlotThatIsHostedElsewhere) {
  const report::v1::Report split = go({"--steps", "5", "--hosting", "integrator=direct"});
  EXPECT_THAT(split.warnings(), Contains(HasSubstr("the slots of Process \"one\" are hosted in different ways")));
}

}  // namespace
}  // namespace gravitas
