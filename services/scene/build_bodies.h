// Bodies: mass and inertia, pose of the centre of mass, bound, and rows of what they name.
#pragma once

#include <vector>

#include "services/scene/build_context.h"
#include "services/scene/build_shapes.h"

namespace gravitas::scene {

struct BodyReferences {
  const IdIndex& geometries;
  const IdIndex& materials;
  const IdIndex& forces;
  const std::vector<Solid>& solids;  // by geometry
};

// Fills description.bodies. BodyDescription::material is left a row of the scene's materials, kNone
// for none: see build_materials.h.
void build_bodies(const BodyReferences& references, BuildContext* context);

}  // namespace gravitas::scene
