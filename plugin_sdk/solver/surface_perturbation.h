// Imperfect surfaces (§ 2.6.5): the normal of an impact, tilted a little at random, the same way
// for the same contact in every step, process and run.
//
// The generator is counter-based: numbers are a function of the contact's key alone, so there is no
// state to keep, replay or share. A new key is a new draw; the step, the order of contacts and the
// history are not asked.
#pragma once

#include <array>
#include <cstdint>

#include "plugin_sdk/math/types.h"

namespace gravitas {

// Philox4x32-10: Salmon, Moraes, Dror and Shaw, "Parallel random numbers: as easy as 1, 2, 3",
// SC11.
std::array<std::uint32_t, 4> philox4x32(std::array<std::uint32_t, 4> counter, std::array<std::uint32_t, 2> key);

// n_mu = (n + d)/|n + d| with the components of d (world) uniform in (-epsilon, epsilon); `normal`
// itself if n + d is shorter than 1e-3. The tilt is at most asin(sqrt(3) epsilon) while sqrt(3)
// epsilon < 1. § 2.6.5 calls the spread an angle of 2 theta and draws anew in every step: 2 theta
// is a plane angle, and fresh draws make a body at rest wander.
Vector3 perturbed_normal(const Vector3& normal, double epsilon, std::uint64_t contact_key);

}  // namespace gravitas
