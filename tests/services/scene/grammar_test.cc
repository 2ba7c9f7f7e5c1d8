// The grammar is read from the schema; these are the names that scenes rely on.
#include "services/scene/grammar.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <set>
#include <string>
#include <vector>

#include "gravitas/scene/v1/scene.pb.h"

namespace gravitas::scene {
namespace {

using testing::ElementsAre;

TEST(Grammar, HasTheNamesOfTheLanguage) {
  const auto names = [](const google::protobuf::Descriptor* message) { return grammar_of(*message).names; };
  EXPECT_THAT(scene_grammar().names,
              ElementsAre("Geometries", "Materials", "Forces", "Simulator", "Environment", "Plugins"));
  EXPECT_THAT(names(v1::Geometry::descriptor()), ElementsAre("Type", "Id", "CustomProperties"));
  EXPECT_THAT(
      names(v1::Material::descriptor()),
      ElementsAre("Id", "RestitutionCoefficient", "StaticFrictionCoefficient", "DynamicFrictionCoefficient",
                  "RollingFrictionCoefficient", "SpinningFrictionCoefficient", "SurfacePerturbationCoefficient"));
  EXPECT_THAT(names(v1::Environment::descriptor()),
              ElementsAre("Id", "Space", "CollisionFilter", "Constraints", "KineticIntegrator", "ConstraintSolver"));
  EXPECT_THAT(names(v1::Space::descriptor()), ElementsAre("Type", "Id", "CustomProperties", "Bodies"));
  EXPECT_THAT(
      names(v1::Body::descriptor()),
      ElementsAre("Type", "Id", "GeometryId", "Material", "MassDensity", "Mass", "PrincipalMoments", "CentreOfMass",
                  "PrincipalAxes", "Immovable", "Kinematic", "Motion", "CollisionGroups", "Forces",
                  "BoundingVolumeType", "KineticProperties", "VisualFile", "VisualTransform", "SurfaceVelocity"));
  EXPECT_THAT(
      names(v1::KineticProperties::descriptor()),
      ElementsAre("Position", "Orientation", "LinearVelocity", "AngularVelocity", "DampingCoefficient", "CanSleep"));
  EXPECT_THAT(names(v1::Constraint::descriptor()), ElementsAre("Type", "Id", "Body1", "Body2", "BreakingThreshold",
                                                               "BreakingForce", "BreakingTorque", "CustomProperties"));
  EXPECT_THAT(names(v1::CollisionFilter::descriptor()), ElementsAre("DefaultAllow", "Rules", "Exceptions"));
  EXPECT_THAT(names(v1::Rule::descriptor()), ElementsAre("Allow", "Body", "Bodies", "Group", "Groups"));
  EXPECT_THAT(names(v1::Plugin::descriptor()),
              ElementsAre("Slot", "Name", "Hosting", "Standby", "Deadline", "Fallback", "Process", "Library", "Command",
                          "Address", "CustomProperties", "Failures"));
}

// Every name says what it means, and every default obeys its own rule.
void check(const BlockRule& rule, std::set<const BlockRule*>* seen) {
  if (!seen->insert(&rule).second) return;
  for (const Entry& entry : rule.entries) {
    EXPECT_FALSE(entry.declared.meaning.empty()) << rule.name << '.' << entry.name;
    EXPECT_FALSE(entry.is_required && entry.default_value.has_value()) << rule.name << '.' << entry.name;
    if (entry.form == Form::kNumbers && entry.default_value.has_value()) {
      std::vector<double> numbers;
      std::vector<PropertyProblem> problems;
      EXPECT_TRUE(flatten_value(entry.declared, *entry.default_value, &numbers, &problems))
          << rule.name << '.' << entry.name << ": " << problems[0].text;
    }
    if (entry.block != nullptr) check(*entry.block, seen);
  }
}

TEST(Grammar, IsWhole) {
  std::set<const BlockRule*> seen;
  check(scene_grammar(), &seen);
  EXPECT_GE(seen.size(), 20U);
}

TEST(Grammar, NamesFieldsInPascalCase) {
  EXPECT_EQ(pascal_case("mass_density"), "MassDensity");
  EXPECT_EQ(pascal_case("body1"), "Body1");
  EXPECT_EQ(name_of(*v1::Body::descriptor(), v1::Body::kGeometryIdFieldNumber), "GeometryId");
}

}  // namespace
}  // namespace gravitas::scene
