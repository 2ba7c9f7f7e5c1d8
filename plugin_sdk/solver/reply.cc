#include "plugin_sdk/solver/reply.h"

#include <algorithm>
#include <cmath>
#include <span>
#include <string>

#include "plugin_sdk/plugin.h"

namespace gravitas {

DiscrepancyColumns columns_of(const stage::SolverSolveRequest& r) {
  return {r.point1(), r.point2(), r.velocity(),   r.correction(), r.axes(),          r.mode(),
          r.lower(),  r.upper(),  r.compliance(), r.damping(),    r.maximum_force(), r.restitution()};
}

void set_all_unpushed(const stage::SolverSolveRequest& request, const SolverBodies& bodies, SolverSolution* solution) {
  const std::size_t joints = request.mode().size(), contacts = request.contact_key().size();
  solution->velocity.assign(bodies.count() + 1, Twist{});
  for (std::uint32_t i = 0; i < bodies.count(); ++i) solution->velocity[i] = bodies[i].trial_velocity;
  solution->displacement.assign(bodies.count() + 1, Twist{});
  solution->joint_impulse.assign(3 * joints, 0.0);
  solution->joint_correction.assign(3 * joints, 0.0);
  solution->contact_impulse.assign(3 * contacts, 0.0);
  solution->contact_turning.assign(3 * contacts, 0.0);
  solution->contact_correction.assign(contacts, 0.0);
  solution->contact_direction.assign(request.contact_normal().begin(), request.contact_normal().end());
}

void write(const SolverSolution& solution, const SolverOutcome& outcome, const stage::SolverSolveReply& reply) {
  const std::size_t count = solution.velocity.size() - 1;
  const std::span<double> linear = reply.linear_velocity().resize(3 * count);
  const std::span<double> angular = reply.angular_velocity().resize(3 * count);
  const std::span<double> change = reply.pose_change().resize(6 * count);
  const bool has_room = linear.size() + angular.size() + change.size() == 12 * count;
  for (std::uint32_t i = 0; i < count; ++i) {
    const Twist &v = solution.velocity[i], &d = solution.displacement[i];
    if (!std::isfinite(v.linear.sum() + v.angular.sum() + d.linear.sum() + d.angular.sum()))
      throw Refusal("the answer for body " + std::to_string(i) +
                    " is not finite: masses, velocities or errors overflow");
    if (!has_room) continue;
    set_vector(linear, i, v.linear);
    set_vector(angular, i, v.angular);
    set_vector(change, 2 * i, d.linear);
    set_vector(change, 2 * i + 1, d.angular);
  }
  const auto put = [](const stage::ReplyColumn<double>& column, const std::vector<double>& values) {
    for (const double value : values)
      if (!std::isfinite(value)) throw Refusal("a multiplier is not finite: masses, velocities or errors overflow");
    const std::span<double> room = column.resize(values.size());
    if (!room.empty()) std::copy(values.begin(), values.end(), room.begin());
  };
  put(reply.discrepancy_impulse(), solution.joint_impulse);
  put(reply.discrepancy_correction(), solution.joint_correction);
  put(reply.contact_impulse(), solution.contact_impulse);
  put(reply.contact_correction(), solution.contact_correction);
  put(reply.contact_direction(), solution.contact_direction);
  put(reply.contact_turning(), solution.contact_turning);
  reply.iterations().set(outcome.iterations);
  reply.residual().set(std::isfinite(outcome.residual) ? outcome.residual : kUnlimited);
  reply.stop_reason().set(static_cast<std::uint32_t>(outcome.stop_reason));
}

}  // namespace gravitas
