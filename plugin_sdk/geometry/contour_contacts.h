// From the contact normal of two convex solids to contact points: the touching features of both are laid over each other
// in the plane across the normal.
#pragma once

#include "plugin_sdk/geometry/contact_candidates.h"
#include "plugin_sdk/geometry/penetration.h"

namespace gravitas::collision {

// Adds the contacts of two contours, both in the frame in which `normal` (unit, from a to b) is given: corners of either
// that lie over the other, and crossings of their borders. The depth of each is the distance of the two surfaces along
// the normal at that place. There may be none, where the features do not lie opposite each other.
//
// `tolerance` (m): how far outside a border still counts as inside.
void add_contour_contacts(const Contour& a, double rounding_a, const Contour& b, double rounding_b,
                          const Vector3& normal, double tolerance, ContactCandidates* out);

// A contour of b's frame in that of a.
void place_contour(const Matrix3& R_AB, const Vector3& p_AB, Contour* contour);

// The contacts of the pair in the frame of a, reduced to at most four. A face's normal is preferred to a free one unless
// that is shallower by more than 1 % of the depth and 1e-7 of the thinnest half extent: a body at rest keeps its normal.
// No contact if the pair is further apart than `margin` (m).
void collide_support_maps(const PlacedPair& pair, double margin, Manifold* out);

// The contacts of the half-space below the plane through the origin with the unit normal `up`, and a convex solid at
// (R, p) in the same frame: of the face, line or point turned most towards it.
void collide_halfspace_support_map(const Vector3& up, const SupportMap& map, const Matrix3& R, const Vector3& p,
                                   double margin, Manifold* out);

}  // namespace gravitas::collision
