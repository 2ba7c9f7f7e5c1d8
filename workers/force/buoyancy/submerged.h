// The part of a solid below a water plane.
#pragma once

#include "plugin_sdk/geometry/surface.h"
#include "plugin_sdk/math/pose.h"

namespace gravitas {

struct Submerged {
  double volume = 0.0;               // m^3
  Vector3 centre = Vector3::Zero();  // centre of buoyancy, world, m; the solid's own where nothing is submerged
  double whole_volume = 0.0;         // of the solid, m^3
};

// `up` is the unit normal of the plane up.x = level (m).
//
// A ball with its centre at height z over the plane: the cap of depth h = r - z, V = pi h^2 (3r - h)/3, its centroid
// 3 (2r - h)^2 / (4 (3r - h)) below the ball's centre.
Submerged submerged_ball(const Vector3& centre, double radius, const Vector3& up, double level);

// A closed polyhedron: the sum of the pyramids over the submerged parts of its faces, from a point of the plane above
// the solid's middle, so that the cut, which lies in the plane, adds nothing. Exact for any closed surface.
Submerged submerged_polyhedron(const Surface& surface, const Pose& pose, const Vector3& up, double level);

}  // namespace gravitas
