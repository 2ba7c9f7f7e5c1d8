// Accuracy, special values, symmetries and fixed bits of the transcendental functions. The
// reference is the C library's long double, whose 64-bit mantissa resolves 2^-11 ulp of a double;
// samples come from a fixed sequence of integers, so every run tests the same arguments.
#include "plugin_sdk/math/transcendental.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstdint>
#include <functional>
#include <limits>
#include <string>

namespace gravitas::math {
namespace {

constexpr double kInf = std::numeric_limits<double>::infinity();
constexpr double kNaN = std::numeric_limits<double>::quiet_NaN();
constexpr double kMax = std::numeric_limits<double>::max();
constexpr double kLeast = std::numeric_limits<double>::denorm_min();

// SplitMix64: the same numbers from every compiler and library.
class Samples {
 public:
  explicit Samples(std::uint64_t seed) : state_(seed) {}
  std::uint64_t bits() {
    state_ += 0x9e3779b97f4a7c15ULL;
    std::uint64_t z = state_;
    z = (z ^ (z >> 30)) * 0xbf58476d1ce4e5b9ULL;
    z = (z ^ (z >> 27)) * 0x94d049bb133111ebULL;
    return z ^ (z >> 31);
  }
  double uniform(double a, double b) { return a + (b - a) * (static_cast<double>(bits() >> 11) * 0x1p-53); }
  int integer(int a, int b) { return a + static_cast<int>(bits() % static_cast<std::uint64_t>(b - a + 1)); }
  // any finite double, every exponent alike
  double any() {
    for (;;) {
      const auto value = std::bit_cast<double>(bits());
      if (std::isfinite(value)) return value;
    }
  }
  // both signs, exponents evenly between the two
  double magnitude(int least_exponent, int greatest_exponent) {
    const int exponent = integer(least_exponent, greatest_exponent);
    const double size = std::ldexp(uniform(0.5, 1.0), exponent);
    return (bits() & 1) != 0 ? size : -size;
  }

