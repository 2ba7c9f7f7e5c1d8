// Cubic Hermite curves through rows of a table, of numbers or vectors: continuous with their rates (C1).
//
// Rates at rows are those of the parabola through the row and its neighbours (at the ends the first and last three); of two
// rows, their difference quotient. So a constant rate is exact, and so is a constant acceleration. Where a neighbouring row
// says the same the rate is zero: a row that stands twice is a rest.
#pragma once

#include <cstddef>
#include <vector>

#include "plugin_sdk/math/types.h"

namespace gravitas {

namespace hermite {
inline bool is_rest(double quotient) { return quotient == 0.0; }
inline bool is_rest(const Vector3& quotient) { return quotient.isZero(0.0); }
}  // namespace hermite

// Rates at all rows from the difference quotients and lengths (s) of the intervals between them; `none` is a rate of zero.
template <typename Value>
std::vector<Value> hermite_rates(const std::vector<Value>& quotients, const std::vector<double>& lengths,
                                 const Value& none) {
  const std::size_t intervals = quotients.size();
  std::vector<Value> rates(intervals + 1, none);
  if (intervals == 0) return rates;
  if (intervals == 1) return {quotients[0], quotients[0]};
  // next to the quotient of the interval at the end, with that beyond it
  const auto at_end = [&](std::size_t near, std::size_t far) {
    if (hermite::is_rest(quotients[near])) return none;
    const double h1 = lengths[near], h2 = lengths[far];
    return Value(quotients[near] + (h1 / (h1 + h2)) * (quotients[near] - quotients[far]));
  };
  rates.front() = at_end(0, 1);
  for (std::size_t i = 1; i < intervals; ++i) {
    const Value &before = quotients[i - 1], &after = quotients[i];
    if (hermite::is_rest(before) || hermite::is_rest(after)) continue;
    const double h1 = lengths[i - 1], h2 = lengths[i];
    rates[i] = (h2 * before + h1 * after) / (h1 + h2);
  }
  rates.back() = at_end(intervals - 1, intervals - 2);
  return rates;
}

// Value, rate and change of the rate (1/s, 1/s^2) at s, 0 ... 1, of an interval of h seconds:
//   x = x0 + (3 s^2 - 2 s^3)(x1 - x0) + h (s r^2 v0 - s^2 r v1),  r = 1 - s
template <typename Value>
struct HermitePoint {
  Value value, rate, change;
};
template <typename Value>
HermitePoint<Value> hermite_point(const Value& x0, const Value& v0, const Value& x1, const Value& v1, double h,
                                  double s) {
  const double r = 1.0 - s;
  const Value move = x1 - x0;
  return {x0 + s * s * (1.0 + 2.0 * r) * move + h * (s * r * r * v0 - s * s * r * v1),
          6.0 * s * r / h * move + r * (1.0 - 3.0 * s) * v0 + s * (3.0 * s - 2.0) * v1,
          (6.0 * (r - s) / h * move + (6.0 * s - 4.0) * v0 + (6.0 * s - 2.0) * v1) / h};
}

}  // namespace gravitas
