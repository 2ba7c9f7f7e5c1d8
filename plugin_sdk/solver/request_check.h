// What a solver refuses to compute with: checked once, before the first number is used, so that the
// numeric code needs no check of its own.
#pragma once

#include "schemas/stage_frames.h"

namespace gravitas {

// Throws Refusal naming the column and the row of the first fault: a column of the wrong length, a
// number that is not finite, a time step that is not positive, theta or correction outside 0 ... 1,
// a negative inverse mass or moment, coefficient, compliance, damping or force, restitution outside
// 0 ... 1, an orientation or normal that is not unit within 1e-6, a body that does not exist or is
// paired with itself, an unknown mode, a lower limit above the upper.
void check_solver_request(const stage::SolverSolveRequest& request);
void check_reactions_request(const stage::SolverReactionsRequest& request);

}  // namespace gravitas
