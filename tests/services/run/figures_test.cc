// The figures of a run against numbers that can be worked out by hand.
#include "services/run/figures.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <memory>
#include <string>
#include <utility>
#include <vector>

#include "services/run/session.h"
#include "tests/run_quietly.h"
#include "tests/services/cli/program.h"

namespace gravitas {
namespace {

using harness::run_quietly;
using harness::ScratchFolder;
using ::testing::AllOf;
using ::testing::DoubleNear;
using ::testing::ElementsAre;
using ::testing::HasSubstr;

class Looks final : public kernel::CommitListener {
 public:
  explicit Looks(Figures* figures) : figures_(*figures) {}
  void on_inner_step(const kernel::Environment&, const kernel::InnerStep& inner) override { figures_.look_at(inner); }
  void on_commit(const kernel::Environment&) override {}

 private:
  Figures& figures_;
};

report::v1::Report figures_of(const std::string& scene, int steps) {
  const ScratchFolder folder;
  RunOptions options;
  options.scenes = {folder.write("scene", scene)};
  options.hosting = {{std::nullopt, kernel::Hosting::kDirect}};
  std::vector<std::string> warnings;
  const kernel::EnvironmentDescription description = load(options, &warnings);
  const std::unique_ptr<kernel::Environment> environment = start(description);
  Figures figures(description);
  Looks looks(&figures);
  environment->set_commit_listener(&looks);
  figures.follow(environment.get());
  for (int i = 0; i < steps; ++i) {
    EXPECT_EQ(environment->step(), kernel::StepOutcome::kCommitted);
    figures.follow(environment.get());
  }
  report::v1::Report report;
  figures.write(&report);
  return report;
}

// 2 kg at (1, 2, 0) with 3 m/s along x, moments 2, 3, 4, 5 rad/s about z; a rock of no account.
constexpr const char* kTwoBodies = R"(
Forces { Force { Type = "Gravity" Id = "Down" CustomProperties { Acceleration = {0, -10, 0} } } }
Simulator { CustomProperties { TimeStep = 0.1 Duration = 1 } }
Environment { Space { Bodies {
  Body {
    Id = "Top" Mass = 2 PrincipalMoments = {2, 3, 4}
    KineticProperties { Position = {1, 2, 0} LinearVelocity = {3, 0, 0} AngularVelocity = {0, 0, 5} } Forces = { "Down" }
  }
  Body { Id = "Rock" Immovable = true KineticProperties { Position = {100, 0, 0} } }
} } })";

// An energy that overflows is no energy that stays.
TEST(Figures, ADriftThatHasNoNumberIsNotZero) {
  std::string fast = kTwoBodies;
  fast.replace(fast.find("{3, 0, 0}"), 9, "{1e200, 0, 0}");
  EXPECT_FALSE(std::isfinite(figures_of(fast, 1).energy().max_relative_drift()));
}

TEST(Figures, EnergyAndMomentaAreThoseOfTheMovableBodies) {
  const report::v1::Report report = figures_of(kTwoBodies, 0);
  // 2 3^2/2 + 4 5^2/2 + 2 10 2
  EXPECT_DOUBLE_EQ(report.energy().initial(), 9.0 + 50.0 + 40.0);
  EXPECT_EQ(report.energy().final(), report.energy().initial());
  EXPECT_EQ(report.energy().max_relative_drift(), 0.0);
  EXPECT_THAT(report.linear_momentum().initial(), ElementsAre(6.0, 0.0, 0.0));
  // I w + m x x v = 20 - 2 2 3 about z
  EXPECT_THAT(report.angular_momentum().initial(),
              ElementsAre(DoubleNear(0.0, 1e-14), DoubleNear(0.0, 1e-14), DoubleNear(8.0, 1e-14)));
}

TEST(Figures, FollowEveryCommit) {
  const report::v1::Report report = figures_of(kTwoBodies, 10);
  // v_y = -10; the semi-implicit y = 2 - 10 0.01 55 = -3.5
  EXPECT_NEAR(report.energy().final(), 9.0 + 100.0 + 50.0 + 2.0 * 10.0 * -3.5, 1e-10);
  // it loses m g^2 h^2 n/2 = 1 J per step; the scale is the largest kinetic energy, 159 J
  EXPECT_NEAR(report.energy().max_relative_drift(), 10.0 / 159.0, 1e-12);
  EXPECT_THAT(report.linear_momentum().final(), ElementsAre(6.0, DoubleNear(-20.0, 1e-13), 0.0));
}

TEST(Figures, DrivesAreMeasuredAboutTheAxisThatTurnsWithTheFirstBody) {
  const report::v1::Report report = figures_of(R"(
Simulator { CustomProperties { TimeStep = 0.01 Duration = 1 } }
Environment {
  Space { Bodies {
    Body { Id = "A" Mass = 1 PrincipalMoments = {1, 1, 1} KineticProperties { AngularVelocity = {0, 0, 2} LinearVelocity = {0, 1, 0} } }
    Body { Id = "B" Mass = 1 PrincipalMoments = {1, 1, 1} KineticProperties { Position = {1, 0, 0} AngularVelocity = {0, 0, 2} LinearVelocity = {0, 3, 0} } }
  } }
  Constraints { Constraint { Type = "AngularMotor" Id = "Spindle" Body1 = "A" Body2 = "B"
    CustomProperties { BindAxisPoint1 = {0, 0, 0} BindAxisPoint2 = {1, 0, 0} AngularSpeed = -1.5 } } }
})",
                                               100);
  ASSERT_EQ(report.drives_size(), 1);
  EXPECT_EQ(report.drives(0).constraint(), "Spindle");
  EXPECT_EQ(report.drives(0).target(), -1.5);
  // the axis of the step in which the drive acted lies a turn of 0.02 rad behind
  EXPECT_NEAR(report.drives(0).speed(), -1.5, 1e-3);
}

