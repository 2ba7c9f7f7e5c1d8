// The solver's second question: reactions of joints for which accelerations agree with the joints in a given state.
//
//   J M^-1 J^T lambda = -(gamma + J a),   reaction = J^T lambda
//
// a is what forces, the gyroscopic term and drag make of each body (of a kinematic one what it is given), gamma what
// the velocities alone do to the second derivative of each row's error. Points of a discrepancy are carried by their
// bodies, its axes by body 1, a radial axis by its points; with w the relative velocity of the points seen from body 1,
//
//   along an axis      gamma = a.(w2 x (w2 x r2) - w1 x (w1 x r1) - 2 w1 x w),   r1, r2 the arms to body 2's point
//   radial, e = x2-x1  gamma = e.(w2 x (w2 x r2) - w1 x (w1 x r1))/|e| + (|e'|^2 - (e.e'/|e|)^2)/|e|
//   about an axis      gamma = (w1 x a).(w2 - w1)
//
// Held are axes that hold always: locked, or limited with one limit, without compliance; driven ones without damping;
// all without a bound on the force. Limits, friction, springs and bounded drives are left to the end of the step, so
// they are of first order; so is an angular row whose axis does not turn with body 1 (of ConstantVelocity, and of an
// Axle's camber).
//
// Dependent rows are left out by the factorisation (profile_ldlt.h); rows that contradict each other are met as well as
// can be (least squares), and `residual` says by how much they are missed.
//
// Where rows are nearly dependent, so that bodies would have to move ten times as far as a row might be off, the answer is
// that for the nearest state, along M^-1 J^T, that agrees with the joints in pose and velocity. States that an integrator
// tries are off by its error e, and at a distance x from a singular configuration J and gamma in them are off by e/x^2: the
// motion would turn away on the hyperbola x y = e instead of going through. There a row counts as dependent within a pivot
// of 1e-10 of its diagonal, elsewhere of 1e-12; what is left are roundings over x^3.
#pragma once

#include "plugin_sdk/plugin.h"

namespace gravitas {

// Throws Refusal for an impossible request (request_check.h), and where a reaction is not finite.
void solve_reactions(const stage::SolverReactionsRequest& request, const stage::SolverReactionsReply& reply);

}  // namespace gravitas
