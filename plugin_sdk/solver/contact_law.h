// What a contact's material row asks of its velocities: a frame, the speed at which it parts, and coefficients.
#pragma once

#include <cstdint>

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

// Lowers e s of a contact whose impulse did work on its bodies to the speed at which they arrive where the step ends, if that
// is little less. False if it stays.
inline bool lower_to_arrival(const Gain& own, double arrival, double* target) {
  constexpr double kSafely = 1.0 - 1e-10;
  const double fair = kSafely * arrival;
  if (!own.is_real() || !(fair < *target && fair > 0.5 * *target)) return false;
  *target = fair;
  return true;
}

// The largest share of the e s of some contacts with which an impact adds no energy: of those that are to blame, whose impulses
// do work on their bodies (friction turns one body by what stops another), or of all that are connected where none is (one
// bounces and presses another down that was parting) or these do not suffice. What all impulses do is a quadratic function of
// it as long as the same contacts push: known at one, at nought and at a half. Used so:
//
//   for (SharedRestitution restitution(work at one); solve with share(); restitution.goes_on(what it gains));
class SharedRestitution {
 public:
  explicit SharedRestitution(double work_at_one) : at_one_(work_at_one) {}
  double share() const { return share_; }
  // After a solution with share(), by whether and what it gains: false if it stands, else there is another share to solve with.
  bool goes_on(bool gains, double work);

 private:
  enum class Tried : std::uint8_t { kNought, kHalf, kRoot, kBest };
  double root(double at_half) const;

  double at_one_, at_nought_ = 0.0, share_ = 0.0, best_ = 0.0;
  Tried tried_ = Tried::kNought;
};

}  // namespace gravitas
