// Loads that joints bear, of bodies so light that one step of them would turn the free body far: S* is then nowhere near where
// the joints hold the body, and what closes them from there may end in another assembly of theirs, turned by half a turn. Such
// a step is begun again with as many times more inner steps as leave these turns small; they go by the square of the step, those
// that instantaneous impulses give by itself. Turns that a joint leaves free count, too. `Smooth` knows what joints bear.
#include <algorithm>
#include <cmath>
#include <string>

#include "kernel/environment.h"

namespace gravitas::kernel {
namespace {

constexpr double kFar = 0.5, kSmall = 0.25;  // rad
constexpr std::uint32_t kMostTimes = 256;

}  // namespace

std::pair<double, std::uint32_t> Environment::largest_turn_by_loads() const {
  const double h = data_.time_step[0];
  std::pair<double, std::uint32_t> largest;
  const auto look_at = [&](std::uint32_t body) {
    if (!is_awake(body) || (model_.flags[body] & kKinematic) != 0) return;
    const Vector3 start = vector_at(start_angular_velocity().span(), body);
    const Vector3 by_impulses = start - vector_at(front().angular_velocity.span(), body);
    const Vector3 by_forces = vector_at(data_.trial_angular_velocity.span(), body) - start;
    const double turn = h * (by_impulses.norm() + data_.theta[0] * by_forces.norm());
    if (turn > largest.first) largest = {turn, body};
  };
  for (std::uint32_t i = 0; i < model_.constraint_count; ++i) {
    if (front().intact[i] == 0) continue;
    look_at(model_.constraints[i].body1);
    look_at(model_.constraints[i].body2);
  }
  return largest;
}

bool Environment::makes_step_finer() {
  if (knows_reactions()) return false;
  const auto largest = largest_turn_by_loads();
  if (!(largest.first > kFar)) return false;
  if (times_finer_ == kMostTimes) {
    turned_far_ = std::max(turned_far_, largest);
    return false;
  }
  const double times = std::ceil(std::sqrt(largest.first / kSmall)) * times_finer_;
  times_finer_ = times < kMostTimes ? static_cast<std::uint32_t>(times) : kMostTimes;
  must_restart_ = true;
  return true;
}

std::string Environment::why_turned_far(double turn, std::uint32_t body) const {
  return "loads that joints bear turned body \"" + description_.bodies[body].id + "\" by up to " +
         std::to_string(turn) + " rad in an inner step, of which a step had " +
         std::to_string(kMostTimes * description_.substeps) +
         " and more, so that its joints may have closed in another assembly of theirs: it is too light for its loads, "
         "or TimeStep is too long";
}

}  // namespace gravitas::kernel
