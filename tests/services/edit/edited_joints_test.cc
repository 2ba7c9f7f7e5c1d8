// Joints whose properties are set while a scene runs: ropes that hoist, drives that come and go.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cstdint>
#include <string>
#include <utility>
#include <vector>

#include "tests/services/edit/edited_run.h"

namespace gravitas::edited {
namespace {

// A crane: its rope was refused by where the load began. What an edit leaves too long is pulled in by the next step, which gives the
// load no velocity, and the work that is done is the load's weight times its way.
TEST(EditedJoints, ARopeHoistsWhatHangsOnIt) {
  const std::string rope =
      "Constraints { Constraint { Type = \"Distance\" Id = \"Rope\" Body2 = \"Load\" CustomProperties { BindPoint1 = "
      "{0, 0, 0} BindPoint2 = {0, -2, 0} MaximumDistance = 2 } } }\n";
  const std::string load =
      "Body { Id = \"Load\" Mass = 100 PrincipalMoments = {1, 1, 1} KineticProperties { Position = "
      "{0, -2, 0} } " +
      kFalls + " }\n";
  for (const char* solver : {"Sequential", "Newton", "Direct"}) {
    EditedRun run(scene(load, rope), {}, {std::string("Solver=") + solver});
    const auto set_length = [&](double length, int step) {
      run.options.edits.push_back("set Constraint.Rope.MaximumDistance=" + std::to_string(length) +
                                  "@step=" + std::to_string(step));
    };
    for (int i = 1; i <= 10; ++i) {
      set_length(2.0 - 0.004 * i, 10 + i);
      run.options.steps = 10 + i;
      const Row now = run.end()["Load"];
      ASSERT_NEAR(now.position.y(), -2.0 + 0.004 * i, 1e-9) << solver;
      ASSERT_NEAR(now.velocity.norm(), 0.0, 1e-9) << solver;
    }
    set_length(1.86, 31);
    run.options.steps = 31;
    Row end = run.end()["Load"];
    EXPECT_NEAR(end.position.y(), -1.86, 1e-9) << solver;
    EXPECT_NEAR(end.velocity.norm(), 0.0, 1e-9) << solver;
    const RunResult result = run.run();
    EXPECT_NEAR(result.report.energy().final() - result.report.energy().initial(), 100 * 10 * 0.14, 1e-6) << solver;
    // paid out, it falls freely until the rope is taut again
    set_length(5.0, 41);
    run.options.steps = 60;
    EXPECT_NEAR(run.end()["Load"].velocity.y(), -10 * 20 * kStep, 1e-9) << solver;
    run.options.edits.back() = "set Constraint.Rope.MinimumDistance=3@step=41";
    EXPECT_THAT(run.fault(), ::testing::HasSubstr("Distance: MinimumDistance 3.000000 lies above MaximumDistance"));
  }
}

// A drive comes, turns round and goes while it runs: w = T t / I in between.
// What rests on an elastic stop does not bounce there; what an edit throws at it does, as on a floor.
TEST(EditedJoints, AThrowAtAStopComesBack) {
  const std::string stop =
      "Constraints { Constraint { Type = \"Slider\" Id = \"Guide\" Body2 = \"Load\" CustomProperties { BindPoint = {0, "
      "0, 0} "
      "Axis = {0, 1, 0} LowerLimit = 0 Restitution = 1 } } }\n";
  const std::string load = "Body { Id = \"Load\" Mass = 2 PrincipalMoments = {1, 1, 1} " + kFalls + " }\n";
  for (const char* solver : {"Sequential", "Newton", "Direct"}) {
    EditedRun run(scene(load, stop), {}, {std::string("Solver=") + solver});
    run.options.steps = 20;
    EXPECT_NEAR(run.end()["Load"].position.y(), 0.0, 1e-12) << solver;
    EXPECT_NEAR(run.end()["Load"].velocity.y(), 0.0, 1e-12) << solver;
    run.options.edits = {"set Body.Load.LinearVelocity={0,-3,0}@step=21"};
    run.options.steps = 21;
    EXPECT_NEAR(run.end()["Load"].velocity.y(), 3.0, 10 * kStep) << solver;
  }
}

// At -0.5 rad when its limit is set: beyond one at -0.1 rad, from which 5.78 rad is where it came from.
TEST(EditedJoints, ALimitThatTakesTheAngleForAnotherTurnIsToldOf) {
  const auto joint = [](const std::string& more) {
    return "Constraints { Constraint { Type = \"Revolute\" Id = \"Door\" Body2 = \"A\" CustomProperties { "
           "BindAxisPoint1 = "
           "{0, 0, 0} BindAxisPoint2 = {0, 0, 1} " +
           more + " } } }\n";
  };
  const auto warnings = [&](const std::string& more, const std::string& edit) {
    EditedRun run(scene(ball("A", "AngularVelocity = {0, 0, -1}"), joint(more)), {edit});
    const auto all = run.run().report.warnings();
    std::vector<std::string> told;
    for (const std::string& one : all)
      if (one.find("Door") != std::string::npos) told.push_back(one);
    return told;
  };
  EXPECT_THAT(warnings("", "set Constraint.Door.LowerLimit=-0.1@step=51"),
              ::testing::ElementsAre(
                  "edit before step 51: set Constraint.Door.LowerLimit=-0.1: the joint 'Door' stands at angle = -0.5 "
                  "rad, which counts as 5.78319 rad with its limits"));
  // what it has not reached, and what holds it with another limit on the other side
  EXPECT_THAT(warnings("", "set Constraint.Door.LowerLimit=-0.6@step=51"), ::testing::IsEmpty());
  EXPECT_THAT(warnings("UpperLimit = 1", "set Constraint.Door.LowerLimit=-0.1@step=51"), ::testing::IsEmpty());
}

TEST(EditedJoints, ADriveIsSetWhileItRuns) {
  const double torque = 0.4 * 2 * 0.1 * 0.1;  // 1 rad/s^2
  for (const std::string& joint :
       {std::string("Type = \"Revolute\" CustomProperties { BindAxisPoint1 = {0, 0, 0} BindAxisPoint2 = {0, 0, 1} }"),
        std::string("Type = \"Axle\" CustomProperties { BindPoint = {0, 0, 0} SteeringAxis = {0, 1, 0} RollingAxis = "
                    "{0, 0, 1} }")}) {
    EditedRun run(scene(ball("A", ""), "Constraints { Constraint { Id = \"J\" Body2 = \"A\" " + joint + " } }\n"),
                  {"set Constraint.J.AngularSpeed=10@step=11",
                   "set Constraint.J.MaximumTorque=" + std::to_string(torque) + "@step=11"});
    EXPECT_NEAR(run.run().report.drives(0).speed(), 0.9, 1e-9);
    run.options.edits.emplace_back("set Constraint.J.AngularSpeed=0@step=61");
    EXPECT_NEAR(run.run().report.drives(0).speed(), 0.5 - 0.4, 1e-9);
    run.options.edits = {run.options.edits[1]};
    EXPECT_THAT(run.fault(), ::testing::HasSubstr("MaximumTorque is given without AngularSpeed"));
  }
}

// A course is one of the scene's time: another one goes on at the step of its edit, and a run that is stopped in the middle comes
// to the same bits.
TEST(EditedJoints, ACourseIsSetWhileItIsFollowed) {
  for (const char* bound : {"", " MaximumForce = 80"}) {
    EditedRun run(
        scene(ball("A", "LinearVelocity = {1, 0, 0}"),
              "Constraints { Constraint { Id = \"J\" Type = \"Slider\" Body2 = \"A\" CustomProperties { BindPoint = "
              "{0, 0, 0} Axis = {1, 0, 0} Motion = {{0, 0}, {0.3, 0.3}}" +
                  std::string(bound) + " } } }\n"),
        {"set Constraint.J.Motion={{0,0},{0.3,0.3},{0.5,0.6},{0.8,0.6},{1,0.2}}@step=31"});
    const std::string edit = run.options.edits[0];
    const RunResult whole = run.run();
    EXPECT_NEAR(run.end()["A"].position.x(), 0.2, *bound == '\0' ? 1e-12 : 1e-3) << bound;
    run.options.steps = 30;
    EXPECT_NEAR(run.end()["A"].position.x(), 0.3, 1e-12) << bound;
    run.options.steps = 70;
    EXPECT_NEAR(run.end()["A"].position.x(), 0.6, *bound == '\0' ? 1e-12 : 1e-6) << bound;
    for (const std::uint32_t stop : {20U, 45U}) {
      run.options.steps = stop;
      run.options.checkpoint = run.folder.path("checkpoint");
      run.run();
      run.options.steps = 100;
      run.options.resume = std::exchange(run.options.checkpoint, "");
      EXPECT_EQ(run.run().report.chain_hash(), whole.report.chain_hash()) << bound << stop;
      run.options.resume.clear();
    }
    run.options.edits = {"set Constraint.J.Motion={{0,0},{0,1}}@step=31"};
    EXPECT_THAT(run.fault(), ::testing::HasSubstr("Motion cannot be followed"));
    run.options.edits = {edit, "set Constraint.J.Speed=1@step=41"};
    EXPECT_THAT(run.fault(), ::testing::HasSubstr("Speed and Motion are both given"));
  }
}

}  // namespace
}  // namespace gravitas::edited
