// Whether a declaration makes sense: what `gravitas check` demands of it, and what a run does before it uses a plugin.
#pragma once

#include <string>

#include "plugin_sdk/plugin.h"

namespace gravitas {

// Empty, or the first thing that is wrong. Demanded: a name, a version and meanings; a slot that exists; capabilities that
// the slot knows, none twice; theta within 0 and 1; of slots that serve types at least one; names of types and of the
// properties of each that a scene can write, none twice; of each property bounds with a number between them, choices and
// columns where its kind has them, and a default that it allows, if it is not required; of the capability `coordinates` types
// that have some, each with a unit and a meaning, none twice, and of other plugins none.
//
//   space        rays, debug_geometry
//   collision    times_of_impact, rays, debug_geometry
//   constraint   coordinates
//   force        potential, jacobians
//   solver       reactions, reaction_jacobians, owns_motion, soft
//   integrator   plugin_state, order=N
std::string check_declaration(const PluginDeclaration& declaration);

}  // namespace gravitas
