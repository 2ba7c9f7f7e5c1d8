// What a contact's material row asks of its velocities: a frame, the speed at which it parts, and coefficients.
#pragma once

#include <algorithm>
#include <cmath>

#include "plugin_sdk/math/rotation.h"
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

// Arms of a contact of jointed bodies, from where S* has them to where the pose change ends: its points go along with what their
// body turns about the normal (the line on which a wheel rolls steers with it, and stays under its axle while it spins), those
// of two bodies that can be pushed with what both turn by. Where joints hold bodies in directions of the end, points left
// behind would contradict them, and one end of such a line bear everything.
inline void turn_arms(const Vector3& normal, const SolverBody& one, const SolverBody& two, const Twist& change1,
                      const Twist& change2, Vector3* arm1, Vector3* arm2) {
  const double turn1 = normal.dot(change1.angular), turn2 = normal.dot(change2.angular);
  double turn = one.is_pushed() ? turn1 : turn2;
  if (one.is_pushed() && two.is_pushed())
    turn = turn1 * turn2 > 0.0 ? std::copysign(std::min(std::fabs(turn1), std::fabs(turn2)), turn1) : 0.0;
  if (turn == 0.0) return;
  const Quaternion q = exp_rotation(turn * normal);
  *arm1 = q * *arm1, *arm2 = q * *arm2;
}

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
