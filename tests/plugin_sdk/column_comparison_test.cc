// Answers that differ by known amounts: what is told of them, and what a tolerance lets pass.
#include "plugin_sdk/column_comparison.h"

#include <gtest/gtest.h>

#include <limits>
#include <string_view>
#include <vector>

#include "plugin_sdk/message_columns.h"

namespace gravitas {
namespace {

constexpr stage::Method kSolve = stage::Method::kSolverSolve;

// Of two bodies.
MessageColumns answer() {
  MessageColumns columns(stage::method_info(kSolve).reply);
  columns.f64("linear_velocity") = {8.0, 0.0, 0.0, 0.0, -1.0, 0.0};
  columns.f64("angular_velocity") = {0.0, 0.0, 0.0, 0.0, 0.0, 0.0};
  return columns;
}

Comparison within(double tolerance) {
  Comparison comparison;
  comparison.tolerance = tolerance;
  return comparison;
}

bool differ(Comparison* comparison, const MessageColumns& first, const MessageColumns& second) {
  return comparison->add(kSolve, first.column_bytes(), second.column_bytes()).has_value();
}

bool differ(double tolerance, const MessageColumns& first, const MessageColumns& second) {
  Comparison comparison = within(tolerance);
  return differ(&comparison, first, second);
}

TEST(Comparison, TellsTheLargestDifferenceOfAColumn) {
  MessageColumns other = answer();
  other.f64("linear_velocity") = {8.0, 0.25, 0.0, 0.0, -1.5, 0.0};
  Comparison comparison;
  const auto first = comparison.add(kSolve, answer().column_bytes(), other.column_bytes());
  ASSERT_TRUE(first);
  EXPECT_EQ(first->column->name, std::string_view("linear_velocity"));
  EXPECT_EQ(first->number, 1U);
  ASSERT_EQ(comparison.disagreements.size(), 1U);
  const Disagreement& one = comparison.disagreements[0];
  EXPECT_EQ(one.largest, 0.5);
  EXPECT_EQ(one.relative, 0.5 / 8.0);
  EXPECT_EQ(one.largest_row, 1U);
  EXPECT_EQ(one.rows, 2U);
  EXPECT_EQ(comparison.differing_calls, 1U);
  EXPECT_FALSE(differ(&comparison, answer(), answer()));
  EXPECT_EQ(comparison.differing_calls, 1U);
}

TEST(Comparison, AToleranceIsOfTheLargestMagnitudeOfTheColumn) {
  MessageColumns other = answer();
  other.f64("linear_velocity")[1] = 0.5;  // of 8
  EXPECT_TRUE(differ(0.0, answer(), other));
  EXPECT_TRUE(differ(0.0624, answer(), other));
  EXPECT_FALSE(differ(0.0625, answer(), other));
  EXPECT_FALSE(differ(0.0625, other, answer()));
  // the first that is too far apart
  other.f64("linear_velocity")[4] = -2.0;
  Comparison comparison = within(0.0625);
  const auto first = comparison.add(kSolve, answer().column_bytes(), other.column_bytes());
  ASSERT_TRUE(first);
  EXPECT_EQ(first->number, 4U);
}

// What rests is held against how it moved, whether that was compared or counted in.
TEST(Comparison, MagnitudesAreThoseOfAllCalls) {
  MessageColumns fast = answer(), noise = answer();
  fast.f64("angular_velocity")[0] = 4.0;
  noise.f64("angular_velocity")[0] = 1.0;
  EXPECT_TRUE(differ(0.25, answer(), noise));
  Comparison compared = within(0.25);
  EXPECT_FALSE(differ(&compared, fast, fast)) << "the same bytes";
  EXPECT_TRUE(differ(&compared, answer(), fast));
  EXPECT_FALSE(differ(&compared, answer(), noise));
  Comparison counted = within(0.25);
  counted.count_in(stage::method_info(kSolve).reply, fast.column_bytes());
  EXPECT_FALSE(differ(&counted, answer(), noise));
}

TEST(Comparison, ZeroIsBitForBit) {
  MessageColumns other = answer();
  other.f64("angular_velocity")[2] = -0.0;
  EXPECT_TRUE(differ(0.0, answer(), other));
  EXPECT_FALSE(differ(std::numeric_limits<double>::min(), answer(), other));
}

TEST(Comparison, WhatIsNoNumberIsFarFromAllNumbers) {
  for (const double bad : {std::numeric_limits<double>::quiet_NaN(), std::numeric_limits<double>::infinity()}) {
    MessageColumns other = answer();
    other.f64("linear_velocity")[5] = bad;
    other.f64("linear_velocity")[0] = 8.5;
    EXPECT_TRUE(differ(1e9, answer(), other));
    Comparison comparison;
    EXPECT_TRUE(differ(&comparison, answer(), other));
    EXPECT_EQ(comparison.disagreements[0].largest, std::numeric_limits<double>::infinity());
    EXPECT_EQ(comparison.disagreements[0].largest_row, 1U);
  }
}

// How a solver got there is told, and is no difference where numbers need not be the same.
TEST(Comparison, ScalarsTellOfTheWork) {
  MessageColumns other = answer();
  other.u32("iterations")[0] = 7;
  other.f64("residual")[0] = 1e-3;
  EXPECT_TRUE(differ(0.0, answer(), other));
  Comparison comparison = within(1e-12);
  EXPECT_FALSE(differ(&comparison, answer(), other));
  ASSERT_EQ(comparison.disagreements.size(), 2U);
  EXPECT_EQ(comparison.disagreements[0].relative, 0.0) << "of an integer";
}

TEST(Comparison, IntegersAndNumbersOfRowsAreToBeTheSame) {
  constexpr stage::Method kPairs = stage::Method::kSpacePairs;
  const auto pairs = [](const std::vector<std::uint32_t>& numbers) {
    MessageColumns columns(stage::method_info(kPairs).reply);
    columns.u32("pair") = numbers;
    return columns;
  };
  Comparison comparison = within(1.0);
  const MessageColumns one = pairs({0, 1, 0, 2}), two = pairs({0, 1, 0, 3}), three = pairs({0, 1});
  const auto other = comparison.add(kPairs, one.column_bytes(), two.column_bytes());
  ASSERT_TRUE(other);
  EXPECT_EQ(other->number, 3U);
  const auto shorter = comparison.add(kPairs, one.column_bytes(), three.column_bytes());
  ASSERT_TRUE(shorter);
  EXPECT_FALSE(shorter->number);
  ASSERT_EQ(comparison.disagreements.size(), 1U);
  EXPECT_EQ(comparison.disagreements[0].largest_row, 1U);
  EXPECT_EQ(comparison.disagreements[0].other_counts, 1U);
}

}  // namespace
}  // namespace gravitas
