#include "plugin_sdk/joint_motion.h"

#include <algorithm>
#include <cmath>
#include <string>

#include "plugin_sdk/checks.h"
#include "plugin_sdk/math/hermite.h"
#include "plugin_sdk/math/rotation.h"

namespace gravitas {
namespace {

constexpr std::size_t kGiven = 2, kBound = 3;  // numbers of a row

// The speed at which what is `behind` comes nearer, where the largest force accelerates by `acceleration` (joint_motion.h).
double catching_up(double behind, double acceleration, double time_step) {
  constexpr double kSteps = 2.0, kOfForce = 0.25;
  const double time = kSteps * time_step, reach = kOfForce * acceleration * time * time;
  if (!(reach > 0.0)) return 0.0;
  return 2.0 * behind / time / (1.0 + std::sqrt(1.0 + 2.0 * std::fabs(behind) / reach));
}

// How a body turns about an axis through a point that stays, by a torque: 1/(kg m^2).
double turning_about_point(double inverse_mass, const Vector3& inverse_inertia, const Pose& pose, const Vector3& axis,
                           const Vector3& point) {
  const double inverse = axis.dot(world_inverse_inertia(pose.orientation, inverse_inertia) * axis);
  if (!(inverse > 0.0)) return 0.0;
  const Vector3 arm = pose.position - point;
  const double square = (arm - axis.dot(arm) * axis).squaredNorm();
  // of a body that turns and does not move the point is its own
  return inverse_mass > 0.0 ? inverse / (1.0 + square * inverse / inverse_mass) : inverse;
}

// What asks for the rate of a course and to come nearer to it, where it is off by `error` and `speed` in the free motion.
void drive(const Vector3& axis, double error, double speed, const CourseState& course, double acceleration,
           double time_step, Discrepancy* d) {
  constexpr double kOfSpeed = 0.5;
  const double ahead = error - kOfSpeed * time_step * (speed - course.rate);
  d->velocity = (course.rate - catching_up(ahead, acceleration, time_step)) * axis;
  d->acceleration = course.change * axis;
}

}  // namespace

CourseState CourseState::within(const JointLimits& limits) const {
  const bool is_below = value<limits.lower, is_above = value> limits.upper;
  return is_below ? CourseState{limits.lower} : is_above ? CourseState{limits.upper} : *this;
}

JointMotion JointMotion::of(std::span<const double> rows, std::string_view field) {
  const auto refuse = [&](std::size_t row, const char* what) {
    throw Refusal(std::string(field) + " cannot be followed: row " + std::to_string(row) + what);
  };
  const std::size_t count = rows.size() / kGiven;
  std::vector<double> lengths, quotients;
  for (std::size_t i = 0; i < count; ++i) {
    const double* row = &rows[kGiven * i];
    if (first_not_finite({row, kGiven}) != kNoRow) refuse(i, " has a number that is not finite");
    if (i == 0) continue;
    if (!(row[0] > row[-2])) refuse(i, " has a time that does not ascend");
    lengths.push_back(row[0] - row[-2]);
    quotients.push_back((row[1] - row[-1]) / lengths.back());
  }
  JointMotion motion;
  if (count == 0) return motion;
  const std::vector<double> rates = hermite_rates(quotients, lengths, 0.0);
  for (std::size_t i = 0; i < count; ++i) {
    if (!std::isfinite(rates[i])) refuse(i, " has a rate that is not finite");
    motion.made_.insert(motion.made_.end(), {rows[kGiven * i], rows[kGiven * i + 1], rates[i]});
  }
  return motion;
}

CourseState JointMotion::at(double time) const {
  const std::span<const double> row = rows();
  const std::size_t count = row.size() / kBound;
  std::size_t before = 0, next = count;  // the first row after the time
  while (before < next) {
    const std::size_t middle = (before + next) / 2;
    if (row[kBound * middle] > time)
      next = middle;
    else
      before = middle + 1;
  }
  if (next == 0 || next == count) {
    const double* end = &row[next == 0 ? 0 : kBound * (count - 1)];
    return {end[1] + (time - end[0]) * end[2], end[2], 0.0};
  }
  const double *from = &row[kBound * (next - 1)], *to = &row[kBound * next];
  const double h = to[0] - from[0];
  const HermitePoint<double> point = hermite_point(from[1], from[2], to[1], to[2], h, (time - from[0]) / h);
  return {point.value, point.rate, point.change};
}

void JointMotion::write(BoundWriter* out) const {
  const std::size_t count = rows().size() / kBound;
  out->number(static_cast<double>(count));
  for (const double number : rows()) out->number(number);
}

JointMotion JointMotion::read(PropertyCursor* bound) {
  JointMotion motion;
  motion.bound_ = bound->table(kBound);
  return motion;
}

JointDrive JointDrive::of(PropertyCursor* properties) {
  JointDrive drive;
  if (properties->at_end()) return drive;
  drive.speed = properties->number();
  drive.force = properties->number();
  return drive;
}

void JointDrive::follow(PropertyCursor* properties, std::string_view type, std::string_view speed_field,
                        std::string_view force_field) {
  const std::string joint = std::string(type) + ": ", of_speed(speed_field);
  if (!properties->at_end()) motion = JointMotion::of(properties->table(kGiven), joint + "Motion");
  if (!motion.is_none() && !std::isnan(speed)) throw Refusal(joint + of_speed + " and Motion are both given");
  const bool is_bounded = force < kUnlimited;
  if (is_none() && is_bounded)
    throw Refusal(joint + std::string(force_field) + " is given without " + of_speed + " or Motion");
  if (!is_bounded) force = kUnlimited;
}

void write_drive(const JointDrive& drive, BoundWriter* out) {
  drive.motion.write(out);
  const bool has_speed = !std::isnan(drive.speed);
  out->number(has_speed ? 1.0 : 0.0);
  out->number(has_speed ? drive.speed : 0.0);
  out->number(drive.force);
}

JointDrive read_drive(PropertyCursor* bound) {
  JointDrive drive;
  drive.motion = JointMotion::read(bound);
  const bool has_speed = bound->flag();
  const double speed = bound->number();
  if (has_speed) drive.speed = speed;
  drive.force = bound->number();
  return drive;
}

Property motion_property(std::string_view unit, std::string_view what, std::string_view bound) {
  return Property::table("Motion", kGiven, "s," + std::string(unit), "")
      .means(
          std::string(what) +
          " that a drive keeps over time: rows {t, value} by ascending time, cubic between them, with the rates of "
          "parabolas through three rows, at those of its ends before and after. Accelerations jump at rows, where "
          "steps of Smooth end. A value that stands twice is "
          "a rest. Limits stop it. With " +
          std::string(bound) +
          " it may fall behind, and catches up; without, it is met at the end of each step, whatever is in its way.");
}

Discrepancy followed_twist(const Pose& frame1, const Pose& frame2, const JointBodies& bodies, const JointLimits& limits,
                           const CourseState& course, double torque) {
  const Twisting seen = {frame1.orientation * Vector3::UnitX(), frame2.orientation * Vector3::UnitX(),
                         twist_between(frame1.orientation, frame2.orientation)};
  const double bend = 1.0 + seen.first.dot(seen.second);
  const double speed = bend > 0.0 ? (bodies.spin2 - bodies.spin1).dot(seen.first + seen.second) / bend : 0.0;
  // turns beyond a single limit are not counted; far from it, and where nothing may hold it back, it is whichever is near
  const double to_limit = std::min(limits.upper - course.value, course.value - limits.lower);
  const bool is_nearest = torque >= kUnlimited || to_limit > 0.75 * kWholeTurn;
  double error = seen.angle - course.value;
  if (is_nearest) {
    error -= kWholeTurn * std::round(error / kWholeTurn);
  } else {
    error = limits.turn(seen.angle, twisted_way(frame1.orientation, frame2.orientation, bodies)) - course.value;
  }
  if (torque >= kUnlimited) {
    const Twisting off = {seen.first, seen.second, error};
    const Vector3 axis = off.cosine() * off.bisector();
    Discrepancy d;
    set_twisting(off, &d);
    d.modes = pack_modes(AxisMode::kLocked, AxisMode::kFree, AxisMode::kFree) | kAngularDiscrepancy | kTwistDiscrepancy;
    d.velocity = course.rate * axis, d.acceleration = course.change * axis;
    return d;
  }
  const Vector3 axis = axis_between(frame1, frame2);
  const double turning =
      turning_about_point(bodies.inverse_mass1, bodies.inverse_inertia1, bodies.pose1, axis, frame1.position) +
      turning_about_point(bodies.inverse_mass2, bodies.inverse_inertia2, bodies.pose2, axis, frame2.position);
  Discrepancy d = driven_row(axis, 0.0, torque);
  drive(axis, error, speed, course, torque * turning, bodies.time_step, &d);
  return d;
}

Discrepancy followed_way(const Vector3& axis, const Vector3& point1, const Vector3& point2, const JointBodies& bodies,
                         const CourseState& course, double force) {
  const double error = axis.dot(point2 - point1) - course.value;
  if (force >= kUnlimited) {
    Discrepancy d = row_along(axis, point2 - error * axis, point2, AxisMode::kLocked);
    d.velocity = course.rate * axis, d.acceleration = course.change * axis;
    return d;
  }
  Discrepancy d = row_along(axis, point2, point2, AxisMode::kDriven);
  const double speed = jacobian_row(d, axis, bodies.pose1.position, bodies.pose2.position)
                           .velocity(bodies.velocity1, bodies.spin1, bodies.velocity2, bodies.spin2);
  d.maximum_force.x() = force;
  drive(axis, error, speed, course, force * (bodies.inverse_mass1 + bodies.inverse_mass2), bodies.time_step, &d);
  return d;
}

}  // namespace gravitas
