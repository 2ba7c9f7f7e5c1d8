// The map of stability that `gravitas study` shows (services/study/spring_stability.h: theory and definitions), for worlds
// made by hand: one mass, and a lattice of eight point masses and 28 springs.
#pragma once

#include <vector>

#include "services/study/spring_stability.h"
#include "tests/numerics/motion_problem.h"

namespace gravitas::harness {

using study::SpringCell;

// All methods that the map shows. Adaptive ones take a whole step, since it moves less than their accuracy.
std::vector<MotionMethod> mapped_methods();

double amplification_in_theory(const MotionMethod& method, const SpringCell& cell);
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
