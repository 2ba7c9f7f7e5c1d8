#pragma once

#include <cstdint>

namespace gravitas {

// What is asked of a trial state (column `question` of Integrator.Derivative).
enum class DerivativeQuestion : std::uint32_t {
  kWrenches = 0,          // with what joints do, where simulator Smooth tells it
  kWithJacobian = 1,      // and how they change with the state
  kForces = 2,            // without what joints do
  kPlaceImpulses = 3,     // Derivatives::place_impulses()
  kVelocityImpulses = 4,  // Derivatives::velocity_impulses()
};

// From this question on impulses of joints are asked for instead of wrenches.
inline constexpr auto kFirstOfImpulses = static_cast<std::uint32_t>(DerivativeQuestion::kPlaceImpulses);

}  // namespace gravitas
