// The solver's second question, as tests ask it.
#pragma once

#include <Eigen/Core>
#include <array>
#include <cstddef>
#include <cstdint>
#include <vector>

#include "plugin_sdk/body.h"
#include "plugin_sdk/discrepancy.h"
#include "plugin_sdk/solver/reactions.h"
#include "plugin_sdk/wrench_jacobian.h"

namespace gravitas::harness {

// Bodies without rotation unless said, and joints between them or to the world.
class ReactionProblem {
 public:
  std::uint32_t add_body(double mass, const Vector3& x, const Vector3& v, const Vector3& force) {
    const auto body = static_cast<std::uint32_t>(flags.size());
    flags.push_back(mass > 0.0 ? kMovable : kKinematic);
    inverse_mass.push_back(mass > 0.0 ? 1.0 / mass : 0.0);
    append(inertia, Vector3(1, 2, 3));
    append(inverse_inertia, mass > 0.0 ? Vector3(1, 1.0 / 2, 1.0 / 3) : Vector3::Zero());
    drag.push_back(0.0);
    append(position, x);
    orientation.insert(orientation.end(), {1, 0, 0, 0});
    append(linear_velocity, v);
    append(angular_velocity, Vector3::Zero());
    append(wrench, force), append(wrench, Vector3::Zero());
    acceleration.insert(acceleration.end(), 6, 0.0);
    return body;
  }

  void add_joint(std::uint32_t one, std::uint32_t two, const Discrepancy& d) {
    discrepancy_body.insert(discrepancy_body.end(), {one, two});
    append(point1, d.point1), append(point2, d.point2), append(velocity, d.velocity);
    correction.push_back(d.correction);
    axes.insert(axes.end(), {d.axes.w(), d.axes.x(), d.axes.y(), d.axes.z()});
    mode.push_back(d.modes);
    append(lower, d.lower), append(upper, d.upper), append(compliance, d.compliance), append(damping, d.damping);
    append(maximum_force, d.maximum_force), append(desired_acceleration, d.acceleration);
  }

  using Request = stage::SolverReactionsRequest;
  std::array<gravitas_column, Request::kColumnCount> request() const {
    const auto column = [](const auto& values) { return gravitas_column{values.data(), values.size()}; };
    return {column(flags),
            column(inverse_mass),
            column(inertia),
            column(inverse_inertia),
            column(drag),
            column(position),
            column(orientation),
            column(linear_velocity),
            column(angular_velocity),
            column(wrench),
            column(acceleration),
            column(discrepancy_body),
            column(point1),
            column(point2),
            column(velocity),
            column(correction),
            column(axes),
            column(mode),
            column(lower),
            column(upper),
            column(compliance),
            column(damping),
            column(maximum_force),
            column(block_body),
            column(block),
            column(has_moved ? start_position : position),
            column(has_moved ? start_orientation : orientation),
            column(has_moved ? start_linear_velocity : linear_velocity),
            column(has_moved ? start_angular_velocity : angular_velocity),
            {&time_step, 1},
            column(desired_acceleration),
            column(start_point1),
            column(start_point2),
            column(start_velocity),
            column(start_axes),
            column(start_mode),
            column(start_lower),
            column(start_upper),
            column(start_compliance),
            column(start_damping),
            column(start_acceleration)};
  }

  void solve() {
    reaction_.assign(6 * flags.size(), 0.0), force_.assign(3 * mode.size(), 0.0);
    std::array<gravitas_reply_column, 3> reply = {
        {{reaction_.data(), reaction_.size(), 0}, {force_.data(), force_.size(), 0}, {&residual_, 1, 0}}};
    solve_reactions(Request(request().data()), stage::SolverReactionsReply(reply.data()));
  }

  // Of the reactions on all bodies: six rows and twelve columns each.
  Eigen::MatrixXd differentiate() {
    const std::size_t bodies = flags.size();
    std::vector<std::uint32_t> pairs(2 * bodies * bodies);
    std::vector<double> numbers(kBlockNumbers * bodies * bodies);
    std::array<gravitas_reply_column, 2> reply = {
        {{pairs.data(), pairs.size(), 0}, {numbers.data(), numbers.size(), 0}}};
    differentiate_reactions(Request(request().data()), stage::SolverReactionJacobiansReply(reply.data()));
    Eigen::MatrixXd jacobian =
        Eigen::MatrixXd::Zero(static_cast<Eigen::Index>(6 * bodies), static_cast<Eigen::Index>(12 * bodies));
    blocks_ = reply[0].count / 2;
    for (std::size_t i = 0; i < blocks_; ++i)
      jacobian.block<6, 12>(6 * Eigen::Index{pairs[2 * i]}, 12 * Eigen::Index{pairs[2 * i + 1]}) =
          Eigen::Map<const JacobianBlock>(&numbers[kBlockNumbers * i]);
    return jacobian;
  }
  // That the last differentiate() gave.
  std::size_t blocks() const { return blocks_; }
  const std::vector<double>& reactions() const { return reaction_; }

  Vector3 reaction(std::size_t body) const { return vector_at(reaction_, 2 * body); }
  Vector3 torque(std::size_t body) const { return vector_at(reaction_, 2 * body + 1); }
  Vector3 force(std::size_t joint) const { return vector_at(force_, joint); }
  double residual() const { return residual_; }

  // From here on the state is that of a trial, and the step began with what it was.
  void begin_step() {
    has_moved = true;
    start_position = position, start_orientation = orientation;
    start_linear_velocity = linear_velocity, start_angular_velocity = angular_velocity;
  }

  // And what its joints are.
  void tell_start_joints() {
    start_point1 = point1, start_point2 = point2, start_velocity = velocity, start_axes = axes, start_mode = mode;
    start_lower = lower, start_upper = upper, start_compliance = compliance, start_damping = damping;
    start_acceleration = desired_acceleration;
  }

  bool has_moved = false;
  double time_step = 0.01;
  std::vector<double> start_position, start_orientation, start_linear_velocity, start_angular_velocity;
  std::vector<double> start_point1, start_point2, start_velocity, start_axes, start_lower, start_upper,
      start_compliance, start_damping, start_acceleration;
  std::vector<std::uint32_t> flags, discrepancy_body, mode, block_body, start_mode;
  std::vector<double> inverse_mass, inertia, inverse_inertia, drag, position, orientation, linear_velocity,
      angular_velocity, wrench, acceleration, point1, point2, velocity, correction, axes, lower, upper, compliance,
      damping, maximum_force, desired_acceleration, block;

 private:
  static void append(std::vector<double>& column, const Vector3& v) { column.insert(column.end(), v.begin(), v.end()); }

  std::vector<double> reaction_, force_;
  double residual_ = 0.0;
  std::size_t blocks_ = 0;
};

}  // namespace gravitas::harness
