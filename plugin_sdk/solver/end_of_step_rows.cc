#include "plugin_sdk/solver/end_of_step_rows.h"

#include <Eigen/Eigenvalues>
#include <Eigen/LU>

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
