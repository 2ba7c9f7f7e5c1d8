// What a report takes from what was counted, by hand.
#include "services/run/report.h"

#include <gtest/gtest.h>

#include "tests/kernel/world_builder.h"

namespace gravitas {
namespace {

// A call that was refused has no times: the mean is that of the others.
TEST(Report, AComparisonTellsTheMeanOfTheCallsThatWereAnswered) {
  const kernel::Environment world(harness::WorldBuilder().description());
  Comparison comparison;
  comparison.calls = 4;
  comparison.differing_calls = comparison.refused_calls = 2;
  comparison.first_ns = 6000, comparison.second_ns = 10'000;
  report::v1::Comparison message;
  write_comparison(comparison, world, &message);
  EXPECT_EQ(message.from_us(), 3.0);
  EXPECT_EQ(message.to_us(), 5.0);
  comparison.refused_calls = 4, comparison.first_ns = comparison.second_ns = 0;
  write_comparison(comparison, world, &message);
  EXPECT_EQ(message.from_us(), 0.0);
}

}  // namespace
}  // namespace gravitas
