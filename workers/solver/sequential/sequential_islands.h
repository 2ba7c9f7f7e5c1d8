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

  // As SequentialSolver::solve(). Of iterations and residuals the greatest is answered, of reasons to
  // stop what together() makes of them.
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
