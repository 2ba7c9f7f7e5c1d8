// Sequential island by island (§ 2.6.7.3), each swept until it is at rest itself, on as many threads as there are.
#pragma once

#include <vector>

#include "plugin_sdk/plugin.h"
#include "plugin_sdk/solver/islands.h"
#include "workers/solver/sequential/sequential.h"

namespace gravitas {

class SequentialIslands {
 public:
  explicit SequentialIslands(const SequentialSettings& settings) : settings_(settings), whole_(settings) {}

  // As SequentialSolver::solve(). Of iterations, residuals and reasons to stop the greatest is answered.
  void solve(const stage::SolverSolveRequest& request, const stage::SolverSolveReply& reply, const Host& host);

 private:
  SequentialSettings settings_;
  SequentialSolver whole_;  // where there is one island
  SolverBodies bodies_;
  IslandFinder finder_;
  SolverSolution solution_;
  std::vector<SolverOutcome> outcomes_;
};

}  // namespace gravitas
