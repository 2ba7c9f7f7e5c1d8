#include "plugin_sdk/joint_rows.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <string>

#include "plugin_sdk/math/rotation.h"
#include "plugin_sdk/math/transcendental.h"

namespace gravitas {
namespace {

Vector3 first_axis(const Quaternion& q) { return q * Vector3::UnitX(); }

Discrepancy row_of(const Twisting& twisting, AxisMode mode) {
  Discrepancy d;
  set_twisting(twisting, &d);
  d.modes = pack_modes(mode, AxisMode::kFree, AxisMode::kFree) | kAngularDiscrepancy | kTwistDiscrepancy;
  return d;
}

constexpr double kPast = 0.02;      // rad, that a step may begin beyond a limit by
constexpr double kRounding = 1e-6;  // rad, of turns

}  // namespace

void demand_type(std::uint64_t type, std::string_view name) {
  if (type != type_id(name)) throw Refusal("it is of a type that this plugin does not know");
}

Vector3 unit_axis(const Vector3& axis, std::string_view field) {
  const double length = axis.stableNorm();
  if (!(length > 0.0) || !std::isfinite(length)) throw Refusal(std::string(field) + " has no direction");
  return axis / length;
}

StepTurn twisted_way(const Quaternion& frame1, const Quaternion& frame2, const JointBodies& bodies) {
  const Vector3 one = first_axis(frame1), two = first_axis(frame2);
  const double bend = 1.0 + one.dot(two);
  if (!(bend > 0.0)) return {};
  const Vector3 along = (one + two) / bend;
  return StepTurn::of((bodies.start_spin2 - bodies.start_spin1).dot(along), (bodies.spin2 - bodies.spin1).dot(along),
                      bodies.elapsed);
}

JointLimits JointLimits::of(double lower, double upper, std::string_view lower_field, std::string_view upper_field) {
  JointLimits limits;
  if (!std::isnan(lower)) limits.lower = lower;
  if (!std::isnan(upper)) limits.upper = upper;
  if (limits.lower > limits.upper)
    throw Refusal(std::string(lower_field) + " " + std::to_string(lower) + " lies above " + std::string(upper_field) +
                  " " + std::to_string(upper));
  if (limits.lower > 0.0)
    throw Refusal(std::string(lower_field) + " " + std::to_string(lower) + " lies above 0, where the joint starts");
  if (limits.upper < 0.0)
    throw Refusal(std::string(upper_field) + " " + std::to_string(upper) + " lies below 0, where the joint starts");
  return limits;
}

JointLimits JointLimits::of_turn(double lower, double upper, std::string_view lower_field,
                                 std::string_view upper_field) {
  const JointLimits limits = of(lower, upper, lower_field, upper_field);
  const bool has_lower = limits.lower > -kUnlimited, has_upper = limits.upper < kUnlimited;
  // what rests on one of two that all but meet is told as resting on the other, by rounding
  if (has_lower && has_upper && limits.upper - limits.lower >= kWholeTurn - kRounding)
    throw Refusal(std::string(upper_field) + " lies a full turn or more above " + std::string(lower_field) +
                  ", which limits nothing");
  if (has_lower != has_upper && std::fabs(has_lower ? limits.lower : limits.upper) >= kWholeTurn - kPast)
    throw Refusal(std::string(has_lower ? lower_field : upper_field) +
                  " lies a full turn or more from 0, where the joint starts, and turns are not counted");
  return limits;
}

void JointLimits::limit(double scale, Discrepancy* d) const {
  d->lower.x() = lower > -kUnlimited ? scale * lower : -kUnlimited;
  d->upper.x() = upper < kUnlimited ? scale * upper : kUnlimited;
  d->restitution = restitution;
  if (spring.is_none()) return;
  d->compliance.x() = 1.0 / spring.stiffness;
  d->damping.x() = spring.damping;
}

double JointLimits::turn(double angle, double way) const {
  constexpr double kOfWay = 0.5, kMostPast = 1.0;  // rad
  if (is_none()) return angle;
  const bool has_lower = lower > -kUnlimited, has_upper = upper < kUnlimited;
  // the way is known to first order, or to half of it where a method turns by other spins than those at the end
  const double past = has_lower && has_upper ? kPast : std::min(kPast + kOfWay * std::fabs(way), kMostPast);
  double middle = 0.5 * (lower + upper);
  if (!has_lower) middle = upper + past - kHalfTurn;
  if (!has_upper) middle = lower - past + kHalfTurn;
  const auto nearest = [&](double any) { return any - kWholeTurn * std::round((any - middle) / kWholeTurn); };
  const double seen = nearest(angle), begun = seen - way, known = nearest(begun);
  if (!(known >= lower - past && known <= upper + past)) return seen;
  return seen + (known - begun);
}

double JointLimits::at_limit(double one, double other) const {
  const bool has_lower = lower > -kUnlimited, has_upper = upper < kUnlimited;
  if (has_lower == has_upper) return one;
  return has_upper ? std::max(one, other) : std::min(one, other);
}

double JointLimits::limited_turn(double angle, double way) const {
  constexpr double kRests = 1e-9, kMoves = 1e-2;  // rad; of how far it is beyond
  const bool has_lower = lower > -kUnlimited, has_upper = upper < kUnlimited;
  const double turned = turn(angle, way), begun = turned - way;
  // what moves out of a single limit, or through it from behind, needs no push; what rests on it is beyond it by rounding
  const auto moves_out = [](double beyond, double out) {
    return beyond > kRests && out > kMoves * beyond && out < beyond;
  };
  if (!has_lower && moves_out(begun - upper, -way)) return turned - kWholeTurn;
  if (!has_upper && moves_out(lower - begun, way)) return turned + kWholeTurn;
  return turned;
}

void write_limits(const JointLimits& limits, BoundWriter* out) {
  for (const double number : {limits.lower, limits.upper, limits.restitution}) out->number(number);
}

JointLimits read_limits(PropertyCursor* bound) {
  JointLimits limits;
  limits.lower = bound->number();
  limits.upper = bound->number();
  limits.restitution = bound->number();
  return limits;
}

Property restitution_property() {
  return Property::number("Restitution", "1")
      .at_least(0.0)
      .at_most(1.0)
      .defaults_to({0.0})
      .means(
          "Share of the speed at which a limit is met that it is left at; 0: it stops dead. Limits that give way have "
          "none.");
}

double read_restitution(PropertyCursor* properties, std::string_view type, bool has_stops, std::string_view stops) {
  const double restitution = properties->at_end() ? 0.0 : properties->number();
  if (!(restitution >= 0.0 && restitution <= 1.0))
    throw Refusal(std::string(type) + ": Restitution " + std::to_string(restitution) + " is outside 0 ... 1");
  if (restitution > 0.0 && !has_stops)
    throw Refusal(std::string(type) + ": Restitution is given without " + std::string(stops));
  return restitution;
}

Property limit_stiffness_property(std::string_view unit, std::string_view whose, std::string_view needs) {
  return Property::number(std::string(whose) + "LimitStiffness", std::string(unit))
      .above(0.0)
      .means("Spring that pushes back what is beyond a limit; absent: limits stop dead." +
             (needs.empty() ? std::string() : " Needs " + std::string(needs) + "."));
}

Property limit_damping_property(std::string_view unit, std::string_view whose) {
  return Property::number(std::string(whose) + "LimitDamping", std::string(unit))
      .at_least(0.0)
      .means("Its damper, which never pulls; none if absent.");
}

JointSpring read_limit_spring(PropertyCursor* properties, std::string_view type, const JointLimits& limits,
                              bool has_stops, std::string_view stops, std::string_view whose) {
  const JointSpring spring = JointSpring::of(properties);
  const std::string joint = std::string(type) + ": ", limit = std::string(whose) + "Limit";
  if (spring.stiffness > 0.0 && !has_stops)
    throw Refusal(joint + limit + "Stiffness is given without " + std::string(stops));
  if (spring.damping > 0.0 && spring.stiffness == 0.0)
    throw Refusal(joint + limit + "Damping is given without " + limit + "Stiffness");
  if (spring.stiffness > 0.0 && limits.lower == limits.upper)
    throw Refusal(joint + limit +
                  "Stiffness is given with limits that leave no room; allowed: a spring in their place");
  if (limits.restitution > 0.0 && spring.stiffness > 0.0)
    throw Refusal(joint + "Restitution is given without limits that stop dead: " + limit +
                  "Stiffness lets them give way");
  return spring.stiffness > 0.0 ? spring : JointSpring{};
}

JointSpring JointSpring::of(PropertyCursor* properties) {
  if (properties->at_end()) return {};
  const double stiffness = properties->number(), damping = properties->number();
  if (stiffness < 0.0 || damping < 0.0) throw Refusal("a stiffness or damping is negative");
  return {std::isnan(stiffness) ? 0.0 : stiffness, std::isnan(damping) ? 0.0 : damping};
}

void JointSpring::yield_on(int axis, Discrepancy* d) const {
  const AxisMode mode = stiffness > 0.0 ? AxisMode::kLocked : damping > 0.0 ? AxisMode::kDriven : AxisMode::kFree;
  d->modes = (d->modes & ~(0xFU << (4 * axis))) | static_cast<std::uint32_t>(mode) << (4 * axis);
  if (stiffness > 0.0) d->compliance[axis] = 1.0 / stiffness;
  d->damping[axis] = damping;
}

void write_spring(const JointSpring& spring, BoundWriter* out) {
  out->number(spring.stiffness);
  out->number(spring.damping);
}

JointSpring read_spring(PropertyCursor* bound) {
  const double stiffness = bound->number();
  return {stiffness, bound->number()};
}

void write_soft_limits(const JointLimits& limits, BoundWriter* out) {
  write_limits(limits, out);
  write_spring(limits.spring, out);
}

JointLimits read_soft_limits(PropertyCursor* bound) {
  JointLimits limits = read_limits(bound);
  limits.spring = read_spring(bound);
  return limits;
}

Discrepancy sprung(Discrepancy row, const JointSpring& spring) {
  spring.yield_on(0, &row);
  return row;
}

JointSpring on_swing(const JointSpring& spring, double sine, double swing) {
  constexpr double kSquare = 1e-9, kMost = 1.4;  // rad, where the swing hardly changes any more
  constexpr double kSmall = 1e-4;                // below it a quotient is its limit
  if (!(sine < 1.0 - kSquare)) return spring;
  const double angle = math::asin(std::min(math::sin(std::fabs(swing)) / sine, math::sin(kMost)));
  const double told = math::asin(sine * math::sin(angle));
  // d angle/d swing
  const double slope = math::cos(told) / (sine * math::cos(angle));
  const double stiffness = angle > kSmall ? angle * slope / told : slope * slope;
  return {stiffness * spring.stiffness, slope * slope * spring.damping};
}

void write_drive(PropertyCursor* properties, std::string_view type, BoundWriter* out, std::string_view which) {
  if (properties->at_end()) return;
  const double speed = properties->number(), torque = properties->number();
  if (std::isnan(speed)) {
    if (!std::isnan(torque))
      throw Refusal(std::string(type) + ": MaximumTorque" + std::string(which) + " is given without AngularSpeed" +
                    std::string(which));
    return;
  }
  out->number(speed);
  out->number(std::isnan(torque) ? kUnlimited : torque);
}

Pose frame_along(const Vector3& origin, const Vector3& first) {
  const auto [second, third] = orthonormal_basis(first);
  Matrix3 axes;
  axes << first, second, third;
  return {origin, to_quaternion(axes)};
}

Pose azimuth_frame(const Vector3& origin, const Vector3& first) {
  constexpr double kAlong = 1e-3;
  const Vector3 across = Vector3::UnitX() - first.x() * first;
  const Vector3 start = across.norm() > kAlong ? across : Vector3(first.z() * first - Vector3::UnitZ());
  Matrix3 axes;
  axes.col(0) = first, axes.col(1) = start.normalized(), axes.col(2) = first.cross(axes.col(1));
  return {origin, to_quaternion(axes)};
}

void write_frame(const Pose& body, const Pose& frame, BoundWriter* out) {
  const Pose in_body = relative(body, frame);
  out->vector(in_body.position);
  const Quaternion& q = in_body.orientation;
  for (const double number : {q.w(), q.x(), q.y(), q.z()}) out->number(number);
}

Pose read_frame(PropertyCursor* bound, const Pose& body) {
  const Vector3 position = bound->vector();
  const Quaternion orientation = bound->quaternion();
  Pose frame = compose(body, {position, orientation});
  frame.orientation = normalized(frame.orientation);
  return frame;
}

Discrepancy held_point(const Pose& frame1, const Vector3& point2, HeldAxes held, const Vector3& rest) {
  Discrepancy d;
  d.axes = frame1.orientation;
  const Matrix3 axes = to_rotation_matrix(frame1.orientation);
  d.point1 = d.point2 = point2;
  const bool marked[] = {held.x, held.y, held.z};
  AxisMode modes[3];
  for (int k = 0; k < 3; ++k) {
    modes[k] = marked[k] ? AxisMode::kLocked : AxisMode::kFree;
    if (marked[k]) d.point1 -= (axes.col(k).dot(point2 - frame1.position) - rest[k]) * axes.col(k);
  }
  d.modes = pack_modes(modes[0], modes[1], modes[2]);
  return d;
}

Discrepancy row_along(const Vector3& axis, const Vector3& point1, const Vector3& point2, AxisMode mode) {
  Discrepancy d;
  d.point1 = point1, d.point2 = point2;
  d.axes = frame_along(point1, axis).orientation;
  d.modes = pack_modes(mode, AxisMode::kFree, AxisMode::kFree);
  return d;
}

Discrepancy limited_way_row(const Vector3& axis, const Vector3& point1, const Vector3& point2,
                            const JointLimits& limits) {
  Discrepancy d = row_along(axis, point1, point2, AxisMode::kLimited);
  limits.limit(1.0, &d);
  return d;
}

Discrepancy meshing_row(const Vector3& axis, const Vector3& point, double ahead, double error, double period,
                        const JointBodies& bodies) {
  constexpr double kClearly = 1e-4;  // of a period
  Discrepancy d = row_along(axis, point, point, AxisMode::kLocked);
  const double made = bodies.elapsed * jacobian_row(d, axis, bodies.pose1.position, bodies.pose2.position)
                                           .velocity(bodies.velocity1, bodies.spin1, bodies.velocity2, bodies.spin2);
  double nearest = std::numeric_limits<double>::infinity(), known = error;
  for (const double share : {1.0, 0.5, 0.0}) {
    const double expected = share * made, one = error - period * std::round((error - expected) / period);
    const double apart = std::fabs(one - expected);
    if (!(apart < nearest - kClearly * period)) continue;
    nearest = apart, known = one;
  }
  d.point1 -= (1.0 - ahead) * known * axis;
  d.point2 += ahead * known * axis;
  return d;
}

Discrepancy row_about(const Vector3& axis, double angle, AxisMode mode) {
  Discrepancy d = row_along(axis, Vector3::Zero(), angle * axis, mode);
  d.modes |= kAngularDiscrepancy;
  return d;
}

Discrepancy driven_row(const Vector3& axis, double speed, double torque) {
  return driven(row_about(axis, 0.0, AxisMode::kDriven), speed * axis, torque);
}

Discrepancy driven(const Discrepancy& row, const Vector3& velocity, double torque) {
  Discrepancy drive = row;
  drive.velocity = velocity;
  drive.maximum_force.x() = torque;
  return drive;
}

Pose hinge_frame(const Vector3& point1, const Vector3& point2, const JointBodies& bodies, std::string_view type) {
  const std::string joint(type);
  if (point1 == point2) throw Refusal(joint + ": BindAxisPoint1 and BindAxisPoint2 are the same point");
  const Vector3 axis = unit_axis(point2 - point1, joint + ": BindAxisPoint1, BindAxisPoint2");
  return frame_along(point1 + axis.dot(bodies.centre() - point1) * axis, axis);
}

Vector3 axis_between(const Pose& frame1, const Pose& frame2) {
  return (frame1.orientation * Vector3::UnitX() + frame2.orientation * Vector3::UnitX()).normalized();
}

Discrepancy swing_row(const Vector3& first, const Vector3& second, double angle, AxisMode mode) {
  Discrepancy d;
  set_swing({first, second}, angle, &d);
  d.modes = pack_modes(mode, AxisMode::kFree, AxisMode::kFree) | kAngularDiscrepancy | kSwingDiscrepancy;
  return d;
}

Discrepancy cone_row(const Vector3& first, const Vector3& second, double most, double restitution) {
  Discrepancy row = swing_row(first, second, most, AxisMode::kLimited);
  row.lower.x() = -kUnlimited;
  row.restitution = restitution;
  return row;
}

Pose cross_frame(const Vector3& origin, const Vector3& first, const Vector3& other) {
  Matrix3 axes;
  axes.col(0) = first;
  axes.col(2) = first.cross(other).normalized();
  axes.col(1) = axes.col(2).cross(first);
  return {origin, to_quaternion(axes)};
}

Discrepancy turn_between(const Quaternion& frame1, const Quaternion& frame2) {
  Discrepancy d;
  d.axes = frame1;
  d.point2 = log_rotation(frame2 * frame1.conjugate());
  d.modes = pack_modes(AxisMode::kFree, AxisMode::kFree, AxisMode::kFree, true);
  return d;
}

Discrepancy sprung_turn(const Quaternion& frame1, const Quaternion& frame2, const JointSpring& spring) {
  Discrepancy d = turn_between(frame1, frame2);
  for (int axis = 0; axis < 3; ++axis) spring.yield_on(axis, &d);
  return d;
}

Discrepancy sprung_component(const Quaternion& frame1, const Quaternion& frame2, int axis, const JointSpring& spring) {
  const TurnComponent component = {log_rotation(frame2 * frame1.conjugate()), frame1 * Vector3::Unit(axis)};
  Discrepancy d;
  set_turn_component(component, &d);
  d.modes = pack_modes(AxisMode::kFree, AxisMode::kFree, AxisMode::kFree) | kAngularDiscrepancy | kComponentDiscrepancy;
  // its error is over the gradient's length
  const double square = component.gradient().squaredNorm();
  return sprung(d, {square * spring.stiffness, square * spring.damping});
}

Discrepancy twist_row(const Quaternion& frame1, const Quaternion& frame2, AxisMode mode, double* scale) {
  const Twisting twisting = {first_axis(frame1), first_axis(frame2), twist_between(frame1, frame2)};
  *scale = twisting.cosine();
  return row_of(twisting, mode);
}

Discrepancy limited_twist_row(const Quaternion& frame1, const Quaternion& frame2, const JointBodies& bodies,
                              const JointLimits& limits) {
  const double twist = limits.limited_turn(twist_between(frame1, frame2), twisted_way(frame1, frame2, bodies));
  const Twisting twisting = {first_axis(frame1), first_axis(frame2), twist};
  Discrepancy d = row_of(twisting, AxisMode::kLimited);
  limits.limit(twisting.cosine(), &d);
  return d;
}

Discrepancy sprung_twist_row(const Quaternion& frame1, const Quaternion& frame2, const JointBodies& bodies,
                             const JointLimits& limits, double rest, const JointSpring& spring) {
  const double twist = limits.turn(twist_between(frame1, frame2), twisted_way(frame1, frame2, bodies));
  Twisting twisting = {first_axis(frame1), first_axis(frame2), twist - rest};
  if (limits.is_none()) twisting.angle -= kWholeTurn * std::round(twisting.angle / kWholeTurn);
  return sprung(row_of(twisting, AxisMode::kFree), spring);
}

}  // namespace gravitas
