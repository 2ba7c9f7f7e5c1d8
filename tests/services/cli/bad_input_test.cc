// Bad input from outside: exit code 2, the place, what is wrong, what is allowed; in a second or two.
#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <sys/wait.h>

#include <cstdlib>
#include <filesystem>

#include "services/recorder/output_file.h"
#include "tests/paths.h"
#include "tests/services/cli/program.h"

namespace gravitas {
namespace {

using harness::ProgramResult;
using harness::run_program;
using harness::ScratchFolder;
using harness::shipped_scene;
using ::testing::HasSubstr;

struct BadScene {
  const char* name;
  std::string text;
  std::string place;     // line:column
  std::string expected;  // part of the message
};

void PrintTo(const BadScene& scene, std::ostream* out) { *out << scene.name; }

// A whole scene with one body that `body` describes, on line 4.
std::string with_body(const std::string& body) {
  return "Geometries { Geometry { Type = \"Sphere\" Id = \"S\" CustomProperties { Radius = 0.5 } } }\n"
         "Simulator { Type = \"Basic\" Id = \"M\" CustomProperties { Duration = 0.1 } }\n"
         "Environment { Id = \"W\" Space { Type = \"Basic\" Id = \"B\" Bodies {\n" +
         body + "\n} } }\n";
}

std::string with_geometry(const std::string& properties) {
  return "Geometries {\nGeometry { Type = \"Sphere\" Id = \"S\" CustomProperties { " + properties + " } } }\n" +
         "Environment { Id = \"W\" Space { Type = \"Basic\" Id = \"B\" Bodies {\n" +
         "Body { Type = \"Rigid\" Id = \"A\" GeometryId = \"S\" } } } }\n";
}

const char* good_joint(const std::string& type) {
  if (type == "Spherical") return "BindPoint = {0, 2, 0}";
  if (type == "Slider") return "BindPoint = {0, 2, 0} Axis = {0, 1, 0}";
  if (type == "Distance") return "BindPoint1 = {0, 0, 0} BindPoint2 = {0, 4, 0}";
  if (type == "Universal" || type == "ConstantVelocity")
    return "BindPoint = {0, 2, 0} Axis1 = {0, 1, 0} Axis2 = {1, 0, 0}";
  if (type == "Axle") return "BindPoint = {0, 2, 0} SteeringAxis = {0, 1, 0} RollingAxis = {1, 0, 0}";
  if (type == "AngularMotor") return "BindAxisPoint1 = {0, 2, 0} BindAxisPoint2 = {0, 3, 0} AngularSpeed = 1";
  return "BindAxisPoint1 = {0, 2, 0} BindAxisPoint2 = {0, 3, 0}";
}

// Two balls, a good joint of both on line 4, and what `more` says on line 5.
std::string with_joint(const std::string& type, const std::string& properties, const std::string& simulator = "Basic") {
  return "Geometries { Geometry { Type = \"Sphere\" Id = \"S\" CustomProperties { Radius = 0.5 } } }\n"
         "Simulator { Type = \"" +
         simulator +
         "\" CustomProperties { Duration = 0.1 } }\n"
         "Environment { Space { Bodies { Body { Id = \"A\" GeometryId = \"S\" Mass = 1 } Body { Id = \"B\" GeometryId "
         "= "
         "\"S\" Mass = 1 KineticProperties { Position = {0, 4, 0} } } } } Constraints {\n"
         "Constraint { Type = \"" +
         type + "\" Id = \"J1\" Body1 = \"A\" Body2 = \"B\" CustomProperties { " + good_joint(type) +
         " } }\n"
         "Constraint { Type = \"" +
         type + "\" Id = \"J2\" Body1 = \"A\" CustomProperties {\n" + properties + " } } } }\n";
}

// Two balls, of which the second alone feels the force `F` of line 1 and has a mass.
std::string with_force(const std::string& type, const std::string& properties, const std::string& mass = "1") {
  return "Forces { Force { Type = \"" + type + "\" Id = \"F\" CustomProperties {\n" + properties +
         " } } }\n"
         "Environment { Space { Bodies { Body { Id = \"A\" Mass = 1 PrincipalMoments = {1, 1, 1} }\n"
         "Body { Id = \"B\" Mass = " +
         mass + " PrincipalMoments = {1, 1, 1} Forces = { \"F\" } } } } }\n";
}

const BadScene kBadScenes[] = {
    {"unknown_block", "Enviroment { }\n", "1:1", "Environment"},
    {"unknown_property", with_body("Body { Type = \"Rigid\" Id = \"A\" GeometryId = \"S\" Masss = 1 }"), "4:49",
     "Mass"},
    {"wrong_type", with_body("Body { Type = \"Rigid\" Id = \"A\" GeometryId = \"S\" Mass = \"heavy\" }"), "4:56",
     "number"},
    {"missing_id", with_body("Body { Type = \"Rigid\" GeometryId = \"S\" }"), "4:1", "Id"},
    {"duplicate_id",
     with_body("Body { Type = \"Rigid\" Id = \"A\" GeometryId = \"S\" }\nBody { Type = \"Rigid\" Id = \"A\" GeometryId "
               "= \"S\" }"),
     "5:28", "\"A\""},
    {"dangling_id", with_body("Body { Type = \"Rigid\" Id = \"A\" GeometryId = \"T\" }"), "4:45", "\"S\""},
    {"non_finite", with_geometry("Radius = 1e999"), "2:65", "1e999"},
    {"zero_size", with_geometry("Radius = 0"), "2:65", "> 0"},
    {"negative_size", with_geometry("Radius = -1"), "2:65", "> 0"},
    {"far_from_unit",
     with_body("Body { Type = \"Rigid\" Id = \"A\" GeometryId = \"S\" KineticProperties { Orientation = {1,1,0,0} } }"),
     "4:83", "norm 1"},
    {"descending_times",
     "Forces { Force { Type = \"Basic\" Id = \"F\" CustomProperties { Table = {{1, 0, 0, 0},\n{0.5, 1, 0, 0}} } } }\n" +
         with_body(""),
     "2:1", "Basic \"F\": Table has the time 0.5 after 1; allowed: times that ascend, two of a jump the same"},
    {"three_rows_of_one_time",
     "Forces { Force { Type = \"Basic\" Id = \"F\" CustomProperties { Table = {{1, 0, 0, 0}, {1, {1, 0, 0}},\n{1, 1, "
     "0, "
     "0}} } } }\n" +
         with_body(""),
     "2:1", "Table has the time 1 after 1"},
    {"unbalanced", "Environment {\n", "2:1", "}"},
    {"no_axis", with_joint("Spherical", "BindPoint = {0, 0, 0} ReachConeAngle = 1"), "5:1",
     "error: Constraint \"J2\": Spherical: Axis is missing"},
    {"axis_of_length_0", with_joint("Spherical", "BindPoint = {0, 2, 0} ReachConeAngle = 1\nAxis = {0, 0, 0}"), "7:1",
     "error: Constraint \"J2\": Spherical: Axis has no direction"},
    {"reach_cone", with_joint("Spherical", "BindPoint = {0, 2, 0} Axis = {1, 0, 0}\nReachCone = {{0, 1}}"), "7:1",
     "error: Constraint \"J2\": Spherical: ReachCone"},
    {"hinge_of_one_point", with_joint("Revolute", "BindAxisPoint1 = {0, 2, 0}\nBindAxisPoint2 = {0, 2, 0}"), "7:1",
     "error: Constraint \"J2\": Revolute: BindAxisPoint1 and BindAxisPoint2 are the same point"},
    {"limits_of_a_turn",
     with_joint("Revolute", "BindAxisPoint1 = {0, 2, 0} BindAxisPoint2 = {0, 3, 0} LowerLimit = -5\nUpperLimit = 5"),
     "7:1", "error: Constraint \"J2\": Revolute: UpperLimit"},
    {"motor_of_one_point",
     with_joint("AngularMotor", "BindAxisPoint1 = {0, 2, 0} BindAxisPoint2 = {0, 2, 0} AngularSpeed = 1"), "6:28",
     "error: Constraint \"J2\": AngularMotor: BindAxisPoint1"},
    {"slider", with_joint("Slider", "BindPoint = {0, 2, 0} Axis = {0, 0, 0}"), "6:23",
     "error: Constraint \"J2\": Slider: Axis has no direction"},
    {"force_without_speed", with_joint("Slider", "BindPoint = {0, 2, 0} Axis = {0, 1, 0}\nMaximumForce = 3"), "7:1",
     "error: Constraint \"J2\": Slider: MaximumForce is given without Speed"},
    {"course_back_in_time",
     with_joint("Slider", "BindPoint = {0, 2, 0} Axis = {0, 1, 0}\nMotion = {{1, 0},\n{0.5, 1}}"), "8:1",
     "error: Slider \"J2\": Motion has the time 0.5 after 1; allowed: times that ascend"},
    {"course_of_times", with_joint("Slider", "BindPoint = {0, 2, 0} Axis = {0, 1, 0}\nMotion = {{1, 0}, {2}}"), "7:19",
     "error: Slider \"J2\": a row of Motion has 1 number; allowed: a list of rows of 2 numbers"},
    {"course_that_is_not_finite",
     with_joint("Slider", "BindPoint = {0, 2, 0} Axis = {0, 1, 0}\nMotion = {{1, 0}, {2, 1e999}}"), "7:23", "1e999"},
    {"crossed_distances",
     with_joint("Distance", "BindPoint1 = {0, 0, 0} BindPoint2 = {0, 4, 0} MinimumDistance = 3\nMaximumDistance = 2"),
     "7:1", "error: Constraint \"J2\": Distance: MinimumDistance"},
    {"universal", with_joint("Universal", "BindPoint = {0, 2, 0} Axis1 = {0, 1, 0}\nAxis2 = {0, 1, 0}"), "7:1",
     "error: Constraint \"J2\": Universal: Axis2 is parallel to Axis1"},
    {"constant_velocity", with_joint("ConstantVelocity", "BindPoint = {0, 2, 0} Axis1 = {0, 1, 0}\nAxis2 = {0, -1, 0}"),
     "7:1", "error: Constraint \"J2\": ConstantVelocity: Axis"},
    {"axle", with_joint("Axle", "BindPoint = {0, 2, 0} SteeringAxis = {0, 1, 0}\nRollingAxis = {0, 1, 0}"), "7:1",
     "error: Constraint \"J2\": Axle: RollingAxis is parallel to SteeringAxis"},
    {"limit_that_gives_way_alone",
     with_joint("Revolute",
                "BindAxisPoint1 = {0, 2, 0} BindAxisPoint2 = {0, 3, 0} LowerLimit = -1\nLimitStiffness = 5"),
     "7:1", "error: Constraint \"J2\": Revolute: LimitStiffness is given without LowerLimit and UpperLimit"},
    {"suspension_that_starts_beyond_its_stop",
     with_joint("Axle",
                "BindPoint = {0, 2, 0} SteeringAxis = {0, 1, 0} RollingAxis = {1, 0, 0}\nSuspensionUpperLimit = -0.1"),
     "7:24", "SuspensionUpperLimit"},
    {"suspension_that_bears_without_a_spring",
     with_joint("Axle",
                "BindPoint = {0, 2, 0} SteeringAxis = {0, 1, 0} RollingAxis = {1, 0, 0}\nSuspensionPreload = 100"),
     "7:1", "error: Constraint \"J2\": Axle: SuspensionPreload is given without SuspensionStiffness"},
    {"suspension_that_damps_nothing",
     with_joint("Axle",
                "BindPoint = {0, 2, 0} SteeringAxis = {0, 1, 0} RollingAxis = {1, 0, 0}\nSuspensionDamping = 100"),
     "7:1",
     "error: Constraint \"J2\": Axle: SuspensionDamping is given without SuspensionStiffness, "
     "SuspensionLowerLimit or SuspensionUpperLimit"},
    {"vortex", with_force("Vortex", "Centre = {0, 0, 0} Strength = 1 Axis = {0, 0, 0}"), "2:33",
     "error: Force \"F\" on Body \"B\" ("},
    {"buoyancy", with_force("Buoyancy", "FluidDensity = 1000 FluidLevel = 0 Region = {{1, 1, 1}}"), "2:36",
     "): Region: allowed are two rows, {min} and {max}"},
    {"far_too_heavy", with_force("Gravity", "Acceleration = {0, -9.81, 0}", "1e308"), "1:10",
     ":4:1): the wrench on body 1 is not finite"},
    {"order",
     "Environment { Space { Bodies { Body { Id = \"A\" Mass = 1 PrincipalMoments = {1, 1, 1} } } }\n"
     "KineticIntegrator { Type = \"SymplecticSplitting\" CustomProperties { Order = 3 } } }\n",
     "2:69", "error: SymplecticSplitting: Order: allowed are 2, 4 and 6"},
    {"smooth_contacts", with_joint("Spherical", "BindPoint = {0, 0, 0}", "Smooth"), "2:20",
     "or use Type = \"Basic\", \"Substepping\", \"Continuous\" or \"Bisection\""},
    {"deep", std::string(100'000, '{'), "1:", ""},
};

class Refused : public ::testing::TestWithParam<BadScene> {};

TEST_P(Refused, WithItsPlaceAndWhatIsAllowed) {
  const ScratchFolder folder;
  const std::string scene = folder.write("scene.gravitas", GetParam().text);
  const ProgramResult result = run_program({"run", scene}, folder);
  EXPECT_EQ(result.exit_code, 2);
  EXPECT_EQ(result.out, "");
  EXPECT_THAT(result.err, HasSubstr(scene + ":" + GetParam().place));
  EXPECT_THAT(result.err, HasSubstr(GetParam().expected));
}

INSTANTIATE_TEST_SUITE_P(Scenes, Refused, ::testing::ValuesIn(kBadScenes),
                         [](const auto& one) { return std::string(one.param.name); });

TEST(BadInput, WhatPluginsRefuseIsAsPlainOnEveryCarrierAndInAPlan) {
  const ScratchFolder folder;
  const std::string joint =
      folder.write("joint.gravitas", with_joint("Spherical", "BindPoint = {0, 0, 0} ReachConeAngle = 1"));
  const std::string force =
      folder.write("force.gravitas", with_force("Vortex", "Centre = {0, 0, 0} Strength = 1 Axis = {0, 0, 0}"));
  const std::string good = folder.write("good.gravitas", with_body("Body { Id = \"A\" GeometryId = \"S\" Mass = 1 }"));
  for (const std::vector<std::string>& how : {std::vector<std::string>{"run", "--hosting", "direct"},
                                              {"run", "--hosting", "shm"},
                                              {"run", "--hosting", "grpc"},
                                              {"plan"}}) {
    for (const auto& [what, expected] : std::vector<std::pair<std::vector<std::string>, std::string>>{
             {{joint},
              joint + ":5:1: error: Constraint \"J2\": Spherical: Axis is missing, which reach cone and twist "
                      "limits are measured from\n"},
             {{force}, force + ":2:33: error: Force \"F\" on Body \"B\" (" + force + ":4:1): Axis: a direction"},
             {{good, "--set", "Integrator=SymplecticSplitting", "--set", "Integrator.Order=3"},
              "--set Integrator.Order=3: SymplecticSplitting: Order: allowed are 2, 4 and 6\n"}}) {
      std::vector<std::string> arguments = how;
      arguments.insert(arguments.end(), what.begin(), what.end());
      const ProgramResult result = run_program(arguments, folder);
      EXPECT_EQ(result.exit_code, 2) << how.back();
      EXPECT_EQ(result.out, "");
      EXPECT_THAT(result.err, HasSubstr(expected)) << how.back();
    }
  }
}

TEST(BadInput, AnEditThatAPluginRefusesIsNamedAndWhatWasComputedIsKept) {
  const ScratchFolder folder;
  const std::string trajectory = folder.path("motion.csv"), report = folder.path("report.json");
  const ProgramResult result =
      run_program({"run", kSample, "--duration", "1", "--hosting", "direct", "--trajectory", trajectory, "--report",
                   report, "--edit", "set Constraint.MyAngularMotor.BindAxisPoint2={0,1,0}@step=5"},
                  folder);
  EXPECT_EQ(result.exit_code, 2);
  EXPECT_THAT(result.err,
              HasSubstr("stopped after step 4: edit before step 5: set "
                        "Constraint.MyAngularMotor.BindAxisPoint2={0,1,0}: Constraint "
                        "\"MyAngularMotor\": AngularMotor: BindAxisPoint1 and BindAxisPoint2 are the same"));
  // where what is refused stands elsewhere
  const std::string heavy = folder.write("heavy.gravitas", with_force("Gravity", "Acceleration = {0, -9.81, 0}"));
  EXPECT_THAT(run_program({"run", heavy, "--hosting", "direct", "--edit", "set Body.B.Mass=1e308@step=5"}, folder).err,
              HasSubstr("stopped after step 4: edit before step 5 (set Body.B.Mass=1e308): " + heavy +
                        ":1:10: error: Force \"F\" on Body \"B\" ("));
  EXPECT_EQ(harness::read_report(harness::read_file(report)).steps(), 4U);
  EXPECT_EQ(harness::read_report(harness::read_file(report)).outcome(), "failed");
  EXPECT_THAT(harness::read_file(trajectory), HasSubstr("\n0.0666"));
}

TEST(BadInput, AnEditThatTearsAJointOpenIsToldAsThat) {
  const ScratchFolder folder;
  const std::string report = folder.path("report.json");
  EXPECT_EQ(run_program({"run", kSample, "--steps", "10", "--hosting", "direct", "--report", report, "--edit",
                         "set Body.Ball01.Position={3,1,0}@step=5"},
                        folder)
                .exit_code,
            0);
  EXPECT_THAT(harness::read_file(report),
              HasSubstr("from step 5 on: the edit before that step left apart what they hold"));
}

TEST(BadInput, AQuaternionThatIsNearlyUnitIsRepairedWithAWarning) {
  const ScratchFolder folder;
  const std::string scene =
      folder.write("scene.gravitas", with_body("Body { Type = \"Rigid\" Id = \"A\" GeometryId = \"S\" "
                                               "KineticProperties { Orientation = {1.0005,0,0,0} } }"));
  const ProgramResult result = run_program({"run", scene}, folder);
  EXPECT_EQ(result.exit_code, 0) << result.err;
  EXPECT_THAT(result.err, HasSubstr(scene + ":4:83: warning"));
}

TEST(BadInput, FilesThatCannotBeRead) {
  const ScratchFolder folder;
  for (const std::string& path : {folder.path("missing.gravitas"), folder.path("")}) {
    const ProgramResult result = run_program({"run", path}, folder);
    EXPECT_EQ(result.exit_code, 2);
    EXPECT_THAT(result.err, HasSubstr(path + ":1:1: error"));
  }
}

TEST(BadInput, FilesThatDoNotEndAreNotRead) {
  const ScratchFolder folder;
  const ProgramResult edit = run_program({"run", kSample, "--edit", "add /dev/zero@step=5"}, folder);
  EXPECT_EQ(edit.exit_code, 2);
  EXPECT_THAT(edit.err, HasSubstr("'/dev/zero' cannot be read: it is no file that ends but a device"));
  const ProgramResult scene = run_program({"run", "/dev/zero"}, folder);
  EXPECT_EQ(scene.exit_code, 2);
  EXPECT_THAT(scene.err, HasSubstr("/dev/zero:1:1: error: cannot be read: it is no file that ends but a device"));
}

TEST(BadInput, NoFileIsWrittenByTwoRunsAtOnce) {
  const ScratchFolder folder;
  const std::string path = folder.write("x", "of an earlier run");
  const OutputFile held("of another run", path);
  for (const char* option : {"--trajectory", "--report", "--events", "--reactions", "--joints", "--instrumentation"}) {
    const ProgramResult result = run_program({"run", kSample, "--hosting", "direct", option, path}, folder);
    EXPECT_EQ(result.exit_code, 2) << option;
    EXPECT_THAT(result.err, HasSubstr(std::string(option + 2) + " '" + path + "': another run is writing it"));
  }
  const ProgramResult capture = run_program({"capture", kSample, "--slot", "solver", "--out", path}, folder);
  EXPECT_EQ(capture.exit_code, 2);
  EXPECT_THAT(capture.err, HasSubstr("another run is writing it"));
  EXPECT_EQ(harness::read_file(path), "of an earlier run");
}

TEST(BadInput, AFileThatIsNoSceneAtAll) {
  const ScratchFolder folder;
  const std::string path = folder.write("noise", std::string("\x7f"
                                                             "ELF\0\1\2\3",
                                                             8));
  EXPECT_EQ(run_program({"run", path}, folder).exit_code, 2);
}

TEST(BadInput, AMillionLinesAreReadAndTheMistakeInTheLastIsFound) {
  const ScratchFolder folder;
  std::string text;
  for (int i = 0; i < 1'000'000; ++i) text += "// line\n";
  const std::string path = folder.write("long.gravitas", text + "Environmnt { }\n");
  const ProgramResult result = run_program({"run", path}, folder);
  EXPECT_EQ(result.exit_code, 2);
  EXPECT_THAT(result.err, HasSubstr(path + ":1000001:1: error"));
}

// The sample with a library of the user's for the solver.
ProgramResult run_with_solver_library(const std::string& library, const ScratchFolder& folder) {
  const std::string plugins =
      folder.write("plugins.gravitas", "Plugins { Plugin { Slot = \"solver\" Library = \"" + library + "\" } }");
  return run_program({"run", kSample, plugins}, folder);
}

TEST(BadInput, LibrariesThatAreNoPluginsOrOfAnotherSchema) {
  const ScratchFolder folder;
  const std::string faulty = in_build("/lib/gravitas-faulty/");
  for (const auto& [library, expected] : std::vector<std::pair<std::string, std::string>>{
           {folder.path("missing.so"), "No such file"},
           {folder.write("text.so", "not a library"), "shared library"},
           {faulty + "wrong_schema_hash.so", "schema"},
           {faulty + "crash_on_load.so", "signal"},
           {faulty + "flushes_to_zero_on_load.so", "-ffast-math"},
           {faulty + "declaration_throws.so", "its table of types"},
           {faulty + "declares_bad_default.so", "BadDefault.Margin has a default that it does not allow"}}) {
    const ProgramResult result = run_with_solver_library(library, folder);
    EXPECT_EQ(result.exit_code, 2) << library;
    EXPECT_THAT(result.err, HasSubstr("plugins.gravitas:1:"));
    EXPECT_THAT(result.err, HasSubstr(expected));
  }
}

TEST(BadInput, CommandsThatStartNoWorker) {
  const ScratchFolder folder;
  for (const auto& [command, expected] :
       std::vector<std::pair<std::string, std::string>>{{"false", "false --describe ended with status 1"},
                                                        {"echo", "wrote no catalogue of 1 plugin: its standard output"},
                                                        {"no-such-program", "No such file or directory"}}) {
    const std::string plugins =
        folder.write("plugins.gravitas", "Plugins { Plugin { Slot = \"solver\" Command = \"" + command + "\" } }");
    const ProgramResult result = run_program({"run", kSample, plugins}, folder);
    EXPECT_EQ(result.exit_code, 2) << command;
    EXPECT_THAT(result.err, HasSubstr("plugins.gravitas:1:46: error: Command \"" + command + "\" cannot be used"));
    EXPECT_THAT(result.err, HasSubstr(expected));
  }
}

TEST(BadInput, OptionsOfTheCommandLine) {
  const ScratchFolder folder;
  for (const auto& [option, expected] : std::vector<std::pair<std::vector<std::string>, std::string>>{
           {{"--frobnicate"}, "there is no option \"--frobnicate\"; --help names those that there are\n"},
           {{"--step=5"}, "there is no option \"--step\"; did you mean \"--steps\"? --help names"},
           {{"-durations", "5"}, "there is no option \"-durations\"; did you mean \"--duration\"? --help names"},
           {{"--hosting", "cloud"}, "allowed: direct, shm, grpc"},
           {{"--hosting", "grpc:127.0.0.1:7000"}, "SLOT=grpc:ADDRESS"},
           {{"--hosting", "solver=grpc:192.0.2.1:7000"}, "no address of this machine"},
           {{"--hosting", "solver=grpc:"}, "no address of this machine"},
           {{"--hosting", "integrator=grpc:unix:/nowhere"}, "no worker answers at unix:/nowhere"},
           {{"--hosting", "sovler=shm"}, "allowed: space, collision"},
           {{"--dt", "0"}, "--dt 0: it must be"},
           {{"--duration", "-1"}, "--duration -1: it must be"},
           {{"--steps", "many"}, "--steps"},
           {{"--threads", "0"}, "--threads: \"0\"; allowed: a whole number from 1 to 1024"},
           {{"--steps", "-1"}, "--steps: \"-1\"; allowed: a whole number from 0 to 4294967295"},
           {{"--steps", "1.5"}, "--steps: \"1.5\"; allowed: a whole number"},
           {{"--steps", "010"}, "--steps: \"010\"; allowed: a whole number"},
           {{"--steps", "0x10"}, "--steps: \"0x10\"; allowed: a whole number"},
           {{"--steps", "4294967296"}, "--steps: \"4294967296\"; allowed: a whole number"},
           {{"--dt", "abc"}, "--dt: \"abc\"; allowed: a finite number of seconds > 0"},
           {{"--duration", "abc"}, "--duration: \"abc\"; allowed: a finite number of seconds >= 0"},
           {{"--sample-every", "1s"}, "--sample-every: \"1s\"; allowed: a finite number of seconds > 0"},
           {{"--set", "Solver.Iteration=5"}, "Iterations"},
           {{"--set", "Solver.Iterations=none"}, "--set Solver.Iterations=none"},
           {{"--set", "Integrator=RK9"}, "Euler"},
           {{"--set", "Body.Ball1.LinearVelocity={1,0,0}"}, "Ball01"},
           {{"--set", "nonsense"}, "--set nonsense"},
           {{"--trajectory", "/nonexistent/motion.csv"}, "/nonexistent/motion.csv"}}) {
    std::vector<std::string> arguments = {"run", kSample};
    arguments.insert(arguments.end(), option.begin(), option.end());
    const ProgramResult result = run_program(arguments, folder);
    EXPECT_EQ(result.exit_code, 2) << option[0];
    EXPECT_EQ(result.out, "");
    EXPECT_THAT(result.err, HasSubstr(expected));
  }
}

TEST(BadInput, NamesTheOptionThatWasGiven) {
  const ScratchFolder folder;
  ProgramResult result = run_program({"run", kSample, "--dt", "1e-300", "--duration", "1"}, folder);
  EXPECT_EQ(result.exit_code, 2);
  EXPECT_THAT(result.err, HasSubstr("--dt 1e-300: Duration 1 s in steps of 1e-300 s is"));
  const std::string pendulum = folder.write(
      "pendulum.gravitas",
      "Environment { Space { Bodies { Body { Id = \"A\" Mass = 1 PrincipalMoments = {1, 1, 1} } } } Constraints { "
      "Constraint { Type = \"Spherical\" Id = \"H\" Body1 = \"A\" CustomProperties { BindPoint = {1, 0, 0} } } } }\n"
      "Simulator { CustomProperties { Duration = 1 } }");
  result = run_program(
      {"run", pendulum, "--hosting", "direct", "--set", "Simulator=Smooth", "--set", "Solver=Sequential"}, folder);
  EXPECT_EQ(result.exit_code, 2);
  EXPECT_THAT(result.err, HasSubstr("and Sequential has it not; allowed: \"Direct\", \"Newton\""));
}

TEST(BadInput, ServeListensAtAPathBySocket) {
  const ScratchFolder folder;
  const ProgramResult result = run_program({"serve", kSample, "--headless", "--listen", "unix:/tmp/s"}, folder);
  EXPECT_EQ(result.exit_code, 2);
  EXPECT_THAT(result.err, HasSubstr("allowed: ADDR:PORT; a path is given by --socket /tmp/s"));
}

// An empty value would count as an option that is left out.
TEST(BadInput, EmptyValuesOfOptions) {
  const ScratchFolder folder;
  for (const auto& [command, options] : std::vector<std::pair<std::vector<std::string>, std::vector<std::string>>>{
           {{"run", kSample, "--steps", "1"},
            {"--resume", "--trajectory", "--report", "--checkpoint", "--events", "--reactions", "--joints",
             "--instrumentation"}},
           {{"capture", kSample, "--slot", "solver"}, {"--out"}},
           {{"replay", "s.caps"}, {"--plugin", "--hosting", "--call"}},
           {{"serve", kSample, "--headless"}, {"--socket", "--listen"}},
           {{"ctl", "status"}, {"--socket"}}}) {
    for (const std::string& option : options) {
      std::vector<std::string> arguments = command;
      arguments.insert(arguments.end(), {option, ""});
      const ProgramResult result = run_program(arguments, folder);
      EXPECT_EQ(result.exit_code, 2) << option;
      EXPECT_THAT(result.err, HasSubstr(option + ": \"\"; allowed: "));
      arguments.resize(command.size());
      arguments.insert(arguments.end(), {option + "=", "--json"});
      const ProgramResult joined = run_program(arguments, folder);
      EXPECT_EQ(joined.exit_code, 2) << option;
      EXPECT_THAT(joined.err, HasSubstr(option + "=: \"\"; allowed: "));
    }
  }
  for (const std::vector<std::string>& arguments :
       {std::vector<std::string>{"run", ""}, {"check", ""}, {"bisect", "s.caps", "", "Sequential"}, {"describe", ""}}) {
    const ProgramResult result = run_program(arguments, folder);
    EXPECT_EQ(result.exit_code, 2) << arguments[0];
    EXPECT_THAT(result.err, HasSubstr("allowed: a value that is not empty"));
  }
}

// It named a file of that name.
TEST(BadInput, ADashIsNoStandardStream) {
  const ScratchFolder folder;
  for (const std::vector<std::string>& arguments :
       {std::vector<std::string>{"run", "-"}, {"run", kSample, "--trajectory", "-"}, {"replay", "-"}}) {
    const ProgramResult result = run_program(arguments, folder);
    EXPECT_EQ(result.exit_code, 2) << arguments.back();
    EXPECT_THAT(result.err, HasSubstr(": \"-\"; allowed: a name; /dev/stdin is standard input, /dev/stdout standard"));
  }
  EXPECT_FALSE(std::filesystem::exists(folder.path("-")));
  // what is named instead is read and written
  const std::string piped = "cat " + in_shell(kSample) + " | " + in_shell(in_build("/bin/gravitas")) +
                            " run /dev/stdin --steps 2 --hosting direct --quiet --trajectory /dev/stdout | wc -l > " +
                            in_shell(folder.path("lines"));
  EXPECT_EQ(std::system(piped.c_str()), 0);
  EXPECT_EQ(std::stoi(harness::read_file(folder.path("lines"))), 1 + 3 * 2);
}

TEST(BadInput, NumbersOfCampaign) {
  const ScratchFolder folder;
  for (const std::string option : {"--seed", "--trial", "--jobs"}) {
    for (const std::string value : {"x", "1.5", "-1"}) {
      const ProgramResult result = run_program({"campaign", option, value}, folder);
      EXPECT_EQ(result.exit_code, 2) << option << value;
      EXPECT_THAT(result.err, HasSubstr(option + ": \"" + value + "\"; allowed: a whole number from 0 to "));
    }
  }
  for (const auto& [option, range] : std::vector<std::pair<std::string, std::string>>{
           {"--deadline", "0.01 to 100"}, {"--patience", "1 to 1000000"}, {"--endurance", "0.1 to 1000000"}}) {
    for (const std::string value : {"nan", "inf", "0", "x"}) {
      const ProgramResult result = run_program({"campaign", option, value}, folder);
      EXPECT_EQ(result.exit_code, 2) << option << value;
      EXPECT_THAT(result.err, HasSubstr(option + ": \"" + value + "\"; allowed: a number of seconds from " + range));
    }
  }
}

TEST(BadInput, WhatOnlyTrialsTakeBesideEndurance) {
  const ScratchFolder folder;
  for (const auto& [option, value] : std::vector<std::pair<std::string, std::string>>{
           {"--faults", "5"}, {"--tier", "simulated"}, {"--out", "o"}, {"--trial", "1"}, {"--seed", "2"}}) {
    const ProgramResult result = run_program({"campaign", "--endurance", "1", option, value}, folder);
    EXPECT_EQ(result.exit_code, 2) << option;
    EXPECT_THAT(result.err, HasSubstr(option + " excludes --endurance"));
  }
  const ProgramResult scenes = run_program({"campaign", "--endurance", "1", "joints", "contacts"}, folder);
  EXPECT_EQ(scenes.exit_code, 2);
  EXPECT_THAT(scenes.err, HasSubstr("--endurance: 2 scenes; allowed: one, or none"));
}

TEST(BadInput, AFaultOfASlotThatASwapHasTakenOutOfItsWorker) {
  const ScratchFolder folder;
  const std::vector<std::string> run = {"run", harness::shipped_scene("bounce"), "--swap",
                                        "solver=Newton@step=50,hosting=direct"};
  const auto with_fault = [&](const std::string& fault) {
    std::vector<std::string> words = run;
    words.insert(words.end(), {"--steps", "70", "--fault", fault});
    return run_program(words, folder);
  };
  const ProgramResult late = with_fault("solver:kill@step=60");
  EXPECT_EQ(late.exit_code, 2);
  EXPECT_THAT(late.err,
              HasSubstr("fault kill in slot solver: from step 50 on --swap has it hosted in the kernel's own"));
  EXPECT_EQ(with_fault("solver:kill@step=40").exit_code, 0);
}

TEST(BadInput, NumbersOfReplayAndCapture) {
  const ScratchFolder folder;
  const std::string whole = "\"0\"; allowed: a whole number from 1 to 4294967295";
  for (const auto& [arguments, message] : std::vector<std::pair<std::vector<std::string>, std::string>>{
           {{"replay", "s.caps", "--call", "0"}, "--call: " + whole},
           {{"replay", "s.caps", "--times", "0"}, "--times: " + whole},
           {{"replay", "s.caps", "--deadline", "0"}, "--deadline: \"0\"; allowed: a finite number of seconds > 0"},
           {{"replay", "s.caps", "--deadline", "nan"}, "--deadline: \"nan\"; allowed: a finite number of seconds > 0"},
           {{"capture", kSample, "--slot", "solver", "--out", "c", "--calls", "0"}, "--calls: " + whole},
           {{"capture", kSample, "--slot", "solver", "--out", "c", "--from-step", "0"}, "--from-step: " + whole}}) {
    const ProgramResult result = run_program(arguments, folder);
    EXPECT_EQ(result.exit_code, 2);
    EXPECT_THAT(result.err, HasSubstr(message));
  }
}

TEST(BadInput, NoOrUnknownSubcommand) {
  const ScratchFolder folder;
  EXPECT_EQ(run_program({}, folder).exit_code, 2);
  EXPECT_EQ(run_program({"fly"}, folder).exit_code, 2);
  EXPECT_EQ(run_program({"run"}, folder).exit_code, 2);
}

TEST(BadInput, AWordThatIsNoSubcommandIsNamed) {
  const ScratchFolder folder;
  for (const auto& [arguments, message] : std::vector<std::pair<std::vector<std::string>, const char*>>{
           {{"runn"}, "there is no sub-command \"runn\"; did you mean \"run\"?"},
           {{"ctl", "--socket", "x", "swapp"}, "there is no sub-command \"swapp\"; did you mean \"swap\"?"},
           {{"--bogus"}, "there is no option \"--bogus\""},
           {{"ctl", "--bogus"}, "there is no option \"--bogus\""},
           {{"ctl", "status", "--jsn"}, "there is no option \"--jsn\"; did you mean \"--json\"?"},
           {{"describe", "--jsn"}, "there is no option \"--jsn\"; did you mean \"--json\"?"},
           {{"campaign", "--sed", "1"}, "there is no option \"--sed\"; did you mean \"--seed\"?"},
           {{"ctl", "swapp"}, "there is no sub-command \"swapp\"; did you mean \"swap\"?"}}) {
    const ProgramResult result = run_program(arguments, folder);
    EXPECT_EQ(result.exit_code, 2);
    EXPECT_THAT(result.err, HasSubstr(message));
  }
}

TEST(BadInput, AReportThatCannotBeWrittenIsRefusedBeforeTheRun) {
  const ScratchFolder folder;
  const ProgramResult result = run_program(
      {"run", kSample, "--steps", "2", "--hosting", "direct", "--report", folder.path("nowhere/report.json")}, folder);
  EXPECT_EQ(result.exit_code, 2);
  EXPECT_THAT(result.err, HasSubstr("nowhere/report.json"));
}

// What could not be printed is not done.
TEST(StandardOutput, ThatCannotBeWrittenIsAFailure) {
  for (const std::string& words :
       {"plan --json " + in_shell(kSample), "run --duration 0.1 --hosting direct --json " + in_shell(kSample),
        std::string("--help"), std::string("--version"), std::string("run --help")}) {
    const std::string command = in_shell(in_build("/bin/gravitas")) + " " + words + " > /dev/full 2> /dev/null";
    EXPECT_EQ(WEXITSTATUS(std::system(command.c_str())), 1) << words;
  }
}

}  // namespace
}  // namespace gravitas
