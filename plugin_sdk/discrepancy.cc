#include "plugin_sdk/discrepancy.h"

#include <algorithm>
#include <cmath>

#include "plugin_sdk/body.h"
#include "plugin_sdk/math/rotation.h"
#include "plugin_sdk/math/transcendental.h"

namespace gravitas {
JacobianRow jacobian_row(const Discrepancy& discrepancy, const Vector3& axis, const Vector3& com1,
                         const Vector3& com2) {
  if (discrepancy.is_angular()) return {Vector3::Zero(), -axis, Vector3::Zero(), axis};
  const Vector3 middle = 0.5 * (discrepancy.point1 + discrepancy.point2);
  const Vector3 r1 = middle - com1;
  const Vector3 r2 = middle - com2;
  return {-axis, -r1.cross(axis), axis, r2.cross(axis)};
}

Vector3 carried(const Vector3& point, const Pose& from, const Pose& to) {
  return to.orientation * (from.orientation.conjugate() * (point - from.position)) + to.position;
}

Swing swing_between(const Vector3& first, const Vector3& second) {
  const Vector3 across = first.cross(second);
  const double sine = across.norm();
  // below, the direction is rounding's
  const Vector3 axis = sine > 1e-12 ? Vector3(across / sine) : orthonormal_basis(first).first;
  return {math::atan2(sine, first.dot(second)), axis};
}

SwingDirections swing_directions(const Discrepancy& swing) {
  const Vector3 first = swing.axes * Vector3::UnitY();
  return {first, exp_rotation(swing.point2) * first};
}

double held_angle(const Discrepancy& swing) { return (swing.axes * Vector3::UnitX()).dot(swing.point1); }

void set_swing(const SwingDirections& directions, double angle, Discrepancy* swing) {
  const Swing now = swing_between(directions.first, directions.second);
  swing->point1 = angle * now.axis;
  swing->point2 = now.angle * now.axis;
  Matrix3 axes;
  axes << now.axis, directions.first, now.axis.cross(directions.first);
  swing->axes = to_quaternion(axes);
}

double twist_between(const Quaternion& frame1, const Quaternion& frame2) {
  // relative turn q = swing * twist about x: the twist is the part of q about x
  const Quaternion q = shorter_arc(frame1.conjugate() * frame2);
  const double twist = 2.0 * math::atan2(q.x(), q.w());
  if (twist > 0.5 * kWholeTurn) return twist - kWholeTurn;
  return twist < -0.5 * kWholeTurn ? twist + kWholeTurn : twist;
}

Vector3 Twisting::bisector() const {
  constexpr double kAgainst = 1e-9;
  const Vector3 sum = first + second;
  const double length = sum.norm();
  return length > kAgainst ? Vector3(sum / length) : orthonormal_basis(first).first;
}

Twisting Twisting::turned(const Quaternion& turn1, const Quaternion& turn2) const {
  // how frames turn about their shafts together is no matter
  const auto [second_axis, third_axis] = orthonormal_basis(first);
  Matrix3 axes;
  axes << first, second_axis, third_axis;
  const Swing bend = swing_between(first, second);
  const Quaternion frame1 = to_quaternion(axes);
  const Quaternion frame2 = exp_rotation(angle * second) * (exp_rotation(bend.angle * bend.axis) * frame1);
  const double now = twist_between(turn1 * frame1, turn2 * frame2);
  return {turn1 * first, turn2 * second, now - kWholeTurn * std::round((now - angle) / kWholeTurn)};
}

Twisting twisting_of(const Discrepancy& twist) {
  const Vector3 bisector = twist.axes * Vector3::UnitX(), &half = twist.point1;
  const double cosine = std::sqrt(std::max(0.0, 1.0 - half.squaredNorm()));
  const double error = bisector.dot(twist.point2 - twist.point1);
  return {cosine * bisector + half, cosine * bisector - half, cosine > 0.0 ? error / cosine : 0.0};
}

void set_twisting(const Twisting& twisting, Discrepancy* twist) {
  const Vector3 bisector = twisting.bisector();
  twist->point1 = 0.5 * (twisting.first - twisting.second);
  twist->point2 = twist->point1 + twisting.cosine() * twisting.angle * bisector;
  const auto [second, third] = orthonormal_basis(bisector);
  Matrix3 axes;
  axes << bisector, second, third;
  twist->axes = to_quaternion(axes);
}

Vector3 turn_after(const Vector3& turn, const Quaternion& turn1, const Quaternion& turn2) {
  const Vector3 now = log_rotation(turn2 * exp_rotation(turn) * turn1.conjugate());
  const double angle = now.norm();
  if (angle == 0.0) return Vector3::Zero();
  const Vector3 axis = now / angle;
  return (angle + kWholeTurn * std::round((turn.dot(axis) - angle) / kWholeTurn)) * axis;
}

TurnComponent TurnComponent::turned(const Quaternion& turn1, const Quaternion& turn2) const {
  return {turn_after(turn, turn1, turn2), turn1 * direction};
}

Vector3 TurnComponent::gradient() const {
  constexpr double kLargest = 0.75 * kWholeTurn;
  const double angle = turn.norm();
  // dexp_t^-T = dexp_-t^-1
  return rotation_vector_rate(angle > kLargest ? Vector3(-kLargest / angle * turn) : Vector3(-turn), direction);
}

TurnComponent turn_component_of(const Discrepancy& component) {
  return {component.point2 - component.point1, component.point1};
}

void set_turn_component(const TurnComponent& component, Discrepancy* d) {
  d->point1 = component.direction;
  d->point2 = component.direction + component.turn;
  const Vector3 first = component.gradient().normalized();
  const auto [second, third] = orthonormal_basis(first);
  Matrix3 axes;
  axes << first, second, third;
  d->axes = to_quaternion(axes);
}

Vector3 error_at(const Discrepancy& discrepancy, const Pose& now1, const Pose& now2, const Pose& then1,
                 const Pose& then2) {
  const Vector3 error = discrepancy.point2 - discrepancy.point1;
  if (!discrepancy.is_angular())
    return carried(discrepancy.point2, now2, then2) - carried(discrepancy.point1, now1, then1);
  if (discrepancy.is_swing()) {
    const auto [first, second] = swing_directions(discrepancy);
    const double angle = swing_between(then1.orientation * (now1.orientation.conjugate() * first),
                                       then2.orientation * (now2.orientation.conjugate() * second))
                             .angle;
    return (angle - held_angle(discrepancy)) * (discrepancy.axes * Vector3::UnitX());
  }
  if (discrepancy.is_twist()) {
    const Twisting now = twisting_of(discrepancy);
    const Twisting then =
        now.turned(then1.orientation * now1.orientation.conjugate(), then2.orientation * now2.orientation.conjugate());
    return now.cosine() * then.angle * (discrepancy.axes * Vector3::UnitX());
  }
  if (discrepancy.is_component()) {
    const TurnComponent now = turn_component_of(discrepancy);
    const TurnComponent then =
        now.turned(then1.orientation * now1.orientation.conjugate(), then2.orientation * now2.orientation.conjugate());
    return then.value() / now.gradient().norm() * (discrepancy.axes * Vector3::UnitX());
  }
  const Vector3 turn1 = log_rotation(then1.orientation * now1.orientation.conjugate());
  const Vector3 turn2 = log_rotation(then2.orientation * now2.orientation.conjugate());
  return error + turn2 - turn1;
}

Vector3 error_in_axes_at(const Discrepancy& discrepancy, const Pose& now1, const Pose& now2, const Pose& then1,
                         const Pose& then2) {
  const Vector3 error = error_at(discrepancy, now1, now2, then1, then2);
  return discrepancy.is_angular() ? error : now1.orientation * (then1.orientation.conjugate() * error);
}

double joint_error(const Discrepancy& discrepancy, const Vector3& error) {
  const Matrix3 axes = discrepancy.axes.toRotationMatrix();
  double sum = 0.0;
  for (int i = 0; i < 3; ++i) {
    if (discrepancy.compliance[i] > 0.0) continue;
    const double along = discrepancy.is_radial() && i == 0 ? error.norm() : axes.col(i).dot(error);
    double excess = 0.0;
    switch (axis_mode(discrepancy.modes, i)) {
      case AxisMode::kLocked:
        excess = along;
        break;
      case AxisMode::kLimited:
        excess = std::max({0.0, discrepancy.lower[i] - along, along - discrepancy.upper[i]});
        break;
      case AxisMode::kUnilateral:
        excess = std::max(0.0, -along);
        break;
      default:
        break;
    }
    sum += excess * excess;
  }
  return std::sqrt(sum);
}

Vector3 limit_gaps(const Discrepancy& discrepancy) {
  const Matrix3 axes = discrepancy.axes.toRotationMatrix();
  const Vector3 error = discrepancy.point2 - discrepancy.point1;
  Vector3 gaps = Vector3::Constant(kUnlimited);
  for (int i = 0; i < 3; ++i) {
    if (discrepancy.compliance[i] > 0.0) continue;
    const double along = discrepancy.is_radial() && i == 0 ? error.norm() : axes.col(i).dot(error);
    const double lower = discrepancy.lower[i], upper = discrepancy.upper[i];
    const AxisMode mode = axis_mode(discrepancy.modes, i);
    if (mode == AxisMode::kUnilateral) gaps[i] = along;
    if (mode != AxisMode::kLimited || lower == upper) continue;
    if (lower > -kUnlimited) gaps[i] = along - lower;
    if (upper < kUnlimited) gaps[i] = std::min(gaps[i], upper - along);
  }
  return gaps;
}

Discrepancy contact_discrepancy(const Vector3& point, const Vector3& normal, double depth) {
  Discrepancy contact;
  contact.point1 = point + 0.5 * depth * normal;
  contact.point2 = point - 0.5 * depth * normal;
  const auto [tangent1, tangent2] = orthonormal_basis(normal);
  Matrix3 axes;
  axes << normal, tangent1, tangent2;
  contact.axes = to_quaternion(axes);
  contact.modes = pack_modes(AxisMode::kUnilateral, AxisMode::kFriction, AxisMode::kFriction);
  return contact;
}

Discrepancy DiscrepancyColumns::at(std::size_t row) const {
  Discrepancy d;
  d.point1 = vector_at(point1, row);
  d.point2 = vector_at(point2, row);
  d.velocity = vector_at(velocity, row);
  d.correction = correction[row];
  d.axes = quaternion_at(axes, row);
  d.modes = mode[row];
  d.lower = vector_at(lower, row);
  d.upper = vector_at(upper, row);
  d.compliance = vector_at(compliance, row);
  d.damping = vector_at(damping, row);
  d.maximum_force = vector_at(maximum_force, row);
  if (!restitution.empty()) d.restitution = restitution[row];
  if (!desired_acceleration.empty()) d.acceleration = vector_at(desired_acceleration, row);
  return d;
}

}  // namespace gravitas
