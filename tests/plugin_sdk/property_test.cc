// Declarations of properties, and the numbers that a plugin reads back.
#include "plugin_sdk/property.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <stdexcept>
#include <vector>

namespace gravitas {
namespace {

constexpr double kUnlimitedValue = std::numeric_limits<double>::infinity();

TEST(Property, IsUnboundedAndOptionalUnlessSaidOtherwise) {
  const Property length = Property::number("Length", "m");
  EXPECT_EQ(length.name, "Length");
  EXPECT_EQ(length.kind, PropertyKind::kNumber);
  EXPECT_EQ(length.unit, "m");
  EXPECT_EQ(length.minimum, -kUnlimitedValue);
  EXPECT_EQ(length.maximum, kUnlimitedValue);
  EXPECT_FALSE(length.exclusive_minimum || length.is_required || length.is_live);
  EXPECT_TRUE(length.default_numbers.empty());
}

TEST(Property, SaysItsBounds) {
  const Property closed = Property::number("A", "1").at_least(-1.0).at_most(2.0);
  EXPECT_EQ(closed.minimum, -1.0);
  EXPECT_EQ(closed.maximum, 2.0);
  EXPECT_FALSE(closed.exclusive_minimum);
  const Property open = Property::number("B", "1").above(0.0);
  EXPECT_EQ(open.minimum, 0.0);
  EXPECT_EQ(open.maximum, kUnlimitedValue);
  EXPECT_TRUE(open.exclusive_minimum);
}

TEST(Property, SaysItsOtherTraits) {
  const Property p = Property::vector("Axis", "1", "body").required().live().defaults_to({0, 1, 0}).means("Up.");
  EXPECT_TRUE(p.is_required && p.is_live);
  EXPECT_EQ(p.frame, "body");
  EXPECT_EQ(p.default_numbers, (std::vector<double>{0, 1, 0}));
  EXPECT_EQ(p.meaning, "Up.");
  EXPECT_EQ(Property::choice("C", {"a", "b"}).choices, (std::vector<std::string>{"a", "b"}));
  EXPECT_EQ(Property::table("T", 4, "s,N", "world").columns, 4U);
}

TEST(Property, KnowsHowManyNumbersItTakes) {
  EXPECT_EQ(Property::number("N", "m").flat_size(), 1U);
  EXPECT_EQ(Property::integer("I").flat_size(), 1U);
  EXPECT_EQ(Property::flag("F").flat_size(), 1U);
  EXPECT_EQ(Property::choice("C", {"a"}).flat_size(), 1U);
  EXPECT_EQ(Property::vector("V", "m", "world").flat_size(), 3U);
  EXPECT_EQ(Property::quaternion("Q", "world").flat_size(), 4U);
  // without a row
  EXPECT_EQ(Property::table("T", 4, "s,N", "world").flat_size(), 1U);
}

TEST(PropertyCursor, ReadsBackInTheOrderOfDeclaration) {
  const std::vector<double> numbers = {2.5, -3, 1, 0, 2, 1, 2, 3, 0.5, -0.5, 0.5, 0.5, 2, 0, 10, 1, 20, 0};
  PropertyCursor cursor(numbers);
  EXPECT_EQ(cursor.number(), 2.5);
  EXPECT_EQ(cursor.integer(), -3);
  EXPECT_TRUE(cursor.flag());
  EXPECT_FALSE(cursor.flag());
  EXPECT_EQ(cursor.choice(), 2U);
  EXPECT_EQ(cursor.vector(), Vector3(1, 2, 3));
  EXPECT_EQ(cursor.quaternion().coeffs(), Quaternion(0.5, -0.5, 0.5, 0.5).coeffs());
  const std::span<const double> rows = cursor.table(2);
  EXPECT_EQ(std::vector<double>(rows.begin(), rows.end()), (std::vector<double>{0, 10, 1, 20}));
  EXPECT_FALSE(cursor.at_end());
  EXPECT_TRUE(cursor.table(3).empty());
  EXPECT_TRUE(cursor.at_end());
}

TEST(PropertyCursor, ReadingPastTheEndThrows) {
  const std::vector<double> two = {1, 2}, rows = {2, 0, 0, 0};
  EXPECT_THROW(PropertyCursor({}).number(), std::out_of_range);
  EXPECT_THROW(PropertyCursor(two).vector(), std::out_of_range);
  EXPECT_THROW(PropertyCursor(two).quaternion(), std::out_of_range);
  EXPECT_THROW(PropertyCursor(rows).table(2), std::out_of_range);
  PropertyCursor cursor(two);
  EXPECT_THROW(cursor.vector(), std::out_of_range);
  // what could not be taken is still there
  EXPECT_EQ(cursor.number(), 1.0);
}

TEST(PropertyCursor, AnAbsentNumberIsNanAndNoOtherKindTakesIt) {
  const std::vector<double> absent = {std::nan(""), std::nan(""), std::nan("")};
  EXPECT_TRUE(std::isnan(PropertyCursor(absent).number()));
  EXPECT_TRUE(PropertyCursor(absent).vector().hasNaN());
  EXPECT_THROW(PropertyCursor(absent).integer(), std::out_of_range);
  EXPECT_THROW(PropertyCursor(absent).flag(), std::out_of_range);
  EXPECT_THROW(PropertyCursor(absent).choice(), std::out_of_range);
  EXPECT_THROW(PropertyCursor(absent).table(1), std::out_of_range);
}

TEST(PropertyCursor, RefusesNumbersThatAreNotOfTheKind) {
  for (const double number : {0.5, 1e16, -1e16, kUnlimitedValue, -kUnlimitedValue}) {
    const std::vector<double> one = {number};
    EXPECT_THROW(PropertyCursor(one).integer(), std::out_of_range) << number;
    EXPECT_THROW(PropertyCursor(one).choice(), std::out_of_range) << number;
    EXPECT_THROW(PropertyCursor(one).table(1), std::out_of_range) << number;
    EXPECT_THROW(PropertyCursor(one).flag(), std::out_of_range) << number;
  }
  const std::vector<double> negative = {-1, 0}, large = {4294967296.0};
  EXPECT_THROW(PropertyCursor(negative).choice(), std::out_of_range);
  EXPECT_THROW(PropertyCursor(negative).table(1), std::out_of_range);
  EXPECT_THROW(PropertyCursor(large).choice(), std::out_of_range);
  EXPECT_EQ(PropertyCursor(large).integer(), 4294967296);
}

}  // namespace
}  // namespace gravitas
