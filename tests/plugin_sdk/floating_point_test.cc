// The floating-point control word: read, set, and free of the flags that every operation leaves.
#include "plugin_sdk/floating_point.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <immintrin.h>

#include <limits>

namespace gravitas {
namespace {

constexpr std::uint32_t kFlushToZero = 1U << 15;

// Puts the control word back at the end of a test.
class FloatingPoint : public testing::Test {
 protected:
  ~FloatingPoint() override { set_floating_point_control(before_); }
  const std::uint32_t before_ = floating_point_control();
};

// At run time, under the control word of the moment.
double half_of(double number) {
  volatile double dividend = number;
  return dividend / 2.0;
}

TEST_F(FloatingPoint, ControlIsThatOfTheProcessor) {
  // round to nearest, no flushing, all exceptions masked: what the C library starts with
  EXPECT_EQ(floating_point_control(), 0x1F80U);
}

TEST_F(FloatingPoint, ControlIsFreeOfStickyFlags) {
  volatile double zero = 0.0;
  volatile double infinity = 1.0 / zero;
  EXPECT_EQ(infinity, std::numeric_limits<double>::infinity());
  EXPECT_NE(_mm_getcsr() & 0x3FU, 0U);  // the division left its flag
  EXPECT_EQ(floating_point_control(), before_);
}

TEST_F(FloatingPoint, SettingFlushesAndRestores) {
  const double smallest = std::numeric_limits<double>::min();
  EXPECT_GT(half_of(smallest), 0.0);
  set_floating_point_control(before_ | kFlushToZero);
  EXPECT_EQ(floating_point_control(), before_ | kFlushToZero);
  EXPECT_EQ(half_of(smallest), 0.0);
  set_floating_point_control(before_);
  EXPECT_EQ(floating_point_control(), before_);
  EXPECT_GT(half_of(smallest), 0.0);
}

TEST_F(FloatingPoint, SettingRaisesNoFlag) {
  set_floating_point_control(before_ | 0x3FU);
  EXPECT_EQ(_mm_getcsr() & 0x3FU, 0U);
}

TEST_F(FloatingPoint, NamesTheLibraryAndTheProcessor) {
  EXPECT_THAT(c_library(), testing::MatchesRegex("glibc [0-9]+\\.[0-9]+.*"));
  // this test runs, so the processor has what the build needs
  EXPECT_EQ(missing_cpu_features(), "");
  EXPECT_THAT(cpu_features(), testing::IsSupersetOf({"avx2", "fma", "bmi2"}));
}

}  // namespace
}  // namespace gravitas
