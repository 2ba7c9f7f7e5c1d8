// Words that all solvers share.
#pragma once

#include <cstdint>

namespace gravitas {

// Why a solver stopped: `stop_reason` of SolverSolveReply. Of several islands the greatest.
enum class StopReason : std::uint32_t {
  kNothingToDo = 0,   // no rows
  kConverged = 1,     // the last sweep changed no velocity by more than rounding's size
  kIterations = 2,    // the allowed number of sweeps or steps was used up
  kContradiction = 3  // converged, but joints contradict each other: a least-squares compromise
};

constexpr const char* stop_reason_name(StopReason reason) {
  switch (reason) {
    case StopReason::kNothingToDo:
      return "nothing to do";
    case StopReason::kConverged:
      return "converged";
    case StopReason::kIterations:
      return "iterations used up";
    case StopReason::kContradiction:
      return "contradiction";
  }
  return "unknown";
}

// Columns of `contact_material`.
enum MaterialColumn : std::uint32_t {
  kRestitution = 0,
  kStaticFriction = 1,
  kDynamicFriction = 2,
  kRollingFriction = 3,
  kSpinningFriction = 4,
  kSurfacePerturbation = 5,
  kMaterialColumns = 6
};

}  // namespace gravitas
