#include "workers/force/aerodynamic/round_faces.h"

#include <cmath>
#include <numbers>

#include "plugin_sdk/geometry/circular_segment.h"
#include "plugin_sdk/math/gauss_legendre.h"
#include "plugin_sdk/math/transcendental.h"

namespace gravitas {
namespace {

constexpr double kFar = 2.0;  // half lengths: how far from the middle |v| has to vanish, if anywhere, for Gauss's rule
constexpr double kParallel = 1e-12;

void add(const Vector3& arm, const Vector3& push, Wrench* sum) {
  sum->force += push;
  sum->torque += arm.cross(push);
}

double asinh(double x) {
  const double size = std::fabs(x);
  return std::copysign(math::log(size + std::sqrt(size * size + 1.0)), x);
}

// Integrals of |a + b t| t^k over -half ... half, k = 0, 1, 2.
struct SpeedMoments {
  double zeroth = 0.0, first = 0.0, second = 0.0;
};

SpeedMoments speed_moments(const Vector3& a, const Vector3& b, double half) {
  SpeedMoments all;
  const double rate = b.norm();
  if (a.norm() >= kFar * half * rate) {
    math::for_gauss_points(-half, half, [&](double t, double weight) {
      const double speed = weight * (a + t * b).norm();
      all.zeroth += speed, all.first += t * speed, all.second += t * t * speed;
    });
    return all;
  }
  // |v|^2 = m^2 + b^2 s^2 with s from where it is least
  const double least = -a.dot(b) / (rate * rate), m = (a + least * b).norm();
  const auto primitive = [&](double s) {
    const double speed = std::sqrt(m * m + rate * rate * s * s), cube = speed * speed * speed;
    // what tends to 0 with m is none within rounding
    const double part = m > kParallel * rate * half ? m * m / rate * asinh(rate * s / m) : 0.0;
    const double zeroth = 0.5 * (s * speed + part);
    return SpeedMoments{zeroth, cube / (3.0 * rate * rate), (s * cube - m * m * zeroth) / (4.0 * rate * rate)};
  };
  const SpeedMoments end = primitive(half - least), begin = primitive(-half - least);
  const double j0 = end.zeroth - begin.zeroth, j1 = end.first - begin.first, j2 = end.second - begin.second;
  return {j0, j1 + least * j0, j2 + least * (2.0 * j1 + least * j0)};
}

Wrench on_side(double radius, double height, const Vector3& arm, const Vector3& axis, const Slip& slip) {
  const Vector3 middle = slip.at(arm), across = middle - axis.dot(middle) * axis, change = slip.angular.cross(axis);
  const SpeedMoments speed = speed_moments(across, change, 0.5 * height);
  Wrench sum;
  add(arm, 4.0 / 3.0 * radius * (speed.zeroth * across + speed.first * change), &sum);
  sum.torque += axis.cross(4.0 / 3.0 * radius * (speed.first * across + speed.second * change));
  return sum;
}

// With the outward unit normal.
void add_disc(double radius, const Vector3& arm, const Vector3& normal, const Slip& slip, Wrench* sum) {
  const double speed = normal.dot(slip.at(arm));
  const Vector3 change = normal.cross(slip.angular);  // of that speed, along the disc
  const double rate = change.norm();
  if (speed <= -rate * radius) return;
  const double square = radius * radius;
  double area = std::numbers::pi * square, first = 0.0, second = 0.25 * square * area, third = 0.0;
  if (speed < rate * radius) {
    // on the side of the chord where the speed rises, y downwards in the segment
    const double offset = speed / rate, half_chord = std::sqrt((radius - offset) * (radius + offset));
    const CircularSegment segment{radius, offset, half_chord};
    area = segment.area(), first = -segment.first_moment();
    second = segment.second_moment(), third = -segment.third_moment();
  }
  add(arm, (speed * speed * area + rate * (2.0 * speed * first + rate * second)) * normal, sum);
  if (rate > 0.0)
    sum->torque += (speed * speed * first + rate * (2.0 * speed * second + rate * third)) / rate * change.cross(normal);
}

// Whose round side is along the unit vector.
void add_half_ball(double radius, const Vector3& arm, const Vector3& outward, const Slip& slip, Wrench* sum) {
  const Vector3 u = slip.at(arm);
  const double speed = u.norm(), along = outward.dot(u);
  const double across = (u - along * outward).squaredNorm();
  add(arm, 0.125 * std::numbers::pi * radius * radius * (2.0 * (speed + along) * u + across * outward), sum);
}

}  // namespace

Wrench on_ball(double radius, const Vector3& arm, const Slip& slip) {
  const Vector3 u = slip.at(arm);
  Wrench sum;
  add(arm, 0.5 * std::numbers::pi * radius * radius * u.norm() * u, &sum);
  return sum;
}

Wrench on_cylinder(double radius, double height, const Vector3& arm, const Vector3& axis, const Slip& slip) {
  Wrench sum = on_side(radius, height, arm, axis, slip);
  add_disc(radius, arm - 0.5 * height * axis, -axis, slip, &sum);
  add_disc(radius, arm + 0.5 * height * axis, axis, slip, &sum);
  return sum;
}

Wrench on_capsule(double radius, double height, const Vector3& arm, const Vector3& axis, const Slip& slip) {
  Wrench sum = on_side(radius, height, arm, axis, slip);
  add_half_ball(radius, arm - 0.5 * height * axis, -axis, slip, &sum);
  add_half_ball(radius, arm + 0.5 * height * axis, axis, slip, &sum);
  return sum;
}

}  // namespace gravitas
