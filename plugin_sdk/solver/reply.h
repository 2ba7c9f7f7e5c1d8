// What a solver found, and how it is written to the reply.
#pragma once

#include <cstdint>
#include <vector>

#include "plugin_sdk/discrepancy.h"
#include "plugin_sdk/solver.h"
#include "plugin_sdk/solver/bodies.h"

namespace gravitas {

struct SolverSolution {
  BodyMotion velocity, displacement;                                        // v_{n+1}, delta; the world's rows last
  std::vector<double> joint_impulse, joint_correction;                      // three a discrepancy
  std::vector<double> contact_impulse, contact_turning, contact_direction;  // three a contact
  std::vector<double> contact_correction;                                   // one a contact
};

// Makes all of the solution, whatever it holds, what holds where nobody is pushed: bodies keep v*, impulses and corrections
// are zero.
void set_all_unpushed(const stage::SolverSolveRequest& request, const SolverBodies& bodies, SolverSolution* solution);

// How a solution ended.
struct SolverOutcome {
  std::uint32_t iterations = 0;
  double residual = 0.0;  // m/s
  StopReason stop_reason = StopReason::kNothingToDo;
};

// The discrepancies of a request.
DiscrepancyColumns columns_of(const stage::SolverSolveRequest& request);

// Throws Refusal if a number of the solution is not finite.
void write(const SolverSolution& solution, const SolverOutcome& outcome, const stage::SolverSolveReply& reply);

}  // namespace gravitas
