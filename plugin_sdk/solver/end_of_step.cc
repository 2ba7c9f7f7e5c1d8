// Islands, each by itself.
#include "plugin_sdk/solver/end_of_step.h"

#include "plugin_sdk/solver/island_solver.h"
#include "plugin_sdk/solver/reply.h"
#include "plugin_sdk/solver/request_check.h"

namespace gravitas {
namespace {

// Of a request. Memory is all that stays of it.
struct Whole {
  SolverBodies bodies;
  SolverSolution answer;
  IslandFinder finder;
};

}  // namespace

void solve_end_of_step(const stage::SolverSolveRequest& request, const ConeSettings& settings,
                       const stage::SolverSolveReply& reply, Host& host) {
  check_solver_request(request);
  thread_local Whole whole;
  SolverBodies& bodies = whole.bodies;
  SolverSolution& answer = whole.answer;
  bodies.load(request);
  set_all_unpushed(request, bodies, &answer);
  const std::span<const Island> islands = whole.finder.find(request, bodies);
  std::vector<ConeSummary> summaries(islands.size());
  host.parallel_for_each(islands.size(), [&](std::uint64_t i) {
    // its matrices are large; memory is all that stays of them
    thread_local ConeProblem cone;
    summaries[i] = IslandSolver(request, bodies, islands[i], settings, &cone, &answer).solve(host);
    host.mark_progress();
  });
  write(answer, outcome_of(summaries), reply);
}

}  // namespace gravitas
