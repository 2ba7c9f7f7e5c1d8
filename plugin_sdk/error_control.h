// For authors of integrators with error control: what `Accuracy` is, and where no step meets it.
#pragma once

#include <algorithm>
#include <cmath>
#include <span>

#include "plugin_sdk/plugin.h"

namespace gravitas {

inline Property accuracy_property(double without) {
  return Property::number("Accuracy", "1")
      .above(0.0)
      .at_most(1.0)
      .defaults_to({without})
      .means("Largest estimated error of an inner step, in m, rad, and relative to speeds above 1 m/s, 1 rad/s.");
}

inline Property dense_output_property() {
  return Property::flag("DenseOutput")
      .defaults_to({1})
      .means(
          "Inner steps as long as Accuracy allows, beyond the step where nothing touches the bodies; else they end "
          "with it.");
}

// Of inner steps, as a share of the step.
inline constexpr double kShortestInnerStep = 1e-12;

// Throws Refusal where an inner step would be shorter.
inline void require_inner_step(double inner, double whole) {
  if (!(inner > kShortestInnerStep * whole))
    throw Refusal(
        "Accuracy cannot be met by any step: forces are not smooth, bodies turn too fast, or the state overflows");
}

// The inner step that the step before left in plugin_state, its first number, for this one; 0 where there is none.
inline double remembered_inner_step(std::span<const double> plugin_state, double whole) {
  const bool is_one =
      !plugin_state.empty() && plugin_state[0] > kShortestInnerStep * whole && std::isfinite(plugin_state[0]);
  return is_one ? plugin_state[0] : 0.0;
}

// Length of the next inner step, with `left` to the step's boundary: two equal ones in place of a long and a short one.
inline double next_inner_step(double inner, double left) { return inner >= left ? left : std::min(inner, 0.5 * left); }

}  // namespace gravitas
