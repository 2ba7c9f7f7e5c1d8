// From the contact normal of two boxes or cylinders to contact points: the touching features of
// both are clipped against each other in the plane perpendicular to the normal.
#pragma once

#include "plugin_sdk/geometry/contact_candidates.h"
#include "workers/collision/standard/contact_axis.h"
#include "workers/collision/standard/convex_pair.h"

namespace gravitas::collision {

// Adds the contacts between the features that touch along `axis` to `out`, in the frame of A:
//
//   normal of a face or cap: that face against the face, cap or side line of the other shape that
//   is turned most towards it; free normal: the ends of the overlap of two nearly parallel lines,
//   if there are such.
//
// The depth of each point is the distance of the two surfaces along the normal at that place. There
// may be no point, or none as deep as axis.depth: when the features do not lie opposite each other,
// or touch in a single point.
void add_patch_contacts(const ConvexPair& pair, const ContactAxis& axis, ContactCandidates* out);

// Adds the one contact of depth axis.depth at the features that the supporting planes touch.
void add_support_contact(const ConvexPair& pair, const ContactAxis& axis, ContactCandidates* out);

}  // namespace gravitas::collision
