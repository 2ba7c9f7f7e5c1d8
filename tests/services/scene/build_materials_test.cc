// The table of material pairs.
#include "services/scene/build_materials.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <string>
#include <vector>

#include "tests/services/scene/scene_fixture.h"

namespace gravitas::scene {
namespace {

using testing::ElementsAre;
using testing::IsEmpty;

std::string scene_with_materials(const std::string& materials, const std::vector<std::string>& of_bodies) {
  std::string bodies;
  for (const std::string& material : of_bodies)
    bodies += "Body { Id = \"B" + std::to_string(bodies.size()) + "\" Immovable = true " + material + " }\n";
  return "Materials {\n" + materials + "\n}\nEnvironment { Space { Bodies { " + bodies + " } } }";
}

// Coefficients of a pair of material rows.
std::vector<double> pair(const kernel::EnvironmentDescription& description, std::uint32_t a, std::uint32_t b) {
  const auto begin = description.material_pairs.begin() + (a * description.material_count + b) * kMaterialColumns;
  return {begin, begin + kMaterialColumns};
}

TEST(BuildMaterials, MixesPairs) {
  const BuiltScene built = build(
      scene_with_materials("Material { Id = \"A\" RestitutionCoefficient = 0.1 StaticFrictionCoefficient = 0.25 "
                           "DynamicFrictionCoefficient "
                           "= 0.0625 RollingFrictionCoefficient = 0.01 SpinningFrictionCoefficient = 0.04 "
                           "SurfacePerturbationCoefficient = "
                           "0.1 }\nMaterial { Id = \"B\" RestitutionCoefficient = 0.4 StaticFrictionCoefficient = 1 "
                           "DynamicFrictionCoefficient = 0.25 RollingFrictionCoefficient = 0.04 "
                           "SpinningFrictionCoefficient = 0.01 "
                           "SurfacePerturbationCoefficient = 0.2 }",
                           {"Material = \"A\"", "Material = \"B\""}));
  ASSERT_TRUE(built.description.has_value());
  EXPECT_EQ(built.description->material_count, 2U);
  const std::vector<double> mixed = pair(*built.description, 0, 1);
  EXPECT_DOUBLE_EQ(mixed[kRestitution], 0.25);
  EXPECT_DOUBLE_EQ(mixed[kStaticFriction], 0.5);
  EXPECT_DOUBLE_EQ(mixed[kDynamicFriction], 0.125);
  EXPECT_DOUBLE_EQ(mixed[kRollingFriction], 0.02);
  EXPECT_DOUBLE_EQ(mixed[kSpinningFriction], 0.02);
  EXPECT_DOUBLE_EQ(mixed[kSurfacePerturbation], 0.1 + 0.2);
  EXPECT_EQ(pair(*built.description, 1, 0), mixed);
  EXPECT_THAT(pair(*built.description, 0, 0), ElementsAre(0.1, 0.25, 0.0625, 0.01, 0.04, 0.2));
}

TEST(BuildMaterials, DynamicFrictionIsStaticWhereAbsent) {
  const BuiltScene built =
      build(scene_with_materials("Material { Id = \"A\" StaticFrictionCoefficient = 0.3 }", {"Material = \"A\""}));
  ASSERT_TRUE(built.description.has_value());
  EXPECT_THAT(built.description->material_pairs, ElementsAre(0, 0.3, 0.3, 0, 0, 0));
}

TEST(BuildMaterials, ABodyWithoutOneHasTheDefaults) {
  const BuiltScene built = build(
      scene_with_materials("Material { Id = \"A\" StaticFrictionCoefficient = 0 }", {"", "Material = \"A\"", ""}));
  ASSERT_TRUE(built.description.has_value());
  EXPECT_EQ(built.description->material_count, 2U);
  EXPECT_EQ(built.description->bodies[0].material, 1U);
  EXPECT_EQ(built.description->bodies[1].material, 0U);
  EXPECT_THAT(pair(*built.description, 1, 1), ElementsAre(0, 0.5, 0.5, 0, 0, 0));
  EXPECT_THAT(pair(*built.description, 0, 1), ElementsAre(0, 0, 0, 0, 0, 0));
}

TEST(BuildMaterials, OnlyThoseInUseHaveRows) {
  const BuiltScene built = build(scene_with_materials(
      "Material { Id = \"A\" }\nMaterial { Id = \"B\" }\nMaterial { Id = \"C\" }", {"Material = \"C\""}));
  ASSERT_TRUE(built.description.has_value());
  EXPECT_EQ(built.description->material_count, 1U);
  EXPECT_EQ(built.description->bodies[0].material, 0U);
  EXPECT_EQ(build("Environment { }").description->material_count, 1U);
}

TEST(BuildMaterials, WarnOfMoreFrictionInMotion) {
  const BuiltScene built =
      build(scene_with_materials("Material { Id = \"A\" DynamicFrictionCoefficient = 0.8 }", {"Material = \"A\""}));
  EXPECT_THAT(built.errors(), IsEmpty());
  EXPECT_THAT(built.warnings(),
              ElementsAre("scene:2:50: warning: DynamicFrictionCoefficient of \"A\" is 0.8, more than its "
                          "StaticFrictionCoefficient 0.5: a body at rest then starts more easily than it goes on"));
}

TEST(BuildMaterials, RefusesIdsThatStandTwice) {
  EXPECT_THAT(build(scene_with_materials("Material { Id = \"A\" }\n Material { Id = \"A\" }", {})).errors(),
              ElementsAre("scene:3:18: error: Material \"A\" is there already, at scene:2:17; allowed: an "
                          "id of its "
                          "own"));
}

}  // namespace
}  // namespace gravitas::scene
