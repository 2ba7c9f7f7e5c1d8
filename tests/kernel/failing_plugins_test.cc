// What becomes of a plugin that fails: it is replaced, and the record says which slot, which plugin, what happened and
// how it was noticed. Where it fails on, the environment pauses at its last commit.
#include <dirent.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/wait.h>
#include <unistd.h>

#include <cstring>
#include <string>
#include <vector>

#include "kernel/carrier/carrier.h"
#include "kernel/environment.h"
#include "plugin_sdk/floating_point.h"
#include "tests/kernel/world_builder.h"
#include "tests/paths.h"

namespace gravitas {
namespace {

using harness::faulty_plugin_path;
using harness::WorldBuilder;
using kernel::Environment;
using kernel::FaultKind;
using kernel::Hosting;
using kernel::StepOutcome;

struct Expected {
  const char* library;
  FaultKind kind;
  const char* detected_by;
  const char* text;  // part of it
};

void PrintTo(const Expected& expected, std::ostream* out) { *out << expected.library; }

WorldBuilder ball_on_ground(Hosting hosting) {
  WorldBuilder builder(hosting);
  builder.steps(20, 0.01).ground().sphere(0.5, 1.0, Vector3(0, 0.5, 0)).gravity(Vector3(0, -10, 0));
  return builder;
}

// The i-th failure, which a fresh plugin made good unless it was the last that is allowed.
void expect_failure(const kernel::FaultRecord& record, std::uint32_t i, bool is_last, const Expected& expected) {
  EXPECT_EQ(record.step, 3 + 2 * i);
  EXPECT_EQ(record.fault.kind, expected.kind) << record.fault.text();
  EXPECT_EQ(record.fault.detected_by, expected.detected_by);
  EXPECT_EQ(record.fault.slot, Slot::kIntegrator);
  EXPECT_EQ(record.fault.plugin, "Faulty");
  EXPECT_NE(record.fault.text().find(expected.text), std::string::npos) << record.fault.text();
  EXPECT_EQ(record.recovered_by.empty(), is_last) << record.recovered_by;
  EXPECT_EQ(record.recovery_us > 0.0, !is_last);
}

// Runs a world whose integrator misbehaves in the third call of each of its lives: a fresh one makes the step, until the
// budget of five failures is spent at step 11.
void expect_failures_and_pause(const WorldBuilder& builder, const Expected& expected) {
  Environment world(builder.description());
  while (world.step_count() < 10) ASSERT_EQ(world.step(), StepOutcome::kCommitted) << world.fault()->fault.text();
  const Hash state = world.state_hash(), chain = world.chain_hash();
  ASSERT_EQ(world.step(), StepOutcome::kPaused);
  ASSERT_TRUE(world.fault().has_value());
  ASSERT_EQ(world.faults().size(), 5U);
  for (std::uint32_t i = 0; i < 5; ++i) expect_failure(world.faults()[i], i, i == 4, expected);
  EXPECT_EQ(world.fault()->step, 11U);
  EXPECT_EQ(world.fault()->fault.kind, expected.kind);
  // the committed state is untouched, and stays so
  EXPECT_EQ(world.step(), StepOutcome::kPaused);
  EXPECT_EQ(world.step_count(), 10U);
  EXPECT_EQ(world.state_hash(), state);
  EXPECT_EQ(world.chain_hash(), chain);
}

void expect_failures_in_worker(Hosting hosting, const Expected& expected) {
  WorldBuilder builder = ball_on_ground(hosting);
  builder.plugin(Slot::kIntegrator, faulty_plugin_path(expected.library));
  // short only where it is waited for: a busy machine is slow, and a sanitizer's last words are
  builder.description().integrator.deadline = expected.kind == FaultKind::kDeadline ? 0.5 : 10.0;
  expect_failures_and_pause(builder, expected);
}

// Marks must come within the deadline, of which ten pass for each failure: one is enough.
void expect_replacement_of_marking(Hosting hosting) {
  WorldBuilder builder = ball_on_ground(hosting);
  builder.plugin(Slot::kIntegrator, faulty_plugin_path("integrator_marks_forever"));
  builder.description().integrator.deadline = 0.25;
  Environment world(builder.description());
  while (world.step_count() < 4) ASSERT_EQ(world.step(), StepOutcome::kCommitted) << world.fault()->fault.text();
  ASSERT_EQ(world.faults().size(), 1U);
  expect_failure(world.faults()[0], 0, false,
                 {"integrator_marks_forever", FaultKind::kDeadline, "deadline", "ten times"});
}

TEST(MarksForever, IsReplacedOnSharedMemory) { expect_replacement_of_marking(Hosting::kSharedMemory); }
TEST(MarksForever, IsReplacedOnGrpc) { expect_replacement_of_marking(Hosting::kGrpc); }

class InWorker : public ::testing::TestWithParam<Expected> {};
TEST_P(InWorker, IsReplacedUntilTheBudgetIsSpent) { expect_failures_in_worker(Hosting::kSharedMemory, GetParam()); }

class InGrpcWorker : public ::testing::TestWithParam<Expected> {};
TEST_P(InGrpcWorker, IsReplacedUntilTheBudgetIsSpent) { expect_failures_in_worker(Hosting::kGrpc, GetParam()); }

// Ends the process, or never answers: only a worker's failure can be survived.
const Expected kFatal[] = {
    {"integrator_killed", FaultKind::kDeath, "pidfd", "killed by signal 9"},
    {"integrator_segv", FaultKind::kDeath, "pidfd", "killed by signal 11"},
    {"integrator_exits", FaultKind::kDeath, "pidfd", "exit code 0"},
    {"integrator_hangs", FaultKind::kDeadline, "deadline", "within its deadline"},
};

// Answers wrongly, which is noticed on any hosting.
const Expected kWrong[] = {
    {"integrator_throws", FaultKind::kFailure, "status", "out of ideas"},
    {"integrator_speaks_latin_1", FaultKind::kFailure, "status", "zu k?hl: ????"},
    {"integrator_flush_to_zero", FaultKind::kFailure, "status", "floating-point"},
    {"integrator_nan", FaultKind::kBadNumbers, "numbers", "position of row 1 is not finite"},
    {"integrator_not_unit", FaultKind::kBadNumbers, "numbers", "orientation of row 0"},
    {"integrator_moves_ground", FaultKind::kBadNumbers, "numbers", "immovable body 'body0'"},
    {"integrator_short", FaultKind::kBadStructure, "structure", "position has 1 row"},
    {"integrator_long", FaultKind::kBadStructure, "structure", "position has 200000 rows"},
};

// Says that all is well with an answer that its room cannot hold: nobody reads beyond it.
const Expected kOverfull[] = {{"integrator_overfull", FaultKind::kBadFrame, "wire",
                               "column plugin_state is longer than its room: answered 200000 numbers, room for "}};

// Where messages have the room they need the worker notices it, elsewhere the kernel.
const Expected kGreedy[] = {
    {"integrator_wants_room", FaultKind::kBadStructure, "structure", "room for"},
    {"integrator_wants_more_room", FaultKind::kBadStructure, "structure", "more room again and again"}};
const Expected kOverfullInMessages[] = {
    {"integrator_overfull", FaultKind::kFailure, "status",
     "column plugin_state is longer than its room: answered 200000 numbers, room for "}};
const Expected kGreedyInMessages[] = {
    {"integrator_wants_room", FaultKind::kFailure, "status", "room for"},
    {"integrator_wants_more_room", FaultKind::kFailure, "status", "more room again and again"}};

std::string name_of(const ::testing::TestParamInfo<Expected>& one) { return one.param.library; }

INSTANTIATE_TEST_SUITE_P(Fatal, InWorker, ::testing::ValuesIn(kFatal), name_of);
INSTANTIATE_TEST_SUITE_P(Wrong, InWorker, ::testing::ValuesIn(kWrong), name_of);
INSTANTIATE_TEST_SUITE_P(Greedy, InWorker, ::testing::ValuesIn(kGreedy), name_of);
INSTANTIATE_TEST_SUITE_P(Overfull, InWorker, ::testing::ValuesIn(kOverfull), name_of);
INSTANTIATE_TEST_SUITE_P(Fatal, InGrpcWorker, ::testing::ValuesIn(kFatal), name_of);
INSTANTIATE_TEST_SUITE_P(Wrong, InGrpcWorker, ::testing::ValuesIn(kWrong), name_of);
INSTANTIATE_TEST_SUITE_P(Greedy, InGrpcWorker, ::testing::ValuesIn(kGreedyInMessages), name_of);
INSTANTIATE_TEST_SUITE_P(Overfull, InGrpcWorker, ::testing::ValuesIn(kOverfullInMessages), name_of);

class InProcess : public ::testing::TestWithParam<Expected> {};

TEST_P(InProcess, IsReplacedUntilTheBudgetIsSpent) {
  WorldBuilder builder = ball_on_ground(Hosting::kDirect);
  builder.plugin(Slot::kIntegrator, faulty_plugin_path(GetParam().library));
  expect_failures_and_pause(builder, GetParam());
}

INSTANTIATE_TEST_SUITE_P(Wrong, InProcess, ::testing::ValuesIn(kWrong), name_of);
INSTANTIATE_TEST_SUITE_P(Greedy, InProcess, ::testing::ValuesIn(kGreedy), name_of);
INSTANTIATE_TEST_SUITE_P(Overfull, InProcess, ::testing::ValuesIn(kOverfull), name_of);

TEST(FailingPlugins, PairsOutOfOrderAreRefused) {
  WorldBuilder builder = ball_on_ground(Hosting::kDirect);
  builder.sphere(0.5, 1.0, Vector3(0, 1.4, 0)).plugin(Slot::kSpace, faulty_plugin_path("space_unsorted"));
  Environment world(builder.description());
  ASSERT_EQ(world.step(), StepOutcome::kPaused);
  EXPECT_EQ(world.fault()->fault.kind, FaultKind::kBadStructure);
  EXPECT_EQ(world.fault()->fault.slot, Slot::kSpace);
}

TEST(FailingPlugins, ContactsThatPullAreRefused) {
  WorldBuilder builder = ball_on_ground(Hosting::kDirect);
  builder.plugin(Slot::kSolver, faulty_plugin_path("solver_sticky"));
  Environment world(builder.description());
  ASSERT_EQ(world.step(), StepOutcome::kPaused);
  EXPECT_EQ(world.fault()->fault.kind, FaultKind::kBadNumbers);
  EXPECT_NE(world.fault()->fault.text().find("pulls"), std::string::npos) << world.fault()->fault.text();
}

TEST(FailingPlugins, FrictionOfTurningThatIsNotToldBreaksALaw) {
  const auto outcome = [](bool is_told) {
    WorldBuilder builder = ball_on_ground(Hosting::kDirect);
    builder.material({.rolling_friction = 0.02});
    if (!is_told) builder.plugin(Slot::kSolver, faulty_plugin_path("solver_hides_turning"));
    builder.body().twist = {Vector3(1, 0, 0), Vector3(0, 0, -2)};
    builder.description().check_physics_every = 1;
    Environment world(builder.description());
    (void)world.step();
    return world.fault() ? world.fault()->fault.text() : "";
  };
  EXPECT_EQ(outcome(true), "");
  EXPECT_THAT(outcome(false), ::testing::HasSubstr("angular_velocity of body 1"));
}

TEST(FailingPlugins, ALibraryThatIsNoPluginIsNamedAtTheStart) {
  for (const Hosting hosting : {Hosting::kDirect, Hosting::kSharedMemory, Hosting::kGrpc}) {
    WorldBuilder builder = ball_on_ground(hosting);
    builder.description().solver.plugins[0].library = in_source("/README.md");
    try {
      Environment world(builder.description());
      FAIL() << "it started";
    } catch (const kernel::StageFault& fault) {
      EXPECT_EQ(fault.kind, FaultKind::kHandshake);
      EXPECT_EQ(fault.slot, Slot::kSolver);
      EXPECT_NE(fault.text().find("README.md"), std::string::npos) << fault.text();
    }
  }
}

// The sanitizer sees those that are not.
TEST(FailingPlugins, ThoseBeforeOneThatRefusesAreLetGo) {
  WorldBuilder builder = ball_on_ground(Hosting::kDirect);
  std::vector<kernel::PluginChoice> plugins = builder.description().force.plugins;
  plugins.push_back(builder.description().solver.plugins[0]);
  plugins.back().settings.clear();
  EXPECT_THROW(kernel::make_direct_carrier(plugins, 1), kernel::StageFault);
}

TEST(FailingPlugins, OneWhoseConstructorChangesFloatingPointArithmeticIsNamedAtTheStart) {
  const std::uint32_t control = floating_point_control();
  for (const Hosting hosting : {Hosting::kDirect, Hosting::kSharedMemory, Hosting::kGrpc}) {
    WorldBuilder builder = ball_on_ground(hosting);
    builder.plugin(Slot::kIntegrator, faulty_plugin_path("flushes_to_zero_when_made"));
    try {
      Environment world(builder.description());
      ADD_FAILURE() << "it started";
    } catch (const kernel::StageFault& fault) {
      EXPECT_EQ(fault.kind, FaultKind::kHandshake);
      EXPECT_EQ(fault.slot, Slot::kIntegrator);
      EXPECT_THAT(fault.text(), ::testing::HasSubstr("Faulty: its constructor changed the floating-point environment"));
    }
    EXPECT_EQ(floating_point_control(), control);
  }
}

TEST(FailingPlugins, AFailureInOneEnvironmentLeavesAnotherAlone) {
  WorldBuilder quiet = ball_on_ground(Hosting::kSharedMemory);
  Environment alone(quiet.description());
  while (alone.step_count() < 15) ASSERT_EQ(alone.step(), StepOutcome::kCommitted);

  WorldBuilder bad = ball_on_ground(Hosting::kSharedMemory);
  bad.plugin(Slot::kIntegrator, faulty_plugin_path("integrator_killed"));
  Environment failing(bad.description());
  Environment other(quiet.description());
  while (other.step_count() < 15) {
    failing.step();
    ASSERT_EQ(other.step(), StepOutcome::kCommitted);
  }
  EXPECT_TRUE(failing.fault().has_value());
  EXPECT_EQ(other.chain_hash(), alone.chain_hash());
}

int open_descriptors() {
  int count = 0;
  DIR* folder = opendir("/proc/self/fd");
  while (readdir(folder) != nullptr) ++count;
  closedir(folder);
  return count;
}

TEST(FailingPlugins, NothingIsLeftBehind) {
  const auto live_and_die = [](Hosting hosting, const char* library) {
    WorldBuilder builder = ball_on_ground(hosting);
    if (library != nullptr) builder.plugin(Slot::kIntegrator, faulty_plugin_path(library));
    builder.description().integrator.deadline = 0.1;
    Environment world(builder.description());
    while (world.step_count() < 13 && world.step() == StepOutcome::kCommitted) {
    }
  };
  // what is made once per process (the supervisor, gRPC, the declarations of libraries) is made by the first round
  const char* const libraries[] = {nullptr, "integrator_killed", "integrator_hangs"};
  constexpr Hosting kHostings[] = {Hosting::kSharedMemory, Hosting::kGrpc};
  for (const Hosting hosting : kHostings)
    for (const char* library : libraries) live_and_die(hosting, library);
  const int before = open_descriptors();
  for (const Hosting hosting : kHostings) {
    for (const char* library : libraries) {
      live_and_die(hosting, library);
      // all children are reaped: there is none to wait for
      siginfo_t info{};
      EXPECT_EQ(waitid(P_ALL, 0, &info, WEXITED | WNOHANG | WNOWAIT), -1) << "process " << info.si_pid;
    }
  }
  // gRPC and the supervisor's thread close the last ones in their own time
  for (int i = 0; i < 1000 && open_descriptors() > before; ++i) usleep(10'000);
  EXPECT_LE(open_descriptors(), before);
}

}  // namespace
}  // namespace gravitas
