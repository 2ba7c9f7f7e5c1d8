// The distance between two convex shapes by the method of Gilbert, Johnson and Keerthi (1988): the
// point of A - B closest to the origin, found by closest points of growing simplices.
#pragma once

#include "plugin_sdk/math/types.h"
#include "workers/collision/standard/convex_pair.h"

namespace gravitas::collision {

struct GjkResult {
  // False: the solids overlap, or are nearer than 1e-11 of the pair's reach, where the difference
  // of the closest points is too short to have a direction.
  bool separated;
  // Unit, in A, from a to b along the closest points. Exact to rounding for boxes; for a curved
  // contact an approximation (about 1e-6) that refine_axis() in contact_axis.h sharpens. Undefined
  // if not separated.
  Vector3 normal;
};

// `first_direction` (in A, not zero) is where the search begins: the better the guess, the fewer
// the iterations. Always ends: at most 64 iterations, each of which must bring the origin closer.
GjkResult gjk_separation(const ConvexPair& pair, const Vector3& first_direction);

}  // namespace gravitas::collision
