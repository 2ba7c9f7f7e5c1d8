#include "plugin_sdk/joint_coordinates.h"

#include <cmath>
#include <string>

#include "plugin_sdk/math/rotation.h"
#include "plugin_sdk/math/transcendental.h"

namespace gravitas {
namespace {

// Of a point of body 2 as body 1 sees it.
Vector3 velocity_of(const Vector3& point, const JointBodies& bodies) {
  return bodies.velocity2 + bodies.spin2.cross(point - bodies.pose2.position) - bodies.velocity1 -
         bodies.spin1.cross(point - bodies.pose1.position);
}

}  // namespace

namespace detail {

void push_coordinate(const stage::ConstraintCoordinatesReply& reply, std::size_t joint, std::uint32_t index,
                     const Coordinate& coordinate) {
  if (!std::isfinite(coordinate.value) || !std::isfinite(coordinate.rate))
    throw Refusal("its coordinate " + std::to_string(index) + " is no finite number in this state");
  reply.constraint().push(static_cast<std::uint32_t>(joint));
  reply.coordinate().push(index);
  reply.value().push(coordinate.value);
  reply.rate().push(coordinate.rate);
}

}  // namespace detail

Coordinate way_along(const Vector3& axis, const Vector3& point1, const Vector3& point2, const JointBodies& bodies) {
  return {axis.dot(point2 - point1), axis.dot(velocity_of(point2, bodies))};
}

Coordinate distance_between(const Vector3& point1, const Vector3& point2, const JointBodies& bodies) {
  const Vector3 between = point2 - point1, velocity = velocity_of(point2, bodies);
  const double length = between.norm();
  return {length, length > 0.0 ? (between / length).dot(velocity) : velocity.norm()};
}

std::optional<Coordinate> twist_of(const Pose& frame1, const Pose& frame2, const JointLimits& limits,
                                   const JointBodies& bodies) {
  constexpr double kAgainst = 1e-12;
  const Vector3 one = frame1.orientation * Vector3::UnitX(), two = frame2.orientation * Vector3::UnitX();
  const double bend = 1.0 + one.dot(two);
  if (!(bend > kAgainst)) return std::nullopt;
  const double rate = (bodies.spin2 - bodies.spin1).dot(one + two) / bend;
  const double twist = twist_between(frame1.orientation, frame2.orientation);
  // where it is: no step is to be foretold
  return Coordinate{limits.is_none() ? within_half_turn(twist) : limits.turn(twist, 0.0), rate};
}

Coordinate swing_of(const Vector3& first, const Vector3& second, const JointBodies& bodies) {
  constexpr double kParallel = 1e-12;  // as swing_between() has it
  const Vector3 turning = bodies.spin2 - bodies.spin1;
  const Swing swing = swing_between(first, second);
  if (first.cross(second).norm() > kParallel) return {swing.angle, turning.dot(swing.axis)};
  const double across = (turning - first.dot(turning) * first).norm();
  return {swing.angle, swing.angle < kQuarterTurn ? across : -across};
}

std::optional<Coordinate> azimuth_of(const Vector3& axis, const Vector3& zero, const Vector3& direction,
                                     const Vector3& turning) {
  constexpr double kAlong = 1e-9;  // rad; nearer to the axis an azimuth is mostly rounding
  const double cosine = axis.dot(direction), sine = axis.cross(direction).norm();
  if (!(sine > kAlong)) return std::nullopt;
  const double angle = math::atan2(axis.cross(zero).dot(direction), zero.dot(direction));
  return Coordinate{within_half_turn(angle), (axis.dot(turning) - cosine * direction.dot(turning)) / (sine * sine)};
}

std::optional<Coordinate> reversed(const std::optional<Coordinate>& angle) {
  if (!angle) return std::nullopt;
  return Coordinate{within_half_turn(-angle->value), -angle->rate};
}

double within_half_turn(double angle) {
  const double within = angle - kWholeTurn * std::round(angle / kWholeTurn);
  return within <= -kHalfTurn ? kHalfTurn : within;
}

}  // namespace gravitas
