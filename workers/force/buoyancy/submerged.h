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

// A cylinder about y: its sections are discs, of which the plane cuts off segments. Along the axis, on which the plane rises by s and
// across which by q, the segment's chord is at d = (level - s t)/q; with d = r sin(a) the integrand is analytic, and Gauss's
// rule exact to rounding.
Submerged submerged_cylinder(double radius, double height, const Pose& pose, const Vector3& up, double level);

// A cylinder about y and half balls on its ends, `height` the cylinder's. A half ball about the origin with c.x <= 0 whose flat side is cut
// is bounded by a part S of the sphere, a segment A of the flat side and one W of the plane up.x = d. From a point of their common
// chord, and by the divergences of |x|^2 along each axis, with r for the radius,
//
//   volume = (r S + d W)/3      moment = c/2 (integral of |x|^2 over A - r^2 A) + up/2 (the same of W)
//   S = r^2 (2 pi - 2 w) + r d b       with the angle w between the two planes on the sphere and b of W's arc (Gauss and Bonnet)
//
// and a half ball that is not cut there is a cap, or what a cap leaves.
Submerged submerged_capsule(double radius, double height, const Pose& pose, const Vector3& up, double level);

}  // namespace gravitas
