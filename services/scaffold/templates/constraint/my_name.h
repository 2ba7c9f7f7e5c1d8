// The rows of the joint, free of the plugin interface, so that my_name_test.cc can call them.
#pragma once

#include "plugin_sdk/discrepancy.h"
#include "plugin_sdk/math/pose.h"

namespace plain {

using gravitas::Pose;
using gravitas::Vector3;

// A point that stays in a plane.
//
//        n ^      x2           x2: the point, fixed in body 2;  o, n: the plane, fixed in body 1
//          |      |  error = n.(x2 - o)
//     o ---+------x1-----      x1: the point's projection on the plane
//
// One locked row along n takes one freedom of twelve: n.(v2 + w2 x r2 - v1 - w1 x r1) = 0. The axes across it are free, and
// there x1 is told where x2 is: a joint pushes at the point midway between the two, which would else get an arm of half the
// way that the body has gone (plugin_sdk/discrepancy.h has the form, and the signs).
//
// `plane`: a frame fixed in body 1 whose first axis is the normal; `point`: of body 2. World.
inline gravitas::Discrepancy point_in_plane(const Pose& plane, const Vector3& point) {
  using enum gravitas::AxisMode;
  const Vector3 normal = plane.orientation * Vector3::UnitX();
  gravitas::Discrepancy d;
  d.point2 = point;
  d.point1 = point - normal.dot(point - plane.position) * normal;
  d.axes = plane.orientation;
  d.modes = gravitas::pack_modes(kLocked, kFree, kFree);
  return d;
}

}  // namespace plain
