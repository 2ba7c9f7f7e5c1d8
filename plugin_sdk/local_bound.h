// What the broad phase sees of a body's shape, fixed in the body's frame, and what that is in the world.
#pragma once

#include <cstdint>
#include <span>

#include "plugin_sdk/dynamics.h"
#include "plugin_sdk/math/motion.h"

namespace gravitas {

enum class BoundKind : std::uint32_t { kEverywhere, kSphere, kBox };

struct LocalBound {
  BoundKind kind = BoundKind::kEverywhere;
  Vector3 centre = Vector3::Zero();                 // m
  Quaternion orientation = Quaternion::Identity();  // box to body
  Vector3 half_extents = Vector3::Zero();           // m; a sphere's radius in x
  // Of the shape itself, by whatever it is bounded, m; 0 where it is unbounded: its least half extent (of what is thin, a
  // thousandth of its largest; of a mesh that nothing pushes 0), and half of its box's diagonal (a sphere's radius).
  double least_half_extent = 0.0, reach = 0.0;
  // m: the least half extent as it is; of what is flat the one above, of an open mesh that nothing pushes 0.
  double half_thickness = 0.0;
};

// Sets what is told of a shape itself, from the half extents of its box.
void measure(const Vector3& half_extents, LocalBound* bound);

// The margin, of the smallest half extent of a scene: a contact that the reactions of a step close is then known to the solver.
inline constexpr double kMarginOfHalfExtent = 0.01;

// The least gap up to which contacts are asked for, m; 0 where all shapes are unbounded.
// Steps in which bodies move further ask for more (kernel/simulators/substepping.cc).
double contact_margin(std::span<const LocalBound> bounds);

// World bounds.
Bounds bounds_of(const LocalBound& bound, const Pose& body);

// World bounds of all that a body passes on its way between two poses.
Bounds swept_bounds(const LocalBound& bound, const Pose& from, const Pose& to, const Vector3& rotation);

// The same, wider by `margin` (m) on all sides.
inline Bounds widened(const Bounds& bounds, double margin) {
  return {bounds.lower - Vector3::Constant(margin), bounds.upper + Vector3::Constant(margin)};
}

}  // namespace gravitas
