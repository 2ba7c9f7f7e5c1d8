// Sines, exponentials, logarithms and their kin with one fixed sequence of IEEE operations each.
//
// The C library picks between variants of these functions by the processor it runs on, and the
// variants differ in the last bit; a trajectory computed through them is not the same on two
// machines. The functions here are built from +, -, *, /, sqrt and integer operations alone: no
// dispatch, no fused operation but where it gives the same bits (double_double.h), no global state. The same argument gives the same bits wherever the
// code is compiled without contraction and with round-to-nearest. Results of a simulation use
// these and never the std:: ones.
//
// Accuracy. Each function carries its leading terms as an unevaluated pair (double_double.h) and
// rounds once (twice where the result is subnormal). The number beside each declaration bounds the
// error measured against quadruple precision over some 10^7 arguments of all magnitudes, in units
// in the last place of the exact result (0.5 would be perfect rounding); the tests enforce it on
// fewer. Functions are odd or even exactly where mathematics says so.
//
// Special values are those of C99 Annex F: signed zeros are kept, domain errors give NaN, poles
// give infinity, NaN in gives NaN out (except pow(1, NaN) = pow(NaN, 0) = 1). errno is never set
// and floating-point exception flags are not part of the contract. Angles are in radians.
#pragma once

namespace gravitas::math {

struct SinCos {
  double sin;
  double cos;
};

// For all finite x, however large: the reduction modulo pi/2 keeps every bit of x. NaN at +-inf.
double sin(double x);     // 0.60 ulp
double cos(double x);     // 0.60 ulp
SinCos sincos(double x);  // both, with the same bits as sin and cos, for the price of one reduction
double tan(double x);     // 0.66 ulp

// asin and acos: NaN for |x| > 1. Ranges [-pi/2, pi/2] and [0, pi].
double asin(double x);  // 0.51 ulp
double acos(double x);  // 0.51 ulp
double atan(double x);  // 0.51 ulp

// The angle of the point (x, y) in [-pi, pi], by quadrant; atan2(+-0, x) = +-0 for x > 0 or x = +0
// and +-pi for x < 0 or x = -0.
double atan2(double y, double x);  // 0.51 ulp

// exp(x): +inf above 709.78, gradual underflow, 0 below -745.13.
double exp(double x);  // 0.54 ulp, 0.80 where the result is subnormal

// exp(x) - 1 without cancellation near 0.
double expm1(double x);  // 0.64 ulp

// The natural logarithm: -inf at +-0, NaN below.
double log(double x);  // 0.501 ulp

// log(1 + x) without cancellation near 0: -inf at -1, NaN below.
double log1p(double x);  // 0.501 ulp

// x to the power y: NaN for a negative finite x with a finite y that is no integer. Exact wherever
// the exact result is a double.
double pow(double x, double y);  // 0.54 ulp, 0.80 where the result is subnormal

}  // namespace gravitas::math
