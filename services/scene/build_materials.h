// Materials: a row of coefficients for every pair of materials that bodies have.
#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "plugin_sdk/solver.h"
#include "services/scene/build_context.h"

namespace gravitas::scene {

using MaterialRow = std::array<double, kMaterialColumns>;

// The coefficients of a contact between two materials: restitution the arithmetic mean and
// perturbation the sum (both § 2.6), the four friction coefficients the geometric mean.
MaterialRow mixed(const MaterialRow& a, const MaterialRow& b);

// Fills description.material_pairs. On entry BodyDescription::material is a row of the scene's
// materials, or kNone for the material with all defaults; on return it is a row of the pairs.
void build_materials(BuildContext* context);

}  // namespace gravitas::scene
