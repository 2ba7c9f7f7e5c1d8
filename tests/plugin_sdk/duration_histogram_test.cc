#include "plugin_sdk/duration_histogram.h"

#include <gtest/gtest.h>

namespace gravitas {
namespace {

TEST(DurationHistogram, KnowsQuantilesToFourPerCent) {
  DurationHistogram histogram;
  for (std::uint64_t ns = 1; ns <= 100'000; ++ns) histogram.add(ns);
  EXPECT_EQ(histogram.count(), 100'000U);
  EXPECT_NEAR(histogram.quantile_us(0.5), 50.0, 0.04 * 50.0);
  EXPECT_NEAR(histogram.quantile_us(0.99), 99.0, 0.04 * 99.0);
  EXPECT_DOUBLE_EQ(histogram.max_us(), 100.0);
  EXPECT_NEAR(histogram.mean_us(), 50.0005, 1e-9);
}

TEST(DurationHistogram, IsExactForSmallAndKeepsLargeDurations) {
  DurationHistogram small, large;
  small.add(7);
  EXPECT_DOUBLE_EQ(small.quantile_us(0.5), 0.007);
  // no quantile is above the largest, wherever in its bucket that lies
  DurationHistogram one;
  one.add(381'358);
  EXPECT_LE(one.quantile_us(0.99), one.max_us());
  large.add(3'600'000'000'000);
  EXPECT_NEAR(large.quantile_us(0.5), 3.6e9, 0.04 * 3.6e9);
  EXPECT_EQ(DurationHistogram().quantile_us(0.5), 0.0);
  DurationHistogram largest;
  largest.add(~std::uint64_t{0});
  EXPECT_NEAR(largest.quantile_us(0.5), 1.8447e16, 0.04 * 1.8447e16);
}

}  // namespace
}  // namespace gravitas
