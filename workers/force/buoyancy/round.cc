// Cylinders and capsules below a plane: submerged.h has the equations.
#include <algorithm>
#include <cmath>
#include <numbers>

#include "plugin_sdk/geometry/circular_segment.h"
#include "plugin_sdk/math/gauss_legendre.h"
#include "plugin_sdk/math/transcendental.h"
#include "workers/force/buoyancy/submerged.h"

namespace gravitas {
namespace {

constexpr double kHalfTurn = std::numbers::pi;

// Volume, and first moment about a point.
struct Part {
  double volume = 0.0;
  Vector3 moment = Vector3::Zero();

  void add(const Part& other, const Vector3& shift) {
    volume += other.volume;
    moment += other.moment + other.volume * shift;
  }
};

// The cap of a ball about the origin beyond the distance r - depth along a unit vector.
Part cap(double radius, double depth, const Vector3& along) {
  const double h = std::clamp(depth, 0.0, 2.0 * radius), left = 2.0 * radius - h;
  return {kHalfTurn / 3.0 * h * h * (3.0 * radius - h), 0.25 * kHalfTurn * h * h * left * left * along};
}

// The half of a ball about the origin where inward.x <= 0, below up.x = level.
Part half_ball(double r, const Vector3& inward, const Vector3& up, double level) {
  const double s = up.dot(inward), q = (up - s * inward).norm();
  if (level >= q * r) {
    // the flat side is under water, and at most a cap of the round one above
    const Part dry = s < 0.0 ? cap(r, r - level, up) : Part{};
    return {2.0 / 3.0 * kHalfTurn * r * r * r - dry.volume, -0.25 * kHalfTurn * r * r * r * r * inward - dry.moment};
  }
  if (level <= -q * r) return s > 0.0 ? cap(r, r + level, -up) : Part{};
  const double half_chord = std::sqrt((q * r - level) * (q * r + level)) / q;
  const CircularSegment flat{r, level / q, half_chord};
  const CircularSegment water{std::sqrt((r - level) * (r + level)), -s * level / q, half_chord};
  const double corner = math::atan2(q * half_chord, s * r);
  const double surface = r * r * (2.0 * kHalfTurn - 2.0 * corner) + 2.0 * r * level * water.angle;
  const double along_up = water.polar_moment() + (level * level - r * r) * water.area();
  return {(r * surface + level * water.area()) / 3.0,
          0.5 * ((flat.polar_moment() - r * r * flat.area()) * inward + along_up * up)};
}

// A cylinder about the origin, with a unit axis that does not point down.
Part cylinder(double r, double half_height, const Vector3& axis, const Vector3& up, double level) {
  const double s = up.dot(axis);
  const Vector3 ahead = up - s * axis;
  const double q = ahead.norm();
  // where along the axis the sections' lowest (side = 1) or highest points (-1) pass the plane
  const auto passes = [&](double side) {
    const double way = level + side * q * r;
    return std::fabs(way) < s * half_height ? way / s : std::copysign(half_height, way);
  };
  const double wet_until = passes(-1.0), dry_from = passes(1.0);
  Part part;
  double along = 0.0, across = 0.0;
  const auto add = [&](double t, double length, double area, double moment) {
    part.volume += length * area;
    along += length * t * area;
    across += length * moment;
  };
  add(0.5 * (wet_until - half_height), wet_until + half_height, kHalfTurn * r * r, 0.0);
  if (dry_from > wet_until) {
    // the chord is at r sin(a), so dt goes by cos(a) da
    const auto angle_at = [&](double t) { return math::asin(std::clamp((level - s * t) / (q * r), -1.0, 1.0)); };
    const double begin = angle_at(wet_until), end = angle_at(dry_from);
    const math::SinCos half = math::sincos(0.5 * (end - begin)), middle = math::sincos(0.5 * (begin + end));
    const double whole = half.sin * middle.cos, length = dry_from - wet_until;
    math::for_gauss_points(0.0, 1.0, [&](double share, double weight) {
      const double angle = begin + share * (end - begin);
      const math::SinCos chord = math::sincos(angle);
      double way = share, density = 1.0;  // of the length, and d way / d share
      if (whole != 0.0) {
        way = math::sin(0.5 * share * (end - begin)) * math::cos(begin + 0.5 * share * (end - begin)) / whole;
        density = 0.5 * (end - begin) * chord.cos / whole;
      }
      const double half_chord = r * chord.cos;
      add(wet_until + way * length, weight * density * length,
          r * r * (0.5 * kHalfTurn + angle + chord.sin * chord.cos), -2.0 / 3.0 * half_chord * half_chord * half_chord);
    });
  }
  part.moment = along * axis;
  if (q > 0.0) part.moment += across / q * ahead;
  return part;
}

Submerged as_submerged(const Part& part, double whole, const Vector3& centre) {
  const double volume = std::clamp(part.volume, 0.0, whole);
  return {volume, volume > 0.0 ? Vector3(centre + part.moment / volume) : centre, whole};
}

// Up along the axis of a body of revolution that is the same upside down.
Vector3 upward_axis(const Pose& pose, const Vector3& up) {
  const Vector3 axis = pose.orientation * Vector3::UnitY();
  return up.dot(axis) < 0.0 ? -axis : axis;
}

}  // namespace

Submerged submerged_cylinder(double radius, double height, const Pose& pose, const Vector3& up, double level) {
  const double depth = level - up.dot(pose.position);
  const Part part = cylinder(radius, 0.5 * height, upward_axis(pose, up), up, depth);
  return as_submerged(part, kHalfTurn * radius * radius * height, pose.position);
}

Submerged submerged_capsule(double radius, double height, const Pose& pose, const Vector3& up, double level) {
  const Vector3 axis = upward_axis(pose, up), end = 0.5 * height * axis;
  const double depth = level - up.dot(pose.position), rise = up.dot(end);
  Part part = cylinder(radius, 0.5 * height, axis, up, depth);
  part.add(half_ball(radius, axis, up, depth + rise), -end);
  part.add(half_ball(radius, -axis, up, depth - rise), end);
  return as_submerged(part, kHalfTurn * radius * radius * (height + 4.0 / 3.0 * radius), pose.position);
}

}  // namespace gravitas
