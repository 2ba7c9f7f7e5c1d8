// Who sleeps takes no part in a step: immovable for integrator and solver, in no pair with another that stands still,
// its joints not asked; what is remembered of its contacts and joints goes on to the next state. The space keeps it, so
// that what comes near is found. Forces that are not constant are asked for it, too: that is how a change is seen.
//
//   at the step's start        those asleep, but for islands that the user or another plugin wakes
//   when contacts at S* are    some are woken (wake.cc); the step is made again from S_n
//   known
//   after the last inner step  islands that have rested long enough fall asleep: velocities 0, poses as they are
//
// A step in which nothing moves is that of the clock alone. plugin_sdk/activity.h has the rule.
#include <algorithm>

#include "kernel/environment.h"

namespace gravitas::kernel {

// Where wrenches change, those of bodies at rest are part of the state.
void Environment::remember_wrenches() {
  if (!can_sleep()) return;
  for (const State& state : states_) {
    state.rest_wrench.resize(6ULL * model_.body_count);
    std::ranges::fill(state.rest_wrench.span(), 0.0);
  }
}

void Environment::find_sleepers() {
  is_idle_ = false;
  sleepers_ = 0;
  if (!can_sleep()) return;
  for (std::uint32_t i = 0; i < model_.body_count; ++i) {
    const bool is_asleep = front().rested[i] == kAsleep;
    let_sleep(i, is_asleep);
    sleepers_ += is_asleep ? 1 : 0;
  }
  for (const std::uint32_t body : wake_orders_) wake_island(body);
}

bool Environment::sleeps(std::uint32_t joint) const {
  return sleepers_ > 0 && !is_awake(model_.constraints[joint].body1) && !is_awake(model_.constraints[joint].body2);
}

void Environment::let_sleep(std::uint32_t body, bool sleeps) {
  const std::uint32_t flags = sleeps ? model_.flags[body] & ~std::uint32_t{kMovable} : model_.flags[body];
  if (data_.flags[body] == flags) return;
  data_.flags[body] = flags;
  data_.inverse_mass[body] = sleeps ? 0.0 : model_.inverse_mass[body];
  set_vector(data_.inverse_inertia.span(), body,
             sleeps ? Vector3(Vector3::Zero()) : vector_at(model_.inverse_inertia.span(), body));
}

bool Environment::does_anything_move() const {
  if (sleepers_ == 0 || !wrench_is_constant_ || !model_.curves.empty()) return model_.body_count > 0;
  const std::uint32_t to_look_at = is_idle_ ? 0 : model_.body_count;
  for (std::uint32_t i = 0; i < to_look_at; ++i) {
    if (is_awake(i)) return true;
    if ((model_.flags[i] & kKinematic) != 0 && (!vector_at(front().linear_velocity.span(), i).isZero(0.0) ||
                                                !vector_at(front().angular_velocity.span(), i).isZero(0.0)))
      return true;
  }
  return std::ranges::any_of(slots_, &StageSlot::has_order);  // a fault is ordered for a call
}

// A kinematic body that goes elsewhere in this step.
bool Environment::is_carrying(std::uint32_t body) const {
  if (body == kNone || (model_.flags[body] & kKinematic) == 0) return false;
  const auto differs = [&](const Column<double>& a, const Column<double>& b, std::size_t components) {
    return !std::equal(&a[components * body], &a[components * body] + components, &b[components * body]);
  };
  return differs(data_.trial_position, front().position, 3) ||
         differs(data_.trial_orientation, front().orientation, 4) ||
         !vector_at(data_.trial_linear_velocity.span(), body).isZero(0.0) ||
         !vector_at(data_.trial_angular_velocity.span(), body).isZero(0.0);
}

void Environment::leave_out_sleepers() {
  std::size_t kept = 0;
  for (std::size_t i = 0; i < data_.pair.size(); i += 2) {
    const std::uint32_t a = data_.pair[i], b = data_.pair[i + 1];
    if (!is_awake(a) && !is_awake(b) && !is_carrying(a) && !is_carrying(b)) continue;
    data_.pair[kept++] = a;
    data_.pair[kept++] = b;
  }
  data_.pair.resize(kept);
}

Connections Environment::connections() {
  joint_bodies_.clear();
  for (std::uint32_t i = 0; i < model_.constraint_count; ++i)
    if (front().intact[i] != 0)
      for (const std::uint32_t body : {model_.constraints[i].body1, model_.constraints[i].body2})
        joint_bodies_.push_back(body);
  return {front().contact_body.span(), joint_bodies_};
}

// The last inner step has become the state in front.
void Environment::settle() {
  if (!can_sleep() || inner_ == 0) return;
  const State& next = front();
  for (std::uint32_t i = 0; i < model_.body_count; ++i)
    if (next.rested[i] == kAsleep && is_awake(i)) next.rested[i] = 0;
  const BodiesAtRest bodies = bodies_at_rest(model_, next);
  const std::uint32_t steps = activity_.steps_to_sleep(description_.time_step);
  activity_.count_rest(bodies, steps, next.rested.span());
  if (!wrench_is_constant_)
    activity_.start_again_where_pushed(bodies, data_.start_wrench.span(), next.rest_wrench.span(), next.rested.span());
  // what is near and bears nothing holds nobody
  const Connections holds{next.touching.span(), connections().joints};
  for (const std::uint32_t body : activity_.fall_asleep(bodies, holds, steps, next.rested.span())) {
    for (const Column<double>* velocity : {&next.linear_velocity, &next.angular_velocity})
      set_vector(velocity->span(), body, Vector3::Zero());
    next.state_changed[body] = 1;
  }
}

}  // namespace gravitas::kernel
