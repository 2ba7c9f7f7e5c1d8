// Joints that hold by locks alone, as integrators need them that keep to the joints while they go
// (Derivatives::place_impulses).
#pragma once

#include <cstdint>
#include <span>

#include "plugin_sdk/discrepancy.h"

namespace gravitas {

// True if every axis that is not free is locked rigidly, whatever force that takes: no limits with room, no drives or friction,
// nothing that gives way. Such joints hold their place in every state, and their forces follow from that.
bool are_locks(const DiscrepancyColumns& joints);

// True if some axis holds in some states, by a force that it may not have in others: a limit, a drive with a bound, friction.
bool may_let_go(const DiscrepancyColumns& joints);

// What the locks of joints are off by in another state, m or rad, along their axes as `here` has them (world, three a
// discrepancy). False where the joints do not answer alike in both states. Precondition: are_locks(here).
bool find_lock_errors(const DiscrepancyColumns& here, const DiscrepancyColumns& there, std::span<double> errors);

// By how much the velocities of the bodies differ from what locks want, m/s or rad/s, likewise. `body`: two a discrepancy.
struct MovingBodies {
  std::span<const double> position, linear_velocity, angular_velocity;
};
void find_lock_velocity_errors(const DiscrepancyColumns& joints, std::span<const std::uint32_t> body,
                               const MovingBodies& bodies, std::span<double> errors);

}  // namespace gravitas
