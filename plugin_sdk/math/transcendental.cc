// Each function below is: reduce the argument to a short interval, exactly or as a pair of doubles;
// add a minimax polynomial for what lies beyond the leading terms; round once.
//
// The polynomials were fitted by the Remez exchange in 400-bit arithmetic; the comment above each
// names the interval and the largest error relative to the function, as a power of two.
#include "plugin_sdk/math/transcendental.h"

#include <bit>
#include <cmath>
#include <cstdint>
#include <limits>

#include "plugin_sdk/math/double_double.h"
#include "plugin_sdk/math/transcendental_tables.h"

namespace gravitas::math {
namespace {

constexpr double kNaN = std::numeric_limits<double>::quiet_NaN();
constexpr double kInfinity = std::numeric_limits<double>::infinity();
constexpr DoubleDouble kPi = {0x1.921fb54442d18p+1, 0x1.1a62633145c07p-53};
constexpr DoubleDouble kHalfPi = {0x1.921fb54442d18p+0, 0x1.1a62633145c07p-54};

// ln 2 with 42 fraction bits, so that its product with an exponent is exact, and the rest.
constexpr double kLn2Hi = 0x1.62e42fefa3800p-1;
constexpr double kLn2Lo = 0x1.ef35793c76730p-45;
constexpr double kInverseLn2 = 0x1.71547652b82fep+0;

// Below this x^2 is less than half an ulp of 1.
constexpr double kTiny = 0x1p-27;

// c[0] + z c[1] + ... by Horner's rule, always in this order.
template <int kCount>
double polynomial(double z, const double (&c)[kCount]) {
  double value = c[kCount - 1];
  for (int i = kCount - 2; i >= 0; --i) value = value * z + c[i];
  return value;
}

// 2^k for -1022 <= k <= 1023.
double power_of_two(int k) { return std::bit_cast<double>(static_cast<std::uint64_t>(k + 1023) << 52); }

// v * 2^k with one rounding, for |v| between 1/4 and 4 and -1100 <= k <= 1100.
double scaled(double v, int k) {
  if (k > 1020) return v * power_of_two(1020) * power_of_two(k - 1020);
  if (k < -1020) return v * power_of_two(k + 1000) * power_of_two(-1000);
  return v * power_of_two(k);
}

// ---- sine, cosine, tangent

// x = quadrant * pi/2 + (hi + lo), |hi + lo| <= pi/4 and a rounding; quadrant is modulo 4.
struct QuarterTurns {
  int quadrant;
  double hi;
  double lo;
};

// Cody-Waite: pi/2 in three pieces of 33 bits, whose products with an integer below 2^20 are exact,
// and a fourth. For |x| < 2^20.
QuarterTurns reduce_moderate(double x) {
  constexpr double kTwoOverPi = 0x1.45f306dc9c883p-1;
  constexpr double kPiece1 = 0x1.921fb54400000p+0;
  constexpr double kPiece2 = 0x1.0b4611a600000p-34;
  constexpr double kPiece3 = 0x1.3198a2e000000p-69;
  constexpr double kPiece4 = 0x1.b839a252049c1p-104;
  const double n = std::floor(x * kTwoOverPi + 0.5);
  const double first = x - n * kPiece1;  // exact: a multiple of 2^-53 below 1
  const DoubleDouble second = two_sum(first, -(n * kPiece2));
  const DoubleDouble third = two_sum(second.hi, -(n * kPiece3));
  const DoubleDouble rest = two_sum(third.hi, (second.lo + third.lo) - n * kPiece4);
  const auto quadrant = static_cast<int>(static_cast<std::int64_t>(n) & 3);
  return {quadrant, rest.hi, rest.lo};
}

// Payne-Hanek in integers, for finite |x| >= 1: with x = m 2^e, bits of 2/pi that contribute whole
// turns to x * 2/pi are skipped, 192 are multiplied by m, and the top two bits of the product (its
// value is P * 2^-190 quarter turns, P modulo 2^192) are the quadrant. What is cut off is below
// 2^-137; no double comes closer to a multiple of pi/2 than 2^-62 of a quarter turn.
QuarterTurns reduce_large(double x) {
  __extension__ using Uint128 = unsigned __int128;
  const auto bits = std::bit_cast<std::uint64_t>(x);
  const int e = static_cast<int>((bits >> 52) & 0x7ff) - 1075;
  const std::uint64_t m = (bits & 0xfffffffffffffULL) | 0x10000000000000ULL;

  // the window starts at the bit of weight 2^-(e-1); 64 zero bits precede weight 2^-1
  const int start = (e - 1) - 1 + 64;
  const int word = start / 64;
  const int shift = start % 64;
  const auto window = [&](int i) {
    const std::uint64_t left = kTwoOverPiBits[word + i] << shift;
    return shift == 0 ? left : left | (kTwoOverPiBits[word + i + 1] >> (64 - shift));
  };
  const Uint128 low = static_cast<Uint128>(m) * window(2);
  const Uint128 middle = static_cast<Uint128>(m) * window(1) + static_cast<std::uint64_t>(low >> 64);
  const std::uint64_t high = m * window(0) + static_cast<std::uint64_t>(middle >> 64);
  const auto p1 = static_cast<std::uint64_t>(middle);
  const auto p0 = static_cast<std::uint64_t>(low);

  // drop the quadrant: f is the fraction in units of 2^-192, negative when its top bit is set
  std::uint64_t f2 = (high << 2) | (p1 >> 62);
  std::uint64_t f1 = (p1 << 2) | (p0 >> 62);
  std::uint64_t f0 = p0 << 2;
  const bool negative = (f2 >> 63) != 0;
  int quadrant = static_cast<int>(high >> 62) + (negative ? 1 : 0);
  if (negative) {
    f0 = ~f0 + 1;
    f1 = ~f1 + (f0 == 0 ? 1 : 0);
    f2 = ~f2 + (f0 == 0 && f1 == 0 ? 1 : 0);
  }

  // normalise: f2 becomes the leading word
  int exponent = 0;
  if (f2 == 0) {
    f2 = f1;
    f1 = f0;
    f0 = 0;
    exponent = -64;
  }
  const int zeros = std::countl_zero(f2);
  if (zeros > 0) {
    f2 = (f2 << zeros) | (f1 >> (64 - zeros));
    f1 = (f1 << zeros) | (f0 >> (64 - zeros));
  }
  exponent -= zeros;

  // the first 53 bits and the next 64 as doubles, times pi/2
  const double hi = static_cast<double>(f2 >> 11) * power_of_two(exponent - 53);
  const double lo = static_cast<double>((f2 << 53) | (f1 >> 11)) * power_of_two(exponent - 117);
  const DoubleDouble product = two_product(hi, kHalfPi.hi);
  DoubleDouble angle = fast_two_sum(product.hi, product.lo + (hi * kHalfPi.lo + lo * kHalfPi.hi));
  if (negative != std::signbit(x)) angle = {-angle.hi, -angle.lo};
  if (std::signbit(x)) quadrant = -quadrant;
  return {quadrant & 3, angle.hi, angle.lo};
}

QuarterTurns reduce_quarter_turns(double x) {
  const double magnitude = std::fabs(x);
  if (magnitude <= 0x1.921fb54442d18p-1) return {0, x, 0.0};
  return magnitude < 0x1p20 ? reduce_moderate(x) : reduce_large(x);
}

// The leading bits of v: the square of 26 of them is exact, and so is the cube of 17.
double leading_26_bits(double v) {
  return std::bit_cast<double>(std::bit_cast<std::uint64_t>(v) & 0xfffffffff8000000ULL);
}
double leading_17_bits(double v) {
  return std::bit_cast<double>(std::bit_cast<std::uint64_t>(v) & 0xfffffff000000000ULL);
}

// sin(r + r_lo) = r - r^3/6 + r^5 S(r^2) + r_lo cos r, |r| <= 0.786: 2^-68.3. The cube is formed as
// u^3 + (r - u)(r^2 + r u + u^2) with u the leading bits of r, since its roundings would otherwise
// be a quarter ulp of the result.
DoubleDouble sin_reduced(double r, double r_lo) {
  static constexpr double kS[] = {0x1.111111111110fp-7,   -0x1.a01a01a01937ep-13, 0x1.71de3a53cf74dp-19,
                                  -0x1.ae64534170f39p-26, 0x1.6120f20178330p-33,  -0x1.aacfb79055a65p-41};
  constexpr double kSixthHi = 0x1.5555555555555p-3;
  constexpr double kSixthLo = 0x1.5555555555555p-57;
  const double z = r * r;
  const double u = leading_17_bits(r);
  const double cube = u * u * u;
  const double cube_rest = (r - u) * (z + r * u + u * u);
  const DoubleDouble head = fast_two_sum(r, -kSixthHi * cube);
  const double fifth = r * z * z * polynomial(z, kS);
  const double small = (kSixthHi * cube_rest + kSixthLo * cube) - (r_lo - 0.5 * z * r_lo);
  return {head.hi, head.lo + (fifth - small)};
}

// cos(r + r_lo) = 1 - r^2/2 + r^4 C(r^2) - r r_lo, |r| <= 0.786: 2^-64.2. The square is taken from
// the upper half of r exactly, since half an ulp of r^2/2 would be a quarter ulp of the result.
DoubleDouble cos_reduced(double r, double r_lo) {
  static constexpr double kC[] = {0x1.555555555554cp-5,   -0x1.6c16c16c15150p-10, 0x1.a01a019cad178p-16,
                                  -0x1.27e4f8066f94ep-22, 0x1.1ee9e96f9c565p-29,  -0x1.8fad48c060467p-37};
  const double z = r * r;
  const double upper = leading_26_bits(r);
  const double half_square = 0.5 * (upper * upper);
  const double half_rest = 0.5 * ((r - upper) * (r + upper));
  const DoubleDouble head = fast_two_sum(1.0, -half_square);
  return {head.hi, ((z * z * polynomial(z, kC) - r * r_lo) - half_rest) + head.lo};
}

double rounded(DoubleDouble v) { return v.hi + v.lo; }

// ---- inverse functions

// atan(n / d) for 0 <= n <= d, both pairs, d normal: with c = k/8 next to n/d,
// atan(n/d) = atan(c) + atan(t), t = (n - c d)/(d + c n), |t| <= 1/16,
// atan(t) = t + t^3 A(t^2), |t| <= 0.0628: 2^-72.7
DoubleDouble atan_of_ratio(DoubleDouble n, DoubleDouble d) {
  static constexpr double kA[] = {-0x1.5555555555555p-2, 0x1.999999999982dp-3,  -0x1.2492492400273p-3,
                                  0x1.c71c6e68db184p-4,  -0x1.7458109549493p-4, 0x1.37620fccb6a9ep-4};
  const auto k = static_cast<int>(std::floor(8.0 * (n.hi / d.hi) + 0.5));
  const double c = 0.125 * k;
  const DoubleDouble cd = two_product(c, d.hi);
  const DoubleDouble cn = two_product(c, n.hi);
  const DoubleDouble above = two_sum(n.hi, -cd.hi);
  const DoubleDouble below = two_sum(d.hi, cn.hi);
  const DoubleDouble t = divide(two_sum(above.hi, above.lo + ((n.lo - cd.lo) - c * d.lo)),
                                two_sum(below.hi, below.lo + ((d.lo + cn.lo) + c * n.lo)));
  const double z = t.hi * t.hi;
  const DoubleDouble sum = fast_two_sum(kAtanTable[k].hi, t.hi);
  return {sum.hi, sum.lo + (kAtanTable[k].lo + (t.lo + t.hi * z * polynomial(z, kA)))};
}

DoubleDouble difference(DoubleDouble a, DoubleDouble b) {
  const DoubleDouble head = two_sum(a.hi, -b.hi);
  return {head.hi, head.lo + (a.lo - b.lo)};
}

DoubleDouble sum(DoubleDouble a, DoubleDouble b) {
  const DoubleDouble head = two_sum(a.hi, b.hi);
  return {head.hi, head.lo + (a.lo + b.lo)};
}

// acos(a) for 0 <= a <= 1 as the angle of (a, sqrt(1 - a^2)); asin(a) swaps the two.
DoubleDouble acos_of_magnitude(double a, bool complement) {
  const DoubleDouble square = two_product(a, a);
  const DoubleDouble head = two_sum(1.0, -square.hi);
  const DoubleDouble rest = two_sum(head.hi, head.lo - square.lo);
  DoubleDouble height = {std::sqrt(rest.hi), 0.0};
  if (height.hi > 0.0) {
    const DoubleDouble back = two_product(height.hi, height.hi);
    height.lo = (((rest.hi - back.hi) - back.lo) + rest.lo) / (2.0 * height.hi);
  }
  const DoubleDouble base = {a, 0.0};
  if (a <= height.hi) {
    const DoubleDouble small = atan_of_ratio(base, height);
    return complement ? small : difference(kHalfPi, small);
  }
  const DoubleDouble small = atan_of_ratio(height, base);
  return complement ? difference(kHalfPi, small) : small;
}

// |atan2| for finite y, x >= 0, not both zero, before the quadrant of x is applied:
// the angle from the nearer axis and whether that axis is y's.
struct FoldedAngle {
  DoubleDouble angle;
  bool from_y_axis;
};
FoldedAngle fold_angle(double y, double x) {
  const bool from_y_axis = y > x;
  double n = from_y_axis ? x : y;
  double d = from_y_axis ? y : x;
  // beyond this ratio the arctangent is the ratio, and pi or pi/2 swallow it
  if (n * 0x1p60 < d || n == 0.0) return {{n / d, 0.0}, from_y_axis};
  if (d > 0x1p900) {
    n *= 0x1p-200;
    d *= 0x1p-200;
  } else if (d < 0x1p-800) {
    n *= 0x1p200;
    d *= 0x1p200;
  }
  return {atan_of_ratio({n, 0.0}, {d, 0.0}), from_y_axis};
}

// ---- exponential and logarithm

// exp(r + r_lo) - 1 = r + r^2/2 + r^3 Q(r) + ..., |r| <= 0.3467: 2^-67.8
DoubleDouble expm1_reduced(double r, double r_lo) {
  static constexpr double kQ[] = {0x1.5555555555555p-3,  0x1.5555555555557p-5,  0x1.1111111111113p-7,
                                  0x1.6c16c16c156b3p-10, 0x1.a01a01a0182e5p-13, 0x1.a01a01ab5520cp-16,
                                  0x1.71de3a603ded9p-19, 0x1.27e4d0b6f822fp-22, 0x1.ae641619e3ffap-26,
                                  0x1.1f84bbf627d6bp-29, 0x1.61e0a612cadbap-33};
  const DoubleDouble square = two_product(r, r);
  const DoubleDouble head = fast_two_sum(r, 0.5 * square.hi);
  const double cubic = r * square.hi * polynomial(r, kQ);
  return {head.hi, head.lo + (cubic + (0.5 * square.lo + (r_lo + r * r_lo)))};
}

// v + v_lo = k ln 2 + (hi + lo), |hi + lo| <= ln(2)/2 and a rounding.
struct BinaryPower {
  int k;
  DoubleDouble rest;
};
BinaryPower reduce_ln2(double v, double v_lo) {
  const double k = std::floor(v * kInverseLn2 + 0.5);
  return {static_cast<int>(k), two_sum(v - k * kLn2Hi, v_lo - k * kLn2Lo)};
}

// exp(v + v_lo), v between the limits of overflow and of underflow to zero.
double exp_of_pair(double v, double v_lo) {
  const BinaryPower power = reduce_ln2(v, v_lo);
  const DoubleDouble minus_one = expm1_reduced(power.rest.hi, power.rest.lo);
  const DoubleDouble head = fast_two_sum(1.0, minus_one.hi);
  return scaled(head.hi + (head.lo + minus_one.lo), power.k);
}

constexpr double kExpOverflow = 0x1.62e42fefa39efp+9;    // the last argument below overflow
constexpr double kExpUnderflow = -0x1.74910d52d3051p+9;  // the last that does not round to zero

// log(x + x_lo) to about 2^-68 relative, for a positive normal x and |x_lo| <= ulp(x)/2.
// With x = 2^k m and a tabulated c next to m, log x = k ln 2 + log c + log(1 + z), z = m/c - 1;
// log(1 + z) = z - z^2/2 + z^3 P(z), |z| <= 0.00785: 2^-73.7. Row 0 and the last have c = 1
// exactly, so that nothing cancels near x = 1.
DoubleDouble log_of_pair(double x, double x_lo) {
  static constexpr double kP[] = {0x1.5555555555555p-2,  -0x1.000000000006ap-2, 0x1.9999999999c08p-3,
                                  -0x1.5555554449c48p-3, 0x1.24924908fa2f1p-3,  -0x1.00069fa2ce421p-3,
                                  0x1.c72bb473e347ep-4};
  const auto bits = std::bit_cast<std::uint64_t>(x);
  int k = static_cast<int>(bits >> 52) - 1023;
  double m = std::bit_cast<double>((bits & 0xfffffffffffffULL) | 0x3ff0000000000000ULL);
  const auto row = static_cast<int>(std::floor((m - 1.0) * 64.0 + 0.5));
  if (row >= kLogHalvedFrom) {
    m *= 0.5;
    k += 1;
  }
  const LogRow& c = kLogTable[row];

  // the products of the halves of m with the 21-bit reciprocal are exact
  const double upper = leading_26_bits(m);
  const DoubleDouble main = two_sum(upper * c.reciprocal - 1.0, (m - upper) * c.reciprocal);
  const double m_lo = x_lo == 0.0 ? 0.0 : x_lo * power_of_two(-k < -1022 ? -1022 : -k);
  const DoubleDouble z = two_sum(main.hi, main.lo + m_lo * c.reciprocal);

  const DoubleDouble square = two_product(z.hi, z.hi);
  const double tail =
      z.hi * square.hi * polynomial(z.hi, kP) - (0.5 * square.lo + z.hi * z.lo) + (k * kLn2Lo + c.log_lo) + z.lo;
  const DoubleDouble first = two_sum(k * kLn2Hi + c.log_hi, z.hi);
  const DoubleDouble second = two_sum(first.hi, -0.5 * square.hi);
  return fast_two_sum(second.hi, (first.lo + second.lo) + tail);
}

// log_of_pair for any positive finite x.
DoubleDouble log_of_positive(double x) {
  if (x >= std::numeric_limits<double>::min()) return log_of_pair(x, 0.0);
  const DoubleDouble scaled_log = log_of_pair(x * 0x1p54, 0.0);
  return difference(scaled_log, {54.0 * kLn2Hi, 54.0 * kLn2Lo});
}

enum class Parity { kNoInteger, kEven, kOdd };
Parity parity(double y) {
  if (std::fabs(y) >= 0x1p53) return Parity::kEven;
  if (std::floor(y) != y) return Parity::kNoInteger;
  return std::floor(0.5 * y) == 0.5 * y ? Parity::kEven : Parity::kOdd;
}

}  // namespace

double sin(double x) { return sincos(x).sin; }

double cos(double x) { return sincos(x).cos; }

SinCos sincos(double x) {
  if (!std::isfinite(x)) return {kNaN, kNaN};
  if (std::fabs(x) < kTiny) return {x, 1.0};
  const QuarterTurns turns = reduce_quarter_turns(x);
  const double s = rounded(sin_reduced(turns.hi, turns.lo));
  const double c = rounded(cos_reduced(turns.hi, turns.lo));
  switch (turns.quadrant) {
    case 0:
      return {s, c};
    case 1:
      return {c, -s};
    case 2:
      return {-s, -c};
    default:
      return {-c, s};
  }
}

double tan(double x) {
  if (!std::isfinite(x)) return kNaN;
  if (std::fabs(x) < kTiny) return x;
  const QuarterTurns turns = reduce_quarter_turns(x);
  const DoubleDouble s_raw = sin_reduced(turns.hi, turns.lo);
  const DoubleDouble c_raw = cos_reduced(turns.hi, turns.lo);
  const DoubleDouble s = fast_two_sum(s_raw.hi, s_raw.lo);
  const DoubleDouble c = fast_two_sum(c_raw.hi, c_raw.lo);
  return (turns.quadrant & 1) == 0 ? rounded(divide(s, c)) : -rounded(divide(c, s));
}

double asin(double x) {
  const double a = std::fabs(x);
  if (!(a <= 1.0)) return kNaN;
  if (a < kTiny) return x;
  return std::copysign(rounded(acos_of_magnitude(a, true)), x);
}

double acos(double x) {
  const double a = std::fabs(x);
  if (!(a <= 1.0)) return kNaN;
  const DoubleDouble angle = acos_of_magnitude(a, false);
  return rounded(x < 0.0 ? difference(kPi, angle) : angle);
}

double atan(double x) {
  const double a = std::fabs(x);
  if (std::isnan(x)) return kNaN;
  if (a < kTiny) return x;
  if (a > 0x1p60) return std::copysign(kHalfPi.hi, x);
  const FoldedAngle folded = fold_angle(a, 1.0);
  const DoubleDouble angle = folded.from_y_axis ? difference(kHalfPi, folded.angle) : folded.angle;
  return std::copysign(rounded(angle), x);
}

double atan2(double y, double x) {
  if (std::isnan(x) || std::isnan(y)) return kNaN;
  double ay = std::fabs(y);
  double ax = std::fabs(x);
  if (ay == 0.0) return std::signbit(x) ? std::copysign(kPi.hi, y) : y;
  if (std::isinf(ax) || std::isinf(ay)) {
    // the directions of the axes and diagonals at infinity
    ax = std::isinf(ax) ? 1.0 : 0.0;
    ay = std::isinf(ay) ? 1.0 : 0.0;
    if (ay == 0.0) return std::signbit(x) ? std::copysign(kPi.hi, y) : std::copysign(0.0, y);
  }
  const FoldedAngle folded = fold_angle(ay, ax);
  DoubleDouble angle = folded.angle;
  if (folded.from_y_axis) {
    angle = std::signbit(x) ? sum(kHalfPi, angle) : difference(kHalfPi, angle);
  } else if (std::signbit(x)) {
    angle = difference(kPi, angle);
  }
  return std::copysign(rounded(angle), y);
}

double exp(double x) {
  if (std::isnan(x)) return kNaN;
  if (x > kExpOverflow) return kInfinity;
  if (x < kExpUnderflow) return 0.0;
  return exp_of_pair(x, 0.0);
}

double expm1(double x) {
  if (std::isnan(x)) return kNaN;
  if (std::fabs(x) < 0x1p-54) return x;
  if (x > 45.0) return exp(x);  // the 1 is less than 2^-64 of it
  if (x < -45.0) return -1.0;
  const BinaryPower power = reduce_ln2(x, 0.0);
  const DoubleDouble minus_one = expm1_reduced(power.rest.hi, power.rest.lo);
  if (power.k == 0) return rounded(minus_one);
  // 2^k (1 + p) - 1, each sum exact
  const double scale = power_of_two(power.k);
  const DoubleDouble exponential = fast_two_sum(1.0, minus_one.hi);
  const DoubleDouble head = two_sum(scale * exponential.hi, -1.0);
  return head.hi + (head.lo + scale * (exponential.lo + minus_one.lo));
}

double log(double x) {
  if (std::isnan(x)) return kNaN;
  if (x == 0.0) return -kInfinity;
  if (x < 0.0) return kNaN;
  if (std::isinf(x)) return x;
  return rounded(log_of_positive(x));
}

double log1p(double x) {
  if (std::isnan(x) || x < -1.0) return kNaN;
  if (x == -1.0) return -kInfinity;
  if (std::fabs(x) < 0x1p-54 || std::isinf(x)) return x;
  const DoubleDouble argument = two_sum(1.0, x);
  return rounded(log_of_pair(argument.hi, argument.lo));
}

double pow(double x, double y) {
  if (y == 0.0 || x == 1.0) return 1.0;
  if (std::isnan(x) || std::isnan(y)) return kNaN;
  const double base = std::fabs(x);
  const Parity kind = parity(y);
  const double sign = std::signbit(x) && kind == Parity::kOdd ? -1.0 : 1.0;
  if (base == 0.0 || std::isinf(base)) {
    return (base == 0.0) == (y < 0.0) ? sign * kInfinity : sign * 0.0;
  }
  if (base == 1.0 && (std::isinf(y) || kind != Parity::kNoInteger)) return sign;
  if (x < 0.0 && !std::isinf(y) && kind == Parity::kNoInteger) return kNaN;

  // the logarithm of a double other than 1 is at least 2^-53 and at most 2^10 in magnitude
  if (std::fabs(y) >= 0x1p66) return (base > 1.0) == (y > 0.0) ? sign * kInfinity : sign * 0.0;
  if (std::fabs(y) < 0x1p-66) return 1.0;
  const DoubleDouble logarithm = log_of_positive(base);
  const DoubleDouble product = two_product(logarithm.hi, y);
  const DoubleDouble exponent = fast_two_sum(product.hi, product.lo + logarithm.lo * y);
  if (exponent.hi > kExpOverflow + 1.0) return sign * kInfinity;
  if (exponent.hi < kExpUnderflow - 1.0) return sign * 0.0;
  return sign * exp_of_pair(exponent.hi, exponent.lo);
}

}  // namespace gravitas::math
