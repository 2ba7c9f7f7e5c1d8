// What a contact's material row asks of its velocities: a frame, the speed at which it parts, and coefficients.
#pragma once

#include <algorithm>
#include <cstdint>
#include <span>
#include <vector>

#include "plugin_sdk/solver.h"
#include "plugin_sdk/solver/bodies.h"

namespace gravitas {

// n.v_{n+1} >= target. Where the surface is perturbed and something arrives, n is the perturbed normal
// (surface_perturbation.h) if it keeps the signs of n.v at S_n and at S* and finds an arrival along it too, and friction
// acts across it. A resting contact uses the true normal: a tilt that persists would roll a resting ball away for ever.
struct ContactLaw {
  Matrix3 frame = Matrix3::Identity();  // columns: direction of the normal law and two tangents, world
  double arrival = 0.0, target = 0.0;   // s and e s, m/s (arrival.h)
  double static_friction = 0.0;         // never below the dynamic one
  double dynamic_friction = 0.0;
  double rolling_friction = 0.0, spinning_friction = 0.0;  // m

  bool has_turning() const { return rolling_friction > 0.0 || spinning_friction > 0.0; }
};

// Of contact `i` of the request, between two bodies.
ContactLaw contact_law(const stage::SolverSolveRequest& request, std::size_t i, const SolverBody& one,
                       const SolverBody& two);

// The share of friction's impulse that displaces two bodies in the pose change, of all their contacts. What arrives in this
// step, faster than loads make it, is pressed for part of it alone, and rubs for that part: as far as its contacts overlap at
// S*, beside how far what they change of the velocities goes in theta h. A box that keeps flat in its velocities, where
// friction is balanced by where the ground presses, then does in its pose. 1 for all else, and where one of the contacts
// pressed in the step before.
class DisplacingFriction {
 public:
  DisplacingFriction(const stage::SolverSolveRequest& request, const SolverBody& one, const SolverBody& two)
      : request_(request), one_(one), two_(two) {}
  void add(std::size_t contact);
  double share() const;

 private:
  const stage::SolverSolveRequest& request_;
  const SolverBody &one_, &two_;
  double overlap_ = 0.0, change_ = 0.0, arrival_ = 0.0;  // m, m/s, m/s
  bool has_pressed_ = false;
};

// Those of `count` contacts of the request, contact(k) being its rows in turn, pair by pair; body(i, end) is the first or
// second body of row i.
template <typename ContactAt, typename BodyOf>
void find_displacing_friction(const stage::SolverSolveRequest& request, std::size_t count, ContactAt&& contact,
                              BodyOf&& body, std::vector<double>* shares) {
  shares->clear();
  while (shares->size() < count) {
    const std::size_t first = contact(shares->size());
    const auto pair_of = [&](std::size_t i) { return request.contact_body().subspan(2 * i, 2); };
    DisplacingFriction friction(request, body(first, 0), body(first, 1));
    std::size_t end = shares->size();
    for (; end < count && std::ranges::equal(pair_of(contact(end)), pair_of(first)); ++end) friction.add(contact(end));
    shares->resize(end, friction.share());
  }
}

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