// A light bob above a heavy one, both let fall: held, and with one sweep of the solver not.
TEST(Figures, JointsThatComeOpenAreWarnedOf) {
  const auto warnings = [](const std::string& solver) {
    const report::v1::Report report = figures_of(R"(
Simulator { CustomProperties { TimeStep = 0.01 Duration = 1 } }
Forces { Force { Type = "Gravity" Id = "Down" CustomProperties { Acceleration = {0, -10, 0} } } }
Environment {
  Space { Bodies {
    Body { Id = "Light" Mass = 1 PrincipalMoments = {1, 1, 1} KineticProperties { Position = {1, 0, 0} } Forces = { "Down" } }
    Body { Id = "Heavy" Mass = 10000 PrincipalMoments = {1, 1, 1} KineticProperties { Position = {4, 4, 0} } Forces = { "Down" } }
  } }
  Constraints {
    Constraint { Type = "Spherical" Id = "Upper" Body2 = "Light" CustomProperties { BindPoint = {0, 0, 0} } }
    Constraint { Type = "Spherical" Id = "Lower" Body1 = "Light" Body2 = "Heavy" CustomProperties { BindPoint = {4, 4, 0} } }
  }
  ConstraintSolver { )" + solver + "} }",
                                                 100);
    return std::vector<std::string>(report.warnings().begin(), report.warnings().end());
  };
  EXPECT_THAT(warnings("Type = \"Newton\""), ElementsAre());
  EXPECT_THAT(warnings("Type = \"Sequential\" CustomProperties { Iterations = 1 }"),
              // 3 4 5
              ElementsAre(AllOf(HasSubstr("joints came open by up to"),
                                HasSubstr("by more than 1 % of what they hold together (5 m) from step "))));
}

