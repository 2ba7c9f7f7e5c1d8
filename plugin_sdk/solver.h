// Words that all solvers share.
#pragma once

#include <algorithm>
#include <cstdint>

namespace gravitas {

// Why a solver stopped: `stop_reason` of SolverSolveReply. Of several islands what together() makes of theirs.
enum class StopReason : std::uint32_t {
  kNothingToDo = 0,             // no rows
  kConverged = 1,               // the last sweep changed no velocity by more than rounding's size
  kIterations = 2,              // the allowed number of sweeps or steps was used up
  kContradiction = 3,           // converged, but joints contradict each other: a least-squares compromise
  kUnfinishedContradiction = 4  // joints contradict each other, and there or elsewhere the iterations were used up
};

constexpr bool tells_contradiction(StopReason reason) {
  return reason == StopReason::kContradiction || reason == StopReason::kUnfinishedContradiction;
}
constexpr bool tells_unfinished(StopReason reason) {
  return reason == StopReason::kIterations || reason == StopReason::kUnfinishedContradiction;
}
constexpr StopReason together(StopReason a, StopReason b) {
  const bool contradicts = tells_contradiction(a) || tells_contradiction(b);
  const bool is_unfinished = tells_unfinished(a) || tells_unfinished(b);
  return contradicts && is_unfinished ? StopReason::kUnfinishedContradiction : std::max(a, b);
}

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
    case StopReason::kUnfinishedContradiction:
      return "contradiction, and iterations used up";
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
