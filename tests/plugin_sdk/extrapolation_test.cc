// Results in 1, 2, 3, … pieces, and what they tend to.
#include "plugin_sdk/extrapolation.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <numbers>
#include <span>
#include <vector>

namespace gravitas {
namespace {

double add(Extrapolation* extrapolation, const std::vector<double>& numbers, double scale = 1.0) {
  for (const double number : numbers) extrapolation->put(number, scale);
  return extrapolation->add();
}

// c0 + c1 h + c2 h^2 + c3 h^3 is known from four results.
TEST(Extrapolation, IsExactForPolynomialsInTheStep) {
  Extrapolation extrapolation;
  extrapolation.begin();
  for (int pieces = 1; pieces <= 4; ++pieces) {
    const double h = 1.0 / pieces;
    add(&extrapolation, {3.0 + h * (2.0 + h * (-5.0 + h)), -1.0 + 4.0 * h});
    if (pieces == 1) continue;
    EXPECT_NEAR(extrapolation.best()[1], -1.0, 1e-15) << pieces;
  }
  EXPECT_NEAR(extrapolation.best()[0], 3.0, 1e-14);
}

// Euler's method for y' = y over 1/4: k results make it one of order k, and its error is what it is estimated to be.
TEST(Extrapolation, RaisesTheOrderByOneAResult) {
  const auto solve = [](double length, int results, double* estimate) {
    Extrapolation extrapolation;
    extrapolation.begin();
    for (int pieces = 1; pieces <= results; ++pieces)
      *estimate = add(&extrapolation, {std::pow(1.0 + length / pieces, pieces)});
    return std::fabs(extrapolation.best()[0] - std::exp(length));
  };
  for (int results = 2; results <= 5; ++results) {
    double estimate = 0.0;
    const double fine = solve(0.125, results, &estimate), coarse = solve(0.25, results, &estimate);
    // of one step: an order more
    EXPECT_NEAR(std::log2(coarse / fine), results + 1.0, 0.25) << results;
    EXPECT_LT(coarse, estimate);
    EXPECT_GT(coarse, 1e-3 * estimate);
  }
}

// The first result, and then the first two, are off as none of the others: they have no part in what is found.
TEST(Extrapolation, LeavesOutWhatIsOffAtTheBeginning) {
  for (const int off : {1, 2}) {
    Extrapolation extrapolation;
    extrapolation.begin();
    double error = 0.0;
    for (int pieces = 1; pieces <= 6; ++pieces) {
      const double h = 1.0 / pieces;
      error = add(&extrapolation, {3.0 + h * (2.0 - 5.0 * h) + (pieces <= off ? 1e-3 : 0.0), -1.0 + 4.0 * h});
    }
    EXPECT_LT(error, 1e-13) << off;
    EXPECT_NEAR(extrapolation.best()[0], 3.0, 1e-13) << off;
    EXPECT_NEAR(extrapolation.best()[1], -1.0, 1e-13) << off;
  }
}

// With weights of what is told in 1, 2, 3, ... pieces, the first ones left out or not.
TEST(Extrapolation, IsTheWeightedSumOfResults) {
  for (const int off : {0, 2}) {
    Extrapolation extrapolation;
    extrapolation.begin();
    std::vector<double> results;
    for (int pieces = 1; pieces <= 6; ++pieces) {
      const double h = 1.0 / pieces;
      results.push_back(3.0 + h * (2.0 - 5.0 * h) + (pieces <= off ? 1e-3 : 0.0));
      add(&extrapolation, {results.back()});
      const std::span<const double> weights = extrapolation.weights();
      ASSERT_EQ(weights.size(), results.size());
      double sum = 0.0, all = 0.0, size = 0.0;
      for (std::size_t n = 0; n < weights.size(); ++n) {
        sum += weights[n] * results[n], all += weights[n];
        size += std::fabs(weights[n] * results[n]);
      }
      // rounding of each product, in either way
      const double bound = 4.0 * std::numeric_limits<double>::epsilon() * size;
      EXPECT_NEAR(all, 1.0, bound);
      EXPECT_NEAR(sum, extrapolation.best()[0], bound) << off << ' ' << pieces;
    }
    EXPECT_EQ(extrapolation.weights()[0] == 0.0, off > 0);
  }
}

// The last two are one, and say no more than that.
TEST(Extrapolation, BelievesNoTwoThatAgreeByChance) {
  Extrapolation extrapolation;
  extrapolation.begin();
  add(&extrapolation, {1.0});
  add(&extrapolation, {2.0});
  EXPECT_GT(add(&extrapolation, {2.0}), 0.4);
}

TEST(Extrapolation, KnowsWhatTendsToNothing) {
  for (const double limit : {0.0, 1e-3}) {
    Extrapolation extrapolation;
    extrapolation.begin();
    for (int pieces = 1; pieces <= 5; ++pieces) {
      const double h = 1.0 / pieces;
      add(&extrapolation, {limit + h * (2.0 - h) + (pieces == 1 ? 0.1 : 0.0), h});
    }
    EXPECT_NEAR(extrapolation.least_size(), limit, 1e-14);
  }
}

TEST(Extrapolation, MeasuresErrorsByTheirScale) {
  Extrapolation extrapolation;
  extrapolation.begin();
  EXPECT_EQ(add(&extrapolation, {1.0}, 4.0), std::numeric_limits<double>::infinity());
  // T_{2,1} = 3, T_{2,2} = 5
  EXPECT_DOUBLE_EQ(add(&extrapolation, {3.0}, 4.0), 0.5);
  EXPECT_EQ(extrapolation.best()[0], 5.0);
}

TEST(Extrapolation, LeavesWhatDoesNotChangeAsItIsToTheBit) {
  Extrapolation extrapolation;
  extrapolation.begin();
  for (int pieces = 1; pieces <= 8; ++pieces) {
    const double error = add(&extrapolation, {0.1, std::numbers::pi, -1e300, 0.0});
    EXPECT_EQ(error, pieces == 1 ? std::numeric_limits<double>::infinity() : 0.0);
  }
  EXPECT_EQ(extrapolation.best()[0], 0.1);
  EXPECT_EQ(extrapolation.best()[1], std::numbers::pi);
  EXPECT_EQ(extrapolation.best()[2], -1e300);
  EXPECT_EQ(extrapolation.best()[3], 0.0);
}

TEST(Extrapolation, BelievesNoNumberThatOverflows) {
  Extrapolation extrapolation;
  extrapolation.begin();
  add(&extrapolation, {1.5e308});
  EXPECT_EQ(add(&extrapolation, {-1.5e308}), std::numeric_limits<double>::infinity());
  extrapolation.begin();
  add(&extrapolation, {1.0});
  EXPECT_EQ(add(&extrapolation, {1.0}), 0.0);  // nothing of before is left
}

}  // namespace
}  // namespace gravitas
