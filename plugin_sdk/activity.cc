#include "plugin_sdk/activity.h"

#include <algorithm>
#include <cmath>

#include "plugin_sdk/dynamics.h"

namespace gravitas {
namespace {

Twist twist_of(const BodiesAtRest& bodies, std::uint32_t body) {
  return {vector_at(bodies.linear_velocity, body), vector_at(bodies.angular_velocity, body)};
}

bool moves(const BodiesAtRest& bodies, std::uint32_t body) {
  const Twist twist = twist_of(bodies, body);
  return !twist.linear.isZero(0.0) || !twist.angular.isZero(0.0);
}

// Whether the kinetic energy per mass is below a value; what flies is told without a look at its rotation.
bool is_slow(const BodiesAtRest& bodies, std::uint32_t body, double energy) {
  const Twist twist = twist_of(bodies, body);
  const double mass = bodies.mass[body];
  return 0.5 * twist.linear.squaredNorm() < energy &&
         kinetic_energy(mass, vector_at(bodies.inertia, body), quaternion_at(bodies.orientation, body), twist) / mass <
             energy;
}

bool is_awake(const BodiesAtRest& bodies, std::span<const std::uint32_t> rested, std::uint32_t body) {
  return (bodies.flags[body] & kMovable) != 0 && rested[body] != kAsleep;
}

}  // namespace

std::uint32_t find_wrong_sleeper(const BodiesAtRest& bodies, std::span<const std::uint32_t> rested) {
  for (std::uint32_t i = 0; i < rested.size(); ++i) {
    const bool may_sleep = (bodies.flags[i] & kMovable) != 0 && (bodies.flags[i] & kCanSleep) != 0;
    if (rested[i] == kAsleep && (!may_sleep || moves(bodies, i))) return i;
  }
  return kNone;
}

std::uint32_t Activity::steps_to_sleep(double time_step) const {
  return static_cast<std::uint32_t>(std::clamp(std::ceil(rule_.time / time_step), 1.0, kAsleep - 1.0));
}

void Activity::count_rest(const BodiesAtRest& bodies, std::uint32_t steps, std::span<std::uint32_t> rested) const {
  for (std::uint32_t i = 0; i < rested.size(); ++i) {
    if (!is_awake(bodies, rested, i)) continue;
    const bool rests = (bodies.flags[i] & kCanSleep) != 0 && is_slow(bodies, i, rule_.energy);
    rested[i] = rests ? std::min(rested[i] + 1, steps) : 0;
  }
}

void Activity::start_again_where_pushed(const BodiesAtRest& bodies, std::span<const double> wrench,
                                        std::span<double> rest_wrench, std::span<std::uint32_t> rested) const {
  for (std::uint32_t i = 0; i < rested.size(); ++i) {
    const std::span<const double> now = wrench.subspan(6 * std::size_t{i}, 6);
    const std::span<double> before = rest_wrench.subspan(6 * std::size_t{i}, 6);
    if (!is_awake(bodies, rested, i) || !is_pushed(bodies.mass[i], vector_at(bodies.inertia, i), now, before)) continue;
    std::ranges::copy(now, before.begin());
    rested[i] = 0;
  }
}

std::span<const std::uint32_t> Activity::fall_asleep(const BodiesAtRest& bodies, const Connections& connections,
                                                     std::uint32_t steps, std::span<std::uint32_t> rested) {
  chosen_.clear();
  const auto count = static_cast<std::uint32_t>(rested.size());
  if (std::ranges::find(rested, steps) == rested.end()) return chosen_;

  const auto is_awake = [&](std::uint32_t body) { return gravitas::is_awake(bodies, rested, body); };
  join(count, connections, is_awake);
  is_held_.assign(count, 0), is_restless_.assign(count, 0);
  for (std::uint32_t i = 0; i < count; ++i)
    if (is_awake(i) && rested[i] < steps) is_restless_[islands_.root(i)] = 1;
  const auto note_hold = [&](std::uint32_t body, std::uint32_t other) {
    if (body == kNone || !is_awake(body) || (other != kNone && is_awake(other))) return;
    const bool carries = other != kNone && (bodies.flags[other] & kKinematic) != 0 && moves(bodies, other);
    (carries ? is_restless_ : is_held_)[islands_.root(body)] = 1;
  };
  for (const std::span<const std::uint32_t> pairs : {connections.contacts, connections.joints})
    for (std::size_t i = 0; i < pairs.size(); i += 2)
      note_hold(pairs[i], pairs[i + 1]), note_hold(pairs[i + 1], pairs[i]);

  for (std::uint32_t i = 0; i < count; ++i) {
    if (!is_awake(i)) continue;
    const std::uint32_t root = islands_.root(i);
    if (is_held_[root] != 0 && is_restless_[root] == 0) chosen_.push_back(i);
  }
  for (const std::uint32_t body : chosen_) rested[body] = kAsleep;
  return chosen_;
}

bool Activity::is_pushed(double mass, const Vector3& inertia, std::span<const double> wrench,
                         std::span<const double> before) const {
  // energy per mass after t under the difference alone: t^2/2 (f^2/m^2 + tau^2/(m I)), of the smallest I
  double force = 0.0, torque = 0.0;
  for (std::size_t k = 0; k < 3; ++k) {
    force += (wrench[k] - before[k]) * (wrench[k] - before[k]);
    torque += (wrench[k + 3] - before[k + 3]) * (wrench[k + 3] - before[k + 3]);
  }
  const double energy = 0.5 * rule_.time * rule_.time * (force / mass + torque / inertia.minCoeff()) / mass;
  return !(energy < rule_.energy);
}

}  // namespace gravitas
