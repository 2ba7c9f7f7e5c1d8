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

// Lowers e s of a contact whose impulse did work on its bodies: to the speed at which they arrive where the step ends, if that
// is little less; else to a half, a quarter, then zero. `times` counts the latter. False if nothing is to be lowered.
inline bool lower_target(const Gain& own, double arrival, double* target, std::uint32_t* times) {
  constexpr double kSafely = 1.0 - 1e-10;
  const double fair = kSafely * arrival;
  if (!own.is_real()) return false;
  const bool lacks_little = fair < *target && fair > 0.5 * *target;
  if (!lacks_little && !own.is_to_blame()) return false;
  *target = lacks_little ? fair : ++*times < 3 ? 0.5 * *target : 0.0;
  return true;
}

}  // namespace gravitas
