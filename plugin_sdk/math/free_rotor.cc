#include "plugin_sdk/math/free_rotor.h"

#include <algorithm>
#include <array>
#include <cmath>

#include "plugin_sdk/math/elliptic.h"
#include "plugin_sdk/math/exact_rotation.h"
#include "plugin_sdk/math/rotation.h"
#include "plugin_sdk/math/transcendental.h"

namespace gravitas {
namespace {

constexpr double kPanel = 0.35;
// Gauss-Legendre, eight points: the positive four.
constexpr std::array<double, 4> kPoints = {0.18343464249564980494, 0.52553240991632898582, 0.79666647741362673959,
                                           0.96028985649753623168};
constexpr std::array<double, 4> kWeights = {0.36268378337836198297, 0.31370664587788728734, 0.22238103445337447054,
                                            0.10122853629037625915};

// Axes in the order of ascending moments, right-handed.
struct SortedAxes {
  std::array<int, 3> axis = {0, 1, 2};
  double sign = 1.0;

  explicit SortedAxes(const Vector3& inverse_moments) {
    const auto order = [&](int i, int j) {
      const auto a = static_cast<std::size_t>(i), b = static_cast<std::size_t>(j);
      if (inverse_moments[axis[a]] >= inverse_moments[axis[b]]) return;
      std::swap(axis[a], axis[b]);
      sign = -sign;
    };
    order(0, 1), order(1, 2), order(0, 1);
  }
  Vector3 sorted(const Vector3& v) const { return sign * Vector3(v[axis[0]], v[axis[1]], v[axis[2]]); }
  Vector3 restored(const Vector3& v) const {
    Vector3 result;
    for (int i = 0; i < 3; ++i) result[axis[static_cast<std::size_t>(i)]] = sign * v[i];
    return result;
  }
};

// The direction of the momentum in the body, as a function of u.
struct Polhode {
  EllipticFunctions functions;
  double parameter;      // k^2
  EllipticValues start;  // at u = 0
  Vector3 at_start;
  int minor, major;                                           // axes that cn and dn belong to: 0 or 2
  double minor_amplitude, middle_amplitude, major_amplitude;  // the last with its sign

  Vector3 at(double u) const { return at_start + change(u); }

