// A plugin's calls, kept and asked again alone: the same bytes on every carrier, the first difference found, the request
// that a run ended at fails again.
#include "services/capsule/capsule.h"

#include <gmock/gmock.h>
#include <google/protobuf/util/json_util.h>
#include <gtest/gtest.h>
#include <sys/stat.h>

#include <cstring>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <string>
#include <vector>

#include "gravitas/report/v1/replay.pb.h"
#include "plugin_sdk/solver.h"
#include "services/run/session.h"
#include "tests/paths.h"
#include "tests/services/cli/program.h"

namespace gravitas {
namespace {

using harness::ProgramResult;
using harness::run_program;
using harness::ScratchFolder;
using harness::shipped_scene;
using ::testing::HasSubstr;

// Writes the first steps of a scene in which the slot is asked.
std::string capture(const std::string& slot, const ScratchFolder& folder, const std::vector<std::string>& more = {}) {
  const std::string file = folder.path(slot + ".capsule");
  std::vector<std::string> words = {
      "capture",
      slot == "constraint" ? shipped_scene("two_spheres_motor") : in_source("/tests/determinism/callbacks.gravitas"),
      "--slot",
      slot,
      "--out",
      file,
      "--steps",
      "12"};
  words.insert(words.end(), more.begin(), more.end());
  const ProgramResult result = run_program(words, folder);
  EXPECT_EQ(result.exit_code, 0) << result.err;
  return file;
}

class Captured : public ::testing::TestWithParam<const char*> {};
INSTANTIATE_TEST_SUITE_P(Slot, Captured, ::testing::Values("force", "solver", "integrator", "collision", "constraint"),
                         [](const auto& one) { return std::string(one.param); });

TEST_P(Captured, CallsAreAnsweredAlikeOnEveryCarrier) {
  const ScratchFolder folder;
  const std::string file = capture(GetParam(), folder);
  for (const char* hosting : {"shm", "grpc", "direct"}) {
    const ProgramResult result = run_program({"replay", file, "--hosting", hosting}, folder);
    EXPECT_EQ(result.exit_code, 0) << result.out << result.err;
    EXPECT_THAT(result.out, HasSubstr(" same, 0 different\n"));
  }
}

TEST(Capsule, OfEveryHostingHoldsTheSameCalls) {
  const ScratchFolder folder;
  const auto calls = [&](const char* hosting) {
    capsule::Reader reader(capture("integrator", folder, {"--hosting", hosting}));
    std::vector<std::string> all;
    recorder::v1::CapsuleCall call;
    while (reader.next(&call)) all.push_back(call.SerializeAsString());
    EXPECT_EQ(reader.note(), "");
    return all;
  };
  const std::vector<std::string> direct = calls("direct");
  EXPECT_EQ(direct.size(), 12U);
  EXPECT_EQ(direct, calls("shm"));
  EXPECT_EQ(direct, calls("grpc"));
}

TEST(Capsule, HoldsTheStepsAndCallsThatWereAskedFor) {
  const ScratchFolder folder;
  capsule::Reader reader(capture("solver", folder, {"--from-step", "5", "--calls", "3"}));
  recorder::v1::CapsuleCall call;
  for (std::uint32_t step = 5; step < 8; ++step) {
    ASSERT_TRUE(reader.next(&call));
    EXPECT_EQ(call.step(), step);
  }
  EXPECT_FALSE(reader.next(&call));
}

TEST(Capsule, BisectFindsTheFirstCallThatTwoPluginsAnswerDifferently) {
  const ScratchFolder folder;
  const std::string file = capture("integrator", folder);
  const ProgramResult same = run_program({"bisect", file, "SemiImplicitEuler", "SemiImplicitEuler"}, folder);
  EXPECT_EQ(same.exit_code, 0) << same.err;
  EXPECT_EQ(same.out, "12 calls answered alike\n");
  const ProgramResult other = run_program({"bisect", file, "SemiImplicitEuler", "Euler"}, folder);
  EXPECT_EQ(other.exit_code, 4) << other.err;
  EXPECT_THAT(other.out, HasSubstr("first: call 1 (Integrator.Integrate, step 1)"));
}

TEST(Capsule, AnotherPluginIsComparedWithTheOneThatAnswered) {
  const ScratchFolder folder;
  const std::string file = capture("integrator", folder);
  const ProgramResult drifting =
      run_program({"replay", file, "--plugin", in_build("/lib/gravitas-faulty/integrator_nan.so")}, folder);
  EXPECT_EQ(drifting.exit_code, 4);
  EXPECT_THAT(drifting.out, HasSubstr("12 calls: 0 same, 12 different"));
  const ProgramResult foreign = run_program({"replay", file, "--plugin", "Sequential"}, folder);
  EXPECT_EQ(foreign.exit_code, 2);
  EXPECT_THAT(foreign.err, HasSubstr("is of slot solver, the capsule of slot integrator"));
}

TEST(Capsule, APluginThatServesOtherTypesCannotTakeThePlace) {
  const ScratchFolder folder;
  for (const auto& [slot, plugin] :
       std::vector<std::pair<std::string, std::string>>{{"force", "hello"}, {"constraint", "constraint_rigid"}}) {
    const std::string library = in_build("/lib/gravitas/") + plugin + ".so";
    const ProgramResult result = run_program({"replay", capture(slot, folder), "--plugin", library}, folder);
    EXPECT_EQ(result.exit_code, 2) << result.out;
    EXPECT_THAT(result.err, ::testing::ContainsRegex("cannot take the place: it does not serve the type '[A-Z]"));
  }
}

// Problems of a run, solved alone: each says how it ended, by the solver that had it and by another one.
TEST(Capsule, OfASolverSaysHowEachProblemEnded) {
  const ScratchFolder folder;
  const std::string file = capture("solver", folder);
  const ProgramResult same = run_program({"replay", file, "--json", "--hosting", "direct"}, folder);
  ASSERT_EQ(same.exit_code, 0) << same.err;
  report::v1::ReplayReport report;
  ASSERT_TRUE(google::protobuf::util::JsonStringToMessage(same.out, &report).ok());
  ASSERT_EQ(report.solutions_size(), 12);
  capsule::Reader reader(file);
  recorder::v1::CapsuleCall call;
  for (int i = 0; i < 12; ++i) {
    const report::v1::SolverOutcome& one = report.solutions(i);
    EXPECT_EQ(one.call(), static_cast<std::uint32_t>(i + 1));
    ASSERT_TRUE(reader.next(&call));
    const MessageColumns reply =
        capsule::columns_of(call.reply(), stage::method_info(stage::Method::kSolverSolve).reply);
    EXPECT_EQ(one.iterations(), reply.u32("iterations")[0]);
    EXPECT_EQ(one.residual(), reply.f64("residual")[0]);
    EXPECT_EQ(one.stop_reason(), stop_reason_name(static_cast<StopReason>(reply.u32("stop_reason")[0])));
  }
  const ProgramResult other = run_program({"replay", file, "--plugin", "Newton"}, folder);
  EXPECT_THAT(other.out, HasSubstr("iterations residual m/s  stopped\n"));
  // nothing but solvers end like that
  const ProgramResult integrator = run_program({"replay", capture("integrator", folder)}, folder);
  EXPECT_EQ(integrator.out.find("stopped"), std::string::npos);
}

// It fails at the state of one step, whoever asks: the run pauses, and the request is kept.
TEST(Capsule, APoisonedRequestIsKeptAndFailsAgainAlone) {
  const ScratchFolder folder;
  const std::string plugins =
      folder.write("plugins.gravitas", "Plugins { Plugin { Slot = \"integrator\" Library = \"" +
                                           in_build("/lib/gravitas-faulty/integrator_poisoned.so") + "\" } }");
  const ProgramResult run = run_program({"run", shipped_scene("two_spheres_motor"), plugins, "--set",
                                         "Integrator=Poisoned", "--checkpoint", folder.path("checkpoint")},
                                        folder);
  ASSERT_EQ(run.exit_code, 3) << run.err;
  const std::size_t name = run.err.find("gravitas replay ");
  ASSERT_NE(name, std::string::npos) << run.err;
  const std::string file = run.err.substr(name + 16, run.err.find('\n', name) - name - 16);
  const ProgramResult again = run_program({"replay", file}, folder);
  EXPECT_EQ(again.exit_code, 4) << again.err;
  EXPECT_THAT(again.out, HasSubstr("1 calls: 0 same, 0 different, 1 failed again"));
  const ProgramResult sound = run_program({"replay", file, "--plugin", "SemiImplicitEuler"}, folder);
  EXPECT_EQ(sound.exit_code, 0) << sound.err;
  EXPECT_THAT(sound.out, HasSubstr("1 failed then and are answered now"));
  std::filesystem::remove(file);
}

TEST(Capsule, BytesOfAnyKindAreReadWithoutHarm) {
  const ScratchFolder folder;
  const std::string file = capture("solver", folder);
  std::ifstream in(file, std::ios::binary);
  const std::string whole((std::istreambuf_iterator<char>(in)), {});
  std::uint64_t state = 7;
  const auto draw = [&](std::size_t below) {
    state = state * 6364136223846793005U + 1442695040888963407U;
    return static_cast<std::size_t>((state >> 33) % below);
  };
  for (int i = 0; i < 300; ++i) {
    std::string bytes = whole.substr(0, i % 3 == 0 ? draw(whole.size()) : whole.size());
    if (i % 3 != 0)
      bytes[draw(i % 3 == 1 ? bytes.size() : std::min<std::size_t>(200, bytes.size()))] ^=
          static_cast<char>(1 + draw(255));
    const std::string damaged = folder.write("damaged.capsule", bytes);
    try {
      capsule::Reader reader(damaged);
      recorder::v1::CapsuleCall call;
      std::size_t calls = 0;
      while (reader.next(&call)) ++calls;
      EXPECT_LE(calls, 12U);
      // a cut between two records is none
      EXPECT_TRUE(!reader.note().empty() || i % 3 == 0);
    } catch (const BadInput& refusal) {
      EXPECT_THAT(refusal.what(), HasSubstr("damaged.capsule"));
    }
  }
}

// What cannot be read shows nothing of the plugin.
TEST(Capsule, ADamagedOneIsBadInput) {
  const ScratchFolder folder;
  const std::string whole = harness::read_file(capture("solver", folder));
  for (const std::size_t size : {whole.size() - 10, whole.size() / 2}) {
    const std::string cut = folder.write("cut.capsule", whole.substr(0, size));
    for (const std::vector<std::string>& words :
         {std::vector<std::string>{"replay", cut}, {"bisect", cut, "Sequential", "Sequential"}}) {
      const ProgramResult result = run_program(words, folder);
      EXPECT_EQ(result.exit_code, 2) << result.out;
      EXPECT_THAT(result.err, HasSubstr("it is cut short"));
    }
  }
}

TEST(Capsule, RefusalsSayWhatIsAllowed) {
  const ScratchFolder folder;
  const std::string scene = shipped_scene("two_spheres_motor"), out = folder.path("x.capsule");
  const auto expect = [&](const std::vector<std::string>& words, const std::string& text) {
    const ProgramResult result = run_program(words, folder);
    EXPECT_EQ(result.exit_code, 2);
    EXPECT_THAT(result.err, HasSubstr(text));
  };
  expect({"capture", scene, "--slot", "motor", "--out", out}, "space, collision, constraint, force, solver");
  expect({"capture", scene, "--slot", "solver", "--out", folder.path("no/x")}, "No such file");
  expect({"replay", folder.path("missing")}, "No such file");
  expect({"replay", scene}, "is no capsule");
  const std::string pipe = folder.path("pipe");
  ASSERT_EQ(mkfifo(pipe.c_str(), 0600), 0);
  expect({"replay", pipe}, "it is not an ordinary file");
  const std::string file = capture("solver", folder);
  expect({"replay", file, "--call", "999"}, "has no such call");
  // what is there is not lost to a run that records nothing
  const std::string whole = harness::read_file(file);
  expect({"capture", scene, "--slot", "solver", "--out", file, "--steps", "5", "--from-step", "10"},
         "ended after step 5");
  expect({"capture", scene, "--slot", "solver", "--out", file, "--set", "Solver.Iterations=0"}, "Iterations");
  EXPECT_EQ(harness::read_file(file), whole);
  // a check of nothing is none
  std::uint32_t header = 0;
  std::memcpy(&header, &whole[24], sizeof header);
  expect({"replay", folder.write("empty", whole.substr(0, 24 + 4 + header + 8))}, "it holds no calls");
  expect({"bisect", file, "Sequential", "Nobody"}, "Nobody");
}

}  // namespace
}  // namespace gravitas
