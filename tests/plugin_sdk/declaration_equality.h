// Field by field comparison of plugin declarations, for the tests of what carries them about.
#pragma once

#include <gtest/gtest.h>

#include "plugin_sdk/plugin.h"

namespace gravitas::test {

inline void expect_equal(const Property& given, const Property& expected) {
  SCOPED_TRACE(expected.name);
  EXPECT_EQ(given.name, expected.name);
  EXPECT_EQ(given.kind, expected.kind);
  EXPECT_EQ(given.unit, expected.unit);
  EXPECT_EQ(given.frame, expected.frame);
  EXPECT_EQ(given.minimum, expected.minimum);
  EXPECT_EQ(given.maximum, expected.maximum);
  EXPECT_EQ(given.exclusive_minimum, expected.exclusive_minimum);
  EXPECT_EQ(given.is_required, expected.is_required);
  EXPECT_EQ(given.default_numbers, expected.default_numbers);
  EXPECT_EQ(given.choices, expected.choices);
  EXPECT_EQ(given.columns, expected.columns);
  EXPECT_EQ(given.is_live, expected.is_live);
  EXPECT_EQ(given.meaning, expected.meaning);
}

inline void expect_equal(const std::vector<Property>& given, const std::vector<Property>& expected) {
  ASSERT_EQ(given.size(), expected.size());
  for (std::size_t i = 0; i < given.size(); ++i) expect_equal(given[i], expected[i]);
}

inline void expect_equal(const PluginDeclaration& given, const PluginDeclaration& expected) {
  EXPECT_EQ(given.name, expected.name);
  EXPECT_EQ(given.version, expected.version);
  EXPECT_EQ(given.slot, expected.slot);
  EXPECT_EQ(given.meaning, expected.meaning);
  EXPECT_EQ(given.capabilities, expected.capabilities);
  EXPECT_EQ(given.theta, expected.theta);
  expect_equal(given.properties, expected.properties);
  ASSERT_EQ(given.types.size(), expected.types.size());
  for (std::size_t i = 0; i < given.types.size(); ++i) {
    EXPECT_EQ(given.types[i].name, expected.types[i].name);
    EXPECT_EQ(given.types[i].meaning, expected.types[i].meaning);
    expect_equal(given.types[i].properties, expected.types[i].properties);
    ASSERT_EQ(given.types[i].coordinates.size(), expected.types[i].coordinates.size());
    for (std::size_t k = 0; k < given.types[i].coordinates.size(); ++k) {
      EXPECT_EQ(given.types[i].coordinates[k].name, expected.types[i].coordinates[k].name);
      EXPECT_EQ(given.types[i].coordinates[k].unit, expected.types[i].coordinates[k].unit);
      EXPECT_EQ(given.types[i].coordinates[k].meaning, expected.types[i].coordinates[k].meaning);
    }
  }
}

// One that uses every field: a property of each kind, bounds, defaults, two types, settings.
inline PluginDeclaration full_declaration() {
  const std::vector<Property> all = {
      Property::number("Stiffness", "N/m").above(0.0).at_most(1e9).required().means("A number."),
      Property::integer("Count").at_least(-3).defaults_to({7}).live().means("A whole number."),
      Property::flag("Active").defaults_to({1}),
      Property::choice("Frame", {"World", "Body", "two words"}).defaults_to({2}),
      Property::vector("Axis", "1", "body").defaults_to({0, 0, -1}),
      Property::quaternion("Attitude", "world").defaults_to({1, 0, 0, 0}),
      Property::table("Curve", 2, "s,N", "scene").means("Rows {t, f}."),
      Property::number("Absent", "m")};
  return {.name = "Full",
          .version = "3.2",
          .slot = Slot::kSolver,
          .meaning = "Uses every field.",
          .capabilities = {"potential", "owns_motion"},
          .types = {{"Spring", "Pulls.", all, {{"length", "m", "A length."}, {"angle", "rad", "An angle."}}},
                    {"Nothing", "", {}}},
          .properties = {all[1], all[6]},
          .theta = 0.25};
}

}  // namespace gravitas::test
