// What the bad solvers do right: they refuse what is no problem, so that each fails at its own level alone.
#pragma once

#include <span>
#include <string>

#include "plugin_sdk/checks.h"
#include "plugin_sdk/plugin.h"

namespace gravitas {

inline void refuse_bad_input(const stage::SolverSolveRequest& request) {
  for (const std::span<const double> column :
       {request.inverse_mass(), request.inverse_inertia(), request.trial_position(), request.trial_orientation(),
        request.trial_linear_velocity(), request.trial_angular_velocity(), request.contact_normal(),
        request.contact_point(), request.contact_depth(), request.contact_material()})
    if (first_not_finite(column) != kNoRow) throw Refusal("a number is not finite");
  const std::size_t bodies = request.flags().size();
  for (const std::uint32_t body : request.contact_body())
    if (body >= bodies) throw Refusal("a contact names body " + std::to_string(body) + ", which does not exist");
  for (const std::uint32_t body : request.discrepancy_body())
    if (body >= bodies && body != kNone)
      throw Refusal("a joint names body " + std::to_string(body) + ", which does not exist");
}

}  // namespace gravitas