// Held at two points that part.
TEST(Figures, JointsThatContradictEachOtherAreToldAsThat) {
  const report::v1::Report report = figures_of(R"(
Simulator { CustomProperties { TimeStep = 0.01 Duration = 1 } }
Environment {
  Space { Bodies {
    Body { Id = "Held" Mass = 1 PrincipalMoments = {1, 1, 1} }
    Body { Id = "Leaves" Kinematic = true Mass = 1 PrincipalMoments = {1, 1, 1}
      KineticProperties { Position = {2, 0, 0} LinearVelocity = {1, 0, 0} } }
  } }
  Constraints {
    Constraint { Type = "Spherical" Id = "Stays" Body2 = "Held" CustomProperties { BindPoint = {-1, 0, 0} } }
    Constraint { Type = "Spherical" Id = "Goes" Body1 = "Leaves" Body2 = "Held" CustomProperties { BindPoint = {1, 0, 0} } }
  }
  ConstraintSolver = "Newton" })",
                                               100);
  ASSERT_EQ(report.warnings_size(), 1);
  EXPECT_THAT(report.warnings(0), HasSubstr("ask for what no motion gives"));
}

// A spring that RK4 cannot follow throws its body along a slider, whose error is rounding of 1e40 m: that was told as a contradiction.
TEST(Figures, JointsOfABodyThatRunsAwayAreToldAsThat) {
  const report::v1::Report report = figures_of(R"(
Simulator { Type = "Smooth" CustomProperties { TimeStep = 0.01 Duration = 1 } }
Environment {
  Space { Bodies { Body { Id = "Car" Mass = 1 PrincipalMoments = {1, 1, 1}
    KineticProperties { LinearVelocity = {0.6, 0.8, 0} } } } }
  Constraints { Constraint { Type = "Slider" Id = "Rail" Body2 = "Car" CustomProperties {
    BindPoint = {1, 1, 0} Axis = {0.6, 0.8, 0} Stiffness = 3e5 } } }
  KineticIntegrator = "RK4" ConstraintSolver = "Newton" })",
                                               14);
  ASSERT_EQ(report.warnings_size(), 2);
  EXPECT_THAT(report.warnings(0), AllOf(HasSubstr("joints came open"), HasSubstr("on: a body runs away")));
  EXPECT_THAT(report.warnings(1), HasSubstr("TimeStep is too long for the forces and the integrator"));
}

// k h^2/m = 5.6, above the 4 that the method bears.
TEST(Figures, ABodyThatRunsAwayIsWarnedOf) {
  const auto warnings = [](double stiffness) {
    const report::v1::Report report =
        figures_of("Forces { Force { Type = \"Spring\" Id = \"Stiff\" CustomProperties { Stiffness = " +
                       std::to_string(stiffness) +
                       R"( } } }
Simulator { CustomProperties { Duration = 1 } }
Environment { Space { Bodies {
  Body { Id = "Bob" Mass = 1 PrincipalMoments = {1, 1, 1} KineticProperties { Position = {1, 0, 0} } Forces = { "Stiff" } } } } })",
                   60);
    return std::vector<std::string>(report.warnings().begin(), report.warnings().end());
  };
  EXPECT_THAT(warnings(2e4), ElementsAre(AllOf(HasSubstr("body \"Bob\" went "), HasSubstr("it runs away"))));
  EXPECT_THAT(warnings(1e4), ElementsAre());
}

// Two balls that overlap by 0.15 m are apart after the first inner step, whatever the simulator.
TEST(Figures, AnOverlapAtTheStartIsPenetration) {
  for (const char* simulator :
       {"Type = \"Basic\"", "Type = \"Substepping\" CustomProperties { Substeps = 4 }", "Type = \"Continuous\"",
        "Type = \"Continuous\" CustomProperties { Accuracy = 1e-6 }", "Type = \"Bisection\""}) {
    const report::v1::Report report = figures_of(std::string("Simulator { ") + simulator + R"( }
Geometries { Geometry { Type = "Sphere" Id = "Ball" CustomProperties { Radius = 0.3 } } }
Environment { Space { Bodies {
  Body { Id = "A" GeometryId = "Ball" Mass = 1 }
  Body { Id = "B" GeometryId = "Ball" Mass = 1 KineticProperties { Position = {0.45, 0, 0} } } } } })",
                                                 3);
    EXPECT_NEAR(report.max_penetration(), 0.15, 1e-12) << simulator;
    ASSERT_EQ(report.warnings_size(), 1) << simulator;
    EXPECT_THAT(report.warnings(0), HasSubstr("at the start bodies \"A\" and \"B\" overlap by 0.15 m:")) << simulator;
  }
}

