// Where integrators are stable on a damped spring, x'' = -k x - c v: by the theory of each method in closed form, and as
// measured on the engine, for one mass and for a lattice of eight point masses and 28 springs.
//
// A step maps (x, h v) linearly; the spectral radius of that map, the amplification, depends on k h^2 and
// zeta = c / (2 sqrt(k)) alone (1 kg). Methods are stable where it does not exceed 1.
#pragma once

#include <vector>

#include "tests/numerics/motion_problem.h"

namespace gravitas::harness {

struct SpringCell {
  double stiffness = 1.0;  // k h^2 of 1 kg
  double zeta = 0.0;

  double damping() const { return 2.0 * zeta * std::sqrt(stiffness); }  // c h
};

// All methods that the map shows. Adaptive ones take a whole step, since it moves less than their accuracy.
std::vector<MotionMethod> mapped_methods();

// By theory. Throws std::out_of_range for a method that is not in the map.
double amplification_in_theory(const MotionMethod& method, const SpringCell& cell);
// k h^2 at which the theory's amplification first exceeds 1; 0: it does at once; infinite: nowhere below 1e12.
double stability_limit(const MotionMethod& method, double zeta);

// As the engine does it: one world of masses on springs.
// kOverflows where the theory has more: stages of such a step are no numbers, and it is refused.
inline constexpr double kOverflows = 1e200;
std::vector<double> amplifications(const MotionMethod& method, const std::vector<SpringCell>& cells);
// Along the stiffest mode of the lattice, the cell's stiffness and damping being those of this mode.
double lattice_amplification(const MotionMethod& method, const SpringCell& cell);

// Grows a thousand times within some steps (or is refused) where unstable.
bool stays_bounded(const MotionMethod& method, const SpringCell& cell, std::uint32_t steps);

}  // namespace gravitas::harness
