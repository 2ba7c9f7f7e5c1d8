// What the stops of a joint give back of the speed at which they are arrived at, as surfaces do (arrival.h).
#pragma once

#include <array>
#include <span>

#include "plugin_sdk/discrepancy.h"
#include "plugin_sdk/solver/bodies.h"
#include "plugin_sdk/solver/joint_laws.h"

namespace gravitas {

// Of a stop that closes in the step, away from it:
//   b = e s,  s = arrival_speed(u, u', gap_n, h),  u = J_n v_n - v_d,  u' = J v' - v_d,
// v' being what the joints, but for stops that bounce, make of v*: what a hinge makes of a load is no part of S*, and a gate that
// falls on its stop would arrive at each bounce as slow as it was a step before. J_n is of S_n, as the errors there are: with J at
// S* a taut rope that swings, or what is spun against its stop, would seem to come towards it by what its axis turns in the step.
//
// What does not move towards a stop at S_n and meets it in the step rests, as it is slower than two steps of its load make it.
// A side that pushed in the step before is not arrived at, nor one at a rate of no more than rounding of the speeds; where
// reactions hold (forces applied), not at one that they take for none.

// For the axes of a joint with a restitution sets that, the rate at S_n and e |u| as the bounce until v' is known.
// `warm_impulse`: along the axes.
void set_bounces(const Discrepancy& discrepancy, const SolverBody& body1, const SolverBody& body2,
                 std::span<const double> warm_impulse, std::array<JointAxisState, 3>* axes);

// b by u'. Precondition: the axis has a bounce.
double bounce_of(const JointAxisState& axis, double rate, double time_step);

}  // namespace gravitas
