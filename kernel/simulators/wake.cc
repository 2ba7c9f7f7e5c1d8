// Who sleeps is woken, with its island, by what moves and touches it, leaves it or holds it by a joint, by a force that
// changes, or by order. An integrator may also ask what would act on a sleeper elsewhere or if it moved, to learn what a
// force depends on: what it is told there has not happened.
#include <algorithm>

#include "kernel/environment.h"

namespace gravitas::kernel {

void Environment::look_for_pushes() {
  for (std::uint32_t i = 0; i < model_.body_count; ++i) {
    if (data_.flags[i] == model_.flags[i]) continue;
    const Pose is = pose_of(front().position, front().orientation, i);
    const Pose asked = pose_of(data_.derivative_position, data_.derivative_orientation, i);
    const bool is_there = asked.position == is.position && asked.orientation.coeffs() == is.orientation.coeffs();
    const bool is_still = vector_at(data_.derivative_linear_velocity.span(), i).isZero(0.0) &&
                          vector_at(data_.derivative_angular_velocity.span(), i).isZero(0.0);
    if (is_there && is_still &&
        activity_.is_pushed(model_.mass[i], vector_at(model_.inertia.span(), i), data_.wrench.span().subspan(6 * i, 6),
                            front().rest_wrench.span().subspan(6 * i, 6)))
      pushed_.push_back(i);
  }
}

// With contacts at S* in place. True if somebody has been woken, and the step is to be made again.
bool Environment::wakes_sleepers() {
  const std::uint32_t before = sleepers_;
  for (const std::uint32_t body : data_.contact_body.span()) wake_island(body);
  const Connections connected = connections();
  for (const std::span<const std::uint32_t> pairs : {connected.contacts, connected.joints}) {
    for (std::size_t i = 0; i < pairs.size(); i += 2) {
      const std::uint32_t a = pairs[i], b = pairs[i + 1];
      if (is_carrying(b)) wake_island(a);
      if (is_carrying(a)) wake_island(b);
    }
  }
  for (const std::uint32_t body : pushed_) wake_island(body);
  must_restart_ |= sleepers_ < before;
  return must_restart_;
}

void Environment::wake_island(std::uint32_t body) {
  if (!can_sleep() || body == kNone || data_.flags[body] == model_.flags[body]) return;
  is_idle_ = false;
  const auto sleeps = [&](std::uint32_t i) { return data_.flags[i] != model_.flags[i]; };
  for (const std::uint32_t one : activity_.sleepers_with(body, model_.body_count, connections(), sleeps)) {
    let_sleep(one, false);
    --sleepers_;
  }
}

}  // namespace gravitas::kernel
