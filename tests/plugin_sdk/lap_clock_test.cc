#include "plugin_sdk/lap_clock.h"

#include <gtest/gtest.h>

namespace gravitas {
namespace {

// However often this test is put aside: each look at the one clock lies between two at the other.
TEST(LapClock, GoesWithTheClockOfTheSystem) {
  constexpr std::uint64_t kWatchedNs = 20'000'000;
  lap_ns();
  const std::uint64_t before = channel::now_ns(), start = lap_ns(), after = channel::now_ns();
  while (channel::now_ns() - after < kWatchedNs) {
  }
  const std::uint64_t before_end = channel::now_ns(), end = lap_ns(), after_end = channel::now_ns();
  const auto lap = static_cast<double>(lap_between(start, end));
  EXPECT_GE(lap, 0.999 * static_cast<double>(before_end - after));
  EXPECT_LE(lap, 1.001 * static_cast<double>(after_end - before));
}

TEST(LapClock, ACounterThatIsBehindMakesNoLap) {
  EXPECT_EQ(lap_between(7, 5), 0U);
  EXPECT_EQ(lap_between(5, 7), 2U);
}

}  // namespace
}  // namespace gravitas
