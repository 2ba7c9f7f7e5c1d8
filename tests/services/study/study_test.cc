// Studies of a few small ladders: errors fall by the order, nothing that failed is lost, and what is measured against itself
// is where it should be.
#include "services/study/study.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <string>
#include <utility>
#include <vector>

#include "services/run/session.h"
#include "services/study/analysis.h"
#include "services/study/problem.h"
#include "services/study/rung.h"
#include "services/study/self_reference.h"
#include "services/study/spring_stability.h"
#include "services/study/stability_diagram.h"
#include "services/study/tables.h"
#include "tests/paths.h"
#include "tests/services/cli/program.h"

namespace gravitas::study {
namespace {

using ::testing::AllOf;
using ::testing::HasSubstr;
using ::testing::Not;

bool never_interrupted() { return false; }

v1::Study study_of(const Options& options) {
  return run(options, never_interrupted, [](const Progress&) {});
}

std::string refusal_of(const Options& options) {
  try {
    study_of(options);
  } catch (const BadInput& refused) {
    return refused.what();
  }
  return "not refused";
}

Options tiny(std::vector<std::string> problems, std::vector<std::string> methods, std::uint32_t rungs) {
  Options options;
  options.problems = std::move(problems);
  options.methods = std::move(methods);
  options.rungs = rungs;
  options.is_short = true;
  options.run_seconds = 10.0;
  return options;
}

Catalog& catalog_of_studies() {
  static Catalog catalog = Catalog::installed(installed_worker(), installed_plugins());
  return catalog;
}

// Every reference is of a body and a time that there are; every demand of a method that is offered.
TEST(StudyProblems, AreWhole) {
  for (const Problem& problem : shipped_problems()) {
    const Subject subject(scene_of(problem), &catalog_of_studies());
    EXPECT_EQ(subject.has_contacts(), problem.task == kContacts) << problem.name;
    const Method& method = offered_methods()[problem.task == kContacts ? 0 : 2];
    const kernel::EnvironmentDescription scene = subject.describe(method, problem.steps, {});
    EXPECT_FALSE(problem.known.empty()) << problem.name;
    for (const Known& known : problem.known) {
      EXPECT_TRUE(std::ranges::any_of(scene.bodies, [&](const auto& body) { return body.id == known.body; }))
          << problem.name << ", " << known.body;
      const double step = known.time / subject.duration() * problem.steps;
      EXPECT_NEAR(step, std::round(step), 1e-9) << problem.name << ", " << known.body;
      EXPECT_LE(step, problem.steps);
    }
    EXPECT_FALSE(problem.bounds.empty()) << problem.name;
    for (const Bound& bound : problem.bounds)
      EXPECT_TRUE(std::ranges::any_of(
          offered_methods(),
          [&](const Method& offered) { return offered.name() == bound.method && (offered.tasks & problem.task) != 0; }))
          << problem.name << ", " << bound.method;
  }
}

TEST(Study, ErrorsFallByTheOrder) {
  const v1::Study study =
      study_of(tiny({"spherical_pendulum", "double_pendulum"}, {"Smooth/RK4/Direct", "ImplicitMidpoint"}, 9));
  ASSERT_EQ(study.problems_size(), 2);
  for (const v1::Problem& problem : study.problems()) {
    ASSERT_EQ(problem.ladders_size(), 2) << problem.name();
    for (const v1::Ladder& ladder : problem.ladders()) {
      EXPECT_NEAR(ladder.observed_order(), ladder.order(), 0.2) << problem.name() << ladder.method();
      ASSERT_EQ(ladder.rungs_size(), 9);
      const v1::Rung &coarse = ladder.rungs(7), &fine = ladder.rungs(8);
      EXPECT_EQ(fine.steps(), 2 * coarse.steps());
      EXPECT_DOUBLE_EQ(fine.setting(), 0.5 * coarse.setting());
      EXPECT_LT(fine.error(), 0.3 * coarse.error());
      EXPECT_LT(fine.energy_drift(), coarse.energy_drift());
      EXPECT_LT(fine.joint_error(), 1e-12);
      EXPECT_GE(fine.runs(), 1U);
      EXPECT_GT(fine.cpu_median(), 0.0);
      EXPECT_LE(fine.cpu_min(), fine.cpu_median());
    }
    // four a step, and those that the joints ask where a step begins
    EXPECT_GE(problem.ladders(1).rungs(8).derivatives(), 4 * problem.ladders(1).rungs(8).steps());
  }
  const std::string table = csv(study);
  EXPECT_EQ(std::ranges::count(table, '\n'), 1 + 2 * 2 * 9);
}

TEST(Study, AccuraciesAreMetAlike) {
  const v1::Study study = study_of(tiny({"point_pendulum"}, {"DormandPrince853"}, 10));
  const v1::Ladder& ladder = study.problems(0).ladders(0);
  EXPECT_EQ(ladder.climbs(), "Accuracy");
  EXPECT_FALSE(ladder.has_observed_order());
  EXPECT_GT(ladder.achieved_to_requested(), 0.1);
  EXPECT_LT(ladder.achieved_to_requested(), 100.0);
  EXPECT_EQ(ladder.reached_size(), 3);
  EXPECT_LE(ladder.rungs(9).error(), 1e-9);
}

// The same in errors and work, whenever it runs.
TEST(Study, RepeatsItself) {
  const Options options = tiny({"slide_to_roll", "welded_pendulum"}, {"Basic/SemiImplicitEuler/Sequential"}, 3);
  const v1::Study one = study_of(options), other = study_of(options);
  ASSERT_EQ(one.problems_size(), 2);
  ASSERT_EQ(other.problems_size(), 2);
  for (int p = 0; p < one.problems_size(); ++p)
    for (int i = 0; i < 3; ++i) {
      const v1::Rung &a = one.problems(p).ladders(0).rungs(i), &b = other.problems(p).ladders(0).rungs(i);
      EXPECT_EQ(a.error(), b.error());
      EXPECT_EQ(a.energy_drift(), b.energy_drift());
      EXPECT_EQ(evaluations(a), evaluations(b));
      EXPECT_GT(a.iterations(), 0U);
    }
}

// An explicit method that is not stable, and a run that may take nothing.
TEST(Study, KeepsWhatFailed) {
  Options options = tiny({"damped_springs"}, {"Smooth/RK4/Direct"}, 3);
  const v1::Study unstable = study_of(options);
  ASSERT_EQ(unstable.problems(0).ladders(0).rungs_size(), 3);
  for (const v1::Rung& rung : unstable.problems(0).ladders(0).rungs()) EXPECT_NE(rung.failed(), "");
  EXPECT_THAT(page(unstable), HasSubstr("What failed\n\n- damped_springs, Smooth/RK4/Direct: "));
  EXPECT_THAT(summary(unstable), HasSubstr("     3      3        0\n"));

  options = tiny({"four_bar"}, {"Smooth/RK4/Direct"}, 4);
  options.run_seconds = 1e-3;
  const v1::Study hurried = study_of(options);
  const v1::Ladder& ladder = hurried.problems(0).ladders(0);
  EXPECT_EQ(ladder.rungs(0).failed(), "more than 0.001 s of CPU");
  EXPECT_EQ(ladder.rungs(3).failed(), "not run: a coarser one took too long");
  EXPECT_THAT(csv(hurried), HasSubstr("not run: a coarser one took too long"));
}

// What a ball meets within a step that no simulator looks into is no shipped answer: it passes.
TEST(Study, AStepAcrossAPlateIsSeenInTheError) {
  const v1::Study study =
      study_of(tiny({"thin_plate"}, {"Basic/SemiImplicitEuler/Newton", "Continuous/Verlet/Newton"}, 3));
  EXPECT_GT(study.problems(0).ladders(0).rungs(0).error(), 1e-2);
  EXPECT_LT(study.problems(0).ladders(1).rungs(0).error(), 1e-9);
}

TEST(Study, RefusesWhatIsNotThere) {
  EXPECT_THAT(refusal_of(tiny({"heavy_to"}, {}, 3)),
              AllOf(HasSubstr("did you mean heavy_top?"), HasSubstr("far_away")));
  EXPECT_THAT(refusal_of(tiny({}, {"RK5"}, 3)),
              AllOf(HasSubstr("did you mean RK4?"), HasSubstr("Smooth/Radau/Direct")));
  EXPECT_THAT(refusal_of(tiny({}, {"Smooth/RK4/Newtn"}, 3)), HasSubstr("no method is called so"));
  EXPECT_THAT(refusal_of(tiny({"bounce"}, {"Smooth/RK4/Direct"}, 3)), HasSubstr("bodies that cannot touch"));
  Options options = tiny({}, {}, 3);
  options.scenes = {"no_such.gravitas"};
  EXPECT_THAT(refusal_of(options), HasSubstr("no_such.gravitas"));
  // their files would be one
  options = tiny({"bounce"}, {}, 3);
  options.scenes = {in_source("/deploy/scenes/bounce.gravitas")};
  EXPECT_THAT(refusal_of(options), HasSubstr("both problems are called bounce"));
}

// A combination of installed plugins that the table lacks.
TEST(Study, TakesAnyInstalledPlugins) {
  const v1::Study study =
      study_of(tiny({"spherical_pendulum"}, {"Smooth/RKMK4/Direct", "Smooth/Rosenbrock/Direct"}, 3));
  ASSERT_EQ(study.problems(0).ladders_size(), 2);
  EXPECT_EQ(study.problems(0).ladders(0).climbs(), "Accuracy");
  EXPECT_EQ(study.problems(0).ladders(1).method(), "Smooth/RKMK4/Direct");
  EXPECT_EQ(study.problems(0).ladders(1).climbs(), "TimeStep");
}

TEST(Study, KeepsWhatIsMeasuredBeforeSomebodyInterrupts) {
  std::size_t ladders = 0;
  const auto interrupted = [&] { return ladders >= 2; };
  const v1::Study study = run(tiny({"point_pendulum", "heavy_top"}, {"RK4", "Smooth/Verlet"}, 3), interrupted,
                              [&](const Progress& now) { ladders = now.done; });
  EXPECT_TRUE(study.is_interrupted());
  ASSERT_GE(study.problems_size(), 1);
  EXPECT_EQ(study.problems(0).ladders(1).rungs_size(), 3);
}

// ---- against itself

TEST(SelfReference, OfAPendulumIsWhereTheClosedFormIs) {
  const Subject subject(in_source("/deploy/scenes/study/point_pendulum.gravitas"), &catalog_of_studies());
  RunLimits limits;
  const SelfReference reference = find_self_reference(subject, 50, 1, limits);
  EXPECT_THAT(reference.text, HasSubstr("Smooth/DormandPrince853/Direct at 1e-12"));
  ASSERT_EQ(reference.samples->poses().size(), 51U);
  const Vector3 known(-0.275087462576116860, -0.961419205099125064, 0);
  const double error = (reference.samples->poses().back()[0].position - known).norm();
  EXPECT_LT(error, 1e-11);
  EXPECT_LT(error, reference.samples->size() * reference.uncertainty);
  EXPECT_LT(reference.uncertainty, 1e-9);
}

TEST(SelfReference, OfASlideIsWhereTheBoxStops) {
  const Subject subject(in_source("/deploy/scenes/study/slide_to_stop.gravitas"), &catalog_of_studies());
  const SelfReference reference = find_self_reference(subject, 20, 1, {});
  EXPECT_THAT(reference.text, HasSubstr("Continuous/Verlet/Newton/Accuracy at 1e-10"));
  EXPECT_NEAR(reference.samples->size(), 4.24736663268773, 1e-9);
  EXPECT_LT(reference.uncertainty, 1e-8);
}

// A user's scene gets the ladders that suit it, and errors of the order of its method.
TEST(Study, OfAnOwnScene) {
  Options options = tiny({}, {"Smooth/RK4/Direct", "Smooth/Verlet"}, 6);
  const harness::ScratchFolder folder;
  options.scenes = {folder.write("swing.gravitas", R"(
    Forces { Force { Type = "Gravity" Id = "Down" CustomProperties { Acceleration = {0, -9.81, 0} } } }
    Simulator { Type = "Basic" Id = "Main" CustomProperties { TimeStep = 0.02 Duration = 2 } }
    Environment { Id = "World"
      Space { Bodies { Body { Id = "Bob" Mass = 1 PrincipalMoments = {0.1, 0.2, 0.1} Forces = {"Down"}
        KineticProperties { Position = {1, 0, 0} } } } }
      Constraints { Constraint { Type = "Revolute" Id = "Pivot" Body2 = "Bob"
        CustomProperties { BindAxisPoint1 = {0, 0, 0} BindAxisPoint2 = {0, 0, 1} } } }
    })")};
  const v1::Study study = study_of(options);
  ASSERT_EQ(study.problems_size(), 1);
  const v1::Problem& problem = study.problems(0);
  EXPECT_EQ(problem.name(), "swing");
  EXPECT_EQ(problem.family(), "own");
  EXPECT_THAT(problem.reference(), HasSubstr("itself by "));
  ASSERT_EQ(problem.ladders_size(), 2);
  EXPECT_DOUBLE_EQ(problem.ladders(0).rungs(0).setting(), 0.08);
  EXPECT_NEAR(problem.ladders(0).observed_order(), 2.0, 0.2);
  EXPECT_NEAR(problem.ladders(1).observed_order(), 4.0, 0.2);
  EXPECT_THAT(page(study), Not(HasSubstr("What failed")));
}

// A plugin that only the scene knows is a method like others: semi-implicit Euler once more.
TEST(Study, OfAnOwnPlugin) {
  Options options = tiny({}, {"Basic/Roomy/Sequential", "Basic/SemiImplicitEuler/Sequential"}, 6);
  const harness::ScratchFolder folder;
  options.scenes = {folder.write("thrown.gravitas", R"(
    Forces { Force { Type = "Spring" Id = "Pull" CustomProperties { Stiffness = 10 RestLength = 0.5 } } }
    Simulator { Type = "Basic" Id = "Main" CustomProperties { TimeStep = 0.01 Duration = 1 } }
    Environment { Id = "World"
      Space { Bodies { Body { Id = "Bob" Mass = 1 PrincipalMoments = {0.1, 0.2, 0.1} Forces = {"Pull"}
        KineticProperties { Position = {1, 0, 0} LinearVelocity = {0, 1, 0} } } } }
    }
    Plugins { Plugin { Slot = "integrator" Library = ")" +
                                                        in_build("/lib/gravitas-honest/integrator_roomy.so") +
                                                        R"(" } })")};
  const v1::Study study = study_of(options);
  ASSERT_EQ(study.problems(0).ladders_size(), 2);
  const v1::Ladder &known = study.problems(0).ladders(0), &own = study.problems(0).ladders(1);
  EXPECT_EQ(own.method(), "Basic/Roomy/Sequential");
  EXPECT_NEAR(own.observed_order(), 1.0, 0.2);
  for (int i = 0; i < own.rungs_size(); ++i) EXPECT_NEAR(own.rungs(i).error(), known.rungs(i).error(), 1e-12);
  EXPECT_THAT(refusal_of(tiny({}, {"Basic/Roomy/Sequential"}, 3)), HasSubstr("no method is called so"));
}

// ---- springs

TEST(StudyStability, EngineAgreesWithTheTheory) {
  const std::vector<v1::Limit> limits = map_stability(never_interrupted);
  EXPECT_EQ(limits.size(), 14U * 4U);
  for (const v1::Limit& limit : limits) {
    EXPECT_EQ(limit.agreeing(), limit.cells_size()) << limit.integrator() << ", zeta " << limit.zeta();
    if (limit.zeta() != 0.0) continue;
    if (limit.integrator() == "Verlet") EXPECT_NEAR(limit.theory(), 4.0, 1e-4);
    if (limit.integrator() == "RK4") EXPECT_NEAR(limit.theory(), 8.0, 1e-4);
    if (limit.integrator() == "Radau") EXPECT_FALSE(limit.has_theory());
  }
  v1::Study study;
  std::ptrdiff_t cells = 0, limited = 0;
  for (const v1::Limit& limit : limits) {
    *study.add_limits() = limit;
    cells += limit.cells_size(), limited += limit.has_theory() && limit.theory() > 0.0;
  }
  const std::string drawing = stability_diagram(study);
  const auto count = [&](const std::string& part) {
    std::ptrdiff_t found = 0;
    for (std::size_t at = drawing.find(part); at != std::string::npos; at = drawing.find(part, at + 1)) ++found;
    return found;
  };
  EXPECT_EQ(count("<rect"), 1 + cells);
  EXPECT_EQ(count("stroke=\"black\""), limited);
}

}  // namespace
}  // namespace gravitas::study
