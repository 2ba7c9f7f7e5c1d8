// Simulator `Basic`: the seed's retroactive pipeline (§ 3.13). Bodies first move as if they were free; where that
// went wrong (overlap, joint error, velocity into a contact) is then put right in one solve.
//
//   S_n -> integrate (asks for forces): S* -> bounds -> broad phase -> narrow phase at S*
//       -> constrain -> solve -> commit S_{n+1} -> events
//
// A committed step is made of one or more inner steps: `Substeps` equal ones, more where loads turn jointed bodies far
// (loads.cc), cut where a force jumps, and whatever a simulator makes of each. A force is asked as it is between the jump
// before and the next, whatever the time.
#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

#include "kernel/environment.h"
#include "plugin_sdk/dynamics.h"
#include "plugin_sdk/solver.h"

namespace gravitas::kernel {
namespace {

constexpr double kSameTime = 1e-9;  // of the step
constexpr double kEpsilon = std::numeric_limits<double>::epsilon(), kInfinity = std::numeric_limits<double>::infinity();

}  // namespace

void Environment::make_inner_steps() {
  if (!does_anything_move()) return;
  const std::uint32_t count = description_.substeps * times_finer_;
  const double length = length_of_step(step_count_ + 1) / count;
  for (std::uint32_t i = 0; i < count; ++i) {
    for (double done = 0.0; done < length && !must_restart_;) {
      const double left = length - done, part = length_to_switch(i * length + done, left);
      make_part(i * length + done, part);
      done = part == left ? length : done + part;
      // a history from before the jump says nothing about what comes
      if (ends_at_switch_ && !must_restart_) std::ranges::fill(front().state_changed.span(), 1U);
    }
  }
}

double Environment::length_to_switch(double begin, double length) {
  asked_from_ = -kInfinity, asked_until_ = kInfinity;
  ends_at_switch_ = false;
  const std::vector<double>& switches = description_.switches;
  if (switches.empty() || (wrench_is_constant_ && model_.curves.empty() && !knows_reactions())) return length;
  const double from = time() + begin;
  const double slack = std::max(kSameTime * length_of_step(step_count_ + 1), 4.0 * kEpsilon * from);
  const auto next = std::ranges::upper_bound(switches, from + slack);
  if (next != switches.begin()) asked_from_ = *std::prev(next);
  if (next == switches.end()) return length;
  asked_until_ = std::nextafter(*next, -kInfinity);
  ends_at_switch_ = *next <= from + length + slack;
  return *next < from + length - slack ? *next - from : length;
}

void Environment::make_part(double begin, double length) {
  if (description_.accuracy > 0.0) return extrapolate_parts(begin, length);
  if (locates_events()) return locate_events(begin, length);
  if (knows_reactions()) return meet_stops(begin, length);
  begin_inner_step(begin, length);
  if (make_next_state()) end_inner_step();
}

bool Environment::make_next_state() {
  const auto trial = integrate();
  if (!has_reactions()) return write_trial(trial), true;
  return write_what_joints_bear(trial, react(trial));
}

void Environment::begin_inner_step(double begin, double length) {
  validator_.begin_step(step_count_ + 1);
  data_.time[0] = time() + begin;
  data_.time_step[0] = length;
  inner_end_ = begin + length;
  broken_.clear();
  data_.wrench_is_constant[0] = wrench_is_constant_ && !knows_reactions() ? 1 : 0;
  start_wrench_known_ = false;
  if (knows_reactions()) data_.start_joints.resize(0);
  // no trace of earlier steps: a step must be the same after a restore
  if (!wrench_is_constant_) std::ranges::fill(data_.start_wrench.span(), 0.0);
  if (may_jump_at_start()) find_start_velocities();
}

void Environment::find_start_velocities() {
  static constexpr std::array<double, 6> kNoImpulse{};
  for (std::uint32_t i = 0; i < model_.body_count; ++i) {
    const double* impulse = is_struck() ? &data_.impulse[6 * i] : kNoImpulse.data();
    const Twist twist =
        after_impulse({vector_at(front().linear_velocity.span(), i), vector_at(front().angular_velocity.span(), i)},
                      quaternion_at(front().orientation.span(), i), model_.inverse_mass[i],
                      vector_at(model_.inverse_inertia.span(), i), Vector3(impulse[0], impulse[1], impulse[2]),
                      Vector3(impulse[3], impulse[4], impulse[5]));
    set_vector(data_.start_linear_velocity.span(), i, twist.linear);
    set_vector(data_.start_angular_velocity.span(), i, twist.angular);
  }
  if (knows_reactions()) join_start_velocities();
}

bool Environment::is_struck() const { return has_impulses_ && data_.time[0] == 0.0; }

bool Environment::may_jump_at_start() const { return is_struck() || (knows_reactions() && is_anew_ && inner_ == 0); }

const Column<double>& Environment::start_linear_velocity() const {
  return may_jump_at_start() ? data_.start_linear_velocity : front().linear_velocity;
}

const Column<double>& Environment::start_angular_velocity() const {
  return may_jump_at_start() ? data_.start_angular_velocity : front().angular_velocity;
}

void Environment::constrain(const Trusted<TrialState>&) {
  ask_discrepancies(data_.trial_time, data_.trial_position, data_.trial_orientation, data_.trial_linear_velocity,
                    data_.trial_angular_velocity);
  const std::size_t forces = 3 * data_.discrepancies.mode.size();
  if (data_.held_force.size() != forces) {
    // those of other rows say nothing of these
    data_.held_force.resize(forces);
    std::ranges::fill(data_.held_force.span(), 0.0);
  }
  // what springs of joints do came with the derivatives
  if (knows_reactions())
    for (std::uint32_t& mode : data_.discrepancies.mode.span()) mode |= kForcesApplied;
}

std::optional<Trusted<Solution>> Environment::react(const Trusted<TrialState>& trial, bool has_found_contacts) {
  if (makes_step_finer()) return std::nullopt;
  if (has_contacts() && !has_found_contacts) look_up_contacts(find_contacts(bound_and_pair(trial)));
  if (sleepers_ > 0 && wakes_sleepers()) return std::nullopt;
  if (constraint_.is_running()) constrain(trial);
  prepare_contacts();
  // What pressed before does not arrive, and has nothing to bounce with: it came no nearer then, and what turning makes of that
  // since is less the shorter the step. Under a fast rim, whose points come down faster than they would fall, it is more than
  // what solvers take for rest.
  for (std::size_t i = 0; i < data_.contact_key.size(); ++i)
    if (!vector_at(data_.contact_warm_impulse.span(), i).isZero(0.0))
      data_.contact_material[kMaterialColumns * i + kRestitution] = 0.0;
  std::optional<Trusted<Solution>> solution = solve();
  if (knows_reactions()) {
    // S* was integrated with what lets go
    borne_.assign(data_.held_force.span().begin(), data_.held_force.span().end());
    while (lets_go_of_limits()) solution.emplace(solve());
    note_what_joints_take();
    std::ranges::copy(borne_, data_.held_force.data());
  }
  if (knows_reactions() && may_jump_at_start()) add_start_impulses();
  return solution;
}

}  // namespace gravitas::kernel
