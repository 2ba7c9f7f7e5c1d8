// The functions behind the table of detector_table.cc: one per unordered pair of shape types, the
// type with the lower value first.
#pragma once

#include <cstdint>
#include <functional>

#include "plugin_sdk/geometry/manifold.h"
#include "plugin_sdk/geometry/penetration.h"
#include "plugin_sdk/geometry/support_map_buffer.h"
#include "plugin_sdk/math/types.h"
#include "workers/collision/standard/shapes.h"

namespace gravitas::collision {

// How a pair lies in the world: both rotations and the position of b relative to a (m, world axes).
// The origin is a's, so that nothing below sees how far the pair is from the origin of W.
struct Placement {
  Matrix3 R_WA;
  Matrix3 R_WB;
  Vector3 p_AB_W;
};

// Each writes the manifold with world axes, points relative to the origin of a. For pairs of one
// type the caller fixes which body is a (see canonical order in narrow_phase.cc).
using PairFunction = void (*)(const Shape& a, const Shape& b, const Placement& placement, double margin, Manifold* out);

// sphere_pairs.cc
void collide_sphere_sphere(const Shape& a, const Shape& b, const Placement& placement, double margin, Manifold* out);
void collide_sphere_box(const Shape& a, const Shape& b, const Placement& placement, double margin, Manifold* out);
void collide_sphere_cylinder(const Shape& a, const Shape& b, const Placement& placement, double margin, Manifold* out);
void collide_sphere_halfspace(const Shape& a, const Shape& b, const Placement& placement, double margin, Manifold* out);

// halfspace_pairs.cc
void collide_box_halfspace(const Shape& a, const Shape& b, const Placement& placement, double margin, Manifold* out);
void collide_cylinder_halfspace(const Shape& a, const Shape& b, const Placement& placement, double margin,
                                Manifold* out);

// box_pairs.cc
void collide_box_box(const Shape& a, const Shape& b, const Placement& placement, double margin, Manifold* out);

// convex_pairs.cc: box - cylinder, cylinder - cylinder
void collide_convex(const Shape& a, const Shape& b, const Placement& placement, double margin, Manifold* out);

// general_pairs.cc: any two convex shapes; a half-space (a) and any bounded convex shape
void collide_general(const Shape& a, const Shape& b, const Placement& placement, double margin, Manifold* out);
void collide_halfspace_general(const Shape& a, const Shape& b, const Placement& placement, double margin,
                               Manifold* out);

// The contacts of two convex shapes along the unit vector n, from a to b, of features that lie within an angle of sine 0.2
// (of rounded cores 0.03) of its planes, as in collide_support_maps(): of a face askew all corners, or bodies would rock
// from one to the next. Those of features that touch there in a point only if `least` is given. All in a's frame. Where a
// touches with a face, none whose feature `is_dropped` names.
using FeatureTest = std::function<bool(std::uint32_t feature)>;
void contacts_along(const PlacedPair& pair, const Vector3& n, double margin, const Separation* least, Manifold* out,
                    const FeatureTest& is_dropped = nullptr);

// The kind of a primitive that is bounded, and the map of a convex shape: its own, or one made in the buffer.
SceneShape::Kind kind_of(ShapeType type);
const SupportMap& support_map_of(const Shape& shape, SupportMapBuffer* buffer);

}  // namespace gravitas::collision
