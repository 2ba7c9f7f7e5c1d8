// The whole of building: time, plugins, forces and joints.
#include "services/scene/build.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <string>
#include <vector>

#include "tests/services/scene/scene_fixture.h"

namespace gravitas::scene {
namespace {

using testing::ElementsAre;
using testing::HasSubstr;
using testing::IsEmpty;

std::vector<std::string> errors_of(const std::string& text) { return build(text).errors(); }

kernel::EnvironmentDescription built(const std::string& text) {
  const BuiltScene result = build(text);
  EXPECT_THAT(result.errors(), IsEmpty());
  return result.description.value_or(kernel::EnvironmentDescription{});
}

// ---- environments and time
// ---------------------------------------------------------------------------------------

TEST(Build, NeedsOneEnvironment) {
  EXPECT_THAT(errors_of("Simulator { }"),
              ElementsAre("scene:1:1: error: the scene has no Environment { … }; required: one"));
  EXPECT_THAT(errors_of("Environment { Id = \"A\" }\nEnvironment { Id = \"B\" }"),
              ElementsAre("scene:2:1: error: a second Environment \"B\"; the first is \"A\" at "
                          "scene:1:1; allowed: one"));
}

TEST(Build, ASceneWithoutGeometryNeedsNoMore) {
  const kernel::EnvironmentDescription description = built("Environment { Id = \"World\" }");
  EXPECT_EQ(description.id, "World");
  EXPECT_EQ(description.steps, 600U);
  EXPECT_EQ(description.time_step, 1.0 / 60.0);
  EXPECT_EQ(description.last_time_step, 1.0 / 60.0);
  EXPECT_EQ(description.validate(), "");
}

TEST(Build, CountsSteps) {
  struct Case {
    const char *time_step, *duration;
    std::uint32_t steps;
    double last;
  };
  for (const Case& c : std::vector<Case>{{"0.01", "5", 500, 0.01},
                                         {"0.1", "0.3", 3, 0.1},  // 0.3/0.1 is 2.9999999999999996
                                         {"1", "2.5", 3, 0.5},
                                         {"1", "2.0000000005", 2, 1.0},  // within 1e-9
                                         {"1", "0.25", 1, 0.25},
                                         {"1", "0", 0, 1.0},
                                         {"5e7", "0.05", 1, 0.05},
                                         {"1e300", "1e-20", 1, 1e-20},
                                         {"1e-6", "1000", 1000000000, 1e-6},
                                         {"0.0001", "100000.00005", 1000000001, 0.00005}}) {
    const kernel::EnvironmentDescription description =
        built("Environment { } Simulator { CustomProperties { TimeStep = " + std::string(c.time_step) +
              " Duration = " + c.duration + " } }");
    EXPECT_EQ(description.steps, c.steps) << c.time_step << ' ' << c.duration;
    // the difference of two times near 1e5 is rounded to 1e-11
    EXPECT_NEAR(description.last_time_step, c.last, 2e-11) << c.time_step << ' ' << c.duration;
  }
}

TEST(Build, RefusesTooManySteps) {
  EXPECT_THAT(
      errors_of("Environment { } Simulator { CustomProperties { TimeStep = 1e-9 } }"),
      ElementsAre("scene:1:59: error: Duration 10 s in steps of 1e-09 s is 1e+10 steps; allowed: up to 4294967295"));
  EXPECT_THAT(errors_of("Environment { } Simulator { CustomProperties { TimeStep = 1e-300 Duration = 1e300 } }"),
              ElementsAre(HasSubstr("is inf steps")));
}

TEST(Build, ChecksWhereAWorkerIs) {
  const auto errors = [](const std::string& place) {
    return errors_of("Environment { } Plugins { Plugin { Slot = \"solver\" " + place + " } }");
  };
  EXPECT_THAT(errors("Hosting = \"grpc\""), IsEmpty());
  EXPECT_THAT(errors("Hosting = \"shm\" Address = \"127.0.0.1:7000\""),
              ElementsAre(HasSubstr("Address is reached by gRPC, not by Hosting \"shm\"")));
  EXPECT_THAT(errors("Address = \"192.0.2.1:7000\""), ElementsAre(HasSubstr("is not of this machine")));
}

// ---- plugins
// -----------------------------------------------------------------------------------------------------

TEST(Build, ChoosesPluginsWithTheirSettings) {
  const kernel::EnvironmentDescription description = built(
      "Environment { Space { Type = \"Grid\" } ConstraintSolver { Type = \"Sequential\" "
      "CustomProperties { "
      "CorrectionFactor = 0.5 } } KineticIntegrator = \"RK4\" }");
  EXPECT_EQ(description.space.plugins.at(0).library, "/plugins/space_Grid.so");
  EXPECT_TRUE(std::isnan(description.space.plugins[0].settings.at(0)));
  EXPECT_THAT(description.solver.plugins.at(0).settings, ElementsAre(100, 0.5));
  EXPECT_EQ(description.integrator.plugins.at(0).declaration.name, "RK4");
  EXPECT_EQ(description.collision.plugins.at(0).declaration.name, "Standard");
  EXPECT_THAT(description.force.plugins, IsEmpty());
  EXPECT_THAT(description.constraint.plugins, IsEmpty());
}

TEST(Build, HasDefaultMethods) {
  const kernel::EnvironmentDescription description = built("Environment { }");
  EXPECT_EQ(description.space.plugins.at(0).declaration.name, "DynamicBVH");
  EXPECT_EQ(description.solver.plugins.at(0).declaration.name, "Sequential");
  EXPECT_EQ(description.integrator.plugins.at(0).declaration.name, "SemiImplicitEuler");
}

TEST(Build, RefusesPluginsThatAreNotInstalled) {
  EXPECT_THAT(errors_of("Environment { KineticIntegrator = \"RK5\" }"),
              ElementsAre("scene:1:35: error: no integrator plugin \"RK5\" is installed; did you "
                          "mean \"RK4\"? Allowed: "
                          "\"Euler\", \"RK4\", \"SemiImplicitEuler\""));
  EXPECT_THAT(errors_of("Environment { ConstraintSolver { Type = \"Sequential\" CustomProperties { "
                        "Iteratons = 1 } } }"),
              ElementsAre("scene:1:73: error: solver plugin \"Sequential\": unknown property "
                          "\"Iteratons\"; did you "
                          "mean \"Iterations\"? Allowed: \"Iterations\", \"CorrectionFactor\""));
  EXPECT_THAT(errors_of("Environment { ConstraintSolver { Type = \"Sequential\" CustomProperties { "
                        "Iterations = 0 } } }"),
              ElementsAre("scene:1:86: error: solver plugin \"Sequential\": Iterations is 0; "
                          "allowed: a whole number "
                          ">= 1"));
}

TEST(Build, LeavesSlotsEmptyThatNothingNeeds) {
  EXPECT_THAT(build("Environment { }", {}, Catalog()).errors(), IsEmpty());
  EXPECT_THAT(build("Environment { KineticIntegrator = \"RK4\" }", {}, Catalog()).errors(),
              ElementsAre("scene:1:35: error: no integrator plugin \"RK4\" is installed; none is allowed here"));
  EXPECT_THAT(
      build("Environment { Space { Bodies { Body { Id = \"A\" Immovable = true } } } }", {}, Catalog()).errors(),
      ElementsAre("scene:1:1: error: no integrator plugin \"SemiImplicitEuler\" is "
                  "installed; none is allowed "
                  "here"));
}

TEST(Build, ReadsHostingAndDeadlines) {
  const kernel::EnvironmentDescription description = built(
      "Environment { } Plugins { Plugin { Slot = \"solver\" Hosting = \"direct\" Deadline = 0.5 } "
      "Plugin { Slot = \"force\" Hosting = \"shm\" } Plugin { Slot = \"force\" Deadline = 3 } }");
  EXPECT_EQ(description.solver.hosting, kernel::Hosting::kDirect);
  EXPECT_EQ(description.solver.deadline, 0.5);
  EXPECT_EQ(description.force.hosting, kernel::Hosting::kSharedMemory);
  EXPECT_EQ(description.force.deadline, 3.0);
  EXPECT_EQ(description.space.deadline, 2.0);
}

TEST(Build, RefusesContradictoryPluginBlocks) {
  const auto plugins = [](const std::string& text) { return errors_of("Environment { } Plugins {\n" + text + "\n}"); };
  EXPECT_THAT(plugins("Plugin { Slot = \"solver\" }\nPlugin { Slot = \"solver\" }"),
              ElementsAre("scene:3:17: error: the slot \"solver\" has a Plugin already, at "
                          "scene:2:1; allowed: one"));
  EXPECT_THAT(plugins("Plugin { Slot = \"force\" Deadline = 1e7 Standby = 65 }"),
              ElementsAre("scene:2:36: error: Deadline is 1e+07; allowed: a number in (0, 1e+06]",
                          "scene:2:50: error: Standby is 65; allowed: a whole number in [0, 64]"));
  EXPECT_THAT(plugins("Plugin { Slot = \"force\" Deadline = 1 }\nPlugin { Slot = \"force\" Deadline = 2 }"),
              ElementsAre("scene:3:36: error: Deadline differs from that at scene:2:1; allowed: one for "
                          "the whole slot "
                          "\"force\""));
  EXPECT_THAT(plugins("Plugin { Slot = \"solver\" Name = \"LCP\" }"),
              ElementsAre("scene:2:33: error: Name of the slot \"solver\" stands elsewhere; allowed: in "
                          "ConstraintSolver { … }"));
  EXPECT_THAT(plugins("Plugin { Slot = \"force\" CustomProperties { Fast = true } }"),
              ElementsAre("scene:2:25: error: CustomProperties of an unnamed plugin; required: "
                          "Name or Library, since "
                          "the slot \"force\" may hold several"));
  EXPECT_THAT(plugins("Plugin { Slot = \"collision\" Name = \"Precise\" }"),
              ElementsAre("scene:2:36: error: no collision plugin \"Precise\" is installed; "
                          "allowed: \"Standard\""));
  EXPECT_THAT(plugins("Plugin { Slot = \"solver\" Library = \"none.so\" }"),
              ElementsAre(HasSubstr("scene:2:36: error: Library \"none.so\" cannot be used: ")));
}

TEST(Build, GivesPluginsOfListsTheirSettings) {
  const kernel::EnvironmentDescription description = built(
      "Forces { Force { Type = \"Drag\" Id = \"Air\" CustomProperties { LinearCoefficient = 1 } } "
      "} Environment "
      "{ } Plugins { Plugin { Slot = \"force\" Name = \"Drag\" CustomProperties { Fast = true } } "
      "}");
  EXPECT_THAT(description.force.plugins.at(0).settings, ElementsAre(1));
}

TEST(Build, SaysWhichSettingsAreOfNoUse) {
  EXPECT_THAT(build("Environment { } Plugins { Plugin { Slot = \"force\" Name = \"Drag\"\nCustomProperties "
                    "{ Fast = "
                    "true } } }")
                  .warnings(),
              ElementsAre("scene:2:1: warning: these CustomProperties are for no plugin that the scene uses"));
}

// ---- geometries and forces
// ---------------------------------------------------------------------------------------

TEST(Build, FlattensGeometries) {
  const kernel::EnvironmentDescription description = built(scene_with_body("GeometryId = \"Rod\" MassDensity = 1"));
  ASSERT_EQ(description.shapes.size(), 5U);
  EXPECT_EQ(description.shapes[2].id, "Rod");
  EXPECT_EQ(description.shapes[2].type, "Cylinder");
  EXPECT_THAT(description.shapes[2].parameters, ElementsAre(0.5, 2));
  EXPECT_THAT(description.shapes[1].parameters, ElementsAre(1, 2, 3));
  EXPECT_THAT(description.shapes[3].parameters, IsEmpty());
  EXPECT_EQ(description.bodies[0].shape, 2U);
}

TEST(Build, RefusesBadGeometries) {
  const auto geometry = [](const std::string& text) {
    return errors_of("Geometries {\nGeometry { Id = \"A\" " + text + " } } Environment { }");
  };
  EXPECT_THAT(geometry("Type = \"Spere\""),
              ElementsAre("scene:2:28: error: the collision plugin \"Standard\" knows no shape \"Spere\"; did you "
                          "mean "
                          "\"Sphere\"? Allowed: \"Sphere\", \"Box\", \"Cylinder\", \"Halfspace\", \"Blob\""));
  EXPECT_THAT(geometry("Type = \"Sphere\""),
              ElementsAre("scene:2:1: error: Sphere \"A\": Radius is missing; required: a number > 0"));
  EXPECT_THAT(geometry("Type = \"Sphere\" CustomProperties { Radius = -1 }"),
              ElementsAre("scene:2:65: error: Sphere \"A\": Radius is -1; allowed: a number > 0"));
  EXPECT_THAT(geometry("Type = \"Sphere\" CustomProperties { }"),
              ElementsAre("scene:2:37: error: Sphere \"A\": Radius is missing; required: a number > 0"));
  EXPECT_THAT(geometry("Type = \"Halfspace\" CustomProperties { Radius = 1 }"),
              ElementsAre("scene:2:59: error: Halfspace \"A\": unknown property \"Radius\"; none is allowed here"));
}

TEST(Build, ABadGeometryIsReportedOnce) {
  EXPECT_THAT(errors_of("Geometries { Geometry { Type = \"Sphere\" Id = \"A\" CustomProperties { "
                        "Radius = 0 } } } "
                        "Environment { Space { Bodies { Body { Id = \"B\" GeometryId = \"A\" "
                        "MassDensity = 1 } } } }"),
              testing::SizeIs(1));
}

TEST(Build, FlattensForcesAndFindsTheirPlugins) {
  const kernel::EnvironmentDescription description = built(
      "Forces { Force { Type = \"Drag\" Id = \"Air\" CustomProperties { LinearCoefficient = 1 } } "
      "Force { Type = "
      "\"Gravity\" Id = \"Down\" CustomProperties { Acceleration = {0, -9.81, 0} } } Force { Type "
      "= \"Drag\" Id = "
      "\"Oil\" CustomProperties { LinearCoefficient = 2 } } } Environment { }");
  ASSERT_EQ(description.forces.size(), 3U);
  EXPECT_THAT(description.forces[1].parameters, ElementsAre(0, -9.81, 0));
  EXPECT_EQ(description.forces[0].plugin, 0U);
  EXPECT_EQ(description.forces[1].plugin, 1U);
  EXPECT_EQ(description.forces[2].plugin, 0U);
  ASSERT_EQ(description.force.plugins.size(), 2U);
  EXPECT_EQ(description.force.plugins[0].declaration.name, "Drag");
}

// A second plugin for the type "Gravity", and one more solver "LCP".
Catalog with_rivals(const std::string& name) {
  std::vector<InstalledPlugin> plugins = declared_plugins();
  const auto copy = [&](Slot slot, const std::string& of, const std::string& as, const std::string& library) {
    InstalledPlugin twin = *std::ranges::find_if(plugins, [&](const InstalledPlugin& one) {
      return one.declaration.slot == slot && one.declaration.name == of;
    });
    twin.declaration.name = as;
    twin.library = library;
    plugins.push_back(twin);
  };
  copy(Slot::kForce, "Gravity", name, "/plugins/own.so");
  copy(Slot::kSolver, "LCP", "LCP", "/plugins/lcp2.so");
  return Catalog(std::move(plugins));
}

TEST(Build, TwoInstalledPluginsForATypeMustBeToldApart) {
  const std::string scene =
      "Forces { Force { Type = \"Gravity\" Id = \"G\" CustomProperties { Acceleration = {0, -1, 0} } } } "
      "Environment { }";
  EXPECT_THAT(build(scene, {}, with_rivals("Moon")).errors(),
              ElementsAre("scene:1:25: error: 2 installed plugins serve the force type \"Gravity\": \"Gravity\" "
                          "(/plugins/force_Gravity.so), \"Moon\" (/plugins/own.so); required: which of them, as "
                          "Plugins { Plugin { Slot = \"force\" Name = … } }"));
  EXPECT_THAT(build(scene, {}, with_rivals("Gravity")).errors(),
              ElementsAre(HasSubstr("Plugins { Plugin { Slot = \"force\" Library = … } }")));
  for (const char* name : {"Moon", "Gravity"}) {
    const BuiltScene chosen =
        build(scene + "Plugins { Plugin { Slot = \"force\" Name = \"" + name + "\" } }", {}, with_rivals("Moon"));
    ASSERT_TRUE(chosen.description.has_value()) << testing::PrintToString(chosen.errors());
    EXPECT_EQ(chosen.description->force.plugins.at(0).declaration.name, name);
  }
}

TEST(Build, TwoInstalledPluginsOfANameMustBeToldApart) {
  EXPECT_THAT(build("Environment { ConstraintSolver = \"LCP\" }", {}, with_rivals("Moon")).errors(),
              ElementsAre("scene:1:34: error: 2 installed plugins of slot solver are called \"LCP\": \"LCP\" "
                          "(/plugins/solver_LCP.so), \"LCP\" (/plugins/lcp2.so); required: which of them, as "
                          "Plugins { Plugin { Slot = \"solver\" Library = … } }"));
  EXPECT_THAT(build("Environment { ConstraintSolver = \"Sequential\" }", {}, with_rivals("Moon")).errors(), IsEmpty());
}

TEST(Build, RefusesUnknownForces) {
  EXPECT_THAT(errors_of("Forces { Force { Type = \"Gravty\" Id = \"G\" } } Environment { }"),
              ElementsAre("scene:1:25: error: no installed force plugin knows the type \"Gravty\"; did you mean "
                          "\"Gravity\"? Allowed: \"Drag\", \"Gravity\""));
}

// ---- joints
// ------------------------------------------------------------------------------------------------------

std::string scene_with_joint(const std::string& joint) {
  return "Environment { Space { Bodies { Body { Id = \"A\" Mass = 1 PrincipalMoments = {1, 1, 1} } "
         "Body { Id = \"B\" "
         "Mass = 1 PrincipalMoments = {1, 1, 1} } Body { Id = \"Wall\" Immovable = true } Body { "
         "Id = \"Belt\" "
         "Kinematic = true } } } Constraints { Constraint { Type = \"Spherical\" Id = \"J\" "
         "CustomProperties { "
         "BindPoint = {1, 2, 3} }\n" +
         joint + "\n} } }";
}

TEST(Build, ResolvesJoints) {
  const kernel::EnvironmentDescription description =
      built(scene_with_joint("Body1 = \"B\" Body2 = \"A\" BreakingThreshold = 0.1 BreakingForce = 7"));
  ASSERT_EQ(description.constraints.size(), 1U);
  const kernel::ConstraintDescription& joint = description.constraints[0];
  EXPECT_EQ(joint.id, "J");
  EXPECT_EQ(joint.body1, 1U);
  EXPECT_EQ(joint.body2, 0U);
  EXPECT_EQ(joint.breaking_threshold, 0.1);
  EXPECT_EQ(joint.breaking_force, 7.0);
  EXPECT_THAT(joint.parameters, ElementsAre(1, 2, 3));
  EXPECT_EQ(description.constraint.plugins.at(joint.plugin).declaration.name, "Joints");
  EXPECT_EQ(description.validate(), "");
}

TEST(Build, TheWorldIsABodyWithoutAName) {
  EXPECT_EQ(built(scene_with_joint("Body1 = \"A\"")).constraints.at(0).body2, kNone);
  EXPECT_EQ(built(scene_with_joint("Body1 = \"\" Body2 = \"A\"")).constraints.at(0).body1, kNone);
  EXPECT_EQ(built(scene_with_joint("Body1 = \"A\" Body2 = \"Wall\"")).constraints.at(0).body2, 2U);
}

TEST(Build, RefusesJointsOfNothing) {
  const auto joint = [](const std::string& text) { return errors_of(scene_with_joint(text)); };
  EXPECT_THAT(joint(""), ElementsAre("scene:1:238: error: Constraint \"J\" joins the world to the world; required: "
                                     "Body1 or Body2"));
  EXPECT_THAT(joint("Body1 = \"A\" Body2 = \"A\""),
              ElementsAre("scene:2:21: error: Constraint \"J\" joins \"A\" to itself; allowed: two "
                          "bodies, or one and "
                          "the world"));
  EXPECT_THAT(joint("Body1 = \"Wall\""),
              ElementsAre("scene:2:9: error: Constraint \"J\" joins nothing that can be pushed; "
                          "required: a body that "
                          "is neither immovable nor kinematic"));
  EXPECT_THAT(joint("Body1 = \"Wall\" Body2 = \"Belt\""), testing::SizeIs(1));
  EXPECT_THAT(joint("Body1 = \"C\""), ElementsAre("scene:2:9: error: Body1 names no Body: \"C\"; "
                                                  "allowed: \"A\", \"B\", \"Belt\", \"Wall\""));
  EXPECT_THAT(joint("Body1 = \"A\" BreakingForce = -1"),
              ElementsAre("scene:2:29: error: BreakingForce is -1; allowed: a number >= 0"));
}

TEST(Build, RefusesIdsThatStandTwice) {
  EXPECT_THAT(errors_of("Environment { Space { Bodies { Body { Id = \"A\" Immovable = true }\nBody "
                        "{ Id = \"A\" Immovable "
                        "= true } } } }"),
              ElementsAre("scene:2:13: error: Body \"A\" is there already, at scene:1:44; allowed: "
                          "an id of its own"));
  // and once among what is allowed
  EXPECT_THAT(
      errors_of("Environment { Space { Bodies { Body { Id = \"A\" Immovable = true }\nBody { Id = \"A\" "
                "Immovable = true } } }\nConstraints { Constraint { Id = \"J\" Type = \"Rigid\" Body2 = \"B\" } } }"),
      testing::Contains(testing::EndsWith("; allowed: \"A\"")));
}

}  // namespace
}  // namespace gravitas::scene
