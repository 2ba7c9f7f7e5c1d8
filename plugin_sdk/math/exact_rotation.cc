#include "plugin_sdk/math/exact_rotation.h"

#include <array>

#include "plugin_sdk/math/double_double.h"

namespace gravitas {
namespace {

using math::DoubleDouble;
using Triple = std::array<DoubleDouble, 3>;

DoubleDouble sum(const DoubleDouble& a, const DoubleDouble& b) {
  const DoubleDouble high = math::two_sum(a.hi, b.hi);
  return math::fast_two_sum(high.hi, high.lo + (a.lo + b.lo));
}

DoubleDouble product(const DoubleDouble& a, double b) {
  const DoubleDouble high = math::two_product(a.hi, b);
  return math::fast_two_sum(high.hi, high.lo + a.lo * b);
}

Triple cross(const Vector3& u, const Triple& v) {
  const auto component = [&](Eigen::Index i, Eigen::Index j) {
    return sum(product(v[static_cast<std::size_t>(j)], u[i]), product(v[static_cast<std::size_t>(i)], -u[j]));
  };
  return {component(1, 2), component(2, 0), component(0, 1)};
}

}  // namespace

Vector3 exactly_rotated(const Quaternion& q, const Vector3& v) {
  const Vector3 u = q.vec();
  const Triple across = cross(u, {DoubleDouble{v.x(), 0.0}, {v.y(), 0.0}, {v.z(), 0.0}});
  const Triple twice = cross(u, across);
  // |q|^2 - 1
  DoubleDouble excess{-1.0, 0.0};
  for (const double number : {q.w(), q.x(), q.y(), q.z()}) excess = sum(excess, math::two_product(number, number));
  Vector3 rotated;
  for (std::size_t i = 0; i < 3; ++i) {
    const DoubleDouble half = sum(product(across[i], q.w()), twice[i]);
    const DoubleDouble change = sum(product(half, 2.0), {-2.0 * excess.hi * half.hi, 0.0});
    const auto k = static_cast<Eigen::Index>(i);
    const DoubleDouble result = sum({v[k], 0.0}, change);
    rotated[k] = result.hi;
  }
  return rotated;
}

}  // namespace gravitas
