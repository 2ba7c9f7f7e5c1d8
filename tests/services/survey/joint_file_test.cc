// --joints: coordinates over a run, beside what the trajectory and the limits say; the run itself is not changed.
#include "services/survey/joint_file.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <map>
#include <sstream>
#include <string>
#include <vector>

#include "plugin_sdk/math/rotation.h"
#include "services/run/session.h"
#include "tests/paths.h"
#include "tests/run_quietly.h"
#include "tests/services/cli/program.h"

namespace gravitas {
namespace {

using harness::read_file;
using harness::run_quietly;
using harness::ScratchFolder;
using kernel::Hosting;
using ::testing::Contains;
using ::testing::ElementsAre;
using ::testing::HasSubstr;
using ::testing::Not;

struct JointRow {
  double time;
  std::string joint, coordinate;
  double value, rate;
};

std::vector<std::vector<std::string>> joint_cells(const std::string& file, const std::string& head) {
  std::istringstream lines(read_file(file));
  std::string line;
  std::getline(lines, line);
  EXPECT_EQ(line, head);
  std::vector<std::vector<std::string>> rows;
  while (std::getline(lines, line)) {
    std::istringstream cells(line);
    rows.emplace_back();
    for (std::string cell; std::getline(cells, cell, ',');) rows.back().push_back(cell);
  }
  return rows;
}

std::vector<JointRow> joint_rows_of(const std::string& file) {
  std::vector<JointRow> rows;
  for (const std::vector<std::string>& cells : joint_cells(file, "time,joint,coordinate,value,rate"))
    rows.push_back({std::stod(cells.at(0)), cells.at(1), cells.at(2), std::stod(cells.at(3)), std::stod(cells.at(4))});
  return rows;
}

// A pendulum that goes round, a lift that comes down onto its stop, a driven cart and a joint that nothing is told of.
constexpr const char* kMechanism = R"(
Forces { Force { Type = "Gravity" Id = "Down" CustomProperties { Acceleration = {0, -9.81, 0} } } }
Simulator { CustomProperties { TimeStep = 0.005 Duration = 1 } }
Environment {
  Space { Bodies {
    Body { Id = "Bob" Mass = 1 PrincipalMoments = {0.1, 0.1, 0.1} Forces = { "Down" }
      KineticProperties { Position = {1, 0, 0} LinearVelocity = {0, 8, 0} AngularVelocity = {0, 0, 8} CanSleep = false } }
    Body { Id = "Lift" Mass = 2 PrincipalMoments = {1, 1, 1} Forces = { "Down" } KineticProperties { Position = {5, 0, 0} } }
    Body { Id = "Cart" Mass = 3 PrincipalMoments = {1, 1, 1} KineticProperties { Position = {9, 0, 0} LinearVelocity = {0.5, 0, 0} } }
    Body { Id = "Post" Mass = 3 PrincipalMoments = {1, 1, 1} KineticProperties { Position = {15, 0, 0} } }
  } }
  Constraints {
    Constraint { Type = "Revolute" Id = "Pivot" Body2 = "Bob" CustomProperties { BindAxisPoint1 = {0, 0, 0} BindAxisPoint2 = {0, 0, 1} } }
    Constraint { Type = "Slider" Id = "Guide" Body2 = "Lift" CustomProperties { BindPoint = {5, 0, 0} Axis = {0, 1, 0} LowerLimit = -0.3 } }
    Constraint { Type = "Slider" Id = "Rails, \"left\"" Body2 = "Cart" CustomProperties { BindPoint = {9, 0, 0} Axis = {1, 0, 0} Speed = 0.5 } }
    Constraint { Type = "Rigid" Id = "Foot" Body2 = "Post" CustomProperties { BindPoint = {15, 0, 0} } }
  }
  ConstraintSolver = "Direct"
})";

RunOptions mechanism_options(const ScratchFolder& folder, const std::string& scene,
                             Hosting hosting = Hosting::kDirect) {
  RunOptions options;
  options.scenes = {folder.write("scene", scene)};
  options.hosting = {{std::nullopt, hosting}};
  return options;
}

// A name with a comma stands in quotes, which joint_cells() does not know.
std::string without_comma(std::string scene) {
  const std::string id = R"(Rails, \"left\")";
  return scene.replace(scene.find(id), id.size(), "Rails");
}

TEST(JointFile, IsTheSameInEveryHostingAndChangesNoBit) {
  const ScratchFolder folder;
  const RunResult quiet = run_quietly(mechanism_options(folder, kMechanism));
  std::string first;
  for (const Hosting hosting : {Hosting::kDirect, Hosting::kSharedMemory, Hosting::kGrpc}) {
    RunOptions options = mechanism_options(folder, kMechanism, hosting);
    options.joints = folder.path("joints.csv");
    options.sample_every = 0.1;
    const RunResult result = run_quietly(options);
    EXPECT_EQ(result.report.chain_hash(), quiet.report.chain_hash());
    EXPECT_THAT(result.report.warnings(), Not(Contains(HasSubstr("joints"))));
    if (first.empty()) first = read_file(options.joints);
    EXPECT_EQ(read_file(options.joints), first);
  }
  EXPECT_THAT(first, HasSubstr("\n0,\"Rails, \"\"left\"\"\",displacement,0,0.5"));
  // the initial state, and ten samples, of three coordinates
  EXPECT_EQ(std::ranges::count(first, '\n'), 1 + 11 * 3);
}

TEST(JointFile, AgreesWithTheTrajectoryThroughWholeTurns) {
  const ScratchFolder folder;
  RunOptions options = mechanism_options(folder, without_comma(kMechanism));
  options.joints = folder.path("joints.csv");
  options.trajectory = folder.path("trajectory.csv");
  run_quietly(options);
  std::map<double, std::vector<double>> bob;
  for (const std::vector<std::string>& cells :
       joint_cells(options.trajectory, "time,body,px,py,pz,qw,qx,qy,qz,vx,vy,vz,wx,wy,wz"))
    if (cells.at(1) == "Bob")
      for (std::size_t i = 2; i < cells.size(); ++i) bob[std::stod(cells[0])].push_back(std::stod(cells[i]));
  std::vector<JointRow> pivot;
  for (JointRow& row : joint_rows_of(options.joints))
    if (row.joint == "Pivot") pivot.push_back(std::move(row));
  ASSERT_EQ(pivot.size(), 201U);
  ASSERT_EQ(bob.size(), 201U);
  double turned = 0.0, largest = 0.0;
  for (std::size_t i = 0; i < pivot.size(); ++i) {
    const JointRow& row = pivot[i];
    const std::vector<double>& state = bob.at(row.time);
    EXPECT_EQ(row.coordinate, "angle");
    EXPECT_GT(row.value, -kHalfTurn);
    EXPECT_LE(row.value, kHalfTurn);
    // the bob is where the angle says, and turns as it says
    EXPECT_NEAR(std::cos(row.value), state[0], 1e-6);
    EXPECT_NEAR(std::sin(row.value), state[1], 1e-6);
    EXPECT_NEAR(std::remainder(row.value - 2.0 * std::atan2(state[6], state[3]), kWholeTurn), 0.0, 1e-9);
    EXPECT_NEAR(row.rate, state[12], 1e-9);
    largest = std::max(largest, std::fabs(row.value));
    if (i > 0) turned += std::remainder(row.value - pivot[i - 1].value, kWholeTurn);
  }
  EXPECT_GT(turned, kHalfTurn);
  EXPECT_GT(largest, 0.9 * kHalfTurn);
}

TEST(JointFile, RatesAreWhatValuesChangeBy) {
  const ScratchFolder folder;
  RunOptions options = mechanism_options(folder, without_comma(kMechanism));
  options.joints = folder.path("joints.csv");
  options.time_step = 5e-4;
  options.duration = 0.2;
  run_quietly(options);
  std::map<std::string, std::vector<JointRow>> joints;
  for (JointRow& row : joint_rows_of(options.joints)) joints[row.joint].push_back(std::move(row));
  ASSERT_EQ(joints.size(), 3U);
  for (const auto& [joint, rows] : joints) {
    SCOPED_TRACE(joint);
    ASSERT_EQ(rows.size(), 401U);
    // the method is of order one: half a step of acceleration (9.81 m/s^2, or less in rad/s^2)
    for (std::size_t i = 1; i + 1 < rows.size(); ++i)
      EXPECT_NEAR(rows[i].rate, std::remainder(rows[i + 1].value - rows[i - 1].value, kWholeTurn) / 1e-3,
                  9.81 * 5e-4 + 1e-6);
  }
}

TEST(JointFile, ALimitIsHitWhereItSaysAndADriveKeepsItsSpeed) {
  const ScratchFolder folder;
  RunOptions options = mechanism_options(folder, without_comma(kMechanism));
  options.joints = folder.path("joints.csv");
  const RunResult result = run_quietly(options);
  const double accuracy = result.report.max_joint_error() + 1e-12;
  EXPECT_LT(accuracy, 1e-5);
  double last = 1.0, lowest = 0.0;
  for (const JointRow& row : joint_rows_of(options.joints)) {
    if (row.joint == "Guide") last = row.value, lowest = std::min(lowest, row.value);
    if (row.joint != "Rails") continue;
    EXPECT_NEAR(row.rate, 0.5, 1e-9);
    EXPECT_NEAR(row.value, 0.5 * row.time, 1e-9);
  }
  EXPECT_NEAR(last, -0.3, accuracy);
  EXPECT_GE(lowest, -0.3 - accuracy);
}

TEST(JointFile, AResumedRunHasTheSameRows) {
  const ScratchFolder folder;
  RunOptions whole = mechanism_options(folder, kMechanism);
  whole.steps = 60;
  whole.joints = folder.path("whole.csv");
  run_quietly(whole);
  RunOptions first = whole;
  first.joints = folder.path("first.csv");
  first.steps = 25;
  first.checkpoint = folder.path("checkpoint");
  run_quietly(first);
  RunOptions rest = whole;
  rest.joints = folder.path("rest.csv");
  rest.resume = first.checkpoint;
  run_quietly(rest);
  const std::string all = read_file(whole.joints), head = survey::kJointHead;
  std::string begin = read_file(first.joints), end = read_file(rest.joints);
  ASSERT_TRUE(end.starts_with(head));
  end = end.substr(head.size());
  // the state of the checkpoint stands in both
  ASSERT_TRUE(all.starts_with(begin));
  ASSERT_TRUE(all.ends_with(end));
  const std::string last = begin.substr(begin.rfind("\n0.125,Pivot") + 1);
  EXPECT_TRUE(end.starts_with(last));
  EXPECT_EQ(all.size(), begin.size() + end.size() - last.size());
}

// The load of 20 N is more than the second hinge bears; the first is taken out by an edit.
TEST(JointFile, JointsThatBrokeOrAreGoneHaveNoRows) {
  const ScratchFolder folder;
  RunOptions options = mechanism_options(folder, R"(
Forces { Force { Type = "Gravity" Id = "Down" CustomProperties { Acceleration = {0, -9.81, 0} } } }
Simulator { CustomProperties { TimeStep = 0.01 Duration = 0.2 } }
Environment {
  Space { Bodies {
    Body { Id = "A" Mass = 2 PrincipalMoments = {1, 1, 1} Forces = { "Down" } KineticProperties { Position = {0, -1, 0} } }
    Body { Id = "B" Mass = 2 PrincipalMoments = {1, 1, 1} Forces = { "Down" } KineticProperties { Position = {3, -1, 0} } }
    Body { Id = "C" Mass = 2 PrincipalMoments = {1, 1, 1} Forces = { "Down" } KineticProperties { Position = {6, -1, 0} } }
  } }
  Constraints {
    Constraint { Type = "Revolute" Id = "Taken" Body2 = "A" CustomProperties { BindAxisPoint1 = {0, 0, 0} BindAxisPoint2 = {0, 0, 1} } }
    Constraint { Type = "Revolute" Id = "Weak" Body2 = "B" BreakingForce = 5 CustomProperties { BindAxisPoint1 = {3, 0, 0} BindAxisPoint2 = {3, 0, 1} } }
    Constraint { Type = "Revolute" Id = "Kept" Body2 = "C" CustomProperties { BindAxisPoint1 = {6, 0, 0} BindAxisPoint2 = {6, 0, 1} } }
  }
})");
  options.joints = folder.path("joints.csv");
  options.edits = {"remove Constraint.Taken@step=11"};
  const RunResult result = run_quietly(options);
  EXPECT_EQ(result.report.events().break_(), 1);
  std::map<std::string, std::size_t> rows;
  for (const JointRow& row : joint_rows_of(options.joints)) ++rows[row.joint];
  EXPECT_EQ(rows["Kept"], 21U);
  // the initial state and ten steps
  EXPECT_EQ(rows["Taken"], 11U);
  EXPECT_EQ(rows["Weak"], 1U);
}

TEST(JointFile, SaysWhichJointsDoNotSayWhatIsCountedFromWhere) {
  const ScratchFolder folder;
  std::string scene = without_comma(kMechanism);
  const std::string properties = R"("Foot" Body2 = "Post" CustomProperties { BindPoint = {15, 0, 0} })";
  const std::string foot = R"(Type = "Rigid" Id = )" + properties;
  for (const bool has_axis : {false, true}) {
    const std::string ball = R"(Type = "Spherical" Id = )" + properties.substr(0, properties.size() - 1) +
                             (has_axis ? "Axis = {0, 1, 0} }" : "}");
    std::string changed = scene;
    RunOptions options = mechanism_options(folder, changed.replace(changed.find(foot), foot.size(), ball));
    options.joints = folder.path("joints.csv");
    options.steps = 3;
    const RunResult result = run_quietly(options);
    std::map<std::string, int> rows;
    for (const JointRow& row : joint_rows_of(options.joints)) ++rows[row.joint];
    // of a ball joint that is at rest where it started, swing and twist
    EXPECT_EQ(rows["Foot"], has_axis ? 2 * 4 : 0);
    if (has_axis) {
      EXPECT_THAT(result.report.warnings(), Not(Contains(HasSubstr("joints"))));
    } else {
      EXPECT_THAT(result.report.warnings(),
                  ElementsAre("joints lacks coordinates of joints of type Spherical that do not say what these are "
                              "counted from: see `gravitas describe Spherical`"));
    }
  }
}

TEST(JointFile, APluginThatOffersNoCoordinatesRunsAsBefore) {
  const ScratchFolder folder;
  RunOptions options = mechanism_options(folder,
                                         R"(
Plugins { Plugin { Slot = "constraint" Library = ")" +
                                             in_build("/lib/gravitas-faulty/constraint_far_points.so") +
                                             R"(" } }
Simulator { CustomProperties { TimeStep = 0.01 Duration = 0.1 } }
Environment {
  Space { Bodies { Body { Id = "A" Mass = 2 PrincipalMoments = {1, 1, 1} } Body { Id = "B" Mass = 2 PrincipalMoments = {1, 1, 1} } } }
  Constraints {
    Constraint { Type = "Planar" Id = "Table" Body2 = "A" CustomProperties { Point = {0, 0, 0} Normal = {0, 1, 0} } }
    Constraint { Type = "Revolute" Id = "Hinge" Body2 = "B" CustomProperties { BindAxisPoint1 = {0, 0, 0} BindAxisPoint2 = {0, 0, 1} } }
  }
})",
                                         Hosting::kSharedMemory);
  const RunResult quiet = run_quietly(options);
  options.joints = folder.path("joints.csv");
  const RunResult result = run_quietly(options);
  EXPECT_EQ(result.outcome, RunOutcome::kCompleted);
  EXPECT_EQ(result.report.chain_hash(), quiet.report.chain_hash());
  EXPECT_THAT(result.report.warnings(), Not(Contains(HasSubstr("joints"))));
  const std::vector<JointRow> rows = joint_rows_of(options.joints);
  EXPECT_EQ(rows.size(), 11U);
  for (const JointRow& row : rows) EXPECT_EQ(row.joint, "Hinge");
}

}  // namespace
}  // namespace gravitas
