// Workers that lie in their handshake are refused with the reason, wherever one is started: the old one goes on.
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/stat.h>

#include <fstream>
#include <memory>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "kernel/environment.h"
#include "plugin_sdk/channel/private_folder.h"
#include "plugin_sdk/host/handshake_lie.h"
#include "tests/kernel/one_call.h"
#include "tests/kernel/world_builder.h"

namespace gravitas {
namespace {

using harness::busy_world;
using harness::Integration;
using harness::start_worker;
using kernel::Environment;
using kernel::FaultKind;
using kernel::Hosting;
using kernel::StageFault;
using kernel::StepOutcome;
using kernel::SwapState;
using ::testing::Contains;
using ::testing::HasSubstr;

constexpr std::uint32_t kMeetingSteps = 40;
constexpr const char* kBuild = "build";

std::string refusal_of(std::string_view lie) { return std::string(host::find_handshake_lie(lie)->refusal); }

std::vector<host::HandshakeLie> refused_lies() {
  std::vector<host::HandshakeLie> lies(host::handshake_lies().begin(), host::handshake_lies().end());
  std::erase_if(lies, [](const host::HandshakeLie& lie) { return lie.refusal.empty(); });
  return lies;
}

// While it lives, workers are started by a script: each of those that serve `library` lies as the next of `lies` says, and
// when there are none left tells the truth.
class LyingWorkers {
 public:
  LyingWorkers(const std::string& library, const std::vector<std::string>& lies) : honest_(kernel::worker_program()) {
    std::ofstream file(folder_.path() + "/lies");
    for (const std::string& lie : lies) file << lie << '\n';
    const std::string script = folder_.path() + "/worker";
    std::ofstream(script) << "#!/bin/sh\ncd '" << folder_.path() << "'\ncase \"$*\" in *" << library
                          << "*) lie=$(head -n 1 lies 2>/dev/null); sed -i 1d lies 2>/dev/null;; esac\nexec '"
                          << honest_ << "' \"$@\" ${lie:+--lie $lie}\n";
    ::chmod(script.c_str(), 0755);
    kernel::set_worker_program(script);
  }
  ~LyingWorkers() { kernel::set_worker_program(honest_); }
  LyingWorkers(const LyingWorkers&) = delete;
  LyingWorkers& operator=(const LyingWorkers&) = delete;

