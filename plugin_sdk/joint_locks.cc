#include "plugin_sdk/joint_locks.h"

#include <algorithm>

#include "plugin_sdk/body.h"
#include "plugin_sdk/math/rotation.h"
#include "plugin_sdk/solver/reaction_solver.h"

namespace gravitas {

bool are_locks(const DiscrepancyColumns& joints) {
  for (std::size_t row = 0; row < joints.size(); ++row) {
    const Discrepancy d = joints.at(row);
    for (int axis = 0; axis < 3; ++axis) {
      const AxisMode mode = axis_mode(d.modes, axis);
      if (mode != AxisMode::kFree && (is_drive(mode) || !holds_always(d, axis))) return false;
    }
  }
  return true;
}

bool may_let_go(const DiscrepancyColumns& joints) {
  const auto is_plain = [](AxisMode mode) { return mode == AxisMode::kFree || mode == AxisMode::kLocked; };
  for (std::size_t row = 0; row < joints.size(); ++row) {
    const std::uint32_t modes = joints.mode[row];
    // most rows; this is asked with each derivative
    if (is_plain(axis_mode(modes, 0)) && is_plain(axis_mode(modes, 1)) && is_plain(axis_mode(modes, 2))) continue;
    const Discrepancy d = joints.at(row);
    if (may_hold(d, 0) || may_hold(d, 1) || may_hold(d, 2)) return true;
  }
  return false;
}

bool find_lock_errors(const DiscrepancyColumns& here, const DiscrepancyColumns& there, std::span<double> errors) {
  if (!std::ranges::equal(here.mode, there.mode)) return false;
  for (std::size_t row = 0; row < here.size(); ++row) {
    const Discrepancy now = here.at(row), then = there.at(row);
    Vector3 error = then.axes.conjugate() * (then.point2 - then.point1);
    for (int axis = 0; axis < 3; ++axis) {
      const AxisMode mode = axis_mode(then.modes, axis);
      if (mode == AxisMode::kFree) error[axis] = 0.0;
      if (mode == AxisMode::kLimited) error[axis] -= then.lower[axis];
    }
    set_vector(errors, row, now.axes * error);
  }
  return true;
}

void find_lock_velocity_errors(const DiscrepancyColumns& joints, std::span<const std::uint32_t> body,
                               const MovingBodies& bodies, std::span<double> errors) {
  const auto of = [](std::span<const double> column, std::uint32_t row) {
    return row == kNone ? Vector3(Vector3::Zero()) : vector_at(column, row);
  };
  for (std::size_t row = 0; row < joints.size(); ++row) {
    const Discrepancy d = joints.at(row);
    const std::uint32_t one = body[2 * row], two = body[2 * row + 1];
    const Matrix3 axes = to_rotation_matrix(d.axes);
    Vector3 error = Vector3::Zero();
    for (int axis = 0; axis < 3; ++axis) {
      if (axis_mode(d.modes, axis) == AxisMode::kFree) continue;
      const Vector3 along = axes.col(axis);
      const JacobianRow row_of_axis = jacobian_row(d, along, of(bodies.position, one), of(bodies.position, two));
      error += along * (row_of_axis.velocity(of(bodies.linear_velocity, one), of(bodies.angular_velocity, one),
                                             of(bodies.linear_velocity, two), of(bodies.angular_velocity, two)) -
                        along.dot(d.velocity));
    }
    set_vector(errors, row, error);
  }
}

}  // namespace gravitas
