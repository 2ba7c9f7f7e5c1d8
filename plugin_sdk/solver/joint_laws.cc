// The table of joint_laws.h, line by line.
#include "plugin_sdk/solver/joint_laws.h"

#include <algorithm>
#include <cmath>

#include "plugin_sdk/math/rotation.h"

namespace gravitas {

namespace {

bool is_limit(AxisMode mode) { return mode == AxisMode::kLimited || mode == AxisMode::kUnilateral; }

double lower_of(const JointAxisState& a) { return a.mode == AxisMode::kLimited ? a.lower : 0.0; }

bool has_lower_side(const JointAxisState& a) {
  return a.mode == AxisMode::kUnilateral || (a.mode == AxisMode::kLimited && a.lower > -kUnlimited);
}

bool has_upper_side(const JointAxisState& a) { return a.mode == AxisMode::kLimited && a.upper < kUnlimited; }

// A limit whose sides meet holds like a lock.
bool is_held(const JointAxisState& a) {
  return a.mode == AxisMode::kLocked || (a.mode == AxisMode::kLimited && a.lower == a.upper);
}

double rest_error(const JointAxisState& a) { return a.mode == AxisMode::kLocked ? 0.0 : a.lower; }

double force_bound(double maximum_force, double factor) {
  if (maximum_force >= kUnlimited) return std::numeric_limits<double>::infinity();
  return maximum_force * factor;
}

bool is_soft(AxisMode mode, double compliance) {
  return compliance > 0.0 && (mode == AxisMode::kLocked || is_limit(mode));
}

bool is_soft(const JointAxisState& a) { return is_soft(a.mode, a.compliance); }

void set_equality(JointLaw& law, double target) {
  law.has_lower = law.has_upper = true;
  law.lower_target = law.upper_target = target;
}

JointLaw soft_law(const JointAxisState& a, double h) {
  JointLaw law;
  const double softness = a.compliance * a.damping + h;
  law.gamma = a.compliance / (h * softness);
  if (is_held(a)) {
    set_equality(law, a.desired_velocity - (a.error_at_start - rest_error(a)) / softness);
    return law;
  }
  // from inside nothing slows the way to the limit
  if (has_lower_side(a) && std::min(a.error_at_start, a.error_at_trial) < lower_of(a)) {
    const double off = a.error_at_start - lower_of(a);
    law.has_lower = true;
    law.lower_target = a.desired_velocity - off / (off > 0.0 ? h : softness);
  }
  if (has_upper_side(a) && std::max(a.error_at_start, a.error_at_trial) > a.upper) {
    const double off = a.error_at_start - a.upper;
    law.has_upper = true;
    law.upper_target = a.desired_velocity - off / (off < 0.0 ? h : softness);
  }
  return law;
}

std::optional<JointStop> side_of(const JointAxisState& a, double sign) {
  if (!is_limit(a.mode) || is_held(a)) return std::nullopt;
  if (sign > 0.0) return has_lower_side(a) ? std::optional(JointStop{1.0, lower_of(a)}) : std::nullopt;
  return has_upper_side(a) ? std::optional(JointStop{-1.0, a.upper}) : std::nullopt;
}

}  // namespace

std::optional<JointStop> stop_of(const JointAxisState& a, double sign) {
  return is_soft(a) ? std::nullopt : side_of(a, sign);
}

std::optional<JointStop> soft_stop_of(const JointAxisState& a, double sign) {
  return is_soft(a) ? side_of(a, sign) : std::nullopt;
}

bool acts_as_force(const Discrepancy& discrepancy, int axis) {
  const AxisMode mode = axis_mode(discrepancy.modes, axis);
  return is_soft(mode, discrepancy.compliance[axis]) || (is_drive(mode) && discrepancy.damping[axis] > 0.0);
}

double force_of(const JointAxisState& a, double velocity) {
  const double error = a.error_at_trial, damped = a.damping * (a.desired_velocity - velocity);
  double force = 0.0;
  if (is_drive(a.mode))
    force = damped;
  else if (is_held(a))
    force = damped - (error - rest_error(a)) / a.compliance;
  else if (has_lower_side(a) && error < lower_of(a))
    force = std::max(0.0, damped - (error - lower_of(a)) / a.compliance);
  else if (has_upper_side(a) && error > a.upper)
    force = std::min(0.0, damped - (error - a.upper) / a.compliance);
  const double bound = force_bound(a.maximum_force, 1.0);
  return std::clamp(force, -bound, bound);
}

JointAxisState joint_axis_state(const Discrepancy& discrepancy, int axis, const Vector3& direction,
                                const Vector3& start_error) {
  JointAxisState a;
  if (!discrepancy.has_forces_applied() || !acts_as_force(discrepancy, axis))
    a.mode = axis_mode(discrepancy.modes, axis);
  a.lower = discrepancy.lower[axis];
  a.upper = discrepancy.upper[axis];
  a.compliance = discrepancy.compliance[axis];
  a.damping = discrepancy.damping[axis];
  a.maximum_force = discrepancy.maximum_force[axis];
  a.desired_velocity = direction.dot(discrepancy.velocity);
  // a radial axis points from x1 to x2 at either time
  const bool is_radial = discrepancy.is_radial() && axis == 0;
  a.error_at_start = is_radial ? start_error.norm() : direction.dot(start_error);
  a.error_at_trial = direction.dot(discrepancy.point2 - discrepancy.point1);
  return a;
}

double turns_to_limit(const Discrepancy& discrepancy) {
  const double lower = discrepancy.lower.x(), upper = discrepancy.upper.x();
  const bool has_lower = lower > -kUnlimited, has_upper = upper < kUnlimited;
  if (!discrepancy.is_twist() || axis_mode(discrepancy.modes, 0) != AxisMode::kLimited || has_lower == has_upper)
    return 0.0;
  const Twisting twisting = twisting_of(discrepancy);
  if (!(twisting.cosine() > 0.0)) return 0.0;
  const double limit = (has_lower ? lower : upper) / twisting.cosine();
  return kWholeTurn * std::round((limit - twisting.angle) / kWholeTurn);
}

void add_turns(double turns, Discrepancy* twist) {
  if (turns == 0.0) return;
  Twisting twisting = twisting_of(*twist);
  twisting.angle += turns;
  set_twisting(twisting, twist);
}

void hold_what_bears(double force, JointAxisState* axis) {
  if (!is_limit(axis->mode) || is_soft(*axis) || force == 0.0 || axis->bounce * force > 0.0) return;
  axis->bounce = 0.0;
  const double target = force > 0.0 ? lower_of(*axis) : axis->upper;
  axis->mode = AxisMode::kLimited;
  axis->lower = axis->upper = target;
}

bool is_only_point(std::span<const std::uint32_t> bodies, std::span<const std::uint32_t> modes, std::size_t row) {
  const auto has_same_bodies = [&](std::size_t other) {
    return bodies[2 * other] == bodies[2 * row] && bodies[2 * other + 1] == bodies[2 * row + 1];
  };
  const bool is_alone =
      (row == 0 || !has_same_bodies(row - 1)) && (row + 1 == modes.size() || !has_same_bodies(row + 1));
  return is_alone && (modes[row] & kAngularDiscrepancy) == 0;
}

Vector3 half_of_locked(const Discrepancy& discrepancy, const Matrix3& axes, const Vector3& errors) {
  Vector3 half = Vector3::Zero();
  for (int k = discrepancy.is_radial() ? 1 : 0; k < 3; ++k)
    if (axis_mode(discrepancy.modes, k) == AxisMode::kLocked && discrepancy.compliance[k] == 0.0)
      half += 0.5 * errors[k] * axes.col(k);
  return half;
}

Vector3 turned_by_joints(const Vector3& turn, const Vector3& whole_turn, const Vector3& angular_velocity) {
  const double square = whole_turn.squaredNorm();
  const double share = square > 0.0 ? std::clamp(turn.dot(whole_turn) / square, 0.0, 1.0) : 0.0;
  return share == 0.0 ? angular_velocity : Vector3(exp_rotation(share * whole_turn) * angular_velocity);
}

JointLaw pose_law(const JointAxisState& a, double beta, double h) {
  JointLaw law;
  if (is_soft(a)) return law;
  law.bound = force_bound(a.maximum_force, h * h);
  if (is_held(a)) {
    const double rest = rest_error(a);
    set_equality(law, rest + (1.0 - beta) * (a.error_at_start - rest) - a.error_at_trial);
    return law;
  }
  if (!is_limit(a.mode)) return law;
  if (has_lower_side(a)) {
    const double lower = lower_of(a);
    law.has_lower = true;
    law.lower_target = lower + std::min(0.0, (1.0 - beta) * (a.error_at_start - lower)) - a.error_at_trial;
  }
  if (has_upper_side(a)) {
    law.has_upper = true;
    law.upper_target = a.upper + std::max(0.0, (1.0 - beta) * (a.error_at_start - a.upper)) - a.error_at_trial;
  }
  return law;
}

bool is_spring(const JointAxisState& a) { return is_soft(a); }

JointLaw spring_pose_law(const JointAxisState& a, double approach, double theta, double h) {
  if (theta == 0.0) return {};
  if (theta == 1.0) approach = (a.error_at_trial - a.error_at_start) / h;
  JointLaw law = soft_law(a, h);
  law.lower_target = theta * h * (law.lower_target - approach);
  law.upper_target = theta * h * (law.upper_target - approach);
  law.bound = force_bound(a.maximum_force, theta * h * h);
  return law;
}

JointLaw velocity_law(const JointAxisState& a, double error_after, double slop, double h) {
  JointLaw law = is_soft(a) ? soft_law(a, h) : JointLaw{};
  law.bound = force_bound(a.maximum_force, h);
  law.is_guided = a.desired_velocity != 0.0;
  if (is_soft(a)) return law;
  if (is_drive(a.mode)) {
    set_equality(law, a.desired_velocity);
    law.is_velocity_only = true;
    if (a.damping > 0.0) law.gamma = 1.0 / (h * a.damping);
  }
  if (is_held(a)) set_equality(law, a.desired_velocity);
  if (!is_limit(a.mode) || is_held(a)) return law;
  law.lower_target = law.upper_target = a.desired_velocity;
  law.set_bounce(a.bounce);
  law.close(has_lower_side(a) && error_after <= lower_of(a) + slop, has_upper_side(a) && error_after >= a.upper - slop);
  return law;
}

double relaxed_multiplier(const JointLaw& law, double multiplier, double value, double response) {
  const double to_lower = multiplier + (law.lower_target - value) / response;
  const double to_upper = multiplier + (law.upper_target - value) / response;
  double relaxed = 0.0;
  if (law.has_lower && to_lower > 0.0)
    relaxed = to_lower;
  else if (law.has_upper && to_upper < 0.0)
    relaxed = to_upper;
  return std::clamp(relaxed, -law.bound, law.bound);
}

}  // namespace gravitas
