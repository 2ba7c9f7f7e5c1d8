#pragma once

#include "plugin_sdk/math/types.h"

namespace gravitas::test {

// A shortest turn from one direction to another. Eigen's FromTwoVectors is the same by way of a singular value
// decomposition, which takes seconds to compile.
inline Quaternion turn_between(const Vector3& from, const Vector3& to) {
  const Vector3 a = from.normalized(), b = to.normalized();
  const double cosine = a.dot(b);
  const Vector3 axis = cosine > -1.0 + 1e-12 ? Vector3(a.cross(b)) : a.unitOrthogonal();
  return Quaternion(1.0 + cosine, axis.x(), axis.y(), axis.z()).normalized();
}

}  // namespace gravitas::test
