// Cylinders against cylinders and boxes, in two stages: the contact normal (contact_axis.h), then
// the points along it (patch_contacts.h).
#include <algorithm>

#include "plugin_sdk/geometry/contact_candidates.h"
#include "workers/collision/standard/contact_axis.h"
#include "workers/collision/standard/convex_pair.h"
#include "workers/collision/standard/pair_functions.h"
#include "workers/collision/standard/patch_contacts.h"

namespace gravitas::collision {
namespace {

// The contacts along `axis`; false if the features that own it miss the depth by more than
// `shortfall` (m).
bool contacts_along(const ConvexPair& pair, const ContactAxis& axis, double shortfall, ContactCandidates* out) {
  add_patch_contacts(pair, axis, out);
  return out->deepest() >= axis.depth - shortfall;
}

}  // namespace

void collide_convex(const Shape& a, const Shape& b, const Placement& placement, double margin, Manifold* out) {
  const Matrix3 R_AW = placement.R_WA.transpose();
  const ConvexPair pair(a, b, R_AW * placement.R_WB, R_AW * placement.p_AB_W);
  out->count = 0;
  ContactAxes axes;
  if (!find_contact_axes(pair, margin, &axes)) return;

  // A preferred face may be a little off the least depth. As long as its patch is about as deep as
  // that, a vertex deeper still lies beside it, in touch with nothing.
  const double rounding = rounding_length(pair);
  ContactCandidates candidates(margin, rounding, depth_tie(pair));
  const bool face = axes.preferred.kind != AxisKind::kFree;
  const double shortfall = face ? face_preference(pair, axes.preferred.depth) : rounding;
  if (!contacts_along(pair, axes.preferred, shortfall, &candidates)) {
    candidates.clear();
    if (!contacts_along(pair, axes.shallowest, face_preference(pair, 0.0), &candidates)) {
      add_support_contact(pair, axes.shallowest, &candidates);
    }
  }

  candidates.reduce_to(out);
  for (int i = 0; i < out->count; ++i) {
    ContactPoint& contact = out->contacts[static_cast<std::size_t>(i)];
    contact.point = placement.R_WA * contact.point;
    contact.normal = placement.R_WA * contact.normal;
  }
}

}  // namespace gravitas::collision
