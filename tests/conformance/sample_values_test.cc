// Values drawn for declared properties, and the draws themselves.
#include "plugin_sdk/conformance/sample_values.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "plugin_sdk/conformance/inquiry.h"
#include "plugin_sdk/property_value.h"

namespace gravitas::conformance {
namespace {

using testing::HasSubstr;

// The reference sequence of SplitMix64 for the seed 1234567.
TEST(Draw, IsSplitMix) {
  Draw draw(1234567);
  EXPECT_EQ(draw.bits(), 6457827717110365317ULL);
  EXPECT_EQ(draw.bits(), 3203168211198807973ULL);
  EXPECT_EQ(draw.bits(), 9817491932198370423ULL);
}

TEST(Draw, StaysWithinItsBounds) {
  Draw draw(1);
  for (int i = 0; i < 1000; ++i) {
    const double number = draw.uniform(-2.0, 3.0);
    EXPECT_TRUE(number >= -2.0 && number < 3.0);
    EXPECT_LT(draw.below(7), 7U);
    EXPECT_NEAR(draw.direction().norm(), 1.0, 1e-15);
    EXPECT_NEAR(draw.rotation().norm(), 1.0, 1e-15);
  }
}

TEST(SampleValues, KeepTheDeclaredBounds) {
  const std::vector<Property> properties = {
      Property::number("Radius", "m").above(0.0).required(),
      Property::number("Share", "1").at_least(0.25).at_most(0.5).required(),
      Property::number("Depth", "m").at_most(-4.0).required(),
      Property::integer("Sweeps").at_least(3.0).at_most(4.0).required(),
  };
  Draw draw(1);
  for (int i = 0; i < 200; ++i) {
    const std::vector<double> values = sample_values(properties, &draw);
    ASSERT_EQ(values.size(), 4U);
    EXPECT_GT(values[0], 0.0);
    EXPECT_TRUE(values[1] >= 0.25 && values[1] <= 0.5);
    EXPECT_LE(values[2], -4.0);
    EXPECT_EQ(values[3], 4.0);
  }
}

TEST(SampleValues, TakeDefaultsAndLeaveOutWhatMayBeAbsent) {
  const std::vector<Property> properties = {
      Property::vector("Point", "m", "world").defaults_to({1, 2, 3}),
      Property::number("MaximumTorque", "N*m").at_least(0.0),
      Property::table("Table", 4, "s,N", "world"),
      Property::flag("Instantaneous").defaults_to({0}),
  };
  Draw draw(1);
  const std::vector<double> values = sample_values(properties, &draw);
  ASSERT_EQ(values.size(), 6U);
  EXPECT_EQ(std::vector<double>(values.begin(), values.begin() + 3), (std::vector<double>{1, 2, 3}));
  EXPECT_TRUE(std::isnan(values[3]));
  EXPECT_EQ(values[4], 0.0);
  EXPECT_EQ(values[5], 0.0);
}

TEST(SampleValues, AxesArePerpendicular) {
  const std::vector<Property> properties = {Property::vector("Axis1", "1", "world").required(),
                                            Property::vector("Axis2", "1", "world").required()};
  Draw draw(1);
  const std::vector<double> values = sample_values(properties, &draw);
  ASSERT_EQ(values.size(), 6U);
  const Vector3 one(values[0], values[1], values[2]), other(values[3], values[4], values[5]);
  EXPECT_NEAR(one.norm(), 1.0, 1e-15);
  EXPECT_NEAR(other.norm(), 1.0, 1e-15);
  EXPECT_NEAR(one.dot(other), 0.0, 1e-15);
}

TEST(SampleValues, TablesAscend) {
  Draw draw(1);
  const std::vector<double> values = sample_values({Property::table("Table", 4, "s,N", "world").required()}, &draw);
  ASSERT_EQ(values.size(), 33U);
  EXPECT_EQ(values[0], 8.0);
  for (std::size_t row = 1; row < 8; ++row) EXPECT_GT(values[1 + 4 * row], values[1 + 4 * (row - 1)]);
}

// Bounds of a table hold for all of its numbers, the first of a row among them.
TEST(SampleValues, TablesKeepTheirBoundsAndAscend) {
  const std::vector<Property> tables[] = {
      {Property::table("Table", 2, "1", "world").at_least(2.0).at_most(5.0).required()},
      {Property::table("Table", 2, "1", "world").at_most(-3.0).required()},
      {Property::table("Table", 2, "1", "world").above(0.0).at_most(1.0).required()},
      {Property::table("Table", 2, "1", "world").at_most(0.5).required()}};
  for (const std::vector<Property>& properties : tables) {
    Draw draw(1);
    const std::vector<double> values = sample_values(properties, &draw);
    EXPECT_EQ(check_flattened(properties, values), "");
    for (std::size_t row = 1; row < 8; ++row) EXPECT_GT(values[1 + 2 * row], values[1 + 2 * (row - 1)]);
  }
}

std::vector<Property> optional_properties() {
  return {Property::number("Share", "1").at_least(0.0).at_most(1.0).required(),
          Property::vector("Wind", "m/s", "world").defaults_to({0, 0, 0}),
          Property::choice("Frame", {"World", "Body", "Path"}).defaults_to({0}),
          Property::table("Curve", 2, "1", "world"),
          Property::body("Anchor"),
          Property::number("Length", "m").at_least(0.0)};
}

TEST(VariedValues, GiveWhatHasADefaultOrMayBeAbsentButBodies) {
  const std::vector<Property> properties = optional_properties();
  Draw draw(1);
  bool has_frame = false;
  for (int i = 0; i < 50; ++i) {
    std::vector<double> values = sample_values(properties, &draw);
    vary(properties, &draw, &values, [] { return Answer{}; });
    EXPECT_EQ(check_flattened(properties, values), "");
    ASSERT_EQ(values.size(), 1U + 3U + 1U + 17U + 1U + 1U);
    EXPECT_NE(values[1], 0.0);
    EXPECT_EQ(values[5], 8.0);
    EXPECT_TRUE(std::isnan(values[22]));
    EXPECT_GT(values[23], 0.0);
    has_frame = has_frame || values[4] == 2.0;
  }
  EXPECT_TRUE(has_frame);
}

// Some of them may exclude each other, or all be wrong.
TEST(VariedValues, AreDrawnAgainWhereTheyAreRefusedAndGivenUpInTheEnd) {
  const std::vector<Property> properties = optional_properties();
  const Answer refused{.status = GRAVITAS_REFUSED, .text = "no", .fault = {}, .columns = {}};
  Draw draw(1);
  std::vector<double> values = sample_values(properties, &draw);
  const std::vector<double> plain = values;
  int asked = 0;
  vary(properties, &draw, &values, [&] { return ++asked < 3 ? refused : Answer{}; });
  EXPECT_EQ(asked, 3);
  EXPECT_NE(values[0], plain[0]);
  values = plain;
  vary(properties, &draw, &values, [&] { return refused; });
  EXPECT_EQ(values[0], plain[0]);
  EXPECT_EQ(values[1], 0.0);
}

TEST(VariedValues, AreShownByTheirNames) {
  const TypeDeclaration type{"Sail", "", optional_properties()};
  const double none = std::nan("");
  EXPECT_EQ(shown(type, {0.5, 1, 2, 3, 1, 0, none, none}), "Sail (Share 0.5, Wind 1 2 3, Frame Body)");
  EXPECT_EQ(shown(type, {0.5, 0, 0, 0, 0, 1, 7, 8, none, 2}),
            "Sail (Share 0.5, Wind 0 0 0, Frame World, Curve 1 7 8, Length 2)");
  EXPECT_EQ(shown(TypeDeclaration{"Sail", "", {}}, {}), "Sail");
}

TEST(RenamedBodies, HaveTheirNewRows) {
  const std::vector<Property> properties = {Property::table("Curve", 2, "1", "world"), Property::body("Anchor"),
                                            Property::number("Length", "m"), Property::body("Other")};
  std::vector<double> values = {1.0, 5.0, 6.0, 2.0, 0.5, std::nan("")};
  const std::uint32_t place[] = {2, 0, 1};
  rename_bodies(properties, place, &values);
  EXPECT_EQ(std::vector<double>(values.begin(), values.begin() + 5), (std::vector<double>{1.0, 5.0, 6.0, 1.0, 0.5}));
  EXPECT_TRUE(std::isnan(values[5]));
}

TEST(Draw, OrdersAllRows) {
  Draw draw(3);
  std::vector<std::uint32_t> place = draw.order(300);
  EXPECT_FALSE(std::ranges::is_sorted(place));
  std::ranges::sort(place);
  for (std::uint32_t i = 0; i < 300; ++i) EXPECT_EQ(place[i], i);
}

TEST(SampleValues, WhatTheSceneLanguageGivesMustBeTaken) {
  const TypeDeclaration ball{"Sphere", "", {Property::number("Radius", "m").above(0.0).required()}};
  EXPECT_EQ(flattened(ball, {given("Radius", 0.5)}), std::vector<double>{0.5});
  try {
    flattened(ball, {given("Radius", -0.5)});
    FAIL() << "a negative radius was taken";
  } catch (const Finding& finding) {
    EXPECT_THAT(finding.what(), HasSubstr("type Sphere does not take what the scene language gives it"));
  }
}

TEST(Capabilities, AreNamesAndNumbers) {
  const PluginDeclaration declaration{
      .name = "X", .version = "1", .slot = Slot::kIntegrator, .meaning = "", .capabilities = {"order=4", "soft"}};
  EXPECT_TRUE(has_capability(declaration, "soft"));
  EXPECT_FALSE(has_capability(declaration, "sof"));
  EXPECT_EQ(capability_number(declaration, "order", 1.0), 4.0);
  EXPECT_EQ(capability_number(declaration, "soft", 1.0), 1.0);
  EXPECT_EQ(capability_number(declaration, "stages", 7.0), 7.0);
}

TEST(SampleValues, DirectionsThatMayBeAbsentAreGivenAcrossEachOther) {
  const std::vector<Property> properties = {
      Property::number("Stiffness", "N/m"), Property::vector("Axis1", "1", "world"),
      Property::table("Curve", 2, "1", "world"), Property::vector("Point", "m", "world"),
      Property::vector("Axis2", "1", "world")};
  Draw draw(3);
  const std::vector<double> plain = sample_values(properties, &draw);
  const std::vector<double> given = with_directions(properties, plain, &draw);
  ASSERT_EQ(given.size(), plain.size());
  ASSERT_EQ(given.size(), 1U + 3U + 1U + 3U + 3U);
  EXPECT_TRUE(std::isnan(given[0]));
  EXPECT_EQ(given[4], 0.0);
  EXPECT_TRUE(std::isnan(given[5]));
  const Vector3 one(given[1], given[2], given[3]), two(given[8], given[9], given[10]);
  EXPECT_NEAR(one.norm(), 1.0, 1e-12);
  EXPECT_NEAR(two.norm(), 1.0, 1e-12);
  EXPECT_NEAR(one.dot(two), 0.0, 1e-12);
}

}  // namespace
}  // namespace gravitas::conformance
