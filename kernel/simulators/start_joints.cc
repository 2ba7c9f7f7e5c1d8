// Joints where an inner step of `Smooth` begins: what they make of velocities there, and what they are, for solvers that find what
// holds in a trial state: limits that were closed there, drives that were at their speed (plugin_sdk/solver/reaction_holdings.cc).
// Joints alone know how they are: carried back from the trial state, a rope on a drum is off by what it rolled.
#include <algorithm>
#include <utility>

#include "kernel/environment.h"

namespace gravitas::kernel {

// Once an inner step. False, and none are there, where they are others than in the trial state that discrepancies are of, which are
// to be asked anew then: a rope that ends on the axis of its drum is none.
bool Environment::ask_start_joints() {
  DiscrepancyAnswer &trial = data_.discrepancies, &start = data_.start_joints;
  const auto are_the_same = [&] { return std::ranges::equal(start.constraint.span(), trial.constraint.span()); };
  if (start.mode.size() > 0 && are_the_same()) return true;
  std::swap(trial, start);
  // behind a switch, not an ulp before it
  const double time = std::exchange(data_.time[0], std::clamp(data_.time[0], asked_from_, asked_until_));
  ask_discrepancies(data_.time, front().position, front().orientation, start_linear_velocity(),
                    start_angular_velocity());
  data_.time[0] = time;
  std::swap(trial, start);
  if (are_the_same()) return true;
  start.resize(0);
  return false;
}

// What bodies do at the start, or an impulse gives them, joints may not allow: it jumps there and then, as by a solve at the
// end of a step without length. Left to the end of the first step it would cost the method its order.
void Environment::join_start_velocities() {
  constexpr double kNoLength = 1e-12;  // of the step
  const double length = data_.time_step[0];
  data_.time_step[0] = kNoLength * length;
  data_.trial_position.assign(front().position);
  data_.trial_orientation.assign(front().orientation);
  data_.trial_linear_velocity.assign(data_.start_linear_velocity);
  data_.trial_angular_velocity.assign(data_.start_angular_velocity);
  data_.trial_time[0] = data_.time[0];
  follow_motion(data_.trial_time[0], data_.trial_position, data_.trial_orientation, data_.trial_linear_velocity,
                data_.trial_angular_velocity);
  constrain(Validator::unchecked<Trusted<TrialState>>());
  std::ranges::fill(data_.held_force.span(), 0.0);
  solve();
  start_impulse_.assign(data_.discrepancy_impulse.span().begin(), data_.discrepancy_impulse.span().end());
  data_.start_linear_velocity.assign(data_.solved_linear_velocity);
  data_.start_angular_velocity.assign(data_.solved_angular_velocity);
  data_.time_step[0] = length;
}

// What joints bear as the step begins is part of what they bear in it, for those who ask.
void Environment::add_start_impulses() {
  if (start_impulse_.size() != data_.held_force.size()) return;
  for (std::size_t i = 0; i < start_impulse_.size(); ++i) data_.held_force[i] += start_impulse_[i] / data_.time_step[0];
}

}  // namespace gravitas::kernel
