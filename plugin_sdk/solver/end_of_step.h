// Joints and contacts where the step ends: the solution that Newton and Direct share. A pure function of the request and
// the settings.
//
//   for each island (islands.h), by itself:
//     repeat   pose change  delta = M^-1 J^T mu + theta h M^-1 J^T lambda_v      rows at S* (+) delta
//              contacts and limits that S* (+) delta closes
//              velocity     v_{n+1} = v* + M^-1 J^T lambda                         rows at S* (+) delta
//     until    delta no longer changes by what lambda_v (friction, drives) adds to it
//
// J, arms and world inertia are those at the end of the step, so that what holds is held where the body will be: a chain
// under 1000 times its mass, linearised at S*, flies apart at 1/60 s.
//
// Joints. The pose change is found by Newton's method on the errors themselves: points are carried as rigid bodies, axes
// turn with body 1, a radial axis with its points, swings, twists and components with what they are of; other angular errors
// are carried to first order in delta's turn. Rows push both bodies at body 2's point, midway to body 1's along what is held
// (where a point is all that holds them together, each at its own), which is one place at the end. Where a step of it was
// small (1e-7 rad), those that follow are chords: new rows and errors, the same factors. What the turn changes of the inertia,
// and of the offset of what acts on velocities alone, is taken anew at each step; where steps shrink slowly by that (capsules
// that an impact turns about their axes), they are accelerated (anderson_acceleration.h).
//
// Springs of joints have a row in either, with the same compliance (joint_laws.h): the errors at the end of the step are what they
// hold against, however far that turns, and what strikes a body moves it in the step after.
//
// Contacts. The gap is linear in delta with the arms of S*, for the surface beyond the contact's points is not known; a
// velocity row's arms end at each body's own surface point, which is where the two meet when the gap is closed (a ball that
// sank by d rolls on its radius, not on a radius less d/2). Those of jointed bodies go along with what delta turns about the
// normal, or joints and contacts would contradict each other (turn_arms() of island_velocity.cc).
//
// Contacts may contradict each other: bodies that lie in one place are pushed off each other in a circle. Where no pose change
// meets them (it goes beyond the bound below, or does not converge and misses a tenth of the deepest overlap, which is more
// than the step's longest way and a tenth of the smallest radius of gyration), contacts of two bodies that can be pushed get a
// compliance, 0.1 to 1 of their own response and rising in their order, so that some part and the next step sees in which
// direction; the others 1e-6 of it.
//
// Recovery is bounded: contacts that leave a body no room (walls that crush it, shapes one in another) ask for a pose change
// without end. Where it goes, from S* and from where lambda_v alone leads, beyond 16 times the ways of the step (S_n to S*, and
// h v*) and twice what is overlapped at S*, summed over the island, all of it is shortened, and what overlaps stays for the
// steps to come.
//
// Drives without a bound ask for their velocity whatever is in the way. Where that has no solution, they are given a compliance of
// 1e-3 of their own response, which finds the velocities that joints, limits and contacts let them reach (steps of the proximal
// point method: nearest to what they ask for, least squares), and then ask for those: they hold loads there, but press no more,
// and what they press does not bounce. What they had moved their bodies by before stays in delta, so that an arm comes to rest
// at the wall and not a step before it. Drives that contradict joints or each other are reported as contradictions.
//
// Places from which no motion leads (links in a row that just reach their end), with reactions in S* already: rows are
// dependent there, so that velocities are allowed which go nowhere, and would gather what forces give them from step to step.
// Where steps of the pose change shrink slowly, as towards such places, and it takes a body back by a tenth of its way,
// v* loses its share along delta, up to 2 delta/h; drives without bound stall. Elsewhere delta is of the size of the method's
// error. Of the steps that of the smallest error counts; nearer than rounding lets them they lead away again.
//
// Laws: joint_laws.h, contact_law.h; solution of the rows: cone_problem.h. Energy. Restitution with friction in coupled
// impacts can create energy (Kane's paradox): where an island gains, e s of the contacts that arrive and do positive work
// is lowered, or where none does all of them, to the largest share with which it does not (contact_law.h). So is what stops of
// joints give back (joint_bounce.h), together with them; an island with such stops that is unfinished and gains all the same has
// its impulses scaled back.
#pragma once

#include <cstdint>
#include <vector>

#include "plugin_sdk/plugin.h"
#include "plugin_sdk/solver/cone_problem.h"

namespace gravitas {

// Answers the request. Throws Refusal for an impossible one (request_check.h), and where the answer is not finite because
// the numbers overflow. Islands are solved on the host's threads, each to places of its own. `iterations` of the reply is
// the sum over islands of steps (sweeps), `residual` the largest of the last velocity solutions' (m/s).
void solve_end_of_step(const stage::SolverSolveRequest& request, const ConeSettings& settings,
                       const stage::SolverSolveReply& reply, Host& host);

}  // namespace gravitas
