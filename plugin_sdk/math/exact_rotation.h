// A vector turned by a quaternion, rounded once.
#pragma once

#include "plugin_sdk/math/types.h"

namespace gravitas {

// v + 2/|q|^2 (w u x v + u x (u x v)) for q = (w, u) of a norm within rounding of 1, in double-double arithmetic. Angular
// velocity is kept in world axes and integrated in body axes: turned to and fro in plain arithmetic it would change its
// size by some 1e-16 a step, in the same direction for long.
Vector3 exactly_rotated(const Quaternion& q, const Vector3& v);

}  // namespace gravitas
