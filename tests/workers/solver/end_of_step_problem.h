// The solution that Newton and Direct share, for SolverProblem::solve(), on one thread.
#pragma once

#include "plugin_sdk/plugin.h"
#include "plugin_sdk/solver/end_of_step.h"

namespace gravitas {

struct EndOfStepSolver {
  ConeSettings settings;

  void solve(const stage::SolverSolveRequest& request, const stage::SolverSolveReply& reply) const {
    gravitas_host plain{};
    plain.mark_progress = [](void*) {};
    plain.parallel_for = [](void*, std::uint64_t count, void (*body)(void*, std::uint64_t, std::uint64_t),
                            void* argument) {
      if (count > 0) body(argument, 0, count);
    };
    Host host(&plain);
    solve_end_of_step(request, settings, reply, host);
  }
};

inline EndOfStepSolver newton(double tolerance = 1e-12) {
  EndOfStepSolver solver;
  solver.settings.tolerance = tolerance;
  return solver;
}

inline EndOfStepSolver direct(std::uint32_t sweeps = 1000) {
  EndOfStepSolver solver;
  solver.settings.method = ConeMethod::kGaussSeidel;
  solver.settings.iterations = sweeps;
  return solver;
}

}  // namespace gravitas
