// A plugin's calls, kept and asked again alone: the same bytes on every carrier, the first difference found, the request
// that a run ended at fails again.
#include "services/capsule/capsule.h"

#include <fmt/format.h>
#include <gmock/gmock.h>
#include <google/protobuf/util/json_util.h>
#include <gtest/gtest.h>
#include <sys/stat.h>

#include <algorithm>
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

using harness::CurrentFolder;
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

// Who is asked once more for comparison alone adds nothing.
TEST(Capsule, HoldsWhatWasUsedAlone) {
  const auto calls = [](const std::vector<std::string>& more) {
    const ScratchFolder folder;
    capsule::Reader reader(capture("force", folder, more));
    std::vector<std::string> all;
    recorder::v1::CapsuleCall call;
    while (reader.next(&call)) all.push_back(call.SerializeAsString());
    return all;
  };
  const std::vector<std::string> plain = calls({});
  EXPECT_GT(plain.size(), 12U);
  EXPECT_EQ(calls({"--set", "Simulator.CheckPhysicsEvery=1"}), plain);
}

// A force that refuses what is too fast leaves the integrator's call without a derivative that it asked for: that call
// differs, and the others are as they were.
TEST(Capsule, WithAnUnansweredDerivativeIsRead) {
  const CurrentFolder here;
  const ScratchFolder folder;
  const std::string scene = folder.write("away.gravitas", R"(
Forces {
  Force { Type = "Basic" Id = "Push" CustomProperties { Force = {5e155, 0, 0} } }
  Force { Type = "Drag" Id = "Air" CustomProperties { LinearCoefficient = 0 QuadraticCoefficient = 1e-300 } }
}
Simulator { CustomProperties { TimeStep = 0.01 Duration = 1 } }
Environment {
  Space { Bodies { Body { Id = "A" Mass = 1 PrincipalMoments = {1, 1, 1} Forces = { "Push", "Air" } } } }
  KineticIntegrator = "RK4"
})");
  const std::string file = folder.path("away.capsule");
  const ProgramResult run = run_program({"capture", scene, "--slot", "integrator", "--out", file}, folder);
  EXPECT_EQ(run.exit_code, 3) << run.err;
  const ProgramResult again = run_program({"replay", file}, folder);
  EXPECT_EQ(again.exit_code, 4) << again.out << again.err;
  EXPECT_THAT(again.out, HasSubstr("3 calls: 2 same, 1 different\n"));
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

// What is told of the differences is what tells them: a tolerance of the largest lets all pass, half of it does not.
TEST(Capsule, AToleranceLetsDifferencesPassThatAreTold) {
  const ScratchFolder folder;
  const std::string file = folder.path("stack.capsule");
  ASSERT_EQ(run_program({"capture", shipped_scene("stack"), "--slot", "solver", "--out", file, "--steps", "12"}, folder)
                .exit_code,
            0);
  const auto asked = [&](const std::vector<std::string>& words, int exit_code) {
    std::vector<std::string> all = {"replay", file, "--plugin", "Newton", "--json"};
    all.insert(all.end(), words.begin(), words.end());
    const ProgramResult result = run_program(all, folder);
    EXPECT_EQ(result.exit_code, exit_code) << result.out << result.err;
    report::v1::ReplayReport report;
    EXPECT_TRUE(google::protobuf::util::JsonStringToMessage(result.out, &report).ok());
    return report;
  };
  const report::v1::ReplayReport bitwise = asked({}, 4);
  double largest = 0.0;
  for (const report::v1::Disagreement& one : bitwise.disagreements())
    if (!one.quantity().ends_with(" residual")) largest = std::max(largest, one.relative());
  EXPECT_GT(largest, 0.0);
  const auto text = [](double number) { return fmt::format("{:.17g}", number); };
  const report::v1::ReplayReport wide = asked({"--tolerance", text(largest * (1 + 1e-12))}, 0);
  EXPECT_EQ(wide.same(), wide.calls());
  EXPECT_EQ(wide.disagreements_size(), bitwise.disagreements_size()) << "told all the same";
  EXPECT_GT(asked({"--tolerance", text(largest / 2)}, 4).different(), 0U);
  EXPECT_EQ(asked({"--tolerance", "0"}, 4).different(), bitwise.different());

  const ProgramResult alike = run_program({"bisect", file, "Sequential", "Newton", "--tolerance", "2"}, folder);
  EXPECT_EQ(alike.exit_code, 0) << alike.out << alike.err;
  EXPECT_THAT(alike.out, HasSubstr("12 calls answered alike to within 2\n  Solver.Solve "));
  EXPECT_THAT(alike.out, ::testing::ContainsRegex("apart at most, [0-9.e-]+ of the largest \\(row [0-9]+\\)\n"));
  for (const char* bad : {"-1", "nan", "inf", "x"})
    EXPECT_EQ(run_program({"bisect", file, "Sequential", "Newton", "--tolerance", bad}, folder).exit_code, 2) << bad;
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

// A slot may have several plugins, each with types of its own: what is not for the plugin in question is left out.
TEST(Capsule, CallsOfOtherTypesAreLeftOut) {
  const ScratchFolder folder;
  const std::string file = capture("force", folder);
  const std::string gravity = in_build("/lib/gravitas/force_gravity.so"),
                    basic = in_build("/lib/gravitas/force_basic.so");
  // the number before these words
  const auto count = [](const std::string& text, const std::string& words) {
    const std::size_t at = text.find(words);
    EXPECT_NE(at, std::string::npos) << text;
    return at == std::string::npos ? 0 : std::stoi(text.substr(text.rfind('\n', at) + 1));
  };
  const int calls = count(run_program({"replay", file}, folder).out, " calls: ");
  int asked = 0;
  for (const auto& [plugin, missing] :
       std::vector<std::pair<std::string, std::string>>{{gravity, "'Basic'"}, {basic, "'Gravity'"}}) {
    const ProgramResult one = run_program({"replay", file, "--plugin", plugin}, folder);
    EXPECT_EQ(one.exit_code, 0) << one.out << one.err;
    EXPECT_THAT(one.out, HasSubstr(", 0 different"));
    EXPECT_THAT(one.out, HasSubstr(" calls left out, as '" + plugin +
                                   "' cannot take the place: it does not serve the type " + missing));
    EXPECT_EQ(count(one.out, " calls: ") + count(one.out, " calls left out"), calls);
    asked += count(one.out, " calls: ");
    const ProgramResult same = run_program({"bisect", file, plugin, plugin}, folder);
    EXPECT_EQ(same.exit_code, 0) << same.out << same.err;
    EXPECT_EQ(count(same.out, " calls answered alike"), count(one.out, " calls: "));
  }
  EXPECT_EQ(asked, calls);
  // no call is for both
  EXPECT_EQ(run_program({"bisect", file, gravity, basic}, folder).exit_code, 2);
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

// The capsule of the request at which a run of a faulty plugin pauses, and what it says of it.
struct KeptRequest {
  std::string file, words;
  ~KeptRequest() { std::filesystem::remove(file); }
};

KeptRequest kept_request(const std::string& slot, const std::string& library, const std::string& name,
                         const ScratchFolder& folder, const std::string& scene = shipped_scene("two_spheres_motor"),
                         const std::vector<std::string>& more = {}) {
  const std::string plugins =
      folder.write("plugins.gravitas", "Plugins { Plugin { Slot = \"" + slot + "\" Library = \"" +
                                           in_build("/lib/gravitas-faulty/" + library + ".so") + "\" } }");
  std::vector<std::string> words = {"run", scene, plugins, "--checkpoint", folder.path("checkpoint")};
  if (!name.empty()) words.insert(words.end(), {"--set", name});
  words.insert(words.end(), more.begin(), more.end());
  const ProgramResult run = run_program(words, folder);
  EXPECT_EQ(run.exit_code, 3) << run.err;
  const std::size_t at = run.err.find("gravitas replay ");
  EXPECT_NE(at, std::string::npos) << run.err;
  if (at == std::string::npos) return {};
  return {run.err.substr(at + 16, run.err.find('\n', at) - at - 16), run.err};
}

// It fails at the state of one step, whoever asks: the run pauses, and the request is kept.
TEST(Capsule, APoisonedRequestIsKeptAndFailsAgainAlone) {
  const ScratchFolder folder;
  const KeptRequest kept = kept_request("integrator", "integrator_poisoned", "Integrator=Poisoned", folder);
  const ProgramResult again = run_program({"replay", kept.file}, folder);
  EXPECT_EQ(again.exit_code, 4) << again.err;
  EXPECT_THAT(again.out, HasSubstr("1 call: 0 same, 0 different, 1 failed again"));
  const ProgramResult sound = run_program({"replay", kept.file, "--plugin", "SemiImplicitEuler"}, folder);
  EXPECT_EQ(sound.exit_code, 0) << sound.err;
  EXPECT_THAT(sound.out, HasSubstr("1 failed then and are answered now"));
}

// Whichever processes they were: this one dies in the third call of each.
TEST(Capsule, TwoDeathsAreAlike) {
  const ScratchFolder folder;
  const std::string file = folder.path("motor.capsule");
  ASSERT_EQ(run_program({"capture", kSample, "--slot", "integrator", "--out", file, "--steps", "12"}, folder).exit_code,
            0);
  const std::string library = in_build("/lib/gravitas-faulty/integrator_segv.so"), same = folder.path("same.so");
  std::filesystem::copy_file(library, same);
  const ProgramResult alike = run_program({"bisect", file, library, same}, folder);
  EXPECT_EQ(alike.exit_code, 4) << alike.out << alike.err;
  EXPECT_THAT(alike.out, HasSubstr("8 calls answered alike, 4 failed alike\n"));
}

// An answer that came, and that a run would not use, is a failure, and in the run's words.
struct UnusableAnswer {
  const char *slot, *library, *name, *sound;
  const char* words;  // of run and replay alike
  const char* every;  // CheckPhysicsEvery
};

class RefusedAnswer : public ::testing::TestWithParam<UnusableAnswer> {};

TEST_P(RefusedAnswer, FailsAgainAlone) {
  const UnusableAnswer& one = GetParam();
  const ScratchFolder folder;
  const KeptRequest kept = kept_request(one.slot, one.library, one.name, folder, shipped_scene("stack"),
                                        {"--set", std::string("Simulator.CheckPhysicsEvery=") + one.every});
  EXPECT_THAT(kept.words, HasSubstr(one.words));
  const ProgramResult again = run_program({"replay", kept.file}, folder);
  EXPECT_EQ(again.exit_code, 4) << again.out << again.err;
  EXPECT_THAT(again.out, HasSubstr("1 call: 0 same, 0 different, 1 failed again"));
  EXPECT_THAT(again.out, HasSubstr(one.words));
  const ProgramResult sound = run_program({"replay", kept.file, "--plugin", one.sound}, folder);
  EXPECT_EQ(sound.exit_code, 0) << sound.out << sound.err;
  EXPECT_THAT(sound.out, HasSubstr("1 failed then and are answered now"));

  const std::string library = in_build("/lib/gravitas-faulty/") + one.library + ".so";
  const ProgramResult alike = run_program({"bisect", kept.file, library, library}, folder);
  EXPECT_EQ(alike.exit_code, 4) << alike.out << alike.err;
  EXPECT_THAT(alike.out, HasSubstr("0 calls answered alike, 1 failed alike\n"));
  EXPECT_THAT(alike.out, HasSubstr(one.words));
  const ProgramResult other = run_program({"bisect", kept.file, library, one.sound}, folder);
  EXPECT_EQ(other.exit_code, 4) << other.out << other.err;
  EXPECT_THAT(other.out, HasSubstr(one.words));
  EXPECT_THAT(other.out, HasSubstr(", then OK"));
}

INSTANTIATE_TEST_SUITE_P(Of, RefusedAnswer,
                         ::testing::Values(UnusableAnswer{"space", "space_unsorted", "Space=Unsorted", "DynamicBVH",
                                                          "its answer is wrong: pair of row ", "0"},
                                           UnusableAnswer{"solver", "solver_sticky", "Solver=Sticky", "Sequential",
                                                          "pulls the bodies together", "0"},
                                           UnusableAnswer{"solver", "solver_gains_energy", "Solver=GainsEnergy",
                                                          "Sequential", "its answer breaks a law: ", "1"}),
                         [](const auto& one) { return std::string(one.param.library); });

// Joints are asked by the plugin of their type alone.
TEST(Capsule, ARefusedJointFailsAgainAlone) {
  const ScratchFolder folder;
  const std::string scene = folder.write("joint.gravitas", R"(
    Geometries { Geometry { Type = "Sphere" Id = "Round" CustomProperties { Radius = 0.1 } } }
    Environment {
      Space { Bodies { Body { Id = "Ball" GeometryId = "Round" KineticProperties { Position = {1, 0, 0} } } } }
      Constraints { Constraint { Type = "TwiceCorrected" Id = "Joint" Body1 = "Ball" CustomProperties { BindPoint = {0, 0, 0} } } }
    })");
  const KeptRequest kept = kept_request("constraint", "constraint_corrects_twice", "", folder, scene);
  constexpr const char* kWords = "its answer is wrong: correction of row 0 is outside 0 … 1";
  EXPECT_THAT(kept.words, HasSubstr(kWords));
  const ProgramResult again = run_program({"replay", kept.file}, folder);
  EXPECT_EQ(again.exit_code, 4) << again.out << again.err;
  EXPECT_THAT(again.out, HasSubstr(kWords));
}

// A poisoned request of an integrator holds no derivatives: whether it obeys laws then is said to be unknown.
TEST(Capsule, PhysicsThatCannotBeJudgedIsNotCured) {
  const ScratchFolder folder;
  const KeptRequest kept =
      kept_request("integrator", "integrator_drifts", "Integrator=Drifting", folder,
                   in_source("/tests/determinism/callbacks.gravitas"), {"--set", "Simulator.CheckPhysicsEvery=1"});
  EXPECT_EQ(run_program({"replay", kept.file}, folder).exit_code, 4);
  const ProgramResult sound = run_program({"replay", kept.file, "--plugin", "SemiImplicitEuler"}, folder);
  EXPECT_EQ(sound.exit_code, 2) << sound.out << sound.err;
  EXPECT_THAT(sound.out, HasSubstr("0 same, 0 different, 1 broke a law of physics then, which is not judged now"));
}

// What a run records of an answer that it refuses is an answer like others: it fails when it is judged.
TEST(Capsule, RefusedAnswersOfACaptureFailAgain) {
  const ScratchFolder folder;
  const std::string plugins =
      folder.write("plugins.gravitas", "Plugins { Plugin { Slot = \"solver\" Library = \"" +
                                           in_build("/lib/gravitas-faulty/solver_gains_energy.so") + "\" } }");
  const std::string file = folder.path("energy.capsule");
  const ProgramResult captured = run_program({"capture", shipped_scene("stack"), plugins, "--set", "Solver=GainsEnergy",
                                              "--slot", "solver", "--out", file, "--calls", "1"},
                                             folder);
  ASSERT_EQ(captured.exit_code, 0) << captured.err;
  const ProgramResult plain = run_program({"replay", file}, folder);
  EXPECT_EQ(plain.exit_code, 0) << plain.out;
  EXPECT_THAT(plain.out, HasSubstr("1 same, 0 different\n"));
  const ProgramResult judged = run_program({"replay", file, "--physics"}, folder);
  EXPECT_EQ(judged.exit_code, 4) << judged.out;
  EXPECT_THAT(judged.out, HasSubstr("its answer breaks a law: kinetic energy grows"));
}

// Links by narrow cones that whip: the trial of a whole step runs away, the integrator refuses it, and half of the step is made.
TEST(Capsule, ARefusalThatWasAnAnswerIsTheSame) {
  const ScratchFolder folder;
  std::string bodies, joints;
  for (int i = 0; i < 3; ++i) {
    const double middle = 0.1 + 0.2 * i;
    bodies += fmt::format(
        "Body {{ Id = \"L{}\" Mass = 0.2 PrincipalMoments = {{7e-4, 7e-4, 7e-4}} Forces = {{ \"Down\" }} "
        "KineticProperties "
        "{{ Position = {{{}, 0, 0}} LinearVelocity = {{0, 0, {}}} AngularVelocity = {{0, 10, 0}} }} }}\n",
        i, middle, -10.0 * middle);
    joints += fmt::format(
        "Constraint {{ Type = \"Spherical\" Id = \"J{0}\" Body1 = \"{1}\" Body2 = \"L{0}\" CustomProperties {{ "
        "BindPoint = {{{2}, 0, 0}} Axis = {{1, 0, 0}} ReachConeAngle = 0.05 }} }}\n",
        i, i == 0 ? std::string() : fmt::format("L{}", i - 1), 0.2 * i);
  }
  const std::string scene = folder.write(
      "whip.gravitas",
      "Forces { Force { Type = \"Gravity\" Id = \"Down\" CustomProperties { Acceleration = {0, -9.81, 0} } } }\n"
      "Simulator { Type = \"Smooth\" CustomProperties { TimeStep = 0.03333333333333333 Duration = 0.1 } }\n"
      "Environment { Space { Bodies {\n" +
          bodies + "} }\nConstraints {\n" + joints + "} }\n");
  const std::string file = folder.path("whip.capsule"), dormand = "DormandPrince54";
  const ProgramResult captured =
      run_program({"capture", scene, "--set", "Solver=Newton", "--set", "Integrator=" + dormand, "--slot", "integrator",
                   "--out", file, "--steps", "1"},
                  folder);
  ASSERT_EQ(captured.exit_code, 0) << captured.err;
  EXPECT_THAT(captured.err, HasSubstr("the integrator refused trials of whole steps"));
  constexpr const char* kRefused = " (1 refused, by which the run asked for less of the step)";
  const ProgramResult again = run_program({"replay", file}, folder);
  EXPECT_EQ(again.exit_code, 0) << again.out;
  EXPECT_THAT(again.out, HasSubstr(std::string(" same") + kRefused + ", 0 different\n"));
  const ProgramResult alike = run_program({"bisect", file, dormand, dormand}, folder);
  EXPECT_EQ(alike.exit_code, 0) << alike.out;
  EXPECT_THAT(alike.out, HasSubstr(std::string(" answered alike") + kRefused + "\n"));
}

// A dense step of three bodies does not fit into the room that is offered first: derivatives are asked again with more.
TEST(Capsule, AnAnswerThatTakesMoreRoomIsTheSame) {
  const ScratchFolder folder;
  std::string bodies;
  for (int i = 1; i <= 3; ++i)
    bodies += fmt::format(
        "Body {{ Id = \"B{0}\" Mass = 1 PrincipalMoments = {{1, 1, 1}} KineticProperties {{ Position = {{{0}, 0, 0}} "
        "}} "
        "Forces = {{ \"Held\" }} }}\n",
        i);
  const std::string scene =
      folder.write("springs.gravitas",
                   "Forces { Force { Type = \"Spring\" Id = \"Held\" CustomProperties { Stiffness = 10 } } }\n"
                   "Simulator { CustomProperties { TimeStep = 0.001 Duration = 0.003 } }\n"
                   "Environment { Space { Bodies {\n" +
                       bodies + "} }\nKineticIntegrator = \"DormandPrince54\" }\n");
  for (const char* kept : {"shm", "grpc"}) {
    const std::string file = folder.path("springs.capsule");
    const ProgramResult captured =
        run_program({"capture", scene, "--slot", "integrator", "--out", file, "--hosting", kept}, folder);
    ASSERT_EQ(captured.exit_code, 0) << captured.err;
    for (const char* asked : {"shm", "grpc", "direct"}) {
      const ProgramResult again = run_program({"replay", file, "--hosting", asked}, folder);
      EXPECT_EQ(again.exit_code, 0) << again.out;
      EXPECT_THAT(again.out, HasSubstr("3 calls: 3 same, 0 different\n")) << kept << ", " << asked;
    }
  }
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
  // nothing is left of a capture without a call
  expect({"capture", scene, "--slot", "solver", "--out", out, "--set", "Solver.Iterations=0"}, "Iterations");
  expect({"capture", scene, "--slot", "solver", "--out", out, "--steps", "5", "--from-step", "10"},
         "ended after step 5");
  EXPECT_FALSE(std::filesystem::exists(out));
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
