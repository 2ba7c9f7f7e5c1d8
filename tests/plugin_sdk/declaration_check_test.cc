// A declaration is refused at the first thing that is wrong with it.
#include "plugin_sdk/declaration_check.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <functional>
#include <string>
#include <vector>

namespace gravitas {
namespace {

using testing::StartsWith;

PluginDeclaration sound() {
  return {.name = "Magnet",
          .version = "1.0",
          .slot = Slot::kForce,
          .meaning = "Pulls.",
          .capabilities = {"potential", "jacobians"},
          .types = {{"Magnet", "Pulls to the origin.", {Property::number("Pull_2", "N").means("How much.")}}},
          .properties = {Property::choice("Frame", {"World", "Body"}).defaults_to({1}).means("Where.")}};
}

std::string problem_of(const std::function<void(PluginDeclaration*)>& spoil) {
  PluginDeclaration declaration = sound();
  spoil(&declaration);
  return check_declaration(declaration);
}

// With a property more.
std::string problem_with(const Property& property) {
  return problem_of([&](PluginDeclaration* d) { d->types[0].properties.push_back(property); });
}

TEST(CheckDeclaration, ASoundOneHasNothingWrong) { EXPECT_EQ(check_declaration(sound()), ""); }

TEST(CheckDeclaration, DemandsAName) {
  const std::string refusal = "it has no name, or one that a scene cannot write";
  EXPECT_EQ(problem_of([](auto* d) { d->name = ""; }), refusal);
  EXPECT_EQ(problem_of([](auto* d) { d->name = "Ma gnet"; }), refusal);
  EXPECT_EQ(problem_of([](auto* d) { d->version = ""; }), "it has no version");
  EXPECT_EQ(problem_of([](auto* d) { d->meaning = ""; }), "it has no meaning");
  EXPECT_EQ(problem_of([](auto* d) { d->slot = static_cast<Slot>(99); }),
            "it declares a slot that this version does not have");
  EXPECT_EQ(problem_of([](auto* d) { d->theta = 1.5; }), "theta is 1.5; allowed: 0 to 1");
}

TEST(CheckDeclaration, KnowsTheCapabilitiesOfEachSlot) {
  EXPECT_EQ(
      problem_of([](auto* d) { d->capabilities = {"jacobian"}; }),
      "slot force knows no capability 'jacobian'; did you mean \"jacobians\"? Allowed: \"potential\", \"jacobians\"");
  EXPECT_EQ(problem_of([](auto* d) {
              d->capabilities = {"jacobians", "jacobians"};
            }),
            "the capability 'jacobians' is declared twice");
  const auto of_integrator = [](const std::string& word) {
    return check_declaration(
        {.name = "I", .version = "1", .slot = Slot::kIntegrator, .meaning = "I.", .capabilities = {word}});
  };
  EXPECT_EQ(of_integrator("order=12"), "");
  EXPECT_EQ(of_integrator("plugin_state"), "");
  for (const char* word : {"order", "order=", "order=N", "order=4.5"})
    EXPECT_THAT(of_integrator(word), StartsWith("slot integrator knows no capability '" + std::string(word) + "'; "));
}

TEST(CheckDeclaration, DemandsTypesThatAreDeclaredOnce) {
  EXPECT_EQ(problem_of([](auto* d) { d->types.clear(); }), "a plugin of slot force serves types; it declares none");
  EXPECT_EQ(problem_of([](auto* d) { d->types.push_back(d->types[0]); }), "type Magnet is declared twice");
  EXPECT_EQ(problem_of([](auto* d) { d->types[0].name = "Mag net"; }),
            "a type has no name, or one that a scene cannot write");
  EXPECT_EQ(problem_of([](auto* d) { d->types[0].meaning = ""; }), "type Magnet has no meaning");
}

TEST(CheckDeclaration, DemandsPropertiesThatASceneCanWrite) {
  for (const char* name : {"My Prop", "2Pull", "Pull-2",
                           "Kr\xc3\xa4"
                           "fte"})
    EXPECT_EQ(problem_with(Property::number(name, "N").means("Wrong.")),
              "Magnet has a property '" + std::string(name) +
                  "', which a scene cannot write; allowed: letters, digits and '_', and no digit first");
  EXPECT_EQ(problem_with(Property::number("", "N").means("Wrong.")), "Magnet has a property without a name");
  EXPECT_EQ(problem_with(Property::number("Pull_2", "N").means("Again.")), "Magnet declares Pull_2 twice");
  EXPECT_EQ(problem_with(Property::number("Low", "N")), "Magnet.Low has no meaning");
}

// A scene's ids become rows for forces alone.
TEST(CheckDeclaration, LetsForcesAloneNameBodies) {
  const auto problem = [](Slot slot, std::vector<Property> of_type, std::vector<Property> of_plugin) {
    return check_declaration({.name = "Mast",
                              .version = "1",
                              .slot = slot,
                              .meaning = "Stands.",
                              .types = {{"Mast", "Stands.", std::move(of_type), {}}},
                              .properties = std::move(of_plugin)});
  };
  const Property other = Property::body("Other").means("Who else.");
  EXPECT_EQ(problem(Slot::kForce, {other}, {}), "");
  EXPECT_EQ(problem(Slot::kConstraint, {other}, {}), "Mast.Other names a body; allowed: of types of forces");
  EXPECT_EQ(problem(Slot::kForce, {}, {other}), "Mast.Other names a body; allowed: of types of forces");
}

TEST(CheckDeclaration, DemandsCoordinatesThatTheCapabilityTellsOf) {
  const auto problem = [](std::vector<std::string> capabilities, std::vector<CoordinateDeclaration> coordinates) {
    return check_declaration({.name = "Mast",
                              .version = "1",
                              .slot = Slot::kConstraint,
                              .meaning = "Stands.",
                              .capabilities = std::move(capabilities),
                              .types = {{"Mast", "Stands.", {}, std::move(coordinates)}}});
  };
  EXPECT_EQ(problem({}, {}), "");
  EXPECT_EQ(problem({"coordinates"}, {{"angle", "rad", "An angle."}, {"way", "m", "A way."}}), "");
  EXPECT_EQ(problem({"coordinates"}, {}), "it declares the capability 'coordinates', but no type has any");
  EXPECT_EQ(problem({}, {{"angle", "rad", "An angle."}}),
            "a type has coordinates, but the plugin does not declare the capability 'coordinates'");
  EXPECT_EQ(problem({"coordinates"}, {{"an angle", "rad", "An angle."}}),
            "Mast has a coordinate 'an angle'; allowed: a name of letters, digits and '_', and no digit first");
  EXPECT_EQ(problem({"coordinates"}, {{"angle", "rad", "An angle."}, {"angle", "m", "A way."}}),
            "Mast declares the coordinate angle twice");
  EXPECT_EQ(problem({"coordinates"}, {{"angle", "", "An angle."}}), "coordinate angle of Mast has no unit");
  EXPECT_EQ(problem({"coordinates"}, {{"angle", "rad", ""}}), "coordinate angle of Mast has no meaning");
}

TEST(CheckDeclaration, DemandsBoundsChoicesAndDefaultsThatFitTogether) {
  EXPECT_EQ(problem_with(Property::number("R", "N").at_least(5).at_most(1).required().means("R.")),
            "Magnet.R has bounds between which there is no number");
  EXPECT_EQ(problem_with(Property::number("R", "N").above(1).at_most(1).required().means("R.")),
            "Magnet.R has bounds between which there is no number");
  EXPECT_EQ(problem_with(Property::number("R", "N").at_least(HUGE_VAL).required().means("R.")),
            "Magnet.R has bounds between which there is no number");
  EXPECT_EQ(problem_with(Property::number("R", "N").at_least(1).at_most(1).required().means("R.")), "");
  EXPECT_EQ(problem_with(Property::number("R", "N").required().defaults_to({1}).means("R.")),
            "Magnet.R is required and has a default");
  EXPECT_THAT(problem_with(Property::number("R", "N").at_least(0).defaults_to({-5}).means("R.")),
              StartsWith("Magnet.R has a default that it does not allow: "));
  EXPECT_EQ(problem_with(Property::choice("C", {}).means("C.")), "Magnet.C is a choice between nothing");
  EXPECT_EQ(problem_with(Property::choice("C", {"a", "b", "a"}).means("C.")), "Magnet.C has the choice 'a' twice");
  EXPECT_EQ(problem_with(Property::table("T", 0, "1", "").means("T.")), "Magnet.T is a table without columns");
}

}  // namespace
}  // namespace gravitas
