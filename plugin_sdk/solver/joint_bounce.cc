// Rates along the axes of a joint at S_n, and what follows for its stops.
#include "plugin_sdk/solver/joint_bounce.h"

#include <algorithm>
#include <cmath>
#include <optional>

#include "plugin_sdk/math/rotation.h"
#include "plugin_sdk/solver/arrival.h"
#include "plugin_sdk/solver/end_of_step_rows.h"

namespace gravitas {
namespace {

constexpr double kRateRounding = 1e-12;  // of the speeds that a rate is the difference of

Quaternion turn_back(const SolverBody& body) { return body.start.orientation * body.trial.orientation.conjugate(); }

EndBody at_start(const SolverBody& body) {
  EndBody end;
  end.pose = body.start;
  end.turn = to_rotation_matrix(turn_back(body));
  return end;
}

}  // namespace

void set_bounces(const Discrepancy& discrepancy, const SolverBody& body1, const SolverBody& body2,
                 std::span<const double> warm_impulse, std::array<JointAxisState, 3>* axes) {
  if (!(discrepancy.restitution > 0.0)) return;
  EndJoint start;
  start.discrepancy = discrepancy;
  start.axes = to_rotation_matrix(discrepancy.axes);
  const Vector3 turn = log_rotation(shorter_arc(turn_back(body2))) - log_rotation(shorter_arc(turn_back(body1)));
  move_joint(body1, body2, at_start(body1), at_start(body2), turn, &start);
  const Twist &one = body1.start_velocity, &two = body2.start_velocity;
  for (std::size_t k = 0; k < axes->size(); ++k) {
    JointAxisState& axis = (*axes)[k];
    const double rate = start.directions[k].along(one, two) - axis.desired_velocity;
    const double size = start.directions[k].size_along(one, two);
    const double none = discrepancy.has_forces_applied() ? still_rate(size) : kRateRounding * size;
    if (!(std::fabs(rate) > none)) continue;
    const std::optional<JointStop> stop = stop_of(axis, -rate);
    if (!stop || stop->sign * warm_impulse[k] > 0.0) continue;
    axis.restitution = discrepancy.restitution;
    axis.start_rate = rate;
    axis.bounce = -discrepancy.restitution * rate;
  }
}

double bounce_of(const JointAxisState& axis, double rate, double time_step) {
  const JointStop stop = *stop_of(axis, axis.bounce);
  const double gap = stop.sign * (axis.error_at_start - stop.limit);
  return stop.sign * axis.restitution *
         arrival_speed(stop.sign * axis.start_rate, stop.sign * rate, std::max(0.0, gap), time_step);
}

}  // namespace gravitas
