// Vectors as messages hold them.
#pragma once

#include <google/protobuf/repeated_field.h>

#include "plugin_sdk/math/types.h"

namespace gravitas::survey {

using Numbers = google::protobuf::RepeatedField<double>;

// + 0.0 turns -0 into 0.
inline void write(const Vector3& v, Numbers* out) {
  for (int k = 0; k < 3; ++k) out->Add(v[k] + 0.0);
}

// w, x, y, z.
inline void write(const Quaternion& q, Numbers* out) {
  for (const double number : {q.w(), q.x(), q.y(), q.z()}) out->Add(number + 0.0);
}

}  // namespace gravitas::survey
