// The motion of a rigid body between two poses: the point that its frame's origin is (the centre of mass) goes straight
// at constant speed, and the body turns about it at constant angular velocity.
#pragma once

#include "plugin_sdk/math/pose.h"

namespace gravitas {

// Over a whole interval, in world axes.
struct Motion {
  Vector3 displacement = Vector3::Zero();  // m
  Vector3 rotation = Vector3::Zero();      // rad; may be longer than a turn
};

// The pose at a fraction of the interval, 0 to 1: (p + s displacement, exp(s rotation) q).
Pose moved(const Pose& start, const Motion& motion, double fraction);

// The motion from one pose to another. The end alone does not say how often the body turned: of the rotation vectors
// that lead there it is the one nearest to `expected` (angular velocity times duration). Where that is zero it is the
// shorter arc. The end is met within rounding; within 1e-9 rad after whole turns, about the axis expected.
Motion motion_between(const Pose& start, const Pose& end, const Vector3& expected_rotation);

}  // namespace gravitas
