// What the force does to a body, free of the plugin interface, so that my_name_test.cc can call it.
#pragma once

#include "plugin_sdk/math/types.h"

namespace plain {

using gravitas::Matrix3;
using gravitas::Vector3;

// A wind that takes a body along, N at its centre of mass:
//
//   f = c (u - v)      c: coefficient, N s/m;  u: wind, v: velocity of the centre of mass, m/s, world
//
// Alone it brings a body of mass m to the wind's velocity: u - v = (u - v_0) exp(-c t/m). Stiff where c h/m is not small:
// an explicit integrator overshoots from 1 on, and grows without bound from 2 on.
inline Vector3 wind_force(double coefficient, const Vector3& wind, const Vector3& velocity) {
  return coefficient * (wind - velocity);
}

// df/dv; the force depends on nothing else of the state.
inline Matrix3 wind_force_slope(double coefficient) { return -coefficient * Matrix3::Identity(); }

}  // namespace plain