TEST(Figures, TellOfAnOverlapAtTheStartBeforeACheckpoint) {
  const ScratchFolder folder;
  RunOptions options;
  options.scenes = {folder.write("scene.gravitas", R"(
Geometries { Geometry { Type = "Sphere" Id = "Ball" CustomProperties { Radius = 0.3 } } }
Environment { Space { Bodies {
  Body { Id = "A" GeometryId = "Ball" Mass = 1 }
  Body { Id = "B" GeometryId = "Ball" Mass = 1 KineticProperties { Position = {0.45, 0, 0} } }
  Body { Id = "C" GeometryId = "Ball" Mass = 1 KineticProperties { Position = {0.95, 0, 0} } } } } })")};
  options.hosting = {{std::nullopt, kernel::Hosting::kDirect}};
  for (const std::uint32_t stop : {0U, 2U}) {
    options.steps = stop;
    options.checkpoint = folder.path("checkpoint");
    run_quietly(options);
    options.steps = 4;
    options.resume = std::exchange(options.checkpoint, "");
    const report::v1::Report report = run_quietly(options).report;
    ASSERT_EQ(report.warnings_size(), 1) << stop;
    EXPECT_THAT(report.warnings(0),
                HasSubstr("at the start bodies \"A\" and \"B\" overlap by 0.15 m, and 1 more pair:"))
        << stop;
    options.resume.clear();
  }
}

// What slides lies elsewhere on the other after the first step, which pushes it out.
TEST(Figures, AnOverlapOfWhatSlidesAtTheStartIsPenetration) {
  for (const char* simulator : {"Basic", "Substepping", "Continuous", "Bisection"}) {
    const report::v1::Report report = figures_of(std::string("Simulator { Type = \"") + simulator + R"(" }
Geometries { Geometry { Type = "Box" Id = "Box" CustomProperties { HalfExtents = {0.1, 0.1, 0.1} } }
  Geometry { Type = "Halfspace" Id = "Plane" } }
Environment { Space { Bodies {
  Body { Id = "Floor" GeometryId = "Plane" }
  Body { Id = "Box" GeometryId = "Box" Mass = 1 KineticProperties { Position = {0, 0.09, 0} LinearVelocity = {1, 0, 0} } } } } })",
                                                 3);
    EXPECT_NEAR(report.max_penetration(), 0.01, 1e-12) << simulator;
  }
}

// What flies into another within the first step was apart.
TEST(Figures, WhatMeetsInTheFirstStepDoesNotOverlapAtTheStart) {
  const report::v1::Report report = figures_of(R"(
Geometries { Geometry { Type = "Sphere" Id = "Ball" CustomProperties { Radius = 0.3 } } }
Environment { Space { Bodies {
  Body { Id = "A" GeometryId = "Ball" Mass = 1 KineticProperties { LinearVelocity = {20, 0, 0} } }
  Body { Id = "B" GeometryId = "Ball" Mass = 1 KineticProperties { Position = {0.65, 0, 0} LinearVelocity = {2, 0, 0} } } } } })",
                                               3);
  EXPECT_EQ(report.warnings_size(), 0);
  EXPECT_LT(report.energy().final(), 0.7 * report.energy().initial());  // they have met
}

