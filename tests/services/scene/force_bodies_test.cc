// Forces that name a body, and the gravity that floats bodies: rows, reactions, splits.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>

#include "tests/services/scene/scene_fixture.h"

namespace gravitas::scene {
namespace {

using testing::ElementsAre;
using testing::HasSubstr;
using testing::IsEmpty;

Catalog force_catalog() {
  std::vector<InstalledPlugin> plugins = declared_plugins();
  PluginDeclaration forces;
  forces.name = "Forces";
  forces.version = "1";
  forces.slot = Slot::kForce;
  forces.types = {
      {"Link", "", {Property::table("Rows", 2, "1", "world"), Property::body("AnchorBody")}},
      {"Lake", "", {Property::vector("Gravity", "m/s^2", "world"), Property::number("Level", "m").defaults_to({0})}}};
  plugins.push_back({"/plugins/force_forces.so", forces});
  return Catalog(std::move(plugins));
}

// Bodies A (forces given), B and the immovable Ground.
BuiltScene built_with(const std::string& forces, const std::string& a, const std::string& b = "") {
  const auto body = [](const std::string& id, const std::string& more) {
    return "Body { Id = \"" + id + "\" Mass = 1 PrincipalMoments = {1, 1, 1} Forces = {" + more + "} }\n";
  };
  return build("Forces {" + forces +
                   "\nForce { Type = \"Gravity\" Id = \"Down\" CustomProperties { Acceleration = {0, -9, 0} } }"
                   "\nForce { Type = \"Gravity\" Id = \"Side\" CustomProperties { Acceleration = {2, 0, 0} } } }\n"
                   "Environment { Space { Type = \"Grid\" Bodies {" +
                   body("A", a) + body("B", b) +
                   "Body { Id = \"Ground\" Immovable = true } } } KineticIntegrator = \"Euler\" }",
               {}, force_catalog());
}

TEST(ForceBodies, AreRowsAndFeelTheReaction) {
  const BuiltScene scene =
      built_with("Force { Type = \"Link\" Id = \"L\" CustomProperties { Rows = {{1, 2}, {3, 4}} AnchorBody = \"B\" } }",
                 "\"L\"", "\"Down\"");
  ASSERT_TRUE(scene.description.has_value()) << testing::PrintToString(scene.errors());
  EXPECT_THAT(scene.description->forces[0].parameters, ElementsAre(2, 1, 2, 3, 4, 1));
  EXPECT_THAT(scene.description->bodies[0].forces, ElementsAre(0));
  // after its own
  EXPECT_THAT(scene.description->bodies[1].forces, ElementsAre(1, 0));
}

TEST(ForceBodies, MayBeImmovableOrAbsent) {
  const BuiltScene ground =
      built_with("Force { Type = \"Link\" Id = \"L\" CustomProperties { AnchorBody = \"Ground\" } }", "\"L\"");
  ASSERT_TRUE(ground.description.has_value());
  EXPECT_THAT(ground.description->forces[0].parameters, ElementsAre(0, 2));
  EXPECT_THAT(ground.description->bodies[2].forces, IsEmpty());
  const BuiltScene world = built_with("Force { Type = \"Link\" Id = \"L\" }", "\"L\"");
  ASSERT_TRUE(world.description.has_value());
  EXPECT_TRUE(std::isnan(world.description->forces[0].parameters[1]));
}

TEST(ForceBodies, AreRefusedWhereThereAreNone) {
  EXPECT_THAT(
      built_with("Force { Type = \"Link\" Id = \"L\" CustomProperties { AnchorBody = \"Grund\" } }", "\"L\"").errors(),
      ElementsAre(HasSubstr("AnchorBody names no Body: \"Grund\"; did you mean \"Ground\"")));
  EXPECT_THAT(
      built_with("Force { Type = \"Link\" Id = \"L\" CustomProperties { AnchorBody = 1.5 } }", "\"L\"").errors(),
      ElementsAre(HasSubstr("allowed: the id of a body")));
  EXPECT_THAT(
      built_with("Force { Type = \"Link\" Id = \"L\" CustomProperties { AnchorBody = \"A\" } }", "\"L\"").errors(),
      ElementsAre(HasSubstr("acts between \"A\" and itself")));
}

// Whatever bears it.
TEST(ForceBodies, DoNotNameTheForceThatNamesThem) {
  for (const char* kind : {"Mass = 1 PrincipalMoments = {1, 1, 1}", "Kinematic = true", "Immovable = true"}) {
    const std::string scene = std::string(R"(
Forces { Force { Type = "Link" Id = "L" CustomProperties { AnchorBody = "B" } } }
Environment { Space { Type = "Grid" Bodies {
  Body { Id = "A" Mass = 1 PrincipalMoments = {1, 1, 1} Forces = {"L"} }
  Body { Id = "B" Forces = {"L"} )") +
                              kind + "} } } KineticIntegrator = \"Euler\" }";
    EXPECT_THAT(build(scene, {}, force_catalog()).errors(),
                ElementsAre(HasSubstr("Force \"L\" acts between \"B\" and itself; allowed: another body, or \"B\" "
                                      "without it in its Forces")))
        << kind;
  }
}

TEST(ForceBodies, AreNoBelts) {
  const std::string scene = R"(
Geometries { Geometry { Type = "Sphere" Id = "Round" CustomProperties { Radius = 1 } } }
Forces { Force { Type = "Link" Id = "L" CustomProperties { AnchorBody = "Belt" } } }
Environment { Space { Type = "Grid" Bodies {
  Body { Id = "A" Mass = 1 PrincipalMoments = {1, 1, 1} Forces = {"L"} }
  Body { Id = "Belt" GeometryId = "Round" Immovable = true SurfaceVelocity = {1, 0, 0} }
} } KineticIntegrator = "Euler" })";
  EXPECT_THAT(build(scene, {}, force_catalog()).errors(),
              ElementsAre(HasSubstr("Link \"L\" names the body \"Belt\", whose surface runs")));
}

TEST(ForceBodies, FloatInTheSumOfTheirGravity) {
  const BuiltScene scene = built_with("Force { Type = \"Lake\" Id = \"Lake\" CustomProperties { Level = 3 } }",
                                      "\"Down\", \"Lake\"", "\"Lake\", \"Side\", \"Down\"");
  ASSERT_TRUE(scene.description.has_value()) << testing::PrintToString(scene.errors());
  const kernel::EnvironmentDescription& d = *scene.description;
  // the second body's is a force of its own
  ASSERT_EQ(d.forces.size(), 4U);
  EXPECT_THAT(d.forces[0].parameters, ElementsAre(0, -9, 0, 3));
  EXPECT_THAT(d.forces[3].parameters, ElementsAre(2, -9, 0, 3));
  EXPECT_THAT(d.bodies[0].forces, ElementsAre(1, 0));
  EXPECT_THAT(d.bodies[1].forces, ElementsAre(3, 2, 1));
}

TEST(ForceBodies, KeepAGravityThatIsGiven) {
  const BuiltScene scene = built_with(
      "Force { Type = \"Lake\" Id = \"Lake\" CustomProperties { Gravity = {0, -1, 0} } }", "\"Down\", \"Lake\"");
  ASSERT_TRUE(scene.description.has_value());
  EXPECT_THAT(scene.description->forces[0].parameters, ElementsAre(0, -1, 0, 0));
}

TEST(ForceBodies, AreWarnedOfWhereNothingLiftsThem) {
  const std::string lake = "Force { Type = \"Lake\" Id = \"Lake\" CustomProperties { Level = 3 } }";
  EXPECT_THAT(
      built_with(lake, "\"Lake\"", "\"Lake\", \"Down\"").warnings(),
      ElementsAre(HasSubstr("Lake \"Lake\" has no Gravity, and the body \"A\" feels no force of type Gravity")));
  EXPECT_THAT(built_with(lake, "\"Lake\", \"Down\"").warnings(), IsEmpty());
}

}  // namespace
}  // namespace gravitas::scene
