// `--set PATH=VALUE`.
#include "services/scene/overrides.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <string>
#include <vector>

#include "tests/services/scene/scene_fixture.h"

namespace gravitas::scene {
namespace {

using testing::ElementsAre;
using testing::IsEmpty;

const char* const kScene =
    "Geometries { Geometry { Type = \"Sphere\" Id = \"Unit\" CustomProperties { Radius = 0.5 } } "
    "}\n"
    "Materials { Material { Id = \"Ice\" } }\n"
    "Forces { Force { Type = \"Gravity\" Id = \"Down\" CustomProperties { Acceleration = {0, "
    "-9.81, 0} } } }\n"
    "Environment { Id = \"World\"\n"
    "Space { Type = \"Grid\" CustomProperties { CellSize = 2 } Bodies {\n"
    "Body { Id = \"Ball01\" GeometryId = \"Unit\" MassDensity = 1000 }\n"
    "Body { Id = \"Ball.02\" GeometryId = \"Unit\" MassDensity = 1000 } } }\n"
    "Constraints { Constraint { Type = \"Spherical\" Id = \"Joint\" Body1 = \"Ball01\" "
    "CustomProperties "
    "{ BindPoint = {0, 0, 0} } } } }\n";

kernel::EnvironmentDescription overridden(const std::vector<std::string>& overrides) {
  const BuiltScene result = build(kScene, overrides);
  EXPECT_THAT(result.errors(), IsEmpty());
  EXPECT_TRUE(result.description.has_value());
  return result.description.value_or(kernel::EnvironmentDescription{});
}

std::vector<std::string> override_errors_of(const std::string& one) { return build(kScene, {one}).errors(); }

TEST(Overrides, ChooseThePluginsOfTheSlots) {
  EXPECT_EQ(overridden({"Integrator=RK4"}).integrator.plugins[0].declaration.name, "RK4");
  EXPECT_EQ(overridden({"KineticIntegrator=\"RK4\""}).integrator.plugins[0].declaration.name, "RK4");
  EXPECT_EQ(overridden({"Integrator.Type=RK4"}).integrator.plugins[0].declaration.name, "RK4");
  EXPECT_EQ(overridden({"Solver=LCP"}).solver.plugins[0].declaration.name, "LCP");
  EXPECT_EQ(overridden({"Environment.ConstraintSolver=LCP"}).solver.plugins[0].declaration.name, "LCP");
  EXPECT_EQ(overridden({"Collision=Standard"}).collision.plugins[0].declaration.name, "Standard");
}

TEST(Overrides, SetThePropertiesOfPlugins) {
  EXPECT_THAT(overridden({"Solver.Iterations=50"}).solver.plugins[0].settings, ElementsAre(50, 1));
  EXPECT_THAT(
      overridden({"Solver.CustomProperties.Iterations=50", "Solver.Iterations = 60"}).solver.plugins[0].settings,
      ElementsAre(60, 1));
  EXPECT_THAT(overridden({"Space.CellSize=3"}).space.plugins[0].settings, ElementsAre(3));
  EXPECT_THAT(overridden({"Collision.Margin=0.5"}).collision.plugins[0].settings, ElementsAre(0.5));
}

TEST(Overrides, DropThePropertiesOfAnotherType) {
  const BuiltScene result = build(kScene, {"Space=KDTree"});
  ASSERT_TRUE(result.description.has_value());
  EXPECT_EQ(result.description->space.plugins[0].declaration.name, "KDTree");
  EXPECT_THAT(result.description->space.plugins[0].settings, ElementsAre(8));
  EXPECT_THAT(result.warnings(), ElementsAre("--set Space=KDTree: warning: the CustomProperties written for \"Grid\" "
                                             "are dropped"));
  EXPECT_THAT(overridden({"Space=Grid"}).space.plugins[0].settings, ElementsAre(2));
}

TEST(Overrides, SetTimes) {
  const kernel::EnvironmentDescription description = overridden({"Simulator.TimeStep=0.5", "Simulator.Duration=2"});
  EXPECT_EQ(description.time_step, 0.5);
  EXPECT_EQ(description.steps, 4U);
  EXPECT_EQ(overridden({"Simulator.CustomProperties.TimeStep=0.25"}).time_step, 0.25);
}

TEST(Overrides, SetPropertiesOfBlocksWithIds) {
  const kernel::EnvironmentDescription description = overridden(
      {"Body.Ball01.LinearVelocity={1,0,0}", "Body.Ball01.KineticProperties.Position={0, 2, 0}",
       "Body.Ball.02.MassDensity=500", "Geometry.Unit.Radius=2", "Material.Ice.StaticFrictionCoefficient=0.25",
       "Body.Ball01.Material=Ice", "Force.Down.Acceleration={0,-1,0}", "Body.Ball01.Forces={Down}",
       "Constraint.Joint.BindPoint={0,1,0}", "Constraint.Joint.Body2=Ball.02"});
  EXPECT_EQ(description.bodies[0].twist.linear, Vector3(1, 0, 0));
  EXPECT_EQ(description.bodies[0].pose.position, Vector3(0, 2, 0));
  EXPECT_EQ(description.bodies[0].mass, 2.0 * description.bodies[1].mass);
  EXPECT_THAT(description.shapes[0].parameters, ElementsAre(2));
  EXPECT_EQ(description.material_pairs[1], 0.25);
  EXPECT_THAT(description.forces[0].parameters, ElementsAre(0, -1, 0));
  EXPECT_THAT(description.bodies[0].forces, ElementsAre(0));
  EXPECT_THAT(description.constraints[0].parameters, ElementsAre(0, 1, 0));
  EXPECT_EQ(description.constraints[0].body2, 1U);
}

// A sphere of 0.5 m has 2/5 m r^2 = m / 10, whichever of both made it.
TEST(Overrides, MassAndDensityTakeEachOthersPlace) {
  const auto ball = [](const std::vector<std::string>& overrides) { return overridden(overrides).bodies.at(0); };
  const double volume = 4.0 / 3.0 * 3.14159265358979323846 * 0.125;
  for (const std::vector<std::string>& overrides :
       {std::vector<std::string>{"Body.Ball01.Mass=3"}, {"Body.Ball01.MassDensity=7", "Body.Ball01.Mass=3"}}) {
    EXPECT_DOUBLE_EQ(ball(overrides).mass, 3.0);
    EXPECT_NEAR((ball(overrides).inertia - Vector3::Constant(0.3)).norm(), 0.0, 1e-14);
  }
  const auto dense = ball({"Body.Ball01.Mass=3", "Body.Ball01.MassDensity=6"});
  EXPECT_NEAR(dense.mass, 6.0 * volume, 1e-14);
  EXPECT_NEAR(dense.inertia.x(), 0.6 * volume, 1e-14);
}

TEST(Overrides, MomentsThatAreWrittenGoWithAMass) {
  const std::vector<std::string> told = {"Body.Ball01.Mass=3", "Body.Ball01.PrincipalMoments={1,1,1}"};
  EXPECT_DOUBLE_EQ(overridden({told[0], told[1], "Body.Ball01.Mass=4"}).bodies.at(0).inertia.x(), 1.0);
  EXPECT_THAT(build(kScene, {told[0], told[1], "Body.Ball01.MassDensity=6"}).errors(),
              ElementsAre(::testing::HasSubstr("has Mass and MassDensity; allowed: one of them")));
}

TEST(Overrides, SetHostingAndDeadlines) {
  const kernel::EnvironmentDescription description =
      overridden({"Plugin.solver.Deadline=5", "Plugin.solver.Hosting=direct"});
  EXPECT_EQ(description.solver.deadline, 5.0);
  EXPECT_EQ(description.solver.hosting, kernel::Hosting::kDirect);
}

TEST(Overrides, CreateTheBlockThatIsNotWritten) {
  const BuiltScene result = build("Environment { }", {"Simulator.TimeStep=0.5", "Integrator=RK4"});
  ASSERT_TRUE(result.description.has_value());
  EXPECT_EQ(result.description->time_step, 0.5);
  EXPECT_EQ(result.description->integrator.plugins[0].declaration.name, "RK4");
}

TEST(Overrides, NameTheCollisionFilterWithAndWithoutItsEnvironment) {
  for (const std::string path : {"CollisionFilter", "Environment.CollisionFilter"}) {
    for (const std::string scene : {"Environment { }", "Environment { CollisionFilter { DefaultAllow = true } }"}) {
      BuiltScene result = build(scene, {path + ".DefaultAllow=false"});
      ASSERT_TRUE(result.description.has_value()) << path;
      EXPECT_FALSE(result.read.scene().environment(0).collision_filter().default_allow()) << path;
    }
  }
  EXPECT_THAT(override_errors_of("CollisionFilter.DefaultAllov=false"),
              ElementsAre(testing::HasSubstr("did you mean \"DefaultAllow\"?")));
}

TEST(Overrides, TakeTextsWithAndWithoutQuotes) {
  EXPECT_EQ(overridden({"Environment.Id=a b"}).id, "a b");
  EXPECT_EQ(overridden({"Environment.Id=\"a \\\" b\""}).id, "a \" b");
  EXPECT_EQ(overridden({"Environment.Id=2nd"}).id, "2nd");
  EXPECT_EQ(overridden({"Environment.Id=true"}).id, "true");
}

TEST(Overrides, NameTheirMistakes) {
  EXPECT_THAT(override_errors_of("Solver"), ElementsAre("--set Solver: there is no \"=\"; allowed: PATH=VALUE"));
  EXPECT_THAT(override_errors_of("=1"), ElementsAre("--set =1: the path is empty; allowed: PATH=VALUE"));
  EXPECT_THAT(override_errors_of("Solver="),
              ElementsAre("--set Solver=: the value is empty; allowed: a value, \"\" for no text"));
  EXPECT_THAT(override_errors_of("Solver.=1"),
              ElementsAre("--set Solver.=1: the path ends with a dot; allowed: PATH=VALUE"));
  EXPECT_THAT(override_errors_of("Slover=LCP"),
              ElementsAre(testing::StartsWith("--set Slover=LCP: the path begins with \"Slover\"; did you mean "
                                              "\"Solver\"? Allowed: \"Integrator\", \"Solver\", ")));
  EXPECT_THAT(override_errors_of("Body.Ball03.Mass=1"),
              ElementsAre("--set Body.Ball03.Mass=1: no Body \"Ball03\"; did you mean \"Ball01\"? "
                          "Allowed: \"Ball01\", "
                          "\"Ball.02\""));
  EXPECT_THAT(override_errors_of("Body.Ball01=1"),
              ElementsAre(testing::StartsWith("--set Body.Ball01=1: a property must follow \"Ball01\"; allowed: ")));
  EXPECT_THAT(override_errors_of("Body.Ball01.LinearVelcity={0,0,0}"),
              ElementsAre(testing::StartsWith("--set Body.Ball01.LinearVelcity={0,0,0}: no property \"LinearVelcity\"; "
                                              "did you mean \"LinearVelocity\"? Allowed: ")));
  EXPECT_THAT(override_errors_of("Simulator.TimeStep=-1"),
              ElementsAre("--set Simulator.TimeStep=-1: TimeStep is -1; allowed: a number > 0"));
  EXPECT_THAT(override_errors_of("Simulator.TimeStep=fast"),
              ElementsAre("--set Simulator.TimeStep=fast: TimeStep is \"fast\"; allowed: a number > 0"));
  EXPECT_THAT(override_errors_of("Simulator=Basik"),
              ElementsAre(testing::StartsWith("--set Simulator=Basik: Type is \"Basik\"; did you mean \"Basic\"?")));
  EXPECT_THAT(override_errors_of("Space.Bodies=1"), ElementsAre(testing::HasSubstr("\"Bodies\" is no property")));
  EXPECT_THAT(override_errors_of("Plugin.solvr.Deadline=1"),
              ElementsAre(testing::HasSubstr("no slot \"solvr\"; did you mean \"solver\"?")));
  EXPECT_THAT(build("", {"Solver=LCP"}).errors(),
              ElementsAre("--set Solver=LCP: the scene has no Environment; add one"));
}

TEST(Overrides, NameTheBeginningThatAPathLacks) {
  const auto says = [](const std::string& what) {
    return ElementsAre(testing::HasSubstr("did you mean \"" + what + "\"? Allowed: \"Integrator\", "));
  };
  EXPECT_THAT(override_errors_of("Duration=2"), says("Simulator.Duration"));
  EXPECT_THAT(override_errors_of("Timestep=0.1"), says("Simulator.TimeStep"));
  EXPECT_THAT(override_errors_of("Ball01.Mass=1"), says("Body.Ball01"));
  EXPECT_THAT(override_errors_of("Unit.Radius=1"), says("Geometry.Unit"));
}

TEST(Overrides, ErrorsKnowTheirColumn) {
  const auto column = [](const std::string& one) { return build(kScene, {one}).read.problems.errors.at(0).column; };
  EXPECT_EQ(column("Simulator.TimeStep = 1 2"), 24);
  EXPECT_EQ(column("Body.Ball01.LinearVelocity={1,x,0}"), 31);
  EXPECT_EQ(column("Body.Ball01.LinearVelocity={1,"), 31);
  EXPECT_EQ(column("Body.Ball03.Mass=1"), 6);
  EXPECT_EQ(column("Body.Ball01.Mas=1"), 13);
}

TEST(Overrides, MistakesThatOnlyBuildingFindsNameThemToo) {
  EXPECT_THAT(override_errors_of("Solver=LPC"),
              ElementsAre("--set Solver=LPC: no solver plugin \"LPC\" is installed; did you mean \"LCP\"? Allowed: "
                          "\"LCP\", \"Sequential\""));
  EXPECT_THAT(override_errors_of("Solver.Iteration=5"),
              ElementsAre("--set Solver.Iteration=5: solver plugin \"Sequential\": unknown property "
                          "\"Iteration\"; did "
                          "you mean \"Iterations\"? Allowed: \"Iterations\", \"CorrectionFactor\""));
  EXPECT_THAT(override_errors_of("Body.Ball01.GeometryId=Unti"),
              ElementsAre("--set Body.Ball01.GeometryId=Unti: GeometryId names no Geometry: \"Unti\"; did you mean "
                          "\"Unit\"? Allowed: \"Unit\""));
  EXPECT_THAT(override_errors_of("Simulator.TimeStep=1e-300"),
              ElementsAre(::testing::StartsWith(
                  "--set Simulator.TimeStep=1e-300: Duration 10 s in steps of 1e-300 s is 9.99")));
}

}  // namespace
}  // namespace gravitas::scene
