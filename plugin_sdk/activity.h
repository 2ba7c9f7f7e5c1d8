// Sleep and wake (§ 3.10.4): which bodies rest, which islands fall asleep, and who wakes with whom.
//
// A body is at rest while its kinetic energy per mass is below SleepRule::energy. An island (bodies that contacts and
// joints connect; what cannot be pushed connects nothing) falls asleep when
//
//   - every body of it may sleep (kCanSleep) and has been at rest for SleepRule::time, and
//   - something that stands still holds it: a contact or a joint with an immovable body, a resting kinematic one or the
//     world; none of its bodies touches or is joined to a kinematic body that moves.
//
// So what flies or drifts freely never sleeps, however slow it is. What is held and slow is told from what rests by its
// speed alone, and no threshold can tell a slide of a micrometre a second from rest: the default energy is that of
// 1.4e-6 m/s, far above what solvers leave of a body at rest (1e-15 m/s in stacks) and far below what is meant to
// move. The time bridges turning points: with the acceleration a, what turns back is slower than v for 2 v/a, in the
// gravity of the Earth 3e-7 s of a throw. What swings or slides more slowly than that all the time is stopped, and what
// starts more slowly than that out of an unstable balance stays in it; a scene about such motions sets the energy to 0,
// or CanSleep = false.
//
// Asleep, a body has velocity 0, and nothing moves it until its whole island is woken: by a contact or a joint with what
// moves, by the user, by another plugin in a slot, or by a force that changes; and while forces change, nothing rests.
// A force has changed when the difference to what it was when the rest began, were it alone, would in SleepRule::time
// bring the body to SleepRule::energy. A joint whose drive depends on time alone wakes nobody: it
// must keep its bodies awake (no kCanSleep), as services/scene has those that follow a table.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "plugin_sdk/body.h"
#include "plugin_sdk/solver/islands.h"

namespace gravitas {

struct SleepRule {
  double energy = 1e-12;  // J/kg; 0: nothing falls asleep
  double time = 0.5;      // s
};

// Among the steps that bodies have rested: this one sleeps.
inline constexpr std::uint32_t kAsleep = 0xffffffffU;

// Pairs of bodies, 2 numbers each, in two lists; kNone: the world.
struct Connections {
  std::span<const std::uint32_t> contacts, joints;
};

// A state, as the columns of bodies have it.
struct BodiesAtRest {
  std::span<const std::uint32_t> flags;
  std::span<const double> mass, inertia, orientation, linear_velocity, angular_velocity;
};

// The first body that sleeps and may not, or moves; kNone if there is none.
std::uint32_t find_wrong_sleeper(const BodiesAtRest& bodies, std::span<const std::uint32_t> rested);

// Keeps nothing but room between calls. Cost: a look at each body and, where somebody falls asleep or wakes, at each
// connection.
class Activity {
 public:
  explicit Activity(const SleepRule& rule) : rule_(rule) {}

  // Steps of a length (s) that make SleepRule::time.
  std::uint32_t steps_to_sleep(double time_step) const;

  // Counts a step for bodies that are awake and at rest, up to `steps`; the others begin again. `rested`: steps so far,
  // or kAsleep.
  void count_rest(const BodiesAtRest& bodies, std::uint32_t steps, std::span<std::uint32_t> rested) const;

  // Bodies that are awake begin again where a wrench (6 numbers a body) is not what it was when they began.
  void start_again_where_pushed(const BodiesAtRest& bodies, std::span<const double> wrench,
                                std::span<double> rest_wrench, std::span<std::uint32_t> rested) const;

  // Lets islands fall asleep whose bodies have all rested for `steps`; returns these bodies, rising.
  std::span<const std::uint32_t> fall_asleep(const BodiesAtRest& bodies, const Connections& connections,
                                             std::uint32_t steps, std::span<std::uint32_t> rested);

  // Bodies that sleep now (by `is_asleep`) in the island of one that does, itself included, rising.
  template <typename IsAsleep>
  std::span<const std::uint32_t> sleepers_with(std::uint32_t body, std::uint32_t count, const Connections& connections,
                                               IsAsleep&& is_asleep) {
    join(count, connections, is_asleep);
    chosen_.clear();
    for (std::uint32_t i = 0; i < count; ++i)
      if (is_asleep(i) && islands_.root(i) == islands_.root(body)) chosen_.push_back(i);
    return chosen_;
  }

  // True if a wrench (6 numbers) has changed for a body.
  bool is_pushed(double mass, const Vector3& inertia, std::span<const double> wrench,
                 std::span<const double> before) const;

 private:
  // Islands of the bodies that `belongs` names.
  template <typename Belongs>
  void join(std::uint32_t count, const Connections& connections, Belongs&& belongs) {
    islands_.reset(count);
    for (const std::span<const std::uint32_t> pairs : {connections.contacts, connections.joints})
      for (std::size_t i = 0; i < pairs.size(); i += 2)
        if (pairs[i] != kNone && pairs[i + 1] != kNone && belongs(pairs[i]) && belongs(pairs[i + 1]))
          islands_.join(pairs[i], pairs[i + 1]);
  }

  SleepRule rule_;
  BodyUnion islands_{0};
  std::vector<std::uint8_t> is_held_, is_restless_;  // by the root of an island
  std::vector<std::uint32_t> chosen_;
};

}  // namespace gravitas
