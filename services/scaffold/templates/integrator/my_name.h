// Half a step without forces, free of the plugin interface, so that my_name_test.cc can call it.
#pragma once

#include "plugin_sdk/integrator.h"

namespace plain {

// In half a step h/2 a body that nothing pushes, with damping c (1/s), goes `way` of its velocity and keeps `kept` of it:
//
//   x' = x + way v,  v' = kept v,      way = (1 - e^(-c h/2))/c, h/2 without damping,  kept = e^(-c h/2)
//
// Two halves make the whole: way + kept way = (1 - e^(-c h))/c. A body that turns does so for the time `way`, freely, and keeps
// as much of its angular velocity, since Euler's equations are homogeneous in that.
struct HalfDrift {
  double way;   // s
  double kept;  // 1
};
inline HalfDrift half_drift(double damping, double time_step) {
  return {gravitas::damped_time(damping, 0.5 * time_step), gravitas::damping_factor(damping, 0.5 * time_step)};
}

}  // namespace plain
