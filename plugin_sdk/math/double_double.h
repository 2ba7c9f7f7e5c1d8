// Error-free sums and products: the exact result of one double operation as an unevaluated pair
// hi + lo. transcendental.cc carries its leading terms this way, so that each function rounds once
// at its end.
//
// IEEE double arithmetic in round-to-nearest: a compiler that contracts or reassociates on its own would break the
// identities below. Where the target has a fused multiply-add it finds the rest of a product, with the same bits. Source:
// T. J. Dekker, "A floating-point technique for
// extending the available precision", Numer. Math. 18 (1971).
#pragma once

#ifdef __FAST_MATH__
#error "double_double.h needs IEEE arithmetic: build without -ffast-math"
#endif

namespace gravitas::math {

// The value hi + lo. Normalised means that hi is the sum rounded to double.
struct DoubleDouble {
  double hi;
  double lo;
};

// a + b exactly, for any two finite numbers whose sum does not overflow.
inline DoubleDouble two_sum(double a, double b) {
  const double sum = a + b;
  const double b_part = sum - a;
  return {sum, (a - (sum - b_part)) + (b - b_part)};
}

// a + b exactly, if |a| >= |b| or a = 0.
inline DoubleDouble fast_two_sum(double a, double b) {
  const double sum = a + b;
  return {sum, b - (sum - a)};
}

// a = hi + lo with at most 26 significant bits in each. Precondition: |a| < 2^996.
inline DoubleDouble split(double a) {
  const double scaled = 134217729.0 * a;  // 2^27 + 1
  const double hi = scaled - (scaled - a);
  return {hi, a - hi};
}

// a * b exactly. Preconditions: |a|, |b| < 2^996, the product does not overflow, and it is either
// zero or at least 2^-968 in magnitude (below that the error term itself underflows).
inline DoubleDouble two_product(double a, double b) {
  const double product = a * b;
#ifdef __FMA__
  return {product, __builtin_fma(a, b, -product)};
#else
  const DoubleDouble as = split(a);
  const DoubleDouble bs = split(b);
  const double error = ((as.hi * bs.hi - product) + as.hi * bs.lo + as.lo * bs.hi) + as.lo * bs.lo;
  return {product, error};
#endif
}

// a / b to about 2^-104 relative. Preconditions: b.hi != 0, both normalised, and the ranges of
// two_product for the quotient times b.
inline DoubleDouble divide(DoubleDouble a, DoubleDouble b) {
  const double quotient = a.hi / b.hi;
  const DoubleDouble product = two_product(quotient, b.hi);
  const double rest = (((a.hi - product.hi) - product.lo) + a.lo) - quotient * b.lo;
  return {quotient, rest / b.hi};
}

}  // namespace gravitas::math