  Vector3 change(double u) const {
    const auto [s, c, d] = functions.at(u);
    const auto& [s0, c0, d0] = start;
    // 1 - k^2 s0^2 s^2 without its cancellation
    const double denominator = c * c + s * s * d0 * d0;
    Vector3 n;
    if (c < 0.9) {
      n[minor] = minor_amplitude * (c0 * c - s0 * d0 * s * d) / denominator;
      n[1] = middle_amplitude * (s0 * c * d + s * c0 * d0) / denominator;
      n[major] = major_amplitude * (d0 * d - parameter * s0 * c0 * s * c) / denominator;
      return n - at_start;
    }
    // the change alone, so that the rounding of a short step, the same in each, is as short
    const double one_less_c = s * s / (1.0 + c), one_less_d = parameter * s * s / (1.0 + d);
    const double less = parameter * s0 * s0 * s * s;
    n[minor] = minor_amplitude * (c0 * (less - one_less_c) - s0 * d0 * s * d) / denominator;
    n[1] = middle_amplitude * (s0 * (less - one_less_c - one_less_d * c) + s * c0 * d0) / denominator;
    n[major] = major_amplitude * (d0 * (less - one_less_d) - parameter * s0 * c0 * s * c) / denominator;
    return n;
  }
};

// Mean of J over the two axes that are not k, weighted with n^2: the rate of e_k around n per G.
double precession(const Vector3& n, const Vector3& inverse_moments, int k) {
  const int i = (k + 1) % 3, j = (k + 2) % 3;
  const double ni = n[i] * n[i], nj = n[j] * n[j];
  return (ni * inverse_moments[i] + nj * inverse_moments[j]) / (ni + nj);
}

// Integral of the precession over u from 0 to `end` >= 0, times `direction`'s sign of u.
double integrated(const Polhode& polhode, const Vector3& inverse_moments, int k, double end, double direction) {
  const double panels = std::max(1.0, std::ceil(end / kPanel)), half = 0.5 * end / panels;
  double sum = 0.0;
  for (double panel = 0.0; panel < panels; panel += 1.0) {
    const double middle = (2.0 * panel + 1.0) * half;
    double part = 0.0;
    for (std::size_t i = 0; i < kPoints.size(); ++i)
      part += kWeights[i] * (precession(polhode.at(direction * (middle - half * kPoints[i])), inverse_moments, k) +
                             precession(polhode.at(direction * (middle + half * kPoints[i])), inverse_moments, k));
    sum += half * part;
  }
  return sum;
}

// (f_2 x n, f_2, n) with f_2 along e_k x n.
Matrix3 frame_of(const Vector3& n, int k) {
  const Vector3 across = Vector3::Unit(k).cross(n).normalized();
  Matrix3 frame;
  frame << across.cross(n), across, n;
  return frame;
}

// Of a short motion: u up to which n's series is summed, and how many terms it takes (poles are pi/2 away).
constexpr double kShort = 0.08;
constexpr std::size_t kMostTerms = 13;
std::size_t terms_for(double u_squared) { return u_squared > 9e-4 ? kMostTerms : u_squared > 2.5e-5 ? 10 : 6; }

// Four numbers at once, as the compiler has them.
using Lanes = double __attribute__((vector_size(4 * sizeof(double))));

// Gauss-Legendre on 0 … 1, four points.
constexpr Lanes kFourPoints = {0.069431844202973712, 0.33000947820757187, 0.66999052179242813, 0.93056815579702629};
constexpr Lanes kFourWeights = {0.17392742256872693, 0.32607257743127307, 0.32607257743127307, 0.17392742256872693};

// R(0)^T R(t) is the shortest turn that takes n_t to n_0 and then one by phi about n_0, where
//   phi' = 2T/G - n_0.(n x n') / (1 + n_0.n).
// The second term is that of the area between n's path and the arc, and of third order.
RotorMotion short_motion(const Vector3& inverse_moments, const Vector3& momentum, const Vector3& n, double size,
                         double time, std::size_t terms) {
  // n' = n x J n in powers of the share s of the time
  const Vector3& J = inverse_moments;
  const double scale = size * time;
  const Lanes factor = {scale * (J[2] - J[1]), scale * (J[0] - J[2]), scale * (J[1] - J[0]), 0.0};
  std::array<Lanes, kMostTerms + 1> power, after, before;  // of axes i, i + 1, i + 2
  const auto keep = [&](std::size_t m, const Lanes& c) {
    power[m] = c;
    after[m] = __builtin_shufflevector(c, c, 1, 2, 0, 3), before[m] = __builtin_shufflevector(c, c, 2, 0, 1, 3);
  };
  keep(0, Lanes{n[0], n[1], n[2], 0.0});
  for (std::size_t m = 0; m < terms; ++m) {
    // two sums that do not wait for each other
    Lanes even = after[0] * before[m], odd = {};
    for (std::size_t i = 1; i < m; i += 2) {
      odd += after[i] * before[m - i];
      even += after[i + 1] * before[m - i - 1];
    }
    if (m % 2 == 1) odd += after[m] * before[0];
    keep(m + 1, factor * (even + odd) * (1.0 / static_cast<double>(m + 1)));
  }
  // n - n_0 and its rate at the points, and n - n_0 at the end
  std::array<Lanes, 3> change = {}, rate = {};
  Lanes whole = {};
  for (std::size_t m = terms; m > 0; --m) {
    const Lanes c = power[m], slope = static_cast<double>(m) * c;
    whole += c;
    for (std::size_t k = 0; k < 3; ++k) {
      rate[k] = rate[k] * kFourPoints + slope[k];
      change[k] = (change[k] + c[k]) * kFourPoints;
    }
  }
  const Lanes area = n[0] * (change[1] * rate[2] - change[2] * rate[1]) +
                     n[1] * (change[2] * rate[0] - change[0] * rate[2]) +
                     n[2] * (change[0] * rate[1] - change[1] * rate[0]);
  const Lanes parts = kFourWeights * area / (2.0 + n[0] * change[0] + n[1] * change[1] + n[2] * change[2]);
  const double angle = scale * n.dot(J.cwiseProduct(n)) - ((parts[0] + parts[1]) + (parts[2] + parts[3]));

  const Vector3 moved(whole[0], whole[1], whole[2]);
  const double cosine = std::sqrt(1.0 - 0.25 * moved.squaredNorm());  // of half the angle between n_0 and n_t
  const Vector3 axis = moved.cross(n) * (0.5 / cosine);
  const math::SinCos half = math::sincos(0.5 * angle);
  const Quaternion about(half.cos, half.sin * n[0], half.sin * n[1], half.sin * n[2]);
  return {momentum + size * moved, about * Quaternion(cosine, axis.x(), axis.y(), axis.z())};
}

RotorMotion steady(const Vector3& inverse_moments, const Vector3& momentum, double time) {
  return {momentum, exp_rotation(time * inverse_moments.cwiseProduct(momentum))};
}

}  // namespace

RotorMotion free_rotor(const Vector3& inverse_moments, const Vector3& momentum, double time) {
  const double square = momentum.squaredNorm();
  const double size = square > 1e-250 && square < 1e250 ? std::sqrt(square) : momentum.stableNorm();
  if (size == 0.0 || time == 0.0) return {momentum, Quaternion::Identity()};
  // the square of what u moves by, or up to twice as much
  const Vector3 direction_at_start = momentum / size;
  const Vector3 apart(inverse_moments[1] - inverse_moments[2], inverse_moments[2] - inverse_moments[0],
                      inverse_moments[0] - inverse_moments[1]);
  const Vector3 products(apart[1] * apart[2], apart[2] * apart[0], apart[0] * apart[1]);
  const double u_squared = size * time * (size * time) * products.cwiseAbs().dot(direction_at_start.cwiseAbs2());
  if (u_squared <= kShort * kShort)
    return short_motion(inverse_moments, momentum, direction_at_start, size, time, terms_for(u_squared));

  const SortedAxes axes(inverse_moments);
  const Vector3 J(inverse_moments[axes.axis[0]], inverse_moments[axes.axis[1]], inverse_moments[axes.axis[2]]);
  const Vector3 n = axes.sorted(direction_at_start).normalized();
  const double a1 = J[1] - J[2], a2 = J[0] - J[2], a3 = J[0] - J[1];
  if (!(a2 > 0.0)) return steady(inverse_moments, momentum, time);  // a ball

  // around which axis
  const double m1 = std::sqrt(n[0] * n[0] + a1 / a2 * n[1] * n[1]);
  const double m3 = std::sqrt(n[2] * n[2] + a3 / a2 * n[1] * n[1]);
  const double delta = a1 * n[2] * n[2] - a3 * n[0] * n[0];
  const bool around_3 = delta >= 0.0;
  const int minor = around_3 ? 0 : 2, major = 2 - minor;
  const double minor_amplitude = around_3 ? m1 : m3, major_amplitude = around_3 ? m3 : m1;
  const double a_major = around_3 ? a1 : a3;
  const double rate = size * major_amplitude * std::sqrt(a_major * a2);
  if (!(minor_amplitude > 0.0) || !(rate > 0.0)) return steady(inverse_moments, momentum, time);

  const double middle_ratio = std::sqrt(a2 / a_major);
  const double complement = std::min(1.0, std::fabs(delta) / (a_major * major_amplitude * major_amplitude));
  const double direction = (n[major] < 0.0) == (time < 0.0) ? 1.0 : -1.0;
  const Polhode polhode{
      EllipticFunctions(complement),
      1.0 - complement,
      {n[1] / (minor_amplitude * middle_ratio), n[minor] / minor_amplitude, std::fabs(n[major]) / major_amplitude},
      n,
      minor,
      major,
      minor_amplitude,
      minor_amplitude * middle_ratio,
      std::copysign(major_amplitude, n[major])};

  // how far, in u: the squares return after 2 K, the signs after 4 K
  const double end = rate * std::fabs(time), half_period = 2.0 * polhode.functions.quarter_period();
  const double turns = std::floor(end / half_period), rest = std::fmod(end, half_period);
  const int k = m1 <= m3 ? 0 : 2;
  double angle = integrated(polhode, J, k, rest, direction);
  if (turns > 0.0) angle += turns * integrated(polhode, J, k, half_period, 1.0);
  angle *= size / rate * (time < 0.0 ? -1.0 : 1.0);
  const Vector3 change = polhode.change(direction * std::fmod(end, 2.0 * half_period)), next = n + change;

  const Quaternion turn = exp_rotation(angle * n) * to_quaternion(frame_of(n, k) * frame_of(next, k).transpose());
  const Vector3 axis = axes.restored(turn.vec());
  return {momentum + size * axes.restored(change), Quaternion(turn.w(), axis.x(), axis.y(), axis.z())};
}

Turning turned_freely(const Turning& start, const Vector3& moments, const Vector3& inverse_moments, double time) {
  const auto& [q, w] = start;
  if (w.isZero(0.0)) return start;
  const Vector3 momentum = moments.cwiseProduct(exactly_rotated(q.conjugate(), w));
  const RotorMotion moved = free_rotor(inverse_moments, momentum, time);
  const Quaternion end = normalized(q * moved.turn);
  // divided, for moments times rounded inverses would gather the same error in each step
  return {end, exactly_rotated(end, moved.momentum.cwiseQuotient(moments))};
}

}  // namespace gravitas
