// No honest answer is taken for a wrong one: every scene, with every shipped method, the physics of each step checked.
#include <gtest/gtest.h>

#include <algorithm>
#include <filesystem>
#include <string>
#include <vector>

#include "services/run/session.h"
#include "tests/paths.h"
#include "tests/scenes/scene_run.h"

namespace gravitas {
namespace {

// Steps of one run: of the large scenes the fall and the first heap.
constexpr std::uint32_t kMostSteps = 120, kMostStepsOfLarge = 20;

std::vector<std::string> scenes() {
  std::vector<std::string> paths;
  for (const char* folder : {"/deploy/scenes", "/tests/determinism", "/tests/scenes"})
    for (const auto& entry : std::filesystem::directory_iterator(in_source(folder)))
      if (entry.path().extension() == ".gravitas") paths.push_back(entry.path());
  std::ranges::sort(paths);
  return paths;
}

struct Methods {
  const char* name;
  std::vector<std::string> overrides;
};

// A solution of Newton or Direct that stops unfinished may break a balance by more than is allowed (WEAKNESSES.md), and
// the piles take them minutes.
constexpr std::size_t kMostBodiesOfAccurate = 5;

const Methods kMethods[] = {
    {"Euler", {"Integrator=Euler"}},
    {"SemiImplicitEuler", {"Integrator=SemiImplicitEuler"}},
    {"EulerOneSweep", {"Integrator=Euler", "Solver.Iterations=1"}},
    {"OneSweep", {"Integrator=SemiImplicitEuler", "Solver.Iterations=1"}},
    {"HalfCorrected", {"Integrator=SemiImplicitEuler", "Solver.CorrectionFactor=0.5"}},
    {"Grid", {"Space=Grid"}},
    {"NewtonVerlet", {"Solver=Newton", "Integrator=Verlet"}},
    {"NewtonLongSteps", {"Solver=Newton", "Simulator.TimeStep=0.05"}},
    {"DirectRK4", {"Solver=Direct", "Integrator=RK4"}},
    {"BasicVerletKDTree", {"Integrator=BasicVerlet", "Space=KDTree"}},
    {"RKMK4SweepAndPrune", {"Integrator=RKMK4", "Space=SweepAndPrune"}},
    {"SymplecticSplitting", {"Integrator=SymplecticSplitting"}},
    {"ImplicitMidpoint", {"Integrator=ImplicitMidpoint"}},
    {"DormandPrince54", {"Integrator=DormandPrince54"}},
    {"DormandPrince853", {"Integrator=DormandPrince853"}},
    {"Rosenbrock", {"Integrator=Rosenbrock"}},
    {"Radau", {"Integrator=Radau"}},
    {"LongSteps", {"Simulator.TimeStep=0.05"}},
};

class HonestAnswers : public ::testing::TestWithParam<Methods> {};

INSTANTIATE_TEST_SUITE_P(Of, HonestAnswers, ::testing::ValuesIn(kMethods),
                         [](const auto& one) { return std::string(one.param.name); });

TEST_P(HonestAnswers, PassTheChecksOfTheirPhysicsInEveryStep) {
  ASSERT_GE(scenes().size(), 20U);
  std::size_t taken = 0;
  for (const std::string& scene : scenes()) {
    SCOPED_TRACE(scene);
    RunOptions options;
    options.scenes = {scene};
    options.hosting = {{std::nullopt, kernel::Hosting::kDirect}};
    options.overrides = GetParam().overrides;
    options.overrides.push_back("Simulator.CheckPhysicsEvery=1");
    std::vector<std::string> warnings;
    kernel::EnvironmentDescription description;
    try {
      description = load(options, &warnings);
      ++taken;
    } catch (const BadInput&) {
      // a scene without the part that is overridden
      options.overrides = {"Simulator.CheckPhysicsEvery=1"};
      description = load(options, &warnings);
    }
    ASSERT_EQ(description.check_physics_every, 1U);
    const std::string solver = description.solver.plugins.empty() ? "" : description.solver.plugins[0].declaration.name;
    if (solver != "Sequential" && description.bodies.size() > kMostBodiesOfAccurate) continue;
    const auto environment = start(description);
    const std::uint32_t most = description.bodies.size() > 300 ? kMostStepsOfLarge : kMostSteps;
    while (environment->step_count() < std::min(most, environment->total_steps())) {
      if (environment->step() == kernel::StepOutcome::kCommitted) continue;
      ADD_FAILURE() << "step " << environment->fault()->step << ": " << environment->fault()->fault.text();
      break;
    }
  }
  EXPECT_GT(2 * taken, scenes().size()) << "the overrides mean nothing to most scenes";
}

// At the speed where damping balances gravity nothing of a velocity changes in a step, and of the place what damping does.
TEST(DampedBodies, AreTakenAtTheirTerminalSpeed) {
  const std::string scene = R"(
Forces { Force { Type = "Gravity" Id = "Down" CustomProperties { Acceleration = {0, -10, 0} } } }
Simulator { CustomProperties { Duration = 12 CheckPhysicsEvery = 1 } }
Environment { Space { Bodies {
  Body { Id = "Falls" Mass = 1 PrincipalMoments = {0.1, 0.2, 0.3} Forces = { "Down" } KineticProperties { AngularVelocity = {1, 2, 3} DampingCoefficient = 1 } } } } })";
  for (const char* integrator : {"Euler", "Verlet", "RK4", "DormandPrince54", "SymplecticSplitting", "Radau"}) {
    for (const double damping : {1.0, 5.0, 20.0, 40.0}) {
      harness::SceneRun run(
          scene, {std::string("Integrator=") + integrator, "Body.Falls.DampingCoefficient=" + std::to_string(damping)});
      while (!run.is_done()) ASSERT_NO_THROW(run.step()) << integrator << ", " << damping << " at " << run.time();
    }
  }
}

// Two bodies of unlike mass on a bushing in free space: its springs stay open at the end of a step, and push there.
TEST(SprungBodies, AreTakenWhereTheirSpringsStayOpen) {
  const std::string body = " PrincipalMoments = {4.1, 6.1, 5.2} KineticProperties { ";
  for (const std::string springs :
       {"", " Damping = {5, 5, 5} AngularStiffness = {20, 10, 30} AngularDamping = {1, 1, 1}"}) {
    const std::string scene =
        "Simulator { CustomProperties { Duration = 1 CheckPhysicsEvery = 1 } }\nEnvironment { Space { Bodies {\n"
        "Body { Id = \"A\" Mass = 120" +
        body +
        "LinearVelocity = {-0.26, 0.99, -1.29} AngularVelocity = {-1.1, -1.77, -1.17} } }\n"
        "Body { Id = \"B\" Mass = 36.8" +
        body +
        "Position = {0.7, 0, 0} LinearVelocity = {0.97, -0.43, -0.32} "
        "AngularVelocity = {-0.09, 1.64, -0.8} } }\n} }\nConstraints { Constraint { Type = \"Bushing\" Id = \"H\" "
        "Body1 = \"A\" "
        "Body2 = \"B\" CustomProperties { BindPoint = {0.35, 0, 0} Axes = {1, 0, 0, 0} Stiffness = {500, 800, 300}" +
        springs + " } } } }\n";
    for (const std::string solver : {"Newton", "Direct", "Sequential"}) {
      for (const double step : {0.01, 0.003, 0.001}) {
        harness::SceneRun run(scene, {"Solver=" + solver, harness::set("Simulator.TimeStep", step)});
        while (!run.is_done()) ASSERT_NO_THROW(run.step()) << solver << ", " << step << springs << " at " << run.time();
      }
    }
  }
}

}  // namespace
}  // namespace gravitas