// Nor did what flies over it.
TEST(Figures, WhatComesAcrossInTheFirstStepDoesNotOverlapAtTheStart) {
  const report::v1::Report report = figures_of(R"(
Geometries { Geometry { Type = "Sphere" Id = "Ball" CustomProperties { Radius = 0.3 } } }
Environment { Space { Bodies {
  Body { Id = "A" GeometryId = "Ball" Mass = 1 KineticProperties { Position = {0, 0.5, 0} LinearVelocity = {60, 0, 0} } }
  Body { Id = "B" GeometryId = "Ball" Mass = 1 KineticProperties { Position = {1, 0, 0} } } } } })",
                                               1);
  EXPECT_EQ(report.warnings_size(), 0);
}

// Nor did what falls past the middle of another: the way out is on the other side then.
TEST(Figures, WhatFallsThroughTheMiddleInTheFirstStepDoesNotOverlapAtTheStart) {
  for (const char* shape : {R"(Type = "Sphere" CustomProperties { Radius = 0.0005 })",
                            R"(Type = "Box" CustomProperties { HalfExtents = {0.1, 0.0005, 0.1} })"}) {
    const report::v1::Report report =
        figures_of(std::string("Geometries { Geometry { Id = \"Shape\" ") + shape + R"( } }
Forces { Force { Type = "Gravity" Id = "Down" CustomProperties { Acceleration = {0, -9.81, 0} } } }
Simulator { CustomProperties { TimeStep = 0.012 } }
Environment { Space { Bodies {
  Body { Id = "Held" GeometryId = "Shape" Immovable = true }
  Body { Id = "Falls" GeometryId = "Shape" Mass = 1 KineticProperties { Position = {0, 0.001, 0} } Forces = { "Down" } } } } })",
                   1);
    EXPECT_EQ(report.warnings_size(), 0) << shape << ": " << report.warnings(0);
    EXPECT_LE(report.max_penetration(), 1e-12) << shape;
  }
}

// A rod that turns its end to the floor in the first step began above it.
TEST(Figures, WhatTurnsDownInTheFirstStepDoesNotOverlapAtTheStart) {
  for (const char* simulator : {"Basic", "Substepping"}) {
    const report::v1::Report report = figures_of(std::string("Simulator { Type = \"") + simulator + R"(" }
Geometries { Geometry { Type = "Box" Id = "Rod" CustomProperties { HalfExtents = {1, 0.05, 0.05} } }
  Geometry { Type = "Halfspace" Id = "Plane" } }
Environment { Space { Bodies {
  Body { Id = "Floor" GeometryId = "Plane" }
  Body { Id = "Rod" GeometryId = "Rod" Mass = 1 KineticProperties { Position = {0, 0.1, 0} AngularVelocity = {0, 0, 20} } } } } })",
                                                 1);
    EXPECT_EQ(report.warnings_size(), 0) << simulator << ": " << report.warnings(0);
    EXPECT_LT(report.energy().final(), 0.95 * report.energy().initial());  // it has met it
  }
}

