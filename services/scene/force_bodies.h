// What forces need to know of bodies: rows in the place of ids, reactions, and the gravity that floats them.
#pragma once

#include <vector>

#include "services/scene/build_context.h"

namespace gravitas::scene {

// Flattens the properties of a force; those of kind body get the row of the body that they name.
void flatten_force(const TypeDeclaration& type, const v1::Force& force, const IdIndex& bodies, BuildContext* context,
                   std::vector<double>* parameters);

// Once all bodies are built: a force that names a movable body is applied to that one too, last of its forces, where it
// answers the reaction; and a vector property `Gravity` that is absent becomes the sum of the accelerations of the
// body's Gravity forces, for which the force is split where its bodies differ in that. Notes when forces of bodies jump.
void complete_forces(BuildContext* context);

}  // namespace gravitas::scene
