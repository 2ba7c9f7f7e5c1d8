#include "plugin_sdk/math/elliptic.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "plugin_sdk/math/transcendental.h"

namespace gravitas {
namespace {

constexpr double kSmallestParameter = 1e-300;
// The means agree to the square of this after one step more.
constexpr double kAgreement = 1e-9;
constexpr double kSmallestSine = 1e-150;

}  // namespace

EllipticFunctions::EllipticFunctions(double complementary_parameter) {
  double a = 1.0, b = std::sqrt(std::clamp(complementary_parameter, kSmallestParameter, 1.0));
  for (means_ = 0; means_ < kMostMeans; ++means_) {
    a_[means_] = a, b_[means_] = b;
    const double mean = 0.5 * (a + b);
    if (a - b <= kAgreement * a) {
      limit_ = mean;
      ++means_;
      break;
    }
    b = std::sqrt(a * b);
    a = mean;
    limit_ = mean;
  }
  quarter_period_ = 0.5 * std::numbers::pi / limit_;
}

EllipticValues EllipticFunctions::at(double u) const {
  const math::SinCos angle = math::sincos(limit_ * u);
  // so near zero that the cotangent's square would overflow
  if (std::fabs(angle.sin) < kSmallestSine) return {u, angle.cos, 1.0};
  double y = limit_ * (angle.cos / angle.sin), next = limit_, dn = 1.0;
  for (std::size_t n = means_; n-- > 0;) {
    const double mean = y * (y / next);
    y *= dn;
    dn = (b_[n] + mean) / (a_[n] + mean);
    next = a_[n];
  }
  const double sn = std::copysign(1.0 / std::sqrt(y * y + 1.0), angle.sin);
  return {sn, y * sn, dn};
}

}  // namespace gravitas