 private:
  std::uint64_t state_;
};

// The error of a result in units in the last place of the exact value.
double ulps(double got, long double exact) {
  const auto nearest = static_cast<double>(exact);
  if (std::isinf(nearest)) return got == nearest ? 0.0 : kInf;
  const int last_place = exact == 0.0L ? -1074 : std::max(std::ilogb(exact) - 52, -1074);
  return static_cast<double>(std::ldexp(std::fabs(static_cast<long double>(got) - exact), -last_place));
}

using Function = double (*)(double);
using Reference = long double (*)(long double);

void expect_accurate(const std::string& name, Function function, Reference reference, double bound,
                     const std::function<double(Samples&)>& draw, int count = 40000) {
  Samples samples(7);
  double worst = 0.0;
  double worst_at = 0.0;
  for (int i = 0; i < count; ++i) {
    const double x = draw(samples);
    const double error = ulps(function(x), reference(static_cast<long double>(x)));
    if (!(error <= worst)) {
      worst = error;
      worst_at = x;
    }
  }
  EXPECT_LE(worst, bound) << name << " at " << std::hexfloat << worst_at;
}

bool same_bits(double a, double b) { return std::bit_cast<std::uint64_t>(a) == std::bit_cast<std::uint64_t>(b); }

#define EXPECT_BITS(expression, expected)                                              \
  EXPECT_TRUE(same_bits(expression, expected))                                         \
      << #expression << " = " << std::hexfloat << (expression) << ", not " << double { \
    expected                                                                           \
  }

double small_angle(Samples& s) { return s.uniform(-4.0, 4.0); }
double moderate_angle(Samples& s) { return s.uniform(-1e6, 1e6); }
double any_angle(Samples& s) { return s.any(); }
double any_size(Samples& s) { return s.magnitude(-60, 30); }
double near_quarter_turn(Samples& s) {
  const long double quarter = 1.57079632679489661923132169163975144L;
  return static_cast<double>(quarter * static_cast<long double>(std::floor(s.magnitude(0, 50))));
}

TEST(Transcendental, SineCosineTangentAreAccurateAtEverySize) {
  const struct {
    const char* name;
    double (*draw)(Samples&);
  } kinds[] = {{"small", small_angle},
               {"moderate", moderate_angle},
               {"any", any_angle},
               {"any size", any_size},
               {"near multiples of pi/2", near_quarter_turn}};
  for (const auto& kind : kinds) {
    expect_accurate(std::string("sin, ") + kind.name, sin, std::sin, 0.60, kind.draw);
    expect_accurate(std::string("cos, ") + kind.name, cos, std::cos, 0.60, kind.draw);
    expect_accurate(std::string("tan, ") + kind.name, tan, std::tan, 0.66, kind.draw);
  }
}

// Each exponent reads its own window of the stored bits of 2/pi.
TEST(Transcendental, ReductionReadsTheRightBitsForEveryExponent) {
  Samples samples(11);
  for (int exponent = -10; exponent <= 1023; ++exponent) {
    for (int i = 0; i < 8; ++i) {
      const double x = std::ldexp(samples.uniform(1.0, 2.0), exponent);
      const long double reference = x;
      ASSERT_LE(ulps(sin(x), std::sin(reference)), 0.60) << std::hexfloat << x;
      ASSERT_LE(ulps(cos(x), std::cos(reference)), 0.60) << std::hexfloat << x;
    }
  }
}

// The double closest to a multiple of pi/2: reference digits from 1400-bit arithmetic.
TEST(Transcendental, HardestReductionKeepsAllDigits) {
  const double x = std::ldexp(6381956970095103.0, 797);
  EXPECT_BITS(cos(x), -0x1.14ae72e6ba22fp-61);
  EXPECT_BITS(sin(x), 1.0);
  EXPECT_LE(ulps(tan(x), -0x1.d9ba9a7975636p+60L), 1.0);
}

TEST(Transcendental, SincosHasTheBitsOfSinAndCos) {
  Samples samples(3);
  for (int i = 0; i < 20000; ++i) {
    const double x = (i & 1) != 0 ? samples.any() : samples.uniform(-10.0, 10.0);
    const SinCos both = sincos(x);
    ASSERT_TRUE(same_bits(both.sin, sin(x)) && same_bits(both.cos, cos(x))) << std::hexfloat << x;
  }
}

TEST(Transcendental, InverseFunctionsAreAccurate) {
  const auto unit = [](Samples& s) { return s.uniform(-1.0, 1.0); };
  const auto near_one = [](Samples& s) {
    const double size = 1.0 - std::fabs(s.magnitude(-50, 0));
    return (s.bits() & 1) != 0 ? size : -size;
  };
  const auto tiny = [](Samples& s) { return s.magnitude(-80, 0); };
  for (const std::function<double(Samples&)>& draw :
       {std::function<double(Samples&)>(unit), std::function<double(Samples&)>(near_one),
        std::function<double(Samples&)>(tiny)}) {
    expect_accurate("asin", asin, std::asin, 0.51, draw);
    expect_accurate("acos", acos, std::acos, 0.51, draw);
    expect_accurate("atan", atan, std::atan, 0.51, draw);
  }
  expect_accurate("atan, any", atan, std::atan, 0.51, any_angle);
  expect_accurate("atan, any size", atan, std::atan, 0.51, any_size);
}

TEST(Transcendental, Atan2IsAccurateInAllQuadrantsAndSizes) {
  Samples samples(5);
  for (int i = 0; i < 90000; ++i) {
    double x = samples.any();
    double y = samples.any();
    if (i % 3 == 0) {
      x = samples.uniform(-1.0, 1.0);
      y = samples.uniform(-1.0, 1.0);
    } else if (i % 3 == 1) {
      y = 0x1p-60 * x * samples.magnitude(0, 119);
    }
    if (!std::isfinite(y)) continue;
    const long double exact = std::atan2(static_cast<long double>(y), static_cast<long double>(x));
    ASSERT_LE(ulps(atan2(y, x), exact), 0.51) << std::hexfloat << y << ", " << x;
  }
}

TEST(Transcendental, ExponentialsAreAccurate) {
  const auto whole = [](Samples& s) { return s.uniform(-708.0, 709.7); };
  const auto unit = [](Samples& s) { return s.uniform(-1.0, 1.0); };
  const auto tiny = [](Samples& s) { return s.magnitude(-60, 0); };
  const auto subnormal = [](Samples& s) { return s.uniform(-745.13, -708.4); };
  expect_accurate("exp", exp, std::exp, 0.54, whole);
  expect_accurate("exp, unit", exp, std::exp, 0.54, unit);
  expect_accurate("exp, tiny", exp, std::exp, 0.54, tiny);
  // the sum rounds once as a normal number and once more to the subnormal grid
  expect_accurate("exp, subnormal", exp, std::exp, 0.80, subnormal);
  expect_accurate("expm1", expm1, std::expm1, 0.64, whole);
  expect_accurate("expm1, small", expm1, std::expm1, 0.64, small_angle);
  expect_accurate("expm1, unit", expm1, std::expm1, 0.64, unit);
  expect_accurate("expm1, tiny", expm1, std::expm1, 0.64, tiny);
}

TEST(Transcendental, LogarithmsAreAccurate) {
  const auto positive = [](Samples& s) { return std::fabs(s.any()); };
  const auto moderate = [](Samples& s) { return s.uniform(0.0, 2.5); };
  const auto near_one = [](Samples& s) { return 1.0 + s.magnitude(-51, -1); };
  const auto subnormal = [](Samples& s) { return std::bit_cast<double>((s.bits() >> 12 >> s.integer(0, 50)) + 1); };
  expect_accurate("log", log, std::log, 0.501, positive);
  expect_accurate("log, moderate", log, std::log, 0.501, moderate);
  expect_accurate("log, near one", log, std::log, 0.501, near_one);
  expect_accurate("log, subnormal", log, std::log, 0.501, subnormal);
  const auto near_minus_one = [](Samples& s) { return std::fabs(s.magnitude(-51, 0)) - 1.0; };
  const auto tiny = [](Samples& s) { return s.magnitude(-60, -1); };
  expect_accurate("log1p", log1p, std::log1p, 0.501, positive);
  expect_accurate("log1p, near -1", log1p, std::log1p, 0.501, near_minus_one);
  expect_accurate("log1p, tiny", log1p, std::log1p, 0.501, tiny);
}

TEST(Transcendental, PowIsAccurate) {
  Samples samples(13);
  for (int i = 0; i < 150000; ++i) {
    double x = samples.uniform(0.0, 10.0);
    double y = samples.uniform(-20.0, 20.0);
    double bound = 0.54;
    if (i % 4 == 1) {
      // the whole range of results, from any base
      x = std::fabs(samples.any());
      y = samples.uniform(-708.0, 709.7) / std::log(x);
    } else if (i % 4 == 2) {
      // bases so near 1 that every digit of the logarithm counts
      x = 1.0 + samples.magnitude(-50, -1);
      y = samples.uniform(-708.0, 709.7) / std::log(x);
    } else if (i % 4 == 3) {
      x = samples.uniform(0.01, 0.9);
      y = samples.uniform(-745.0, -708.5) / std::log(x);
      bound = 0.80;  // a subnormal result is rounded twice
    }
    const long double exact = std::pow(static_cast<long double>(x), static_cast<long double>(y));
    ASSERT_LE(ulps(pow(x, y), exact), bound) << std::hexfloat << x << ", " << y;
  }
}

TEST(Transcendental, PowIsExactWhereTheResultIsADouble) {
  for (int base = 2; base <= 20; ++base) {
    double product = 1.0;
    for (int n = 1; product * base < 0x1p53; ++n) {
      product *= base;
      EXPECT_BITS(pow(base, n), product);
      EXPECT_BITS(pow(-base, n), n % 2 == 0 ? product : -product);
      EXPECT_BITS(pow(product, 1.0), product);
    }
  }
  for (int n = -1074; n <= 1023; ++n) EXPECT_BITS(pow(2.0, n), std::ldexp(1.0, n));
  EXPECT_BITS(pow(0.0625, 0.25), 0.5);
  EXPECT_BITS(pow(1e-300, 1.0), 1e-300);
}

TEST(Transcendental, OddAndEvenFunctionsAreExactlySo) {
  Samples samples(17);
  for (int i = 0; i < 20000; ++i) {
    const double x = (i & 1) != 0 ? samples.any() : samples.magnitude(-30, 20);
    ASSERT_TRUE(same_bits(sin(-x), -sin(x))) << x;
    ASSERT_TRUE(same_bits(cos(-x), cos(x))) << x;
    ASSERT_TRUE(same_bits(tan(-x), -tan(x))) << x;
    ASSERT_TRUE(same_bits(atan(-x), -atan(x))) << x;
    const double u = samples.uniform(-1.0, 1.0);
    ASSERT_TRUE(same_bits(asin(-u), -asin(u))) << u;
    ASSERT_TRUE(same_bits(atan2(-u, x), -atan2(u, x))) << u << ", " << x;
  }
}

TEST(Transcendental, CircularFunctionsKeepZerosAndRefuseInfinities) {
  for (const double zero : {0.0, -0.0}) {
    EXPECT_BITS(sin(zero), zero);
    EXPECT_BITS(tan(zero), zero);
    EXPECT_BITS(asin(zero), zero);
    EXPECT_BITS(atan(zero), zero);
    EXPECT_BITS(cos(zero), 1.0);
    EXPECT_BITS(acos(zero), 0x1.921fb54442d18p+0);
  }
  for (const double x : {kLeast, -kLeast, 1e-310, 1e-200}) {
    EXPECT_BITS(sin(x), x);
    EXPECT_BITS(tan(x), x);
    EXPECT_BITS(asin(x), x);
    EXPECT_BITS(atan(x), x);
    EXPECT_BITS(cos(x), 1.0);
  }
  for (const double x : {kInf, -kInf, kNaN}) {
    EXPECT_TRUE(std::isnan(sin(x)) && std::isnan(cos(x)) && std::isnan(tan(x))) << x;
    EXPECT_TRUE(std::isnan(asin(x)) && std::isnan(acos(x))) << x;
  }
  EXPECT_TRUE(std::isnan(asin(0x1.0000000000001p+0)) && std::isnan(acos(-0x1.0000000000001p+0)));
  EXPECT_TRUE(std::isnan(atan(kNaN)));
  EXPECT_BITS(acos(1.0), 0.0);
  EXPECT_BITS(acos(-1.0), 0x1.921fb54442d18p+1);
  EXPECT_BITS(asin(-1.0), -0x1.921fb54442d18p+0);
  EXPECT_BITS(atan(kInf), 0x1.921fb54442d18p+0);
  EXPECT_BITS(atan(-kMax), -0x1.921fb54442d18p+0);
}

TEST(Transcendental, Atan2FollowsAnnexF) {
  const double pi = 0x1.921fb54442d18p+1;
  for (const double sign : {1.0, -1.0}) {
    for (const double x : {0.0, 3.0, kLeast, kInf}) {
      EXPECT_BITS(atan2(sign * 0.0, x), sign * 0.0);
      EXPECT_BITS(atan2(sign * 0.0, -x), sign * pi);
    }
    for (const double y : {kLeast, 2.0, kMax, kInf}) {
      EXPECT_BITS(atan2(sign * y, 0.0), sign * pi / 2);
      EXPECT_BITS(atan2(sign * y, -0.0), sign * pi / 2);
    }
    for (const double y : {kLeast, 2.0, kMax}) {
      EXPECT_BITS(atan2(sign * y, kInf), sign * 0.0);
      EXPECT_BITS(atan2(sign * y, -kInf), sign * pi);
      EXPECT_BITS(atan2(sign * kInf, y), sign * pi / 2);
    }
    EXPECT_BITS(atan2(sign * kInf, kInf), sign * pi / 4);
    EXPECT_BITS(atan2(sign * kInf, -kInf), sign * 0x1.2d97c7f3321d2p+1);
    EXPECT_BITS(atan2(sign * kMax, kMax), sign * pi / 4);
    EXPECT_BITS(atan2(sign * kLeast, kLeast), sign * pi / 4);
    EXPECT_BITS(atan2(sign * kLeast, 4.0), sign * 0.0);
    EXPECT_BITS(atan2(sign * kLeast, kMax), sign * 0.0);
  }
  EXPECT_TRUE(std::isnan(atan2(kNaN, 1.0)) && std::isnan(atan2(0.0, kNaN)));
}

TEST(Transcendental, ExponentialsAndLogarithmsFollowAnnexF) {
  EXPECT_BITS(exp(0.0), 1.0);
  EXPECT_BITS(exp(-0.0), 1.0);
  EXPECT_BITS(exp(kInf), kInf);
  EXPECT_BITS(exp(-kInf), 0.0);
  EXPECT_TRUE(std::isfinite(exp(0x1.62e42fefa39efp+9)));
  EXPECT_BITS(exp(0x1.62e42fefa39f0p+9), kInf);
  EXPECT_BITS(exp(-0x1.74910d52d3051p+9), kLeast);
  EXPECT_BITS(exp(-0x1.74910d52d3052p+9), 0.0);
  for (const double x : {0.0, -0.0, kLeast, -kLeast, 1e-300}) {
    EXPECT_BITS(expm1(x), x);
    EXPECT_BITS(log1p(x), x);
  }
  EXPECT_BITS(expm1(kInf), kInf);
  EXPECT_BITS(expm1(-kInf), -1.0);
  EXPECT_BITS(expm1(-50.0), -1.0);
  EXPECT_BITS(log(1.0), 0.0);
  EXPECT_BITS(log(0.0), -kInf);
  EXPECT_BITS(log(-0.0), -kInf);
  EXPECT_BITS(log(kInf), kInf);
  EXPECT_BITS(log1p(-1.0), -kInf);
  EXPECT_BITS(log1p(kInf), kInf);
  for (const double x : {-kLeast, -1.0, -kInf, kNaN}) EXPECT_TRUE(std::isnan(log(x))) << x;
  for (const double x : {-1.5, -kInf, kNaN}) EXPECT_TRUE(std::isnan(log1p(x))) << x;
  EXPECT_TRUE(std::isnan(exp(kNaN)) && std::isnan(expm1(kNaN)));
}

TEST(Transcendental, PowFollowsAnnexF) {
  for (const double x : {0.0, -0.0, 1.0, -2.5, kInf, -kInf, kNaN}) EXPECT_BITS(pow(x, 0.0), 1.0);
  for (const double y : {0.5, -3.0, kInf, -kInf, kNaN}) EXPECT_BITS(pow(1.0, y), 1.0);
  EXPECT_BITS(pow(-1.0, kInf), 1.0);
  EXPECT_BITS(pow(-1.0, -kInf), 1.0);
  EXPECT_BITS(pow(-1.0, 3.0), -1.0);
  EXPECT_BITS(pow(-1.0, 0x1p60), 1.0);

  EXPECT_BITS(pow(-0.0, -3.0), -kInf);
  EXPECT_BITS(pow(0.0, -3.0), kInf);
  EXPECT_BITS(pow(-0.0, -2.5), kInf);
  EXPECT_BITS(pow(-0.0, 3.0), -0.0);
  EXPECT_BITS(pow(-0.0, 2.0), 0.0);
  EXPECT_BITS(pow(0.0, kInf), 0.0);
  EXPECT_BITS(pow(-0.0, -kInf), kInf);

  EXPECT_BITS(pow(0.5, -kInf), kInf);
  EXPECT_BITS(pow(-0.5, kInf), 0.0);
  EXPECT_BITS(pow(2.0, -kInf), 0.0);
  EXPECT_BITS(pow(-2.0, kInf), kInf);
  EXPECT_BITS(pow(-kInf, -3.0), -0.0);
  EXPECT_BITS(pow(-kInf, -2.0), 0.0);
  EXPECT_BITS(pow(-kInf, 3.0), -kInf);
  EXPECT_BITS(pow(-kInf, 2.5), kInf);
  EXPECT_BITS(pow(kInf, -0.5), 0.0);

  EXPECT_BITS(pow(10.0, 400.0), kInf);
  EXPECT_BITS(pow(-10.0, 401.0), -kInf);
  EXPECT_BITS(pow(10.0, -400.0), 0.0);
  EXPECT_BITS(pow(-10.0, -401.0), -0.0);
  EXPECT_BITS(pow(0x1.0000000000001p+0, 1e300), kInf);
  EXPECT_BITS(pow(0x1.fffffffffffffp-1, 1e300), 0.0);
  EXPECT_BITS(pow(kMax, kLeast), 1.0);
  EXPECT_TRUE(std::isnan(pow(-2.0, 0.5)) && std::isnan(pow(kNaN, 1.0)) && std::isnan(pow(2.0, kNaN)));
}

// Correctly rounded values from 1400-bit arithmetic.
TEST(Transcendental, KnownBits) {
  EXPECT_BITS(sin(1.0), 0x1.aed548f090ceep-1);
  EXPECT_BITS(cos(1.0), 0x1.14a280fb5068cp-1);
  EXPECT_BITS(tan(1.0), 0x1.8eb245cbee3a6p+0);
  EXPECT_BITS(sin(1e22), -0x1.b453ab76bf397p-1);
  EXPECT_BITS(cos(1e22), 0x1.0be2cef01c8f4p-1);
  EXPECT_BITS(sin(kMax), 0x1.452fc98b34e97p-8);
  EXPECT_BITS(cos(kMax), -0x1.fffe62ecfab75p-1);
  EXPECT_BITS(tan(kMax), -0x1.4530cfe729484p-8);
  EXPECT_BITS(asin(0.1), 0x1.9a49276037884p-4);
  EXPECT_BITS(acos(0.1), 0x1.787b22ce3f590p+0);
  EXPECT_BITS(atan(0.1), 0x1.983e282e2cc4dp-4);
  EXPECT_BITS(atan2(1.0, 2.0), 0x1.dac670561bb4fp-2);
  EXPECT_BITS(atan2(-3.0, -4.0), -0x1.3fc176b7a8560p+1);
  EXPECT_BITS(atan2(1.0, -1e-5), 0x1.92205d09ef188p+0);
  EXPECT_BITS(exp(0.1), 0x1.1aec7b35a00d4p+0);
  EXPECT_BITS(exp(1.0), 0x1.5bf0a8b145769p+1);
  EXPECT_BITS(expm1(0.1), 0x1.aec7b35a00d3ap-4);
  EXPECT_BITS(log(0.1), -0x1.26bb1bbb55515p+1);
  EXPECT_BITS(log(2.0), 0x1.62e42fefa39efp-1);
  EXPECT_BITS(log(10.0), 0x1.26bb1bbb55516p+1);
  EXPECT_BITS(log1p(0.1), 0x1.8663f793c46c7p-4);
  EXPECT_BITS(pow(10.0, 0.5), 0x1.94c583ada5b53p+1);
  EXPECT_BITS(pow(1.1, 1000.0), 0x1.6aec8cd64aba1p+137);
  EXPECT_BITS(pow(0.1, 0.3), 0x1.009b9cf334253p-1);
}

// FNV-1a over the results of 20000 arguments each. A change of a single bit anywhere changes every
// recorded trajectory: these digests may change only together with the numerics of a release.
TEST(Transcendental, BitsStayAsTheyAre) {
  const auto digest = [](const std::function<double(Samples&)>& result) {
    Samples samples(2024);
    std::uint64_t hash = 0xcbf29ce484222325ULL;
    for (int i = 0; i < 20000; ++i) {
      hash = (hash ^ std::bit_cast<std::uint64_t>(result(samples))) * 0x100000001b3ULL;
    }
    return hash;
  };
  EXPECT_EQ(digest([](Samples& s) { return sin(s.any()); }), 0x0192c74d56b8e684ULL);
  EXPECT_EQ(digest([](Samples& s) { return cos(s.uniform(-9, 9)); }), 0x88e6ed5cbd8708f2ULL);
  EXPECT_EQ(digest([](Samples& s) { return tan(s.uniform(-9, 9)); }), 0x22ea89414c89532bULL);
  EXPECT_EQ(digest([](Samples& s) { return asin(s.uniform(-1, 1)); }), 0xa010968022a8f1e6ULL);
  EXPECT_EQ(digest([](Samples& s) { return acos(s.uniform(-1, 1)); }), 0x8c3db57b30829189ULL);
  EXPECT_EQ(digest([](Samples& s) { return atan(s.magnitude(-9, 9)); }), 0x249c8e8b9ee35c51ULL);
  EXPECT_EQ(digest([](Samples& s) { return exp(s.uniform(-740, 709)); }), 0x56ade197bd73b4faULL);
  EXPECT_EQ(digest([](Samples& s) { return expm1(s.uniform(-9, 9)); }), 0xcbca43acd17bfbcaULL);
  EXPECT_EQ(digest([](Samples& s) { return log(std::fabs(s.any())); }), 0x96550ebefadd1df3ULL);
  EXPECT_EQ(digest([](Samples& s) { return log1p(s.uniform(-1, 9)); }), 0x5b0d7477693e9ff3ULL);
  EXPECT_EQ(digest([](Samples& s) {
              const double x = s.uniform(0, 9);
              return pow(x, s.uniform(-99, 99));
            }),
            0xefa72cad17ecd941ULL);
  EXPECT_EQ(digest([](Samples& s) {
              const double y = s.uniform(-1, 1);
              return atan2(y, s.uniform(-1, 1));
            }),
            0xb282293715bca7e5ULL);
}

}  // namespace
}  // namespace gravitas::math
