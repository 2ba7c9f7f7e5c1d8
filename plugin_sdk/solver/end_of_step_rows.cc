#include "plugin_sdk/solver/end_of_step_rows.h"

#include <Eigen/Eigenvalues>
#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <utility>

#include "plugin_sdk/math/rotation.h"
#include "plugin_sdk/math/transcendental.h"

namespace gravitas {
namespace {

// By how much a pose law is missed where its row's value is 0, m or rad.
double missed_by(const JointLaw& law) {
  return (law.has_lower ? std::max(0.0, law.lower_target) : 0.0) +
         (law.has_upper ? std::max(0.0, -law.upper_target) : 0.0);
}

}  // namespace

bool is_held(AxisMode mode) {
  return mode == AxisMode::kLocked || mode == AxisMode::kLimited || mode == AxisMode::kUnilateral;
}

bool holds_pose(const Discrepancy& d) {
  return is_held(axis_mode(d.modes, 0)) || is_held(axis_mode(d.modes, 1)) || is_held(axis_mode(d.modes, 2));
}

void move_joint(const SolverBody& one, const SolverBody& two, const EndBody& end1, const EndBody& end2,
                const Vector3& turn, EndJoint* joint) {
  const Discrepancy& d = joint->discrepancy;
  if (d.is_swing()) {
    const auto [first, second] = swing_directions(d);
    const Vector3 turned = end1.turn * first;
    const Swing swing = swing_between(turned, end2.turn * second);
    joint->errors = {swing.angle - joint->axes.col(0).dot(d.point1), 0.0, 0.0};
    joint->directions = {turning_about(swing.axis), turning_about(turned), turning_about(swing.axis.cross(turned))};
    return;
  }
  if (d.is_twist()) {
    const Twisting trial = twisting_of(d);
    const Twisting end = trial.turned(to_quaternion(end1.turn), to_quaternion(end2.turn));
    const auto [second, third] = orthonormal_basis(end.bisector());
    joint->errors = {trial.cosine() * end.angle, 0.0, 0.0};
    joint->directions = {turning_about(end.bisector()), turning_about(second), turning_about(third)};
    return;
  }
  if (d.is_component()) {
    const TurnComponent trial = turn_component_of(d);
    const TurnComponent end = trial.turned(to_quaternion(end1.turn), to_quaternion(end2.turn));
    const double scale = trial.gradient().norm();
    joint->errors = {end.value() / scale, 0.0, 0.0};
    joint->directions = {turning_about(end.gradient() / scale), turning_about(joint->axes.col(1)),
                         turning_about(joint->axes.col(2))};
    return;
  }
  if (d.is_angular()) {
    const Vector3 error = d.point2 - d.point1 + turn;
    for (int k = 0; k < 3; ++k) {
      joint->directions[static_cast<std::size_t>(k)] = turning_about(joint->axes.col(k));
      joint->errors[k] = joint->axes.col(k).dot(error);
    }
    return;
  }
  const Vector3 point1 = end1.pose.position + end1.turn * (d.point1 - one.trial.position);
  const Vector3 point2 = end2.pose.position + end2.turn * (d.point2 - two.trial.position);
  const Vector3 error = point2 - point1;
  const double length = error.norm();
  // axes fixed in body 1 push where body 2's point is, midway along what is held; a drive where it is in body 1
  Vector3 at = holds_pose(d) ? point2 : point1;
  Matrix3 axes;
  for (int k = 0; k < 3; ++k) {
    const Vector3 axis = joint->axes.col(k);
    const bool is_radial = d.is_radial() && k == 0 && length > 0.0;
    axes.col(k) = is_radial ? Vector3(error / length) : Vector3(end1.turn * axis);
    joint->errors[k] = is_radial ? length : axes.col(k).dot(error);
    if (is_held(axis_mode(d.modes, k))) at -= 0.5 * joint->errors[k] * axes.col(k);
  }
  const Vector3 apart = joint->is_only_point ? half_of_locked(d, axes, joint->errors) : Vector3(Vector3::Zero());
  joint->arm1 = at - apart - end1.pose.position, joint->arm2 = at + apart - end2.pose.position;
  for (int k = 0; k < 3; ++k)
    joint->directions[static_cast<std::size_t>(k)] = direction_at(axes.col(k), joint->arm1, joint->arm2);
}

ConeContact cone_contact(const EndContact& contact, std::uint32_t first, bool has_turning) {
  const ContactLaw& law = contact.law;
  ConeContact cone;
  cone.first = first;
  cone.has_friction = law.static_friction > 0.0;
  cone.has_turning = has_turning;
  cone.target = law.target;
  cone.slides = contact.slides;
  cone.static_friction = law.static_friction, cone.dynamic_friction = law.dynamic_friction;
  cone.rolling_friction = law.rolling_friction, cone.spinning_friction = law.spinning_friction;
  return cone;
}

bool ShrinkingSteps::end_with(double change, double size, double rounding) {
  const std::size_t before = count_++;
  const double enough = std::max(rounding, 1e-14 * size);
  const double rate = before > 0 ? change / last_ : 1.0;
  double next = change;
  if (rate < 1e-2) {
    next *= rate;
    const double rate_before = before > 1 ? last_ / last_but_one_ : 0.0;
    if (rate * rate < rate_before * rate_before * rate_before) next *= std::sqrt(rate);
  }
  last_but_one_ = std::exchange(last_, change);
  return next <= enough || (before > 3 && !(rate < 0.9) && change <= 1e-9 * size);
}

double sum_of_overlaps(const std::vector<EndJoint>& joints, const std::vector<EndContact>& contacts) {
  double sum = 0.0;
  for (const EndJoint& joint : joints)
    for (const JointLaw& law : joint.pose_laws)
      if (law.gamma == 0.0) sum += joint.length * missed_by(law);
  for (const EndContact& contact : contacts) sum += std::max(0.0, contact.gap_target);
  return sum;
}

double way_of(const SolverBody& body, double gyration, double h) {
  const Quaternion turn = shorter_arc(body.trial.orientation * body.start.orientation.conjugate());
  const Twist& velocity = body.trial_velocity;
  return (body.trial.position - body.start.position).norm() + gyration * log_rotation(turn).norm() +
         h * (velocity.linear.norm() + gyration * velocity.angular.norm());
}

SolverOutcome outcome_of(const std::vector<ConeSummary>& summaries) {
  SolverOutcome outcome;
  bool has_converged = true, contradicts = false;
  for (const ConeSummary& one : summaries) {
    outcome.iterations += one.iterations;
    outcome.residual = std::max(outcome.residual, one.residual);
    has_converged = has_converged && one.has_converged;
    contradicts = contradicts || one.contradiction > 0.0;
  }
  if (!summaries.empty()) outcome.stop_reason = StopReason::kConverged;
  if (contradicts) outcome.stop_reason = StopReason::kContradiction;
  if (!has_converged) outcome.stop_reason = together(outcome.stop_reason, StopReason::kIterations);
  return outcome;
}

double way_of(const Vector3& point, const SolverBody& one, const SolverBody& two) {
  return (carried(point, one.trial, one.start) - carried(point, two.trial, two.start)).norm();
}

void add_work(const ConeRow& row, const BodyMotion& before, const BodyMotion& after, Gain* gain) {
  const double start = row.direction.along(before[row.body1], before[row.body2]);
  const double end = row.direction.along(after[row.body1], after[row.body2]);
  gain->add(0.5 * row.multiplier * (start + end),
            0.5 * std::fabs(row.multiplier) * (std::fabs(start) + std::fabs(end)));
}

Vector3 moments_of(const Vector3& inverse_moments) {
  Vector3 moments = Vector3::Zero();
  for (int k = 0; k < 3; ++k)
    if (inverse_moments[k] > 0.0) moments[k] = 1.0 / inverse_moments[k];
  return moments;
}

TurnOfSwing turn_of_swing(const Vector3& axis, const Vector3& first, double angle, double push) {
  TurnOfSwing turn;
  const math::SinCos half = math::sincos(0.5 * angle), whole = math::sincos(angle);
  if (!(half.sin > 0.0) || !(half.cos > 0.0)) return turn;
  const Vector3 second = whole.cos * first + whole.sin * axis.cross(first);
  const Vector3 of_first = first.cross(axis);
  turn.direction.angular1 = push > 0.0 ? of_first : Vector3(-of_first);
  turn.direction.angular2 = second.cross(axis);
  turn.stiffness = push > 0.0 ? 0.5 * push * half.sin / half.cos : -0.5 * push * half.cos / half.sin;
  return turn;
}

Matrix3 geometric_stiffness(const Vector3& arm, const Vector3& push) {
  const Matrix3 product = push * arm.transpose();
  return push.dot(arm) * Matrix3::Identity() - 0.5 * (product + product.transpose());
}

Matrix3 stiffened_inverse(const Quaternion& orientation, const Vector3& inverse_moments, const Matrix3& stiffness) {
  const Matrix3 rotation = to_rotation_matrix(orientation);
  const Matrix3 root = rotation * inverse_moments.cwiseSqrt().asDiagonal();
  const Matrix3 added = root.transpose() * stiffness * root;
  // nothing to limit where added + 1/2 is positive definite
  const Matrix3 least = added + 0.5 * Matrix3::Identity();
  if (least(0, 0) > 0.0 && least.topLeftCorner<2, 2>().determinant() > 0.0 && least.determinant() > 0.0)
    return root * Matrix3(added + Matrix3::Identity()).inverse() * root.transpose();
  const Eigen::SelfAdjointEigenSolver<Matrix3> modes(added);
  if (modes.info() != Eigen::Success) return world_inverse_inertia(orientation, inverse_moments);
  const Vector3 share = (1.0 + modes.eigenvalues().array().max(-0.5)).inverse();
  const Matrix3 base = root * modes.eigenvectors();
  return base * share.asDiagonal() * base.transpose();
}

}  // namespace gravitas