 private:
  channel::PrivateFolder folder_;
  std::string honest_;
};

class Handshake : public ::testing::TestWithParam<Hosting> {};
INSTANTIATE_TEST_SUITE_P(On, Handshake, ::testing::Values(Hosting::kSharedMemory, Hosting::kGrpc),
                         [](const auto& one) { return std::string(kernel::hosting_name(one.param)); });

TEST_P(Handshake, RefusesEveryLieWithItsReason) {
  ASSERT_EQ(refused_lies().size(), 10U);
  for (const host::HandshakeLie& lie : refused_lies()) {
    SCOPED_TRACE(lie.what);
    const LyingWorkers workers("integrator_euler", {std::string(lie.what)});
    try {
      start_worker(GetParam(), "integrator_euler", 30.0);
      ADD_FAILURE() << "it was taken";
    } catch (const StageFault& fault) {
      EXPECT_EQ(fault.kind, FaultKind::kHandshake);
      EXPECT_THAT(fault.text(), HasSubstr(std::string(lie.refusal)));
    }
  }
}

TEST_P(Handshake, TakesAnotherBuildAndSaysSo) {
  const LyingWorkers workers("integrator_euler", {kBuild});
  Integration call;
  const std::unique_ptr<kernel::Carrier> carrier = start_worker(GetParam(), "integrator_euler", 30.0);
  EXPECT_EQ(call.make(carrier.get()).status, GRAVITAS_OK);
  EXPECT_THAT(carrier->take_complaints(), Contains("it is of another build, another build: its bits may differ"));
}

Hash chain_without_lies() {
  Environment quiet(busy_world(Hosting::kDirect).steps(kMeetingSteps, 1.0 / 120.0).description());
  for (std::uint32_t step = 0; step < kMeetingSteps; ++step) EXPECT_EQ(quiet.step(), StepOutcome::kCommitted);
  return quiet.chain_hash();
}

class LyingSolver : public Handshake {
 protected:
  harness::WorldBuilder builder(std::uint32_t standbys) const {
    harness::WorldBuilder builder = busy_world(GetParam()).steps(kMeetingSteps, 1.0 / 120.0);
    builder.description().solver.standbys = standbys;
    return builder;
  }
  static void run_to_end(Environment* world) {
    while (world->step_count() < kMeetingSteps)
      ASSERT_EQ(world->step(), StepOutcome::kCommitted) << world->fault()->fault.text();
    EXPECT_EQ(world->chain_hash(), chain_without_lies());
  }
};
INSTANTIATE_TEST_SUITE_P(On, LyingSolver, ::testing::Values(Hosting::kSharedMemory, Hosting::kGrpc),
                         [](const auto& one) { return std::string(kernel::hosting_name(one.param)); });

TEST_P(LyingSolver, IsRefusedAtTheStart) {
  const LyingWorkers workers("solver_sequential", {"schema"});
  try {
    const Environment world(builder(1).description());
    ADD_FAILURE() << "it was taken";
  } catch (const StageFault& fault) {
    EXPECT_EQ(fault.slot, Slot::kSolver);
    EXPECT_EQ(fault.plugin, "Sequential");
    EXPECT_THAT(fault.text(), HasSubstr(refusal_of("schema")));
  }
}

// The run waits until one that is started cold is honest.
TEST_P(LyingSolver, IsNotTakenAtAColdStart) {
  std::optional<LyingWorkers> workers;  // outlives the world, whose standbys start beside it
  std::optional<Environment> world;
  world.emplace(builder(0).description());
  workers.emplace("solver_sequential", std::vector<std::string>{"protocol", "nonce"});
  world->inject({Slot::kSolver, "kill", 10});
  run_to_end(&*world);
  ASSERT_EQ(world->faults().size(), 1U);
  EXPECT_EQ(world->faults()[0].recovered_by, "cold start");
}

TEST_P(LyingSolver, IsNotTakenAsAStandby) {
  std::optional<LyingWorkers> workers;  // outlives the world, whose standbys start beside it
  Environment world(builder(1).steps(60'000, 1e-4).description());
  workers.emplace("solver_sequential", std::vector<std::string>{"protocol", "processor"});
  std::vector<std::string> refused;
  while (refused.size() < 2 && world.step_count() < 59'000) {
    ASSERT_EQ(world.step(), StepOutcome::kCommitted);
    for (const std::string& one : world.warnings())
      if (one.find("standby could not be started") != std::string::npos) refused.push_back(one);
  }
  ASSERT_EQ(refused.size(), 2U);
  EXPECT_THAT(refused[0], HasSubstr(refusal_of("protocol")));
  EXPECT_THAT(refused[1], HasSubstr(refusal_of("processor")));
  EXPECT_TRUE(world.faults().empty());
}

TEST_P(LyingSolver, IsNotSwappedIn) {
  Environment world(builder(1).description());
  std::uint32_t step = 5;
  const std::vector<host::HandshakeLie> lies = refused_lies();
  for (const host::HandshakeLie& lie : lies) {
    kernel::PluginChoice liar = busy_world(GetParam()).description().solver.plugins[0];
    liar.command = "'" + kernel::worker_program() + "' --lie " + std::string(lie.what) + " '" + liar.library + "'";
    world.order_swap({Slot::kSolver, liar, std::nullopt, step += 3});
  }
  run_to_end(&world);
  ASSERT_EQ(world.swaps().size(), lies.size());
  auto expected = lies.begin();
  for (const kernel::SwapRecord& swap : world.swaps()) {
    EXPECT_EQ(swap.state, SwapState::kRefused);
    EXPECT_THAT(swap.reason, HasSubstr(std::string((expected++)->refusal)));
  }
  EXPECT_TRUE(world.faults().empty());
}

}  // namespace
}  // namespace gravitas
