// The narrow phase of the standard collision plugin: whether two placed shapes touch, and where.
//
// Pure geometry. The answer depends on the arguments alone: there is no warm start and no state, so
// equal arguments give equal bits whatever was asked before, and from any thread.
//
//   pair                     depth and normal                          points
//   sphere - sphere, box,    closed form                               1
//   cylinder, half-space
//   box - half-space         closed form                               up to 4 vertices
//   cylinder - half-space    closed form                               4 of a cap, 2 of a side line
//   box - box                separating axes (15, box_axes.h)          face clipping, or 1 edge
//   box - cylinder,          separating axes and an exact search of    patch clipping: 3 or 4 on a face,
//   cylinder - cylinder      the curved families (contact_axis.h)      2 on a line, else 1
//   half-space - half-space  no contact
//   capsule, cone,           distance or expanding polytope (plugin_sdk/geometry/penetration.h), the features that
//   polyhedron - any convex  touch laid over each other: up to 4; against a half-space the feature turned towards it
//   mesh - anything          triangle by triangle, through its tree (composite_pairs.h)
//   flat face of a mesh,     as with a thick box (flat_faces.h)
//   what lies over it
//   compound - anything      child by child
// For a gap between boxes and cylinders whose closest features own no separating axis, the normal
// is that of the closest points (plugin_sdk/geometry/penetration.h).
//
// The convention for the contact point is that of equations 2.70 and 2.82 (the midpoint of the two
// surface points) for every pair, also where §§ 2.5.3.2, 2.5.3.3 and 4.3.2.15 put it elsewhere.
#pragma once

#include "plugin_sdk/geometry/manifold.h"
#include "plugin_sdk/math/pose.h"
#include "workers/collision/standard/contact_list.h"
#include "workers/collision/standard/seams.h"
#include "workers/collision/standard/shapes.h"

namespace gravitas::collision {

// Writes to `out` the contacts of shape a at X_WA with shape b at X_WB whose depth is at least
// -margin, margin >= 0 (m) being the gap up to which a contact is reported. No contact gives
// count = 0. The normal of all contacts of a pair is the same.
//
// Depth is the smallest translation that separates the pair, up to a preference of faces over edges
// and rims (at most 1 % of the depth plus 1e-7 of the smallest half extent), without which a
// resting body would change its normal from step to step. The deepest contact has this depth within
// the same preference, and within 1e-6 of the smallest half extent where a patch of more than four
// points is reduced.
//
// Preconditions: finite poses with unit orientations, sizes finite and > 0. A position that is not
// finite gives no contact. Sizes from 1e-6 to 1e6 m are supported. All arithmetic is relative to
// one of the two bodies, so accuracy does not suffer far from the origin of W, but for the rounding
// of the positions themselves and of the final sum.
//
// Mirror law: collide(b, a) gives the same points, depths and features as collide(a, b) and the
// opposite normals, bit for bit. (Two identical shapes with identical poses are the one exception:
// their normal is a fixed direction whichever comes first.)
void collide(const Shape& a, const Pose& X_WA, const Shape& b, const Pose& X_WB, double margin, Manifold* out);

// The same for all shapes, meshes and compounds too: at most four contacts for each normal; with what both
// bodies rest on, flush with it (seams.h). The first form is for pairs of convex shapes and half-spaces.
void collide(const Shape& a, const Pose& X_WA, const Shape& b, const Pose& X_WB, double margin, ContactList* out,
             const PairRests* rests = nullptr);

// Whether the solids have a point in common, touching included (within rounding). False for two
// half-spaces, between which no contact is defined. Same preconditions.
bool intersects(const Shape& a, const Pose& X_WA, const Shape& b, const Pose& X_WB);

}  // namespace gravitas::collision
