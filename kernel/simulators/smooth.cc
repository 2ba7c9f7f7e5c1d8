// Simulator `Smooth`: Basic's step for jointed bodies that touch nothing, with derivatives that know the joints.
//
//   S_n -> integrate: S*, asking for wrenches: forces -> discrepancies of the trial state -> reactions (solver)
//       -> constrain -> solve -> commit S_{n+1}
//
// and before the first step constrain -> solve, for velocities that joints do not allow.
//
// The integrator gets the reactions among the wrenches and need not know of joints: it integrates the index-1 form of the equations and
// keeps its order. What that leaves of joint errors, in position and velocity, is of the size of the method's own error; the solve at
// the end projects it away along M^-1 J^T. Springs of joints are among the reactions, so that their stiffness bounds the step of an
// explicit method; the solve is told to leave them alone (kForcesApplied), and what the reactions had along each axis, as limits and
// bounded drives are there, too.
#include <algorithm>
#include <cmath>

#include "kernel/environment.h"
#include "kernel/simulators/location.h"
#include "plugin_sdk/dynamics.h"
#include "plugin_sdk/joint_locks.h"
#include "plugin_sdk/wrench_jacobian.h"

namespace gravitas::kernel {

void Environment::ask_reactions() {
  const auto ask_joints = [&] {
    ask_discrepancies(data_.derivative_time, data_.derivative_position, data_.derivative_orientation,
                      data_.derivative_linear_velocity, data_.derivative_angular_velocity);
  };
  ask_joints();
  if (!may_let_go(data_.discrepancies.columns()))
    data_.start_joints.resize(0);
  else if (!ask_start_joints())
    ask_joints();
  for (const auto& [body, curve] : model_.curves) {
    const Twist change = curve.at(data_.derivative_time[0]).change;
    set_vector(data_.kinematic_acceleration.span(), 2 * body, change.linear);
    set_vector(data_.kinematic_acceleration.span(), 2 * body + 1, change.angular);
  }
  const DiscrepancyAnswer &joints = data_.discrepancies, &at_start = data_.start_joints;
  const auto request = [&](const Column<std::uint32_t>& block_body, const Column<double>& block) {
    return ids(model_.flags, model_.inverse_mass, model_.inertia, model_.inverse_inertia, model_.damping,
               data_.derivative_position, data_.derivative_orientation, data_.derivative_linear_velocity,
               data_.derivative_angular_velocity, data_.wrench, data_.kinematic_acceleration, data_.discrepancy_body,
               joints.point1, joints.point2, joints.velocity, joints.correction, joints.axes, joints.mode, joints.lower,
               joints.upper, joints.compliance, joints.damping, joints.maximum_force, block_body, block,
               front().position, front().orientation, start_linear_velocity(), start_angular_velocity(),
               data_.time_step, joints.desired_acceleration, at_start.point1, at_start.point2, at_start.velocity,
               at_start.axes, at_start.mode, at_start.lower, at_start.upper, at_start.compliance, at_start.damping,
               at_start.desired_acceleration);
  };
  data_.block_body.resize(0), data_.block.resize(0);
  data_.discrepancy_force.resize(3 * joints.mode.size());
  const auto reply = ids(data_.reaction, data_.discrepancy_force, data_.reaction_residual);
  const auto asked = request(data_.block_body, data_.block);
  ask(Stage::kSolve, &solver_, {stage::Method::kSolverReactions, 0, asked, reply}, nullptr,
      [&](const auto& answer) { return validator_.reactions(answer); });
  last_joints_ = LastJoints::kFresh;  // joint_impulses.cc
  data_.held_position.assign(data_.derivative_position), data_.held_orientation.assign(data_.derivative_orientation);
  if (attempt_counts_) note_what_joints_bear();
  std::ranges::transform(data_.wrench.span(), data_.reaction.span(), data_.wrench_with_reactions.data(), std::plus());
  if (!wants_jacobian()) return;
  const auto with_forces = request(data_.jacobian_body, data_.jacobian);
  ask_jacobians(Stage::kSolve, &solver_, {stage::Method::kSolverReactionJacobians, 0, with_forces, {}},
                most_reaction_blocks());
  // of this state alone: of others a run that is resumed would know nothing
  if (data_.block_body.size() == 0) data_.jacobian_body.resize(0), data_.jacobian.resize(0);
}

// A limit that bears holds like a lock while the step's end is solved, so that what the method is off by to its free side is put
// right, too. That is a small share of what it pushed in the step: where it would pull by more, it opens.
bool Environment::lets_go_of_limits() {
  constexpr double kOfPush = 1e-3;
  bool any = false;
  for (std::size_t i = 0; i < data_.discrepancy_impulse.size(); ++i) {
    const double push = data_.held_force[i] * data_.time_step[0], impulse = data_.discrepancy_impulse[i];
    if (!may_open(data_.discrepancies, i) || push * impulse >= 0.0 || std::abs(impulse) <= kOfPush * std::abs(push))
      continue;
    data_.held_force[i] = 0.0;
    any = true;
  }
  return any;
}

// Derivatives know the joints, so that at the step's end these have next to nothing to take of the velocities, but where a stop
// closes or a drive slips. Where they take much, the mechanism has passed a place where its rows depend on each other, as a
// parallelogram that lies flat, and a stage fell on it; or the step is long for the integrator. Energy is lost or gained then.
void Environment::note_what_joints_take() {
  constexpr double kMuch = 0.1 /* of the velocities */, kOfHeld = 1e-3, kOfLoad = 1e-6;
  if (!broken_.empty()) return;
  const DiscrepancyAnswer& joints = data_.discrepancies;
  const double h = data_.time_step[0];
  for (std::size_t i = 0; i < data_.discrepancy_impulse.size(); ++i) {
    const AxisMode mode = axis_mode(joints.mode[i / 3], static_cast<int>(i % 3));
    const bool holds = mode == AxisMode::kLocked || (mode == AxisMode::kLimited && joints.lower[i] == joints.upper[i]);
    if (!holds && std::abs(data_.discrepancy_impulse[i]) > kOfHeld * h * std::abs(data_.held_force[i])) return;
  }
  double taken = 0.0, all = 0.0;
  for (std::uint32_t i = 0; i < model_.body_count; ++i) {
    if (!is_awake(i) || !(model_.inverse_mass[i] > 0.0)) continue;
    const Quaternion attitude = quaternion_at(data_.trial_orientation.span(), i);
    const auto energy = [&](const Twist& motion) {
      return kinetic_energy(1.0 / model_.inverse_mass[i], vector_at(model_.inertia.span(), i), attitude, motion);
    };
    const Twist before = {vector_at(data_.trial_linear_velocity.span(), i),
                          vector_at(data_.trial_angular_velocity.span(), i)};
    taken += energy({vector_at(data_.solved_linear_velocity.span(), i) - before.linear,
                     vector_at(data_.solved_angular_velocity.span(), i) - before.angular});
    const auto load = [&](std::uint32_t k) { return Vector3(kOfLoad * h * vector_at(data_.reaction.span(), k)); };
    all += energy(before) +  // what rests is moved by roundings of its load
           energy(after_impulse({}, attitude, model_.inverse_mass[i], vector_at(model_.inverse_inertia.span(), i),
                                load(2 * i), load(2 * i + 1)));
  }
  if (taken > kMuch * kMuch * all)
    taken_by_joints_ = std::max(taken_by_joints_, std::pair(std::sqrt(taken / all), step_count_ + 1));
}

std::string Environment::why_joints_took(double share, std::uint32_t step) {
  return "in step " + std::to_string(step) + " the joints took or gave " + std::to_string(std::lround(100.0 * share)) +
         " % of the velocities at its end: a mechanism was where the rows of its joints depend on each other, or "
         "TimeStep is too long for the integrator; energy may be lost or gained";
}

std::uint64_t Environment::most_reaction_blocks() const {
  if (!has_capability(solver_.description().plugins[0].declaration, "reaction_jacobians")) return 0;
  const auto movable = static_cast<std::uint64_t>(
      std::ranges::count_if(model_.flags.span(), [](std::uint32_t flags) { return (flags & kMovable) != 0; }));
  return movable <= kMostJoinedBodies ? movable * movable : 0;
}

}  // namespace gravitas::kernel
