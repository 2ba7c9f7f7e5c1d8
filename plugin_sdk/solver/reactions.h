// The solver's second question: reactions of joints for which accelerations agree with the joints in a given state.
//
//   J M^-1 J^T lambda = -(gamma + J a),   reaction = J^T lambda
//
// a is what forces, the gyroscopic term and drag make of each body (of a kinematic one what it is given), gamma what
// the velocities alone do to the second derivative of each row's error, less its desired acceleration. Points of a
// discrepancy are carried by their bodies, its axes by body 1, a radial axis by its points; with w the relative velocity of the points seen from body 1,
//
//   along an axis      gamma = a.(w2 x (w2 x r2) - w1 x (w1 x r1) - 2 w1 x w),   r2 the arm to body 2's point, r1 to where
//                      that is once the held axes are at their targets, w along the other axes
//   radial, e = x2-x1  gamma = e.(w2 x (w2 x r2) - w1 x (w1 x r1))/|e| + (|e'|^2 - (e.e'/|e|)^2)/|e|
//   about an axis      gamma = (w1 x a).(w2 - w1)
//   swing, a = s x r/|s x r|  gamma = a'.(w2 - w1), s turning with body 1 and r with body 2
//   twist, a = (s + r)/|s + r|  the same
//
// States that an integrator tries are off by an error e of its own. Each body is pushed at its own point, so that a joint of
// points is exactly e'' = 0 in them, too: at one point for both, a body with a small I would feel e x force / I, and turn
// away from step to step.
//
// Held are axes that hold always: locked, or limited with one limit, without compliance; driven ones without damping;
// all without a bound on the force.
//
// What gives way is no row but a force among the others (joint_laws.h: acts_as_force(), force_of()): springs and dampers,
// soft limits, drives and friction with damping, each bounded by its maximum_force. It acts along the axis on both bodies
// at one point: where body 2's is (a drive: body 1's), a radial one along the line through both, so that a spring is the
// gradient of e^2/2c where axes turn with body 1. `reaction` and `discrepancy_force` contain it. An integrator meets it as
// it meets any force: at its order, and an explicit one within its stability limit, h sqrt(1/(c m)) < 2.8 for RK4.
//
// In some states hold limits without compliance, and drives and friction with a bound and without damping, so that a rope that is
// taut is a rod, and a bounded drive that is not overloaded one without bound (reaction_holdings.cc). A limit is a row where
// it was closed in S_n (1e-8 of the reach, or rad) and not opening, a drive or friction where it was at its velocity there.
// Multipliers that a row cannot have let it go: a limit is open then, a drive pushes with its bound; what closes without is held
// again, twice at most. A drive that was not at its velocity in S_n pushes towards it, with its bound, and beyond; one that would
// go beyond it by three times what it was short of is left to the step's end. A limit that opens in S_n, or that is open by more
// than 3/4 of the square of what turns in the step, by which states that an integrator tries may be off, is let go: pushed on
// where it goes, it would be given energy. So the integrator's order is that of motion while none of this changes; where it does,
// a step is of first order, unless it ends there (stop_location.h: limits that close, drives that come to their velocity). At the
// step's end a limit that bore something is closed like a lock, and a drive that did all it can is left alone, unless it went
// beyond its velocity.
//
// Each mechanism, the bodies that joints connect (islands.h), is solved by itself (reaction_solver.h), and what is decided for it
// goes by it alone: it moves beside others as it does without them, bit for bit. `residual` is that of the worst.
//
// Dependent rows are left out by the factorisation (profile_ldlt.h); rows that contradict each other are met as well as
// can be (least squares), and `residual` says by how much they are missed.
//
// Where rows are nearly dependent, so that bodies would have to move ten times as far as a row might be off, and where dependent
// ones contradict each other by what the state is off the joints, the answer is that for the nearest state, along M^-1 J^T, that
// agrees with the joints in pose and velocity. States that an integrator tries are off by its error e, and at a distance x from
// a singular configuration J and gamma in them are off by e/x^2: the motion would turn away on the hyperbola x y = e instead of
// going through. There a row counts as dependent within a pivot of 1e-10 of its diagonal, elsewhere of 1e-12; what is left are
// roundings over x^3. Nearer than e the state that agrees may lie on the other branch, which takes the velocities: it is then
// looked for a little ahead.
//
// Where no state near by agrees (steps towards it do not leave a thousandth of the error: links in a row that just reach their
// end are locked, and what they are off by, e, is the square of how far they are from being in a row), the question is answered
// as asked, and rows within a pivot of 100 e of their diagonal count as dependent. Else their gamma, v^2/L, would be
// answered by v^2/r, r the distance from the place: the motion on a circle of that radius, which no step resolves.
#pragma once

#include "plugin_sdk/plugin.h"

namespace gravitas {

// Throws Refusal for an impossible request (request_check.h), and where a reaction is not finite.
void solve_reactions(const stage::SolverReactionsRequest& request, const stage::SolverReactionsReply& reply);

// How the reactions change with the states of bodies. With the forces' Jacobian dF, multipliers as they are, and rows and
// springs in states that differ by 1e-7 (of the mechanism's reach, rad, m/s, rad/s) from that of each body in turn,
//
//   dR = d(J^T) lambda + dS + J^T dlambda,   J M^-1 J^T dlambda = -(dgamma + dJ a + J M^-1 (dF + dS + d(J^T) lambda)),
//
// S what springs do and a the accelerations with the reactions: one factorisation, and for each of the twelve numbers of a
// body the rows of its own joints and one substitution, in each mechanism that it or a force carries them to. Where the
// answer is that of the nearest state that agrees with the joints, states are moved along what these allow.
void differentiate_reactions(const stage::SolverReactionsRequest& request,
                             const stage::SolverReactionJacobiansReply& reply);

}  // namespace gravitas
