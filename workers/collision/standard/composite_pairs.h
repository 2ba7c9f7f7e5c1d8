// Meshes and compounds against everything, each other too.
//
// A compound is the union of its children. A mesh is taken triangle by triangle: every triangle that its tree finds near
// the other shape is a convex solid without thickness. What the single triangle cannot know is put right by its
// neighbours, so that a flush surface has no edges:
//
//   a normal at an edge or vertex is kept only if the triangles round it lie below its plane (it is in the mesh's own
//   normal cone there); else, where they are flush or rise, the triangle's own normal takes its place, and where they
//   fall away, or it points far more along the normal of one of them, that one has the contact
//   a triangle of a closed mesh pushes outward only, one of an open mesh to the side on which the other shape's centre is
//   a shape whose centre is inside a closed mesh is pushed to the nearest place of its surface
//   closed meshes that cross, none of whose triangles tells a normal, part as hulls if both are convex, else over the
//   place nearest to a vertex of one that is inside the other
//
// Known limits. Near an edge of a closed mesh two faces may each report the depth below their own plane, also where the
// way out over the other is shorter. A shape that has passed through an open mesh with its centre stays on the far side.
#pragma once

#include <vector>

#include "plugin_sdk/math/pose.h"
#include "workers/collision/standard/contact_list.h"
#include "workers/collision/standard/seams.h"
#include "workers/collision/standard/shapes.h"

namespace gravitas::collision {

struct CompoundShape {
  struct Child {
    Shape shape;
    Pose pose;
  };
  std::vector<Child> children;
};

// Collects the contacts of a pair of which one at least is composite (ContactList::finish() then answers them).
void collide_composite(const Shape& a, const Pose& X_WA, const Shape& b, const Pose& X_WB, const PairRests& rests,
                       double margin, ContactList* out);

}  // namespace gravitas::collision
