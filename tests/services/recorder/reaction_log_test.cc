// The file of reactions: the same wherever the plugins ran, sampled like the trajectory, and no bit of the run changes.
#include "services/recorder/reaction_log.h"

#include <google/protobuf/util/json_util.h>
#include <gtest/gtest.h>

#include <optional>
#include <sstream>
#include <string>
#include <string_view>
#include <vector>

#include "services/run/session.h"
#include "tests/run_quietly.h"
#include "tests/services/cli/program.h"

namespace gravitas {
namespace {

using harness::read_file;
using harness::run_quietly;
using harness::ScratchFolder;

// A crate that lands beside a pendulum.
constexpr const char* kReactionScene = R"(
Geometries { Geometry { Type = "Box" Id = "Cube" CustomProperties { HalfExtents = {0.5, 0.5, 0.5} } }
             Geometry { Type = "Halfspace" Id = "Plane" } }
Forces { Force { Type = "Gravity" Id = "Down" CustomProperties { Acceleration = {0, -9.81, 0} } } }
Simulator { CustomProperties { TimeStep = 0.01 Duration = 0.5 } }
Environment {
  Space { Bodies {
    Body { Id = "Ground" GeometryId = "Plane" Immovable = true }
    Body { Id = "Crate" GeometryId = "Cube" Mass = 2 KineticProperties { Position = {0, 0.6, 0} } Forces = { "Down" } }
    Body { Id = "Bob" Mass = 1 PrincipalMoments = {0.1, 0.1, 0.1} KineticProperties { Position = {5, 3, 0} } Forces = { "Down" } }
  } }
  Constraints { Constraint { Type = "Spherical" Id = "Pivot" Body2 = "Bob" CustomProperties { BindPoint = {4, 3, 0} } } }
})";

RunResult run_with(const ScratchFolder& folder, kernel::Hosting hosting, const std::string& reactions,
                   std::optional<double> sample_every = std::nullopt) {
  RunOptions options;
  options.scenes = {folder.write("scene", kReactionScene)};
  options.hosting = {{std::nullopt, hosting}};
  options.reactions = reactions;
  options.sample_every = sample_every;
  return run_quietly(options);
}

std::vector<report::v1::Reaction> lines_of(const std::string& file) {
  std::vector<report::v1::Reaction> all;
  std::istringstream lines(read_file(file));
  for (std::string line; std::getline(lines, line);)
    EXPECT_TRUE(google::protobuf::util::JsonStringToMessage(line, &all.emplace_back()).ok()) << line;
  return all;
}

TEST(ReactionLog, IsTheSameInEveryHostingAndChangesNoBit) {
  const ScratchFolder folder;
  const RunResult quiet = run_with(folder, kernel::Hosting::kDirect, "");
  EXPECT_EQ(quiet.report.reactions_size(), 0);
  const std::string file = folder.path("reactions.jsonl");
  std::string first;
  for (const kernel::Hosting hosting :
       {kernel::Hosting::kDirect, kernel::Hosting::kSharedMemory, kernel::Hosting::kGrpc}) {
    const RunResult result = run_with(folder, hosting, file);
    EXPECT_EQ(result.report.chain_hash(), quiet.report.chain_hash());
    if (first.empty()) first = read_file(file);
    EXPECT_EQ(read_file(file), first);
    // the report has those of the last step: the joint, and the crate's corners
    ASSERT_GE(result.report.reactions_size(), 2);
    EXPECT_EQ(result.report.reactions(0).constraint(), "Pivot");
    EXPECT_EQ(result.report.reactions(0).step(), 50U);
    double weight = 0.0;
    for (int i = 1; i < result.report.reactions_size(); ++i) {
      EXPECT_EQ(result.report.reactions(i).bodies(0), "Ground");
      EXPECT_EQ(result.report.reactions(i).bodies(1), "Crate");
      weight += result.report.reactions(i).force(1);
    }
    EXPECT_NEAR(weight, 2 * 9.81, 1e-8);
  }
}

TEST(ReactionLog, IsSampledLikeTheTrajectory) {
  const ScratchFolder folder;
  const std::string file = folder.path("reactions.jsonl");
  (void)run_with(folder, kernel::Hosting::kDirect, file, 0.2);
  std::vector<std::uint32_t> steps;
  for (const report::v1::Reaction& one : lines_of(file)) {
    if (one.constraint() == "Pivot") steps.push_back(one.step());
    EXPECT_DOUBLE_EQ(one.time(), 0.01 * one.step());
  }
  EXPECT_EQ(steps, (std::vector<std::uint32_t>{20, 40, 50}));
}

// Two balls of 2 kg on felt, and one on glass. The one that rolls along x is held back by mu_r m g, the one that spins about
// the normal by mu_sp m g.
constexpr const char* kBallsScene = R"(
Geometries { Geometry { Type = "Sphere" Id = "Round" CustomProperties { Radius = 0.5 } }
             Geometry { Type = "Halfspace" Id = "Plane" } }
Materials { Material { Id = "Felt" RollingFrictionCoefficient = 0.02 SpinningFrictionCoefficient = 0.01 }
            Material { Id = "Glass" } }
Forces { Force { Type = "Gravity" Id = "Down" CustomProperties { Acceleration = {0, -9.81, 0} } } }
Simulator { Type = "Basic" Id = "Main" CustomProperties { TimeStep = 0.01 Duration = 0.2 } }
Environment {
  Space { Bodies {
    Body { Id = "Ground" GeometryId = "Plane" Immovable = true Material = "Felt" }
    Body { Id = "Rolls" GeometryId = "Round" Mass = 2 Material = "Felt" Forces = { "Down" }
           KineticProperties { Position = {0, 0.5, 0} LinearVelocity = {3, 0, 0} AngularVelocity = {0, 0, -6} } }
    Body { Id = "Spins" GeometryId = "Round" Mass = 2 Material = "Felt" Forces = { "Down" }
           KineticProperties { Position = {0, 0.5, 5} AngularVelocity = {0, 7, 0} } }
    Body { Id = "Slips" GeometryId = "Round" Mass = 2 Material = "Glass" Forces = { "Down" }
           KineticProperties { Position = {0, 0.5, 9} AngularVelocity = {0, 7, -6} } }
  } }
})";

