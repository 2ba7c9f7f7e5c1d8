// The trajectory file: frames, quoting, samples, failures.
#include "services/recorder/trajectory.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <cstdlib>
#include <fstream>
#include <sstream>
#include <string>
#include <system_error>
#include <vector>

#include "services/run/session.h"
#include "tests/services/cli/program.h"

namespace gravitas {
namespace {

using harness::ScratchFolder;
using ::testing::ElementsAre;
using ::testing::Eq;
using ::testing::StartsWith;

constexpr const char* kTrajectoryHeader = "time,body,px,py,pz,qw,qx,qy,qz,vx,vy,vz,wx,wy,wz";

// A body whose centre of mass lies 1 m along y of its geometry's frame, with principal axes that are turned by a quarter
// about z; one whose id CSV would misread; one that cannot move.
constexpr const char* kScene = R"(
Geometries { Geometry { Type = "Sphere" Id = "Unit" CustomProperties { Radius = 0.5 } } }
Simulator { CustomProperties { TimeStep = 0.1 Duration = 1 } }
Environment { Space { Bodies {
  Body {
    Id = "Offset" GeometryId = "Unit" Mass = 1 PrincipalMoments = {1, 2, 3} CentreOfMass = {0, 1, 0}
    PrincipalAxes = {0.70710678118654752, 0, 0, 0.70710678118654752}
    KineticProperties { Position = {10, 0, 0} LinearVelocity = {1, 0, 0} }
  }
  Body { Id = "a,\"b\"" GeometryId = "Unit" Mass = 1 KineticProperties { Position = {0, 0.1, 0.3} AngularVelocity = {0, 1, 0} } }
  Body { Id = "Rock" GeometryId = "Unit" Immovable = true KineticProperties { Position = {-10, 0, 0} } }
} } })";

kernel::EnvironmentDescription description_of(const ScratchFolder& folder) {
  RunOptions options;
  options.scenes = {folder.write("scene", kScene)};
  options.hosting = {{std::nullopt, kernel::Hosting::kDirect}};
  std::vector<std::string> warnings;
  return load(options, &warnings);
}

// Runs the scene to its end and returns the lines of its trajectory.
std::vector<std::string> trajectory_of(const ScratchFolder& folder, double interval) {
  const kernel::EnvironmentDescription description = description_of(folder);
  const std::unique_ptr<kernel::Environment> environment = start(description);
  TrajectoryWriter writer(folder.path("out.csv"), description, interval);
  writer.offer(*environment, false);
  while (environment->step_count() < environment->total_steps()) {
    if (environment->step() != kernel::StepOutcome::kCommitted) {
      ADD_FAILURE() << environment->fault()->fault.text();
      break;
    }
    writer.offer(*environment, environment->step_count() == environment->total_steps());
  }
  // an end that was offered before is not written again
  writer.offer(*environment, true);
  writer.close();
  std::istringstream text(harness::read_file(folder.path("out.csv")));
  std::vector<std::string> lines;
  for (std::string line; std::getline(text, line);) lines.push_back(line);
  return lines;
}

std::vector<double> sample_times(const std::vector<std::string>& lines) {
  std::vector<double> times;
  for (std::size_t i = 1; i < lines.size(); i += 2) times.push_back(std::stod(lines[i]));
  return times;
}

TEST(Trajectory, HasARowPerBodyThatCanMove) {
  const ScratchFolder folder;
  const std::vector<std::string> lines = trajectory_of(folder, 0.0);
  ASSERT_EQ(lines.size(), 1U + 11 * 2);
  EXPECT_EQ(lines[0], kTrajectoryHeader);
  for (std::size_t i = 1; i < lines.size(); i += 2) {
    EXPECT_NE(lines[i].find(",Offset,"), std::string::npos) << lines[i];
    EXPECT_NE(lines[i + 1].find(",\"a,\"\"b\"\"\","), std::string::npos) << lines[i + 1];
  }
}

TEST(Trajectory, PosesAreThoseOfTheGeometryAndVelocitiesOfTheCentreOfMass) {
  const ScratchFolder folder;
  const std::vector<std::string> lines = trajectory_of(folder, 0.0);
  const auto numbers = [](const std::string& line) {
    std::vector<double> all;
    std::istringstream text(line.substr(line.find("Offset,") + 7));
    for (std::string cell; std::getline(text, cell, ',');) all.push_back(std::stod(cell));
    return all;
  };
  const std::vector<double> first = numbers(lines[1]), last = numbers(lines[lines.size() - 2]);
  ASSERT_EQ(first.size(), 13U);
  // where the scene put it, to rounding of the way to the centre of mass and back
  const std::vector<double> expected = {10, 0, 0, 1, 0, 0, 0, 1, 0, 0, 0, 0, 0};
  for (std::size_t i = 0; i < 13; ++i) EXPECT_NEAR(first[i], expected[i], 2e-15) << i;
  EXPECT_NEAR(last[0], 11.0, 1e-14);
}

TEST(Trajectory, NumbersReadBackBitForBit) {
  const ScratchFolder folder;
  const kernel::EnvironmentDescription description = description_of(folder);
  const std::unique_ptr<kernel::Environment> environment = start(description);
  TrajectoryWriter writer(folder.path("out.csv"), description, 0.0);
  for (int i = 0; i < 3; ++i) ASSERT_EQ(environment->step(), kernel::StepOutcome::kCommitted);
  writer.offer(*environment, false);
  writer.close();
  const std::string text = harness::read_file(folder.path("out.csv"));
  const std::string row = text.substr(text.find("\"a,\"\"b\"\"\",") + 10);
  std::istringstream cells(row);
  std::vector<double> read;
  for (std::string cell; std::getline(cells, cell, ',');) read.push_back(std::strtod(cell.c_str(), nullptr));
  ASSERT_EQ(read.size(), 13U);
  EXPECT_EQ(read[1], 0.1);
  EXPECT_EQ(read[2], 0.3);
  const std::span<const double> q = environment->state().orientation;
  EXPECT_THAT((std::vector<double>(read.begin() + 3, read.begin() + 7)), ElementsAre(q[4], q[5], q[6], q[7]));
  // the time is a product, not a sum: 3 x 0.1 is not 0.3
  EXPECT_EQ(std::strtod(text.c_str() + text.find('\n') + 1, nullptr), 3 * 0.1);
}

TEST(Trajectory, SamplesAreTheFirstBoundariesAtOrAfterTheInterval) {
  const ScratchFolder folder;
  EXPECT_THAT(sample_times(trajectory_of(folder, 0.25)),
              ElementsAre(Eq(0.0), Eq(3 * 0.1), Eq(5 * 0.1), Eq(8 * 0.1), Eq(10 * 0.1)));
  // 0.3 is met by the step at 3 x 0.1, which is a rounding above, and 0.6 by 6 x 0.1; the last state always
  EXPECT_THAT(sample_times(trajectory_of(folder, 0.3)),
              ElementsAre(Eq(0.0), Eq(3 * 0.1), Eq(6 * 0.1), Eq(9 * 0.1), Eq(10 * 0.1)));
  // shorter than a step: every step, once
  EXPECT_EQ(sample_times(trajectory_of(folder, 0.01)).size(), 11U);
  EXPECT_EQ(sample_times(trajectory_of(folder, 1e-300)).size(), 11U);
  // longer than the run
  EXPECT_THAT(sample_times(trajectory_of(folder, 50.0)), ElementsAre(Eq(0.0), Eq(10 * 0.1)));
}

TEST(Trajectory, AFileThatCannotBeMadeOrWrittenIsSaid) {
  const ScratchFolder folder;
  const kernel::EnvironmentDescription description = description_of(folder);
  try {
    TrajectoryWriter(folder.path("none/out.csv"), description, 0.0);
    FAIL() << "a folder that is not there";
  } catch (const std::system_error& problem) {
    EXPECT_THAT(problem.what(), StartsWith("trajectory '" + folder.path("none/out.csv") + "'"));
  }
  // every write to this device fails: nothing may be lost in silence
  const std::unique_ptr<kernel::Environment> environment = start(description);
  TrajectoryWriter writer("/dev/full", description, 0.0);
  EXPECT_THROW(
      {
        for (int i = 0; i < 1000; ++i) {
          writer.offer(*environment, false);
          if (environment->step_count() < environment->total_steps()) environment->step();
        }
        writer.close();
      },
      std::system_error);
}

}  // namespace
}  // namespace gravitas
