// Where a ray first meets a solid.
//
// In the frame of the shape, lengths in m. A ray that starts inside a solid hits it at 0, with a normal against itself;
// a mesh that is not closed is a surface and has no inside. The normal of a mesh is that of the triangle, turned
// towards the side that the ray comes from.
#pragma once

#include <optional>

#include "plugin_sdk/geometry/scene_shape.h"
#include "plugin_sdk/geometry/support_map.h"

namespace gravitas {

struct Ray {
  Vector3 origin = Vector3::Zero();
  Vector3 direction = Vector3::UnitY();  // unit
  double length = 0.0;                   // m, >= 0
};

struct RayHit {
  double distance = 0.0;              // m, along the ray
  Vector3 normal = Vector3::UnitY();  // unit
};

// Closed forms; children of a compound one by one, a mesh through its tree.
std::optional<RayHit> cast_ray(const SceneShape& shape, const Ray& ray);

// Any convex solid by its support points: planes that part it from the end of the ray so far, each moving that end on (G.
// van den Bergen, "Ray casting against general convex objects with application to continuous collision detection",
// 2004). The distance is short by at most 1e-9 of the solid's radius, measured along the normal.
std::optional<RayHit> cast_ray(const SupportMap& map, const Ray& ray);

// The ray in the frame of a shape at this pose, and its hit back again.
Ray ray_in(const Pose& shape, const Ray& ray);
RayHit hit_from(const Pose& shape, const RayHit& hit);

}  // namespace gravitas
