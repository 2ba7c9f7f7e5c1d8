// The stored logarithms and arctangents, derived again from their series in quadruple precision.
#include "plugin_sdk/math/transcendental_tables.h"

#include <gtest/gtest.h>

#include <cmath>
#include <iterator>

namespace gravitas::math {
namespace {

// 113 bits, so that a pair of doubles is compared to some 2^-100 of its value.
__extension__ typedef __float128 Quad;

double magnitude(Quad v) { return std::fabs(static_cast<double>(v)); }

// log r = 2 artanh((r-1)/(r+1)), |r - 1| < 1/2: each term is at least 9 times the next.
Quad log_by_series(Quad r) {
  const Quad s = (r - 1) / (r + 1);
  Quad power = s;
  Quad total = 0;
  for (int n = 1; n < 120; n += 2) {
    total += power / n;
    power *= s * s;
  }
  return 2 * total;
}

// Euler's series, whose terms at least halve for |x| <= 1.
Quad atan_by_series(Quad x) {
  const Quad ratio = x * x / (1 + x * x);
  Quad term = x / (1 + x * x);
  Quad total = 0;
  for (int n = 1; n < 240; ++n) {
    total += term;
    term *= ratio * (2 * n) / (2 * n + 1);
  }
  return total;
}

TEST(TranscendentalTables, LogarithmsAreThoseOfTheReciprocals) {
  ASSERT_EQ(std::size(kLogTable), 65u);
  for (int i = 0; i < 65; ++i) {
    const LogRow& row = kLogTable[i];
    const double c = (1.0 + i / 64.0) * (i >= kLogHalvedFrom ? 0.5 : 1.0);
    EXPECT_EQ(std::ldexp(row.reciprocal, 20), std::floor(std::ldexp(1.0 / c, 20) + 0.5)) << i;
    EXPECT_EQ(std::ldexp(row.log_hi, 42), std::floor(std::ldexp(row.log_hi, 42))) << i;
    const Quad exact = -log_by_series(row.reciprocal);
    const Quad stored = static_cast<Quad>(row.log_hi) + row.log_lo;
    // log_lo is rounded to 53 bits below 2^-43
    EXPECT_LE(magnitude(stored - exact), 0x1p-95) << i;
  }
  // nothing is added next to 1, from either side
  for (const int i : {0, 64}) {
    EXPECT_EQ(kLogTable[i].reciprocal, 1.0);
    EXPECT_EQ(kLogTable[i].log_hi, 0.0);
    EXPECT_EQ(kLogTable[i].log_lo, 0.0);
  }
}

TEST(TranscendentalTables, ArctangentsAreThoseOfEighths) {
  ASSERT_EQ(std::size(kAtanTable), 9u);
  for (int k = 0; k < 9; ++k) {
    const Quad exact = atan_by_series(static_cast<Quad>(k) / 8);
    const Quad stored = static_cast<Quad>(kAtanTable[k].hi) + kAtanTable[k].lo;
    // lo is rounded to 53 bits below 2^-54
    EXPECT_LE(magnitude(stored - exact), 0x1p-106) << k;
  }
}

}  // namespace
}  // namespace gravitas::math
