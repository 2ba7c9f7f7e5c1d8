// Checks of answers: what is wrong is found, at its place, and what is right passes.
#include "plugin_sdk/checks.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <string>
#include <vector>

#include "schemas/stage_frames.h"

namespace gravitas {
namespace {

constexpr double kInfinite = std::numeric_limits<double>::infinity();

TEST(FirstNotFinite, FindsTheFirst) {
  std::vector<double> numbers(100, 1.0);
  EXPECT_EQ(first_not_finite(numbers), kNoRow);
  EXPECT_EQ(first_not_finite({}), kNoRow);
  for (const double bad : {kInfinite, -kInfinite, std::nan(""), -std::nan("1")}) {
    for (const std::size_t place : {0U, 37U, 99U}) {
      std::vector<double> spoiled = numbers;
      spoiled[place] = bad;
      EXPECT_EQ(first_not_finite(spoiled), place);
      spoiled[99] = bad;
      EXPECT_EQ(first_not_finite(spoiled), place);
    }
  }
}

TEST(FirstNotFinite, PassesTheLargestAndSmallestNumbers) {
  using Limits = std::numeric_limits<double>;
  EXPECT_EQ(first_not_finite(
                std::vector<double>{Limits::max(), Limits::lowest(), Limits::min(), Limits::denorm_min(), 0.0, -0.0}),
            kNoRow);
}

TEST(FirstNotUnit, FindsTheFirstRowWithAnotherNorm) {
  const std::vector<double> good = {1, 0, 0, 0, 0.5, 0.5, -0.5, 0.5, 0, 0, -1, 0};
  EXPECT_EQ(first_not_unit(good, 4), kNoRow);
  std::vector<double> bad = good;
  bad[10] = -1.001;
  EXPECT_EQ(first_not_unit(bad, 4), 2U);
  bad[5] = 0.51;
  EXPECT_EQ(first_not_unit(bad, 4), 1U);
  EXPECT_EQ(first_not_unit(std::vector<double>{0, 0, 0}, 3), 0U);
  EXPECT_EQ(first_not_unit(std::vector<double>{0, 1, 0, 0, std::nan(""), 1}, 3), 1U);
  EXPECT_EQ(first_not_unit(std::vector<double>{kInfinite, 0, 0}, 3), 0U);
  EXPECT_EQ(first_not_unit({}, 3), kNoRow);
}

TEST(FirstNotUnit, AllowsRoundingButNoMore) {
  const auto row = [](double squared_norm) { return std::vector<double>{0.0, std::sqrt(squared_norm), 0.0}; };
  EXPECT_EQ(first_not_unit(row(1.0 + 0.9 * kUnitTolerance), 3), kNoRow);
  EXPECT_EQ(first_not_unit(row(1.0 - 0.9 * kUnitTolerance), 3), kNoRow);
  EXPECT_EQ(first_not_unit(row(1.0 + 1.1 * kUnitTolerance), 3), 0U);
  EXPECT_EQ(first_not_unit(row(1.0 - 1.1 * kUnitTolerance), 3), 0U);
}

// ---- rows ---------------------------------------------------------------------------------------

using Counts = std::vector<std::uint64_t>;

const stage::MethodInfo& info(stage::Method method) { return stage::method_info(method); }

// Space.Pairs of three bodies with the given number of elements in `pair`.
std::string check_pairs(std::uint64_t pair) {
  return check_rows(info(stage::Method::kSpacePairs), Counts{9, 9, 3, 3, 3}, Counts{pair});
}

TEST(CheckRows, PassesWholeRows) {
  EXPECT_EQ(check_pairs(0), "");
  EXPECT_EQ(check_pairs(8), "");
}

TEST(CheckRows, WantsWholeRows) { EXPECT_EQ(check_pairs(3), "column pair has 3 elements, not a whole number of rows"); }

TEST(CheckRows, WantsEqualColumns) {
  const stage::MethodInfo& pairs = info(stage::Method::kSpacePairs);
  EXPECT_EQ(check_rows(pairs, Counts{9, 6, 3, 3, 3}, Counts{0}), "column upper has 2 rows, expected 3 (one per body)");
  EXPECT_EQ(check_rows(pairs, Counts{9, 9, 3, 3, 4}, Counts{0}),
            "column filter_mask has 4 rows, expected 3 (one per body)");
}

// Constraint.Bind of two joints on one body: bound_begin has one row more.
std::string check_bind(std::uint64_t bound_begin, std::uint64_t bound) {
  return check_rows(info(stage::Method::kConstraintBind), Counts{2, 4, 3, 6, 3, 4, 2}, Counts{bound_begin, bound});
}

TEST(CheckRows, HoldsAReplyAgainstTheRowsOfItsRequest) {
  EXPECT_EQ(check_bind(3, 12), "");
  EXPECT_EQ(check_bind(4, 12), "column bound_begin has 4 rows, expected 3 (one per constraint+1)");
}

TEST(CheckRows, WantsTheExtraRow) {
  EXPECT_EQ(check_bind(0, 12), "column bound_begin has 0 elements, not a whole number of rows");
}

TEST(CheckRows, WantsSingleValues) {
  using Reply = stage::IntegratorIntegrateReply;
  const stage::MethodInfo& integrate = info(stage::Method::kIntegratorIntegrate);
  const Counts request = {1, 1, 1, 2, 2, 6, 6, 2, 12, 6, 8, 6, 6, 0, 2};
  Counts reply = {6, 8, 6, 6, 1, 0};
  EXPECT_EQ(check_rows(integrate, request, reply), "");
  for (const std::uint64_t count : {0U, 2U}) {
    reply[Reply::kErrorEstimate] = count;
    EXPECT_EQ(check_rows(integrate, request, reply),
              "column error_estimate must be one value, has " + std::to_string(count));
  }
  reply[Reply::kErrorEstimate] = 1;
  reply[Reply::kPosition] = 3;
  EXPECT_EQ(check_rows(integrate, request, reply), "column position has 1 row, expected 2 (one per body)");
}

TEST(RowCheck, FindsEachTimeWhatCheckRowsFinds) {
  RowCheck rows;
  const Counts request{9, 9, 3, 3, 3}, other{6, 6, 2, 2, 2}, uneven{9, 6, 3, 3, 3};
  const auto problem = [&](const Counts& asked, const Counts& answered) {
    return rows.check(stage::Method::kSpacePairs, asked, answered);
  };
  EXPECT_NE(problem(uneven, {0}), "");
  EXPECT_NE(problem(uneven, {0}), "");
  for (int i = 0; i < 2; ++i) EXPECT_EQ(problem(request, {8}), "");
  EXPECT_NE(problem(request, {3}), "");
  EXPECT_NE(problem(uneven, {8}), "");
  EXPECT_EQ(problem(other, {8}), "");
  EXPECT_EQ(problem(request, {8}), "");
  // a scalar that is missing where nothing has passed yet
  EXPECT_NE(rows.check(stage::Method::kIntegratorIntegrate, Counts(15, 0), Counts(6, 0)), "");
}

}  // namespace
}  // namespace gravitas
