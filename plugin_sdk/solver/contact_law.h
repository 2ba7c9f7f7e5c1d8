// What a contact's material row asks of its velocities: a frame, the speed at which it parts, and coefficients.
#pragma once

#include "plugin_sdk/solver/bodies.h"

namespace gravitas {

// n.v_{n+1} >= target. Where the surface is perturbed and something arrives, n is the perturbed normal
// (surface_perturbation.h) if it keeps the signs of n.v at S_n and at S* and finds an arrival along it too, and friction
// acts across it. A resting contact uses the true normal: a tilt that persists would roll a resting ball away for ever.
struct ContactLaw {
  Matrix3 frame = Matrix3::Identity();  // columns: direction of the normal law and two tangents, world
  double target = 0.0;                  // e s, m/s (arrival.h)
  double static_friction = 0.0;         // never below the dynamic one
  double dynamic_friction = 0.0;
  double rolling_friction = 0.0, spinning_friction = 0.0;  // m

  bool has_turning() const { return rolling_friction > 0.0 || spinning_friction > 0.0; }
};

// Of contact `i` of the request, between two bodies.
ContactLaw contact_law(const stage::SolverSolveRequest& request, std::size_t i, const SolverBody& one,
                       const SolverBody& two);

// e s of a contact whose impulse did work on its bodies: a half, a quarter, then zero. `times` counts.
inline double lowered_target(double target, std::uint32_t* times) { return ++*times < 3 ? 0.5 * target : 0.0; }

}  // namespace gravitas
