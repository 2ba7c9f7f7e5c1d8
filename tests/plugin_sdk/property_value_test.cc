// Values against declarations: what is taken, how it is flattened, and what is said about the rest.
#include "plugin_sdk/property_value.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <string>
#include <vector>

namespace gravitas {
namespace {

using Values = std::vector<PropertyValue>;

constexpr double kInfiniteValue = std::numeric_limits<double>::infinity();

PropertyValue list(std::vector<double> numbers) { return PropertyValue::numbers(numbers); }

// The numbers of one value, or none after an error.
struct Flattened {
  bool good = false;
  std::vector<double> numbers;
  std::vector<PropertyProblem> problems;
  std::string text() const { return problems.empty() ? "" : problems[0].text; }
};

Flattened take(const Property& declared, const PropertyValue& value) {
  Flattened result;
  result.good = flatten_value(declared, value, &result.numbers, &result.problems);
  EXPECT_EQ(result.good, !result.numbers.empty());
  return result;
}

TEST(PropertyValue, TakesNumbersWithinBounds) {
  const Property radius = Property::number("Radius", "m").above(0.0).at_most(2.0);
  EXPECT_EQ(take(radius, PropertyValue::of(2.0)).numbers, std::vector<double>{2.0});
  EXPECT_EQ(take(radius, PropertyValue::of(0.0)).text(), "Radius is 0; allowed: a number in (0, 2]");
  EXPECT_EQ(take(radius, PropertyValue::of(2.5)).text(), "Radius is 2.5; allowed: a number in (0, 2]");
  EXPECT_EQ(take(radius, PropertyValue::of("1")).text(), R"(Radius is "1"; allowed: a number in (0, 2])");
  EXPECT_EQ(take(radius, PropertyValue::of(true)).text(), "Radius is true; allowed: a number in (0, 2]");
  EXPECT_EQ(take(Property::number("Drag", "1").at_least(0.0), PropertyValue::of(-1.0)).text(),
            "Drag is -1; allowed: a number >= 0");
}

TEST(PropertyValue, RefusesNumbersThatAreNotFinite) {
  for (const double number : {kInfiniteValue, -kInfiniteValue, std::nan("")}) {
    EXPECT_FALSE(take(Property::number("X", "m"), PropertyValue::of(number)).good);
    EXPECT_FALSE(take(Property::vector("X", "m", "world"), list({0.0, number, 0.0})).good);
    EXPECT_FALSE(take(Property::quaternion("X", "world"), list({number, 0.0, 0.0, 0.0})).good);
  }
}

TEST(PropertyValue, TakesWholeNumbers) {
  const Property iterations = Property::integer("Iterations").at_least(1.0);
  EXPECT_EQ(take(iterations, PropertyValue::of(50.0)).numbers, std::vector<double>{50.0});
  EXPECT_EQ(take(iterations, PropertyValue::of(2.5)).text(), "Iterations is 2.5; allowed: a whole number >= 1");
  EXPECT_FALSE(take(iterations, PropertyValue::of(1e300)).good);
}

TEST(PropertyValue, TakesFlagsAndChoices) {
  EXPECT_EQ(take(Property::flag("On"), PropertyValue::of(true)).numbers, std::vector<double>{1.0});
  EXPECT_EQ(take(Property::flag("On"), PropertyValue::of(1.0)).text(), "On is 1; allowed: true or false");
  const Property frame = Property::choice("Frame", {"World", "Body"});
  EXPECT_EQ(take(frame, PropertyValue::of("Body")).numbers, std::vector<double>{1.0});
  EXPECT_EQ(take(frame, PropertyValue::of("body")).text(),
            R"(Frame is "body"; did you mean "Body"? Allowed: "World", "Body")");
  EXPECT_EQ(take(frame, PropertyValue::of(0.0)).text(), R"(Frame is 0; allowed: one of "World", "Body")");
}

TEST(PropertyValue, TakesVectorsOfThree) {
  const Property vector = Property::vector("HalfExtents", "m", "geometry").above(0.0);
  EXPECT_EQ(take(vector, list({1.0, 2.0, 3.0})).numbers, (std::vector<double>{1.0, 2.0, 3.0}));
  EXPECT_EQ(take(vector, list({1.0, 2.0})).text(),
            "HalfExtents is a list of 2; allowed: a list of 3 numbers, each > 0");
  EXPECT_EQ(take(vector, PropertyValue::of(1.0)).text(), "HalfExtents is 1; allowed: a list of 3 numbers, each > 0");
}

TEST(PropertyValue, PointsAtTheElementThatIsWrong) {
  PropertyValue value = list({1.0, -2.0, 3.0});
  value.list[1].position = {0, 7, 9};
  const Flattened result = take(Property::vector("HalfExtents", "m", "geometry").above(0.0), value);
  EXPECT_EQ(result.text(), "an element of HalfExtents is -2; allowed: a list of 3 numbers, each > 0");
  EXPECT_EQ(result.problems[0].position, (TextPosition{0, 7, 9}));
}

TEST(PropertyValue, KeepsUnitQuaternionsBitForBit) {
  const double c = std::sqrt(0.5);
  const Flattened result = take(Property::quaternion("Q", "world"), list({c, 0.0, c, 0.0}));
  EXPECT_EQ(result.numbers, (std::vector<double>{c, 0.0, c, 0.0}));
  EXPECT_TRUE(result.problems.empty());
}

TEST(PropertyValue, NormalisesNearlyUnitQuaternions) {
  const Property q = Property::quaternion("Q", "world");
  // written with four digits: repaired and said
  const Flattened coarse = take(q, list({0.7071, 0.7071, 0.0, 0.0}));
  ASSERT_TRUE(coarse.good);
  EXPECT_DOUBLE_EQ(coarse.numbers[0], std::sqrt(0.5));
  ASSERT_EQ(coarse.problems.size(), 1U);
  EXPECT_TRUE(coarse.problems[0].is_warning);
  // with ten: repaired, nothing to say
  const Flattened fine = take(q, list({0.7071067812, 0.7071067812, 0.0, 0.0}));
  ASSERT_TRUE(fine.good);
  EXPECT_DOUBLE_EQ(fine.numbers[0], std::sqrt(0.5));
  EXPECT_TRUE(fine.problems.empty());
  // the norm 1.001 is the last one taken
  EXPECT_TRUE(take(q, list({1.0009, 0.0, 0.0, 0.0})).good);
  EXPECT_EQ(take(q, list({1.0, 0.0, 0.0, 1.0})).text(),
            "Q has the norm 1.4142135623730951; allowed: a list of 4 numbers (w, x, y, z) with "
            "norm 1 (within 1e-3)");
  EXPECT_FALSE(take(q, list({0.0, 0.0, 0.0, 0.0})).good);
  EXPECT_FALSE(take(q, list({1e200, 0.0, 0.0, 0.0})).good);
}

TEST(PropertyValue, FlattensTablesWithTheirRowCount) {
  const Property table = Property::table("Table", 4, "N", "world");
  const PropertyValue nested = PropertyValue::of(
      Values{PropertyValue::of(Values{PropertyValue::of(0.5), list({1.0, 2.0, 3.0})}), list({1.0, 4.0, 5.0, 6.0})});
  EXPECT_EQ(take(table, nested).numbers, (std::vector<double>{2, 0.5, 1, 2, 3, 1, 4, 5, 6}));
  EXPECT_EQ(take(table, list({})).numbers, std::vector<double>{0.0});
  EXPECT_EQ(take(table, PropertyValue::of(Values{list({1.0, 2.0})})).text(),
            "a row of Table has 2 numbers; allowed: a list of rows of 4 numbers");
  EXPECT_FALSE(take(table, PropertyValue::of(Values{PropertyValue::of("x")})).good);
}

TEST(PropertyValue, ATableOverTimeJumpsWhereATimeComesTwiceAndBendsWhereItsSlopeChanges) {
  const std::vector<Property> declared = {Property::vector("Point", "m", "body"),
                                          Property::table("T", 2, "s,N", "world"),
                                          Property::table("Way", 2, "m,N", "world"), Property::flag("On")};
  const auto jumps = [&](std::vector<double> table) {
    std::vector<double> numbers = {1, 1, 1, static_cast<double>(table.size() / 2)};
    numbers.insert(numbers.end(), table.begin(), table.end());
    numbers.insert(numbers.end(), {2, 3, 4, 3, 5, 0});  // the other table is not over time
    return bends_of(declared, numbers);
  };
  EXPECT_EQ(jumps({}), std::vector<double>());
  EXPECT_EQ(jumps({0, 1, 1, 1, 1.5, 1}), std::vector<double>());
  EXPECT_EQ(jumps({0, 1, 1, 1, 1, 2, 3, 2, 3, 4}), (std::vector<double>{1, 3}));
  // before its first row and after its last a table is constant
  EXPECT_EQ(jumps({0.5, 0, 1, 2, 2, 6, 3, 6}), (std::vector<double>{0.5, 2}));
  EXPECT_EQ(jumps({0, 0, 0.1, 0.3, 0.2, 0.6}), (std::vector<double>{0, 0.2}));
  EXPECT_EQ(jumps({2, 5}), std::vector<double>());
  // what is not whole says nothing
  EXPECT_EQ(bends_of(declared, std::vector<double>{1, 1, 1, 5, 0}), std::vector<double>());
  // of those of a time alone, all of its rows
  EXPECT_EQ(times_of(declared, std::vector<double>{1, 1, 1, 3, 0, 0, 0.1, 0.3, 0.2, 0.6, 1, 7, 4, 0}),
            (std::vector<double>{0, 0.1, 0.2}));
  EXPECT_EQ(times_of(declared, std::vector<double>{1, 1, 1, 5, 0}), std::vector<double>());
}

TEST(Flatten, FollowsTheOrderOfDeclaration) {
  const std::vector<Property> declared = {
      Property::number("Stiffness", "N/m").required(), Property::number("Damping", "N*s/m").defaults_to({0.25}),
      Property::vector("Anchor", "m", "world"), Property::table("Table", 2, "1", "world"), Property::flag("On")};
  std::vector<double> numbers = {99.0};
  std::vector<PropertyProblem> problems;
  ASSERT_TRUE(flatten(declared, {{"On", PropertyValue::of(true), {}}, {"Stiffness", PropertyValue::of(3.0), {}}},
                      &numbers, &problems));
  ASSERT_EQ(numbers.size(), 8U);
  EXPECT_EQ(numbers[0], 99.0);
  EXPECT_EQ(numbers[1], 3.0);
  EXPECT_EQ(numbers[2], 0.25);
  for (const std::size_t absent : {3U, 4U, 5U}) EXPECT_TRUE(std::isnan(numbers[absent]));
  EXPECT_EQ(numbers[6], 0.0);
  EXPECT_EQ(numbers[7], 1.0);
}

TEST(Flatten, WhatItWritesIsWhatTheCursorReads) {
  const std::vector<Property> declared = {Property::choice("Kind", {"A", "B"}), Property::vector("V", "m", "world"),
                                          Property::table("T", 2, "1", "world"), Property::integer("N")};
  const std::vector<NamedValue> given = {{"T", PropertyValue::of(Values{list({1, 2}), list({3, 4})}), {}},
                                         {"N", PropertyValue::of(7.0), {}},
                                         {"V", list({1, 2, 3}), {}},
                                         {"Kind", PropertyValue::of("B"), {}}};
  std::vector<double> numbers;
  std::vector<PropertyProblem> problems;
  ASSERT_TRUE(flatten(declared, given, &numbers, &problems));
  PropertyCursor cursor(numbers);
  EXPECT_EQ(cursor.choice(), 1U);
  EXPECT_EQ(cursor.vector(), Vector3(1, 2, 3));
  EXPECT_EQ(cursor.table(2).size(), 4U);
  EXPECT_EQ(cursor.integer(), 7);
  EXPECT_TRUE(cursor.at_end());
}

TEST(Flatten, ReportsUnknownMissingAndRepeatedNames) {
  const std::vector<Property> declared = {Property::number("Radius", "m").above(0.0).required(),
                                          Property::number("Height", "m")};
  std::vector<double> numbers;
  std::vector<PropertyProblem> problems;
  EXPECT_FALSE(flatten(declared,
                       {{"Raduis", PropertyValue::of(1.0), {0, 3, 4}},
                        {"Height", PropertyValue::of(1.0), {0, 4, 4}},
                        {"Height", PropertyValue::of(2.0), {0, 5, 4}}},
                       &numbers, &problems));
  ASSERT_EQ(problems.size(), 3U);
  EXPECT_EQ(problems[0].text, R"(unknown property "Raduis"; did you mean "Radius"? Allowed: "Radius", "Height")");
  EXPECT_EQ(problems[0].position, (TextPosition{0, 3, 4}));
  EXPECT_EQ(problems[1].text, "Height is given twice; allowed: once");
  EXPECT_EQ(problems[1].position, (TextPosition{0, 5, 4}));
  EXPECT_EQ(problems[2].text, "Radius is missing; required: a number > 0");
  EXPECT_FALSE(problems[2].position.known());
}

TEST(PropertyText, NumbersReadBack) {
  EXPECT_EQ(number_text(0.1), "0.1");
  EXPECT_EQ(number_text(-3.0), "-3");
  EXPECT_EQ(number_text(1e300), "1e+300");
}

TEST(PropertyText, CutsLongTextsBetweenCharacters) {
  std::string text(59, 'x');
  text += "\xC3\xA9\xC3\xA9";
  EXPECT_EQ(shown(PropertyValue::of(text)), '"' + std::string(59, 'x') + "…\"");
  EXPECT_EQ(shown(PropertyValue::of("a")), "\"a\"");
}

TEST(FlatSize, OfATableIsInItsNumbers) {
  const std::vector<double> numbers = {2, 10, 11, 12, 20, 21, 22, 5};
  EXPECT_EQ(flat_size_of(Property::table("T", 3, "m", "world"), numbers), 7U);
  EXPECT_EQ(flat_size_of(Property::vector("V", "m", "world"), numbers), 3U);
  EXPECT_EQ(flat_size_of(Property::table("T", 4, "m", "world"), numbers), 0U) << "they end before";
  EXPECT_EQ(flat_size_of(Property::number("N", "m"), {}), 0U);
}

TEST(CheckFlattened, TakesWhatFlattenMakes) {
  const std::vector<Property> declared = {Property::number("Mass", "kg").above(0.0).required(),
                                          Property::flag("IsOn").defaults_to({1.0}),
                                          Property::choice("Frame", {"World", "Body"}),
                                          Property::integer("Count").at_least(0.0).defaults_to({3.0}),
                                          Property::quaternion("Turn", "world"),
                                          Property::table("Points", 2, "m", "world")};
  constexpr double kNone = std::numeric_limits<double>::quiet_NaN();
  const std::vector<double> good = {2.0, 0.0, 1.0, 4.0, 0.6, 0.0, 0.8, 0.0, 2.0, 1.0, 2.0, 3.0, 4.0};
  EXPECT_EQ(check_flattened(declared, good), "");
  // what may be absent
  EXPECT_EQ(check_flattened(declared, {{2.0, 1.0, kNone, 3.0, kNone, kNone, kNone, kNone, 0.0}}), "");

  const auto with = [&](std::size_t i, double number) {
    std::vector<double> numbers = good;
    numbers[i] = number;
    return check_flattened(declared, numbers);
  };
  EXPECT_EQ(with(0, 0.0), "Mass = 0; allowed: a number > 0");
  EXPECT_NE(with(0, kNone), "");
  EXPECT_NE(with(0, std::numeric_limits<double>::infinity()), "");
  EXPECT_NE(with(1, 2.0), "");
  EXPECT_NE(with(1, kNone), "");
  EXPECT_NE(with(2, 2.0), "");
  EXPECT_NE(with(2, 0.5), "");
  EXPECT_NE(with(3, 0.5), "");
  EXPECT_NE(with(3, -1.0), "");
  EXPECT_EQ(with(4, 0.7), "Turn is no unit quaternion");
  // a table as long as it says, and of whole rows
  EXPECT_EQ(with(8, 3.0), "fewer numbers than the properties take");
  EXPECT_EQ(with(8, 1.0), "more numbers than the properties take");
  EXPECT_EQ(with(8, 1e300), "fewer numbers than the properties take");
  EXPECT_EQ(with(8, 0.5), "Points has 0.5 rows");
  EXPECT_EQ(with(8, -1.0), "Points has -1 rows");
  EXPECT_NE(with(9, kNone), "");
  EXPECT_EQ(check_flattened(declared, {}), "fewer numbers than the properties take");
}

// Rows that are there are not absent, whatever is in them.
TEST(CheckFlattened, TakesNoTableOfNaN) {
  const std::vector<Property> declared = {Property::table("Points", 2, "m", "world")};
  constexpr double kNone = std::numeric_limits<double>::quiet_NaN();
  EXPECT_EQ(check_flattened(declared, {{1.0, kNone, kNone}}), "Points = nan; allowed: a list of rows of 2 numbers");
  EXPECT_EQ(check_flattened(declared, {{0.0}}), "");
}

TEST(CheckFlattened, TakesTheRowOfABodyOrNone) {
  const std::vector<Property> declared = {Property::body("Carrier")};
  EXPECT_EQ(check_flattened(declared, {{0.0}}), "");
  EXPECT_EQ(check_flattened(declared, {{std::numeric_limits<double>::quiet_NaN()}}), "");
  for (const double number : {-1.0, 0.5, 4294967295.0, 1e300})
    EXPECT_NE(check_flattened(declared, {{number}}), "") << number;
}

}  // namespace
}  // namespace gravitas