// It is named, though rows of bodies changed since.
TEST(Figures, ABodyThatRanAwayIsNamedAfterAnEdit) {
  const harness::ScratchFolder folder;
  RunOptions options;
  options.scenes = {folder.write("scene.gravitas", R"(
Forces { Force { Type = "Spring" Id = "Stiff" CustomProperties { Stiffness = 2e4 } } }
Simulator { CustomProperties { Duration = 1 } }
Environment { Space { Bodies {
  Body { Id = "A" Mass = 1 PrincipalMoments = {1, 1, 1} }
  Body { Id = "TheOneThatRunsAway" Mass = 1 PrincipalMoments = {1, 1, 1} KineticProperties { Position = {1, 0, 0} } Forces = { "Stiff" } } } } })")};
  options.hosting = {{std::nullopt, kernel::Hosting::kDirect}};
  options.edits = {"remove Body.A@step=50", "remove Body.TheOneThatRunsAway@step=55"};
  const RunResult result = run_quietly(options);
  EXPECT_THAT(result.report.warnings(), ::testing::Contains(HasSubstr("body \"TheOneThatRunsAway\" went ")));
}

// A damper that wears off within 1e-7 s, three of which an explicit method takes in an inner step.
RunOptions dear_steps(const ScratchFolder& folder) {
  RunOptions options;
  options.scenes = {folder.write("scene", R"(
Forces { Force { Type = "Spring" Id = "Rod" CustomProperties { Stiffness = 1e7 Damping = 1e7 } } }
Simulator { CustomProperties { TimeStep = 0.01 Duration = 0.01 } }
Environment { KineticIntegrator = "DormandPrince54" Space { Bodies {
  Body { Id = "A" Mass = 1 PrincipalMoments = {1, 1, 1} KineticProperties { Position = {1, 0, 0} LinearVelocity = {-1, 0, 0} } Forces = {"Rod"} } } } })")};
  options.hosting = {{std::nullopt, kernel::Hosting::kDirect}};
  return options;
}

TEST(Figures, TellOfAStepThatTakesManyCalls) {
  const ScratchFolder folder;
  RunOptions options = dear_steps(folder);
  const auto warnings = [&](std::uint64_t calls) {
    return run(
               options, [&] { return --calls == 0; }, [](const Progress&) {})
        .report.warnings();
  };
  EXPECT_THAT(warnings(150'000), ElementsAre(HasSubstr("step 1 was not ended after ")));
  EXPECT_THAT(warnings(50'000), ::testing::IsEmpty());
  EXPECT_THAT(warnings(0), ElementsAre(HasSubstr("step 1 took ")));
  options.overrides = {"Integrator=Radau"};
  EXPECT_THAT(warnings(0), ::testing::IsEmpty());
}

// The last step of what goes on is a hundredth of the one that took them.
TEST(Figures, TellOfADearStepBeforeACheckpoint) {
  const ScratchFolder folder;
  RunOptions options = dear_steps(folder);
  options.overrides = {"Simulator.Duration=0.0101"};
  options.checkpoint = folder.path("kept");
  bool is_over = false;
  const RunResult first = run(
      options, [&] { return is_over; }, [&](const Progress&) { is_over = true; });
  ASSERT_EQ(first.report.steps(), 1U);
  options.resume = options.checkpoint;
  options.checkpoint.clear();
  const RunResult second = run_quietly(options);
  EXPECT_EQ(second.report.steps(), 2U);
  const auto is_dear = ::testing::Contains(HasSubstr("step 1 took "));
  EXPECT_THAT(first.report.warnings(), is_dear);
  EXPECT_THAT(second.report.warnings(), is_dear);
}

// What is asked for comparison alone, and what that asks for, makes no step dear.
TEST(Figures, CallsOfComparisonsMakeNoStepDear) {
  const ScratchFolder folder;
  RunOptions options = dear_steps(folder);
  const auto calls = [&] {
    const RunResult result = run_quietly(options);
    for (const std::string& warning : result.report.warnings())
      if (warning.find("calls of plugins") != std::string::npos) return warning;
    return std::string();
  };
  const std::string plain = calls();
  EXPECT_THAT(plain, HasSubstr("step 1 took "));
  options.reruns = {"integrator=1", "force=1"};
  EXPECT_EQ(calls(), plain);
  options.overrides = {"Integrator=Radau"};
  options.reruns.clear();
  options.comparisons = {"integrator=DormandPrince54"};
  EXPECT_EQ(calls(), "");
}

TEST(Figures, OfAnEmptyWorldAreZero) {
  const report::v1::Report report = figures_of("Environment { } Simulator { CustomProperties { Duration = 1 } }", 1);
  EXPECT_EQ(report.energy().initial(), 0.0);
  EXPECT_EQ(report.energy().max_relative_drift(), 0.0);
  EXPECT_THAT(report.linear_momentum().final(), ElementsAre(0.0, 0.0, 0.0));
  EXPECT_EQ(report.max_joint_error(), 0.0);
}

}  // namespace
}  // namespace gravitas
