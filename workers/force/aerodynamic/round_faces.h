// Integral of (n.u)^2 n dA over what of a round face looks into its motion (n.u > 0), with its moment about the centre of mass. A
// normal n goes through the axis or the centre of such a face, so that the body's turn adds nothing to n.u about there:
//
//   half ball    of the velocity u of its centre alone, over a lune between two great circles; with k out along its axis, g the
//                angle of u and k:   pi r^2/8 u^2 (2 (1 + cos g) u/|u| + sin^2 g k), two of them the ball's pi r^2/2 |u| u
//   round side   4/3 r |v| v per length, with v what of the velocity on the axis is across it, linear along the axis
//   disc         (n.u)^2 is quadratic on it, over a segment whose chord is where n.u = 0
#pragma once

#include "plugin_sdk/force.h"
#include "plugin_sdk/math/types.h"

namespace gravitas {

// The body's motion against the flow: u at a point is linear + angular x (point - centre).
struct Slip {
  Vector3 linear, angular;
  Vector3 at(const Vector3& arm) const { return linear + angular.cross(arm); }
};

// `arm` is the middle of the shape from the centre of mass, `axis` a unit vector.
Wrench on_ball(double radius, const Vector3& arm, const Slip& slip);
Wrench on_cylinder(double radius, double height, const Vector3& arm, const Vector3& axis, const Slip& slip);
Wrench on_capsule(double radius, double height, const Vector3& arm, const Vector3& axis, const Slip& slip);

}  // namespace gravitas
