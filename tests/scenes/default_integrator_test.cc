// The integrator and solver of a scene that names none are what its simulator needs.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <string>

#include "tests/scenes/scene_run.h"

namespace gravitas {
namespace {

using harness::SceneRun;

const std::string kBall = R"(
Geometries {
  Geometry { Type = "Sphere" Id = "Ball" CustomProperties { Radius = 0.1 } }
  Geometry { Type = "Halfspace" Id = "Ground" }
}
Materials { Material { Id = "Elastic" RestitutionCoefficient = 1 StaticFrictionCoefficient = 0 } }
Forces { Force { Type = "Gravity" Id = "Down" CustomProperties { Acceleration = {0, -9.81, 0} } } }
Simulator { CustomProperties { Duration = 10 } }
Environment { Space { Bodies {
  Body { Id = "Ground" GeometryId = "Ground" Material = "Elastic" }
  Body { Id = "Ball" GeometryId = "Ball" Material = "Elastic" Mass = 1 Forces = {"Down"} KineticProperties { Position = {0, 1.1, 0} } }
} } }
)";

// m g y = 10.791 J all the time. Euler's flight comes back slower by g h, and 81 % of what is above rest was gone.
TEST(DefaultIntegrator, KeepsTheEnergyOfABallThatBounces) {
  for (const std::string simulator : {"Continuous", "Bisection"}) {
    SceneRun run(kBall, {"Simulator=" + simulator});
    run.to_end();
    EXPECT_NEAR(run.energy(), 9.81 * 1.1, 1e-9) << simulator;
  }
}

TEST(DefaultIntegrator, IsNotTakenForOneThatIsNamed) {
  for (const std::string word : {"Integrator", "KineticIntegrator"}) {
    SceneRun run(kBall, {"Simulator=Continuous", word + "=SemiImplicitEuler"});
    run.to_end();
    EXPECT_LT(run.energy(), 9.0) << word;
  }
  std::string named = kBall;
  named.insert(named.rfind("} } }") + 4, "KineticIntegrator = \"SemiImplicitEuler\" ");
  SceneRun run(named, {"Simulator=Continuous"});
  run.to_end();
  EXPECT_LT(run.energy(), 9.0);
}

// A pendulum of 1 m, let go level: v^2 = 2 g at the bottom, and E = 0.
TEST(DefaultIntegrator, OfSmoothMeetsAnAccuracy) {
  SceneRun run(R"(
Forces { Force { Type = "Gravity" Id = "Down" CustomProperties { Acceleration = {0, -9.81, 0} } } }
Simulator { Type = "Smooth" CustomProperties { Duration = 5 Accuracy = 1e-10 } }
Environment { Space { Bodies {
  Body { Id = "Bob" Mass = 1 PrincipalMoments = {1e-3, 1e-3, 1e-3} Forces = {"Down"} KineticProperties { Position = {1, 0, 0} } }
} } Constraints { Constraint { Type = "Spherical" Id = "Pivot" Body2 = "Bob" CustomProperties { BindPoint = {0, 0, 0} } } } }
)");
  run.to_end();
  EXPECT_NEAR(run.energy(), 0.0, 1e-7);
}

// Of order 1 they gain energy from swing to swing.
TEST(DefaultIntegrator, IsRecommendedOverThoseOfOrderOne) {
  for (const std::string integrator : {"Euler", "SemiImplicitEuler", "Verlet", "RK4", "DormandPrince54"}) {
    const SceneRun run("double_pendulum.gravitas",
                       {"Simulator=Smooth", "Solver=Direct", "Integrator=" + integrator, "Simulator.Duration=0.1"});
    const bool is_warned = std::ranges::any_of(
        run.warnings(), [](const std::string& one) { return one.find("gains energy at joints") != std::string::npos; });
    EXPECT_EQ(is_warned, integrator.ends_with("Euler")) << integrator;
  }
}

}  // namespace
}  // namespace gravitas
