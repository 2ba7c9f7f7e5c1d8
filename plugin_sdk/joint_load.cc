#include "plugin_sdk/joint_load.h"

#include <algorithm>
#include <optional>

#include "plugin_sdk/body.h"
#include "plugin_sdk/dynamics.h"
#include "plugin_sdk/math/rotation.h"

namespace gravitas {
namespace {

constexpr double kPulledApart = 1e-3;  // of the bodies' ways
constexpr double kClosed = 1e-9;       // of what the joint holds, and of its coordinates

// Impulse of a row, world.
Vector3 impulse_of(const JointRows& joint, const Discrepancy& discrepancy, std::size_t row, double time_step) {
  Vector3 along = vector_at(joint.impulses, row);
  if (!joint.forces.empty()) along += time_step * vector_at(joint.forces, row);
  return discrepancy.axes * along;
}

// Velocity per impulse along a row, 1/kg or 1/(kg m^2).
double response(const JointBody& body, const Vector3& linear_row, const Vector3& angular_row) {
  const Vector3 local = body.trial.orientation.conjugate() * angular_row;
  return body.inverse_mass * linear_row.squaredNorm() + local.dot(body.inverse_moments.cwiseProduct(local));
}

double gyration(const JointBody& body) {
  return radius_of_gyration(body.inverse_mass, body.inverse_moments.sum() / 3.0);
}

}  // namespace

double joint_error(const JointRows& joint, const JointBody& body1, const JointBody& body2) {
  double error = 0.0;
  for (std::size_t row = joint.first; row < joint.end; ++row) {
    const Discrepancy discrepancy = joint.rows.at(row);
    error = std::max(error, joint_error(discrepancy, error_in_axes_at(discrepancy, body1.trial, body2.trial, body1.next,
                                                                      body2.next)));
  }
  return error;
}

JointLoad joint_load(const JointRows& joint, const JointBody& body1, double time_step) {
  JointLoad load;
  Vector3 sum = Vector3::Zero(), turn = Vector3::Zero();
  std::optional<Vector3> about;
  for (std::size_t row = joint.first; row < joint.end; ++row) {
    const Discrepancy discrepancy = joint.rows.at(row);
    const Vector3 impulse = impulse_of(joint, discrepancy, row, time_step);
    if (discrepancy.is_angular()) {
      turn += impulse;
    } else {
      const Vector3 point = carried(discrepancy.point1, body1.trial, body1.next);
      if (!about) about = point;
      sum += impulse;
      turn += (point - *about).cross(impulse);
    }
  }
  load.force = sum.norm() / time_step;
  load.torque = turn.norm() / time_step;
  return load;
}

double held_back(const Discrepancy& discrepancy, const Vector3& impulse, const JointBody& body1, const JointBody& body2,
                 double time_step) {
  const double size = impulse.norm();
  if (!(size > 0.0)) return 0.0;
  const JacobianRow row = jacobian_row(discrepancy, impulse / size, body1.trial.position, body2.trial.position);
  return size * time_step * (response(body1, row.linear1, row.angular1) + response(body2, row.linear2, row.angular2));
}

// What holds an error: drives and dampers hold nothing together.
Vector3 holding_part(const Discrepancy& discrepancy, const Vector3& impulse) {
  const Matrix3 axes = to_rotation_matrix(discrepancy.axes);
  Vector3 holding = impulse;
  for (int k = 0; k < 3; ++k)
    if (is_drive(axis_mode(discrepancy.modes, k))) holding -= axes.col(k).dot(impulse) * axes.col(k);
  return holding;
}

double opening(const JointRows& joint, const JointBody& body1, const JointBody& body2, double time_step) {
  double most = 0.0;
  for (std::size_t row = joint.first; row < joint.end; ++row) {
    const Discrepancy discrepancy = joint.rows.at(row);
    const Vector3 error = error_in_axes_at(discrepancy, body1.trial, body2.trial, body1.next, body2.next);
    const Vector3 impulse = holding_part(discrepancy, impulse_of(joint, discrepancy, row, time_step));
    const double length = discrepancy.is_angular() ? std::max(gyration(body1), gyration(body2)) : 1.0;
    most = std::max({most, length * joint_error(discrepancy, error),
                     length * held_back(discrepancy, impulse, body1, body2, time_step)});
  }
  return most;
}

bool is_pulled_apart(const JointRows& joint, const JointBody& body1, const JointBody& body2) {
  const auto way = [](const JointBody& body) {
    const double turn = log_rotation(body.next.orientation * body.start.orientation.conjugate()).norm();
    return (body.next.position - body.start.position).norm() + gyration(body) * turn;
  };
  double opened = 0.0, error = 0.0, size = gyration(body1) + gyration(body2);
  for (std::size_t row = joint.first; row < joint.end; ++row) {
    const Discrepancy discrepancy = joint.rows.at(row);
    const double length = discrepancy.is_angular() ? std::max(gyration(body1), gyration(body2)) : 1.0;
    const auto open = [&](const Pose& one, const Pose& two) {
      return length * joint_error(discrepancy, error_in_axes_at(discrepancy, body1.trial, body2.trial, one, two));
    };
    error = std::max(error, open(body1.next, body2.next));
    opened = std::max(opened, open(body1.next, body2.next) - open(body1.start, body2.start));
    if (!discrepancy.is_angular()) size = std::max(size, discrepancy.point1.norm());
  }
  return error > kClosed * size && opened > kPulledApart * (way(body1) + way(body2));
}

}  // namespace gravitas
