// Runs whose scene changes on the way: what bodies, joints, forces and materials then do has closed forms, and hosting,
// stops and resumes change no bit.
#include "tests/services/edit/edited_run.h"

#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <functional>
#include <map>
#include <optional>
#include <sstream>
#include <string>
#include <utility>
#include <vector>

#include "services/recorder/checkpoint.h"
#include "services/recorder/durable_file.h"
#include "services/recorder/recorder.h"
#include "services/run/session.h"
#include "tests/run_quietly.h"
#include "tests/services/cli/program.h"

namespace gravitas::edited {
namespace {

using harness::run_quietly;
using harness::ScratchFolder;
using kernel::Hosting;
using ::testing::HasSubstr;

TEST(EditedRun, ABodyMovesAsItWasSet) {
  EditedRun run(scene(ball("A", "LinearVelocity = {1, 0, 0}")), {"set Body.A.LinearVelocity={0,2,0}@step=51"});
  Row end = run.end()["A"];
  EXPECT_NEAR((end.position - Vector3(0.5, 1.0, 0)).norm(), 0.0, 1e-12);
  EXPECT_EQ(end.velocity, Vector3(0, 2, 0));
  // moved elsewhere it is as fast as it was
  run.options.edits = {"set Body.A.Position={7,0,0}@step=51"};
  end = run.end()["A"];
  EXPECT_NEAR((end.position - Vector3(7.5, 0, 0)).norm(), 0.0, 1e-12);
  EXPECT_EQ(end.velocity, Vector3(1, 0, 0));
  // back to where it began, which the scene says already
  run.options.edits = {"set Body.A.Position={0,0,0}@step=31", "set Body.A.Position={0,0,0}@step=61"};
  EXPECT_NEAR(run.end()["A"].position.x(), 0.4, 1e-12);
}

TEST(EditedRun, BodiesComeAndGo) {
  EditedRun run(scene(ball("A", "LinearVelocity = {1, 0, 0}") + ball("B", "Position = {0, 5, 0}")));
  const std::string more = run.folder.write(
      "more.gravitas",
      "Geometries { Geometry { Type = \"Box\" Id = \"Cube\" CustomProperties { HalfExtents = {1, 1, 1} } } }\n"
      "Bodies { Body { Id = \"C\" GeometryId = \"Cube\" Mass = 3 KineticProperties { Position = {0, -5, 0} "
      "LinearVelocity = {0, -1, 0} } } }\n");
  run.options.edits = {"remove Body.B@step=21", "add " + more + "@step=31"};
  const std::map<std::string, Row> end = run.end();
  ASSERT_EQ(end.size(), 2U);
  EXPECT_NEAR((end.at("A").position - Vector3(1, 0, 0)).norm(), 0.0, 1e-12);
  EXPECT_NEAR((end.at("C").position - Vector3(0, -5.7, 0)).norm(), 0.0, 1e-12);
  const RunResult result = run.run();
  EXPECT_EQ(result.report.bodies(), 2U);
  EXPECT_NEAR(result.report.linear_momentum().final(0), 2.0, 1e-12);
  EXPECT_NEAR(result.report.linear_momentum().final(1), -3.0, 1e-12);
  // energy is compared with that after the last edit
  EXPECT_NEAR(result.report.energy().initial(), 1.0, 1e-12);
  EXPECT_NEAR(result.report.energy().final(), 2.5, 1e-12);
  EXPECT_LT(result.report.energy().max_relative_drift(), 1e-12);
}

// Pushed by 4 N from rest: at 2 m/s when its mass, by density so far, becomes 8 kg.
TEST(EditedRun, TheMassOfABodyOfADensityIsSet) {
  const double volume = 4.0 / 3.0 * 3.14159265358979323846 * 1e-3;
  const std::string pushed = fmt::format(
      "Body {{ Id = \"A\" GeometryId = \"Unit\" MassDensity = {} Forces = {{ \"Wind\" }} }}\n", 1.0 / volume);
  EditedRun run(
      "Forces { Force { Type = \"Basic\" Id = \"Wind\" CustomProperties { Force = {4, 0, 0} } } }" + scene(pushed),
      {"set Body.A.Mass=8@step=51"});
  EXPECT_NEAR(run.end()["A"].velocity.x(), 4.0 * 0.5 + 0.5 * 0.5, 1e-12);
  run.options.edits = {"set Body.A.Mass=8@step=51", fmt::format("set Body.A.MassDensity={}@step=76", 2.0 / volume)};
  EXPECT_NEAR(run.end()["A"].velocity.x(), 4.0 * 0.5 + 0.5 * 0.25 + 2.0 * 0.25, 1e-12);
}

TEST(EditedRun, AForceThatIsSetActsFromThenOn) {
  EditedRun run(scene(ball("A", "", kFalls)), {"set Force.Down.Acceleration={0,0,0}@step=51"});
  const Row end = run.end()["A"];
  EXPECT_NEAR(end.velocity.y(), -5.0, 1e-12);
  EXPECT_NEAR(end.position.y(), -1.25 - 2.5, 1e-12);
  // one that comes in the middle
  const std::string wind = run.folder.write(
      "wind.gravitas", "Forces { Force { Type = \"Basic\" Id = \"Wind\" CustomProperties { Force = {4, 0, 0} } } }");
  run.options.edits = {"add " + wind + "@step=51", "set Body.A.Forces={\"Down\",\"Wind\"}@step=51"};
  EXPECT_NEAR(run.end()["A"].position.x(), 0.5 * (4.0 / 2.0) * 0.25, 1e-12);
}

// A ball that falls freely is caught by a joint at a point, and let go again: it swings on the arm that it had when it was
// caught, and keeps the energy of its speed along the circle.
TEST(EditedRun, AJointIsBoundWhereTheBodiesAre) {
  EditedRun run(scene(ball("A", "Position = {1, 0, 0}", kFalls)), {}, {"Solver=Newton"});
  const std::string hold = run.folder.write(
      "hold.gravitas",
      "Constraints { Constraint { Type = \"Spherical\" Id = \"Hold\" Body2 = \"A\" CustomProperties { BindPoint = "
      "{0, -0.8, 0} } } }");
  run.options.edits = {"add " + hold + "@step=41"};
  Row end = run.end()["A"];
  // caught at (1, -0.8, 0), at the point's height, 1 m away
  EXPECT_NEAR((end.position - Vector3(0, -0.8, 0)).norm(), 1.0, 1e-9);
  EXPECT_NEAR((end.position - Vector3(0, -0.8, 0)).dot(end.velocity), 0.0, 0.05);
  EXPECT_LT(run.run().report.max_joint_error(), 1e-9);
  // let go it falls on: the velocity of then, and g
  run.options.steps = 60;
  const Row then = run.end()["A"];
  run.options.edits.emplace_back("remove Constraint.Hold@step=61");
  run.options.steps = 90;
  end = run.end()["A"];
  const double t = 30 * kStep;
  EXPECT_NEAR((end.position - then.position - t * then.velocity - 0.5 * t * t * Vector3(0, -10, 0)).norm(), 0.0, 1e-12);
}

// What the joint does not allow is gone where the ball is caught, not at the end of the step: the rest is a steady turn. A
// run that stopped right there ends alike.
TEST(EditedRun, WithSmoothAJointCatchesAtOnce) {
  EditedRun run(scene(ball("A", "Position = {1, 0, 0} LinearVelocity = {3, 2, 0}")), {},
                {"Simulator=Smooth", "Solver=Direct", "Integrator=RK4"});
  const std::string hold = run.folder.write(
      "hold.gravitas",
      "Constraints { Constraint { Type = \"Spherical\" Id = \"Hold\" Body2 = \"A\" CustomProperties { BindPoint = "
      "{1.2, 0.8, 0} } } }");
  run.options.edits = {"add " + hold + "@step=41"};
  run.options.checkpoint = run.folder.path("checkpoint");
  const Row end = run.end()["A"];
  const double inertia = 0.4 * 2.0 * 0.1 * 0.1, rate = 2.0 * 2.0 / (2.0 + inertia), angle = 0.6 * rate;
  EXPECT_NEAR((end.position - Vector3(1.2 + std::cos(angle), 0.8 + std::sin(angle), 0)).norm(), 0.0, 1e-9);
  const std::string chain = run.run().report.chain_hash();
  const std::vector<std::string> edits = run.options.edits;
  for (const std::uint32_t stop : {40U, 41U}) {
    run.options.steps = stop;
    if (stop < 41) run.options.edits.clear();
    run.run();
    run.options.steps.reset();
    run.options.edits = edits;
    run.options.resume = run.options.checkpoint;
    EXPECT_EQ(run.run().report.chain_hash(), chain) << stop;
    run.options.resume.clear();
  }
}

TEST(EditedRun, AMaterialIsThatOfTheImpact) {
  const std::string ground = "Body { Id = \"Ground\" GeometryId = \"Flat\" Material = \"Rubber\" }\n";
  for (const double restitution : {0.0, 0.5, 1.0}) {
    EditedRun run(scene(ground + ball("A", "Position = {0, 1.1, 0} LinearVelocity = {0, -2, 0}")),
                  {"set Material.Rubber.RestitutionCoefficient=" + std::to_string(restitution) + "@step=11"});
    EXPECT_NEAR(run.end()["A"].velocity.y(), 2.0 * restitution, 1e-12);
  }
}

// It bounces with half of 2 m/s, though it pressed the ground before.
TEST(EditedRun, WhatRestsBouncesWhereItIsThrownDown) {
  EditedRun run(scene("Body { Id = \"Ground\" GeometryId = \"Flat\" Material = \"Rubber\" }\n" +
                      ball("A", "Position = {0, 0.1, 0}", kFalls)),
                {"set Body.A.LinearVelocity={0,-2,0}@step=100"});
  EXPECT_NEAR(run.end()["A"].velocity.y(), 1.0, 1e-6);
}

// The plan is that of the edited scene.
TEST(EditedRun, ThePlanIsMadeAnew) {
  EditedRun run(scene(ball("A", "Position = {0, 1.1, 0}", kFalls)));
  const auto planned = [&](const char* name) {
    const RunResult result = run.run();
    for (const report::v1::PlannedSlot& slot : result.report.plan().slots())
      if (slot.slot() == name) return true;
    return false;
  };
  EXPECT_FALSE(planned("collision"));
  const std::string ground =
      run.folder.write("ground.gravitas", "Bodies { Body { Id = \"Ground\" GeometryId = \"Flat\" } }");
  run.options.edits = {"add " + ground + "@step=21"};
  EXPECT_TRUE(planned("collision"));
  EXPECT_GT(run.end()["A"].position.y(), 0.0);
  run.options.edits.emplace_back("remove Body.Ground@step=41");
  EXPECT_FALSE(planned("collision"));
}

// Every collision that began ends: with the body that is removed, and where one is put elsewhere, where it may begin anew.
TEST(EditedRun, CollisionsEndWithWhoIsRemovedOrMoved) {
  const std::string ground = "Body { Id = \"Ground\" GeometryId = \"Flat\" }";
  EditedRun run(
      scene(ground + ball("A", "Position = {0, 0.1, 0}", kFalls) + ball("B", "Position = {3, 0.1, 0}", kFalls)));
  using Counts = std::pair<std::uint64_t, std::uint64_t>;  // begun, ended
  const auto events = [&](const std::string& edit) {
    run.options.edits = {edit};
    const report::v1::EventCounts counts = run.run().report.events();
    return Counts(counts.collision_start(), counts.collision_end());
  };
  EXPECT_EQ(events("remove Body.Ground@step=41"), Counts(2, 2));
  EXPECT_EQ(events("remove Body.A@step=41"), Counts(2, 1));
  EXPECT_EQ(events("set Body.A.Position={5,0.1,0}@step=41"), Counts(3, 1));
  EXPECT_EQ(events("set Body.A.Mass=3@step=41"), Counts(2, 0));
  EXPECT_EQ(events("set Body.A.Immovable=true@step=41"), Counts(2, 1));
  EXPECT_EQ(events("set Geometry.Unit.Radius=0.11@step=41"), Counts(4, 2));
}

// A body that is fixed stays where it is then.
TEST(EditedRun, ABodyThatIsMadeImmovableStaysWhereItIs) {
  EditedRun run(
      scene(ball("A", "LinearVelocity = {1, 0, 0}") + ball("B", "Position = {3, 0, 0} LinearVelocity = {-1, 0, 0}")),
      {"set Body.A.Immovable=true@step=51"});
  // B meets A at rest at x = 0.5 at t = 2.3 s, and comes back
  run.options.duration = 3.0;
  const std::map<std::string, Row> end = run.end();
  EXPECT_FALSE(end.contains("A"));
  EXPECT_NEAR(end.at("B").velocity.x(), 0.5, 1e-12);
  EXPECT_NEAR(end.at("B").position.x(), 0.7 + 0.5 * 0.7, 0.02);
  // whatever is edited after
  run.options.edits.push_back("set Body.B.Mass=3@step=61");
  run.options.edits.push_back("set Body.A.Orientation={0,1,0,0}@step=62");
  EXPECT_NEAR(run.end().at("B").position.x(), end.at("B").position.x(), 1e-12);
}

// A ball comes to roll at 2/7 of what the ground below runs at, and is back at rest when that stops.
TEST(EditedRun, ASurfaceRunsAndStops) {
  EditedRun run(scene("Body { Id = \"Ground\" GeometryId = \"Flat\" Material = \"Rubber\" }\n" +
                      ball("A", "Position = {0, 0.1, 0}", kFalls)),
                {"set Body.Ground.SurfaceVelocity={0.7,0,0}@step=21"},
                {"Material.Rubber.StaticFrictionCoefficient=0.5", "Material.Rubber.DynamicFrictionCoefficient=0.5"});
  EXPECT_NEAR(run.end()["A"].velocity.x(), 0.2, 1e-9);
  run.options.edits.push_back("set Body.Ground.SurfaceVelocity={-0.7,0,0}@step=61");
  EXPECT_NEAR(run.end()["A"].velocity.x(), -0.2, 1e-9);
  run.options.edits.back() = "set Body.Ground.SurfaceVelocity={0,0,0}@step=61";
  EXPECT_NEAR(run.end()["A"].velocity.x(), 0.0, 1e-9);
}

// What the edit does not touch goes on bit for bit, warm start and all; that there was an edit is in the chain.
TEST(EditedRun, WhatIsNotTouchedKeepsItsBits) {
  for (const char* name : {"stack", "sliding_boxes", "double_pendulum", "two_spheres_motor"}) {
    RunOptions options;
    options.scenes = {harness::shipped_scene(name)};
    options.hosting = {{std::nullopt, Hosting::kDirect}};
    options.steps = 80;
    options.overrides = {"Simulator.SleepEnergy=0"};
    const auto run_it = [&] { return run_quietly(options); };
    const RunResult quiet = run_it();
    const ScratchFolder folder;
    const std::string idle = folder.write("idle", "Materials { Material { Id = \"Unused\" } }");
    options.edits = {"add " + idle + "@step=41"};
    const RunResult edited = run_it();
    EXPECT_EQ(edited.outcome, RunOutcome::kCompleted) << edited.fault;
    EXPECT_EQ(edited.report.state_hash(), quiet.report.state_hash()) << name;
    EXPECT_NE(edited.report.chain_hash(), quiet.report.chain_hash()) << name;
    EXPECT_EQ(edited.report.max_penetration(), quiet.report.max_penetration()) << name;
    EXPECT_EQ(edited.report.max_joint_error(), quiet.report.max_joint_error()) << name;
  }
}

// Balls on the ground and on a joint, and edits of all kinds.
struct BusyRun : EditedRun {
  BusyRun()
      : EditedRun(scene("Body { Id = \"Ground\" GeometryId = \"Flat\" Material = \"Rubber\" }\n" +
                            ball("A", "Position = {0, 0.1, 0} LinearVelocity = {0.3, 0, 0}", kFalls) +
                            ball("B", "Position = {1, 0.5, 0}", kFalls) + ball("C", "Position = {2, 1, 0}", kFalls),
                        "Constraints { Constraint { Type = \"Spherical\" Id = \"Hang\" Body1 = \"B\" Body2 = \"C\" "
                        "CustomProperties { BindPoint = {1.5, 0.7, 0} } } }")) {
    const std::string more = folder.write(
        "more.gravitas",
        "Bodies { Body { Id = \"D\" GeometryId = \"Unit\" Mass = 1 KineticProperties { Position = "
        "{0.2, 0.6, 0} } Forces = { \"Down\" } } }\n"
        "Constraints { Constraint { Type = \"Distance\" Id = \"Rope\" Body1 = \"A\" Body2 = \"D\" "
        "CustomProperties { BindPoint1 = {0.12, 0.1, 0} BindPoint2 = {0.2, 0.6, 0} MaximumDistance = 1 } } }\n");
    options.edits = {"add " + more + "@step=31", "remove Constraint.Hang@step=46",
                     "set Body.C.Position={-1,2,0}@step=46", "remove Body.B@step=61",
                     "set Material.Rubber.RestitutionCoefficient=0.9@step=61"};
    options.steps = 100;
  }
};

TEST(EditedRun, HostingChangesNoBit) {
  BusyRun run;
  const std::string chain = run.run().report.chain_hash();
  run.options.hosting = {{std::nullopt, Hosting::kSharedMemory}};
  EXPECT_EQ(run.run().report.chain_hash(), chain);
  run.options.faults = {"solver:kill@step=25", "solver:kill@step=50"};
  const RunResult hurt = run.run();
  EXPECT_EQ(hurt.report.chain_hash(), chain);
  ASSERT_EQ(hurt.report.faults_size(), 2);
  EXPECT_EQ(hurt.report.faults(0).step(), 25U);
  EXPECT_EQ(hurt.report.faults(1).step(), 50U);
}

TEST(EditedRun, DebugGeometryIsThatOfTheEditedScene) {
  BusyRun run;
  const std::string chain = run.run().report.chain_hash();
  run.options.instrumentation = run.folder.path("frames");
  run.options.instrumentation_kinds = {"shape", "contact", "trajectory"};
  const RunResult result = run.run();
  EXPECT_EQ(result.report.chain_hash(), chain);
  std::istringstream text(harness::read_file(run.options.instrumentation));
  std::string first, last;
  std::getline(text, first);
  for (std::string line; std::getline(text, line);) last = line;
  EXPECT_THAT(first, HasSubstr("\"B\""));
  EXPECT_THAT(first, ::testing::Not(HasSubstr("\"D\"")));
  EXPECT_THAT(last, HasSubstr("\"D\""));
  EXPECT_THAT(last, ::testing::Not(HasSubstr("\"B\"")));
}

// Whoever took over answers in the edited scene, too.
TEST(EditedRun, ASwapStays) {
  BusyRun run;
  run.options.hosting = {{std::nullopt, Hosting::kSharedMemory}};
  run.options.swaps = {"integrator=SemiImplicitEuler@step=12", "integrator=Euler@step=70"};
  const RunResult result = run.run();
  ASSERT_EQ(result.report.swaps_size(), 2);
  EXPECT_EQ(result.report.swaps(0).outcome(), "committed");
  EXPECT_EQ(result.report.swaps(1).outcome(), "committed");
  EXPECT_EQ(result.report.swaps(1).from(), "SemiImplicitEuler");
  run.options.hosting = {{std::nullopt, Hosting::kDirect}};
  EXPECT_EQ(run.run().report.chain_hash(), result.report.chain_hash());
}

// A plugin that takes over binds joints where they were bound, not where the scene had the bodies.
TEST(EditedRun, JointsAreBoundAgainWhereTheyWere) {
  BusyRun run;
  run.options.edits.resize(1);
  run.options.hosting = {{std::nullopt, Hosting::kSharedMemory}};
  const std::string chain = run.run().report.chain_hash();
  for (const char* joints : {"constraint=Distance", "constraint=Spherical"}) {
    run.options.swaps = {std::string(joints) + "@step=50,hosting=grpc"};
    const RunResult swapped = run.run();
    EXPECT_EQ(swapped.report.chain_hash(), chain) << joints;
    ASSERT_EQ(swapped.report.swaps_size(), 1);
    EXPECT_EQ(swapped.report.swaps(0).outcome(), "committed") << swapped.report.swaps(0).reason();
  }
}

class StoppedAt : public ::testing::TestWithParam<std::uint32_t> {};

INSTANTIATE_TEST_SUITE_P(Step, StoppedAt, ::testing::Values(10, 30, 31, 45, 46, 60, 80));

TEST_P(StoppedAt, AnEditedRunIsResumedToItsChain) {
  BusyRun run;
  const RunResult whole = run.run();
  run.options.steps = GetParam();
  run.options.checkpoint = run.folder.path("checkpoint");
  run.options.checkpoint_every = 7;
  // with edits beyond its end, too
  run.run();
  const std::vector<std::string> edits = run.options.edits;
  run.options.steps = 100;
  run.options.checkpoint.clear();
  run.options.checkpoint_every = 0;
  run.options.resume = run.folder.path("checkpoint");
  // the checkpoint knows what was edited before it; with and without the words of then
  std::vector<std::string> later;
  for (const std::string& one : edits)
    if (std::stoul(one.substr(one.rfind('=') + 1)) > GetParam()) later.push_back(one);
  for (const std::vector<std::string>& words : {later, edits}) {
    run.options.edits = words;
    const RunResult rest = run.run();
    EXPECT_EQ(rest.report.chain_hash(), whole.report.chain_hash());
    EXPECT_EQ(rest.report.state_hash(), whole.report.state_hash());
    EXPECT_EQ(rest.report.energy().initial(), whole.report.energy().initial());
    EXPECT_NEAR(rest.report.energy().final(), whole.report.energy().final(), 1e-9);
    EXPECT_EQ(rest.report.max_joint_error(), whole.report.max_joint_error());
  }
}

// A kill leaves an old checkpoint and a journal that goes further: it knows the edits.
TEST(EditedRun, TheJournalKnowsTheEdits) {
  BusyRun run;
  const RunResult whole = run.run();
  run.options.steps = 20;
  run.options.checkpoint = run.folder.path("checkpoint");
  const std::vector<std::string> edits = std::exchange(run.options.edits, {});
  run.run();
  const std::vector<std::byte> early = read_whole_file(run.options.checkpoint);
  run.options.steps = 100;
  run.options.edits = edits;
  run.options.resume = run.options.checkpoint;
  EXPECT_EQ(run.run().report.chain_hash(), whole.report.chain_hash());
  replace_file(run.options.checkpoint, early);
  run.options.edits.clear();
  const RunResult again = run.run();
  EXPECT_EQ(again.report.chain_hash(), whole.report.chain_hash());
  EXPECT_THAT(again.report.warnings(), ::testing::Each(::testing::Not(HasSubstr("left aside"))));
  // another edit than the journal's comes out differently
  replace_file(run.options.checkpoint, early);
  run.options.edits = {"set Body.A.Mass=3@step=31"};
  const RunResult other = run_quietly(run.options);
  EXPECT_EQ(other.outcome, RunOutcome::kFailed);
  EXPECT_THAT(other.fault, HasSubstr("step 31 came out differently"));
}

TEST(EditedRun, WhatTheCheckpointWasNotEditedByIsNotPassedOver) {
  BusyRun run;
  run.options.steps = 40;
  run.options.edits.resize(1);
  const std::string made = run.options.edits[0];
  run.options.checkpoint = run.folder.path("checkpoint");
  run.run();
  run.options.resume = std::exchange(run.options.checkpoint, "");
  run.options.edits = {made, "set Body.A.Mass=3@step=35"};
  EXPECT_THAT(run.refusal(),
              HasSubstr("--edit before step 35: the run that the checkpoint of step 40 belongs to was not"));
}

// With a right checksum and wrong content.
TEST(EditedRun, AnImpossibleEditOfACheckpointIsRefused) {
  const auto refusal_of = [](const std::function<void(recorder::v1::Checkpoint*)>& change) {
    BusyRun run;
    run.options.steps = 40;
    run.options.edits.resize(1);
    run.options.checkpoint = run.folder.path("checkpoint");
    run.run();
    std::string problem;
    std::optional<recorder::v1::Checkpoint> checkpoint =
        parse_checkpoint(read_whole_file(run.options.checkpoint), &problem);
    EXPECT_GT(checkpoint->edits(0).places_size(), 0);
    change(&*checkpoint);
    replace_file(run.options.checkpoint, serialize_checkpoint(*checkpoint));
    run.options.resume = std::exchange(run.options.checkpoint, "");
    run.options.edits.clear();
    return run.refusal();
  };
  EXPECT_THAT(refusal_of([](recorder::v1::Checkpoint* checkpoint) {
                checkpoint->mutable_edits(0)->mutable_places(0)->set_position(0, std::nan(""));
              }),
              HasSubstr("the place of "));
  EXPECT_THAT(refusal_of([](recorder::v1::Checkpoint* checkpoint) {
                checkpoint->mutable_edits(0)->mutable_places(0)->mutable_orientation()->RemoveLast();
              }),
              HasSubstr("the place of "));
  EXPECT_THAT(refusal_of([](recorder::v1::Checkpoint* checkpoint) {
                checkpoint->mutable_edits(0)->mutable_changes(0)->mutable_add()->set_text("Bodies {");
              }),
              HasSubstr("the file ends inside the block"));
  EXPECT_THAT(refusal_of([](recorder::v1::Checkpoint* checkpoint) { checkpoint->clear_edits(); }),
              HasSubstr("position has"));
}

TEST(EditedRun, WhatCannotBeIsSaidBeforeTheRunBegins) {
  EditedRun run(scene(ball("A", "") + ball("B", "Position = {1, 0, 0}"),
                      "Constraints { Constraint { Type = \"Spherical\" Id = \"Hang\" Body1 = \"A\" Body2 = \"B\" "
                      "CustomProperties { BindPoint = {0.5, 0, 0} } } }"));
  const std::string twice = run.folder.write("twice", ball("A", ""));
  const std::string bodies = run.folder.write("bodies", "Bodies { " + ball("A", "") + " }");
  const std::string push = run.folder.write("push",
                                            "Forces { Force { Type = \"Basic\" Id = \"Push\" CustomProperties { Force "
                                            "= {1, 0, 0} Instantaneous = true } } }\n"
                                            "Bodies { " +
                                                ball("P", "Position = {0, 9, 0}", "Forces = { \"Push\" }") + " }");
  const std::map<std::string, std::string> refused = {
      {"jump Body.A@step=5", "allowed: add FILE, remove PATH, set PATH=VALUE"},
      {"remove Body.A", "allowed: CHANGE@step=N"},
      {"remove Body.A@step=0", "allowed: CHANGE@step=N"},
      {"remove Body.a@step=5", "did you mean \"A\"?"},
      {"remove Body.A@step=6", "names no Body: \"A\""},
      {"remove Solver.X@step=5", "\"Solver\" is nothing that can go"},
      {"set Solver.Iterations=5@step=5", "a plugin and its properties are exchanged by a swap"},
      {"set Body.A.Weight=5@step=5", "edit before step 5: set Body.A.Weight=5: "},
      {"add /none@step=5", "/none"},
      {"add " + twice + "@step=5", "unknown block \"Body\""},
      {"add " + bodies + "@step=5", "Body \"A\" is there already"},
      {"add " + push + "@step=5", "would act at t = 0"}};
  for (const auto& [edit, why] : refused) {
    run.options.edits = {edit};
    EXPECT_THAT(run.refusal(), HasSubstr(why)) << edit;
  }
  // before the first step it may act once
  run.options.edits = {"add " + push + "@step=1"};
  EXPECT_NEAR(run.end()["P"].velocity.x(), 0.5, 1e-12);
  // nor does a force that acts all the time become one
  const std::string pull = run.folder.write("pull",
                                            "Forces { Force { Type = \"Basic\" Id = \"Pull\" CustomProperties { Force "
                                            "= {1, 0, 0} } } }\n"
                                            "Bodies { " +
                                                ball("Q", "Position = {0, 9, 0}", "Forces = { \"Pull\" }") + " }");
  run.options.edits = {"add " + pull + "@step=1", "set Force.Pull.Instantaneous=true@step=20"};
  EXPECT_THAT(run.refusal(), HasSubstr("would act at t = 0"));
  // all changes before a step are one: the joint goes first
  run.options.edits = {"remove Constraint.Hang@step=5", "remove Body.A@step=5"};
  EXPECT_EQ(run.end().size(), 1U);
}

// Of the solver, when the last joint goes between bodies that cannot touch.
TEST(EditedRun, WhatIsOrderedOfASlotThatAnEditLeavesOutIsRefusedBeforeTheRunBegins) {
  EditedRun run(scene(ball("A", "") + ball("B", "Position = {1, 0, 0}"),
                      "CollisionFilter { DefaultAllow = false }\n"
                      "Constraints { Constraint { Type = \"Spherical\" Id = \"Hang\" Body1 = \"A\" Body2 = \"B\" "
                      "CustomProperties { BindPoint = {0.5, 0, 0} } } }"),
                {"set Body.A.Mass=3@step=10", "remove Constraint.Hang@step=20"});
  run.options.hosting = {{std::nullopt, Hosting::kSharedMemory}};
  const std::string gone =
      ": after the edit before step 20 the plan leaves the slot out: there are neither contacts nor joints";
  run.options.swaps = {"solver=Newton@step=30"};
  EXPECT_EQ(run.refusal(), "swap solver=Newton at step 30" + gone);
  run.options.swaps = {"solver=Newton@step=20"};
  EXPECT_EQ(run.refusal(), "swap solver=Newton at step 20" + gone);
  run.options.swaps.clear();
  run.options.comparisons = {"solver=Newton"};
  EXPECT_EQ(run.refusal(), "--compare solver=Newton" + gone);
  run.options.comparisons.clear();
  run.options.faults = {"solver:kill@step=20"};
  EXPECT_EQ(run.refusal(), "--fault solver:kill@step=20" + gone);
  // before that edit it is there
  run.options.swaps = {"solver=Newton@step=19"};
  run.options.faults = {"solver:kill@step=5"};
  const RunResult result = run.run();
  EXPECT_EQ(result.report.faults_size(), 1);
  EXPECT_EQ(result.report.swaps_size(), 1);
}

}  // namespace
}  // namespace gravitas::edited
