#include "plugin_sdk/solver/end_of_step_rows.h"

#include <Eigen/Eigenvalues>
#include <Eigen/LU>
#include <algorithm>
#include <cmath>

#include "plugin_sdk/math/rotation.h"

namespace gravitas {

bool is_held(AxisMode mode) {
  return mode == AxisMode::kLocked || mode == AxisMode::kLimited || mode == AxisMode::kUnilateral;
}

bool holds_pose(const Discrepancy& d) {
  return is_held(axis_mode(d.modes, 0)) || is_held(axis_mode(d.modes, 1)) || is_held(axis_mode(d.modes, 2));
}

ConstraintDirection direction_at(const Vector3& axis, const Vector3& arm1, const Vector3& arm2) {
  ConstraintDirection d;
  d.linear = axis;
  d.angular1 = axis.cross(arm1);
  d.angular2 = arm2.cross(axis);
  return d;
}

ConstraintDirection turning_about(const Vector3& axis) {
  ConstraintDirection d;
  d.angular1 = -axis;
  d.angular2 = axis;
  return d;
}

ConstraintDirection with_turns(ConstraintDirection d, const Matrix3& inverse1, const Matrix3& inverse2) {
  d.turn1 = inverse1 * d.angular1;
  d.turn2 = inverse2 * d.angular2;
  return d;
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
  std::array<Vector3, 3> axes;
  for (std::size_t k = 0; k < 3; ++k) {
    const Vector3 axis = joint->axes.col(static_cast<Eigen::Index>(k));
    const bool is_radial = d.is_radial() && k == 0 && length > 0.0;
    axes[k] = is_radial ? Vector3(error / length) : Vector3(end1.turn * axis);
    joint->errors[static_cast<Eigen::Index>(k)] = is_radial ? length : axes[k].dot(error);
    if (is_held(axis_mode(d.modes, static_cast<int>(k))))
      at -= 0.5 * joint->errors[static_cast<Eigen::Index>(k)] * axes[k];
  }
  joint->arm1 = at - end1.pose.position, joint->arm2 = at - end2.pose.position;
  for (std::size_t k = 0; k < 3; ++k) joint->directions[k] = direction_at(axes[k], joint->arm1, joint->arm2);
}

double missed_by(const JointLaw& law) {
  return (law.has_lower ? std::max(0.0, law.lower_target) : 0.0) +
         (law.has_upper ? std::max(0.0, -law.upper_target) : 0.0);
}

double way_of(const SolverBody& body, double gyration, double h) {
  const Quaternion turn = shorter_arc(body.trial.orientation * body.start.orientation.conjugate());
  const Twist& velocity = body.trial_velocity;
  return (body.trial.position - body.start.position).norm() + gyration * log_rotation(turn).norm() +
         h * (velocity.linear.norm() + gyration * velocity.angular.norm());
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
