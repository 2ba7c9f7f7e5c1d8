// How fast two surfaces arrive at each other within a step, and the restitution that follows.
#pragma once

#include "plugin_sdk/solver/bodies.h"

namespace gravitas {

// s of the law n.v_{n+1} >= e s, m/s, zero where nothing arrives:
//   s^2 = max(0, u^2 - 2 a max(0, way)),  u = n.(relative velocity at S_n),  a = (u* - u)/h,
// u* the same at S*, way = gap_n - max(0, gap*): the speed after that way at constant acceleration, so that the law of
// restitution holds for the impact itself at every step; the flight in between is the integrator's, so an apex is right
// to its order. A contact may count as closed though S* leaves a gap: then s = |u*|, and nothing is gained.
// s = 0 if u* >= 0, and below the rest speed 2 |a| h, what a body at rest gains by its load in two steps: such a contact
// rests. With explicit Euler and e > 1/2 it may never come to that: each flight gains g h, and the body goes on hopping
// at about e g h / (1 - e).
double arrival_speed(double start_velocity, double trial_velocity, double way, double time_step);

// Gap along `direction` at S_n of two surfaces with `gap` at S*: gap* - J (S* - S_n), both bodies
// displaced as rigid bodies with the arms they have at S*. Turning round the normal or about a
// sphere's own centre changes no gap; the surface points themselves carried back would open one of
// r(1 - cos w h), and a ball that rolls fast would bounce on the flat.
double gap_before(double gap, const ConstraintDirection& direction, const SolverBody& body1, const SolverBody& body2);

}  // namespace gravitas