TEST(ReactionLog, HasTheTorquesOfRollingAndSpinningFriction) {
  const ScratchFolder folder;
  for (const char* solver : {"Newton", "Direct", "Sequential"}) {
    for (const char* simulator : {"Basic", "Substepping", "Continuous"}) {
      SCOPED_TRACE(std::string(solver) + ", " + simulator);
      RunOptions options;
      options.scenes = {folder.write("balls", kBallsScene)};
      options.hosting = {{std::nullopt, kernel::Hosting::kDirect}};
      options.overrides = {std::string("Solver=") + solver, std::string("Simulator=") + simulator};
      if (simulator == std::string_view("Substepping")) options.overrides.push_back("Simulator.Substeps=3");
      options.reactions = folder.path("reactions.jsonl");
      const RunResult result = run_quietly(options);
      ASSERT_EQ(result.report.reactions_size(), 3);
      const double load = 2 * 9.81;
      const Vector3 right[] = {{0, 0, 0.02 * load}, {0, -0.01 * load, 0}, {0, 0, 0}};
      for (int i = 0; i < 3; ++i) {
        const report::v1::Reaction& one = result.report.reactions(i);
        SCOPED_TRACE(one.bodies(1));
        EXPECT_NEAR(one.force(1), load, 1e-8);
        for (int k = 0; k < 3; ++k) EXPECT_NEAR(one.torque(k), right[i][k], 1e-8);
      }
    }
  }
}

TEST(ReactionLog, ThatCannotBeMadeIsBadInput) {
  const ScratchFolder folder;
  try {
    (void)run_with(folder, kernel::Hosting::kDirect, folder.path("nowhere/reactions.jsonl"));
    FAIL() << "it was made";
  } catch (const BadInput& problem) {
    EXPECT_NE(std::string(problem.what()).find("reactions '"), std::string::npos) << problem.what();
  }
}

}  // namespace
}  // namespace gravitas
