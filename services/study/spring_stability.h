// Where integrators are stable on a damped spring, x'' = -k x - c v: by the theory of each method in closed form, and as the
// engine does it.
//
// A step h maps (x, h v) linearly; the spectral radius of that map, the amplification, depends on k h^2 and
// zeta = c / (2 sqrt(k)) alone (1 kg). Methods are stable where it does not exceed 1.
#pragma once

#include <Eigen/Dense>
#include <cmath>
#include <functional>
#include <string>
#include <vector>

#include "gravitas/study/v1/study.pb.h"

namespace gravitas::study {

struct SpringCell {
  double stiffness = 1.0;  // k h^2 of 1 kg
  double zeta = 0.0;

  double damping() const { return 2.0 * zeta * std::sqrt(stiffness); }  // c h
};

// By theory. Methods are called as integrators are, splittings with their order: "SymplecticSplitting 4". Adaptive ones take
// one whole step. Throws std::out_of_range for a method without one.
double amplification_in_theory(const std::string& method, const SpringCell& cell);
// k h^2 at which the theory's amplification first exceeds 1; 0: it does at once; infinite: nowhere below 1e12.
double stability_limit(const std::string& method, double zeta);

// Of displacements in the engine: so small that one step of adaptive methods is as exact as is asked for, and a power of
// two.
inline constexpr double kSmallSwing = 0x1p-300;

// An amplification is told from 1, as it is measured, where it is this much more.
inline constexpr double kTellsApart = 2e-5;

// (x, h v) before the first step and after each.
using SpringPath = std::vector<Eigen::Vector2d>;
// The steps that show the map: of methods with a history, which starts anew, the first is another.
int steps_to_see(const std::string& method);
// The amplification, from the paths of two displacements of `size`, one of x and one of h v; noise: what of them is not the
// map, a share.
double growth_of(const std::string& method, const SpringPath& moved, const SpringPath& thrown, double size,
                 double noise);

// All installed integrators that have a theory, with zeta 0, 0.1, 1 and 10, each on k h^2 from 1e-2 to 1e6. Throws BadInput.
// `interrupted` is asked between dampings: throws StudyInterrupted.
std::vector<v1::Limit> map_stability(const std::function<bool()>& interrupted);

}  // namespace gravitas::study
