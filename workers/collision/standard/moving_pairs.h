// Times of impact and rays for all shapes of the plugin.
//
// Convex shapes and half-spaces: plugin_sdk/geometry/time_of_impact.h. A compound is the earliest of its children. A mesh
// against a half-space is its hull, whose support its tree finds. Otherwise the interval is cut into pieces in which the
// other shape moves by about its own size; in each the tree finds the triangles near its place in the middle, widened by
// the way of half a piece, and each triangle moves as a convex solid. No piece is left out before the first with an
// impact, so none is missed.
#pragma once

#include <optional>

#include "plugin_sdk/geometry/ray.h"
#include "plugin_sdk/geometry/time_of_impact.h"
#include "workers/collision/standard/shapes.h"

namespace gravitas::collision {

// A body on its way: where its shape lies in it, where it starts, and how it moves.
struct MovingBody {
  Pose geometry;
  Pose start;
  Motion motion;
};

// As first_impact() of the SDK. Shapes that overlap at the start have their impact then; of a solid wholly inside a closed
// mesh the depth is that of its centre.
std::optional<Impact> first_impact(const Shape& a, const MovingBody& body_a, const Shape& b, const MovingBody& body_b,
                                   double target_gap);

// `ray` in the world; X_WS: the pose of the shape.
std::optional<RayHit> cast_ray(const Shape& shape, const Pose& X_WS, const Ray& ray);

}  // namespace gravitas::collision
