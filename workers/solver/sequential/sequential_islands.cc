#include "workers/solver/sequential/sequential_islands.h"

#include <algorithm>
#include <span>

#include "plugin_sdk/solver/island_request.h"
#include "plugin_sdk/solver/reply.h"
#include "plugin_sdk/solver/request_check.h"

namespace gravitas {
namespace {

// Fewer are solved before another thread has woken.
constexpr std::size_t kRowsForThreads = 200;

}  // namespace

void SequentialIslands::solve(const stage::SolverSolveRequest& request, const stage::SolverSolveReply& reply,
                              const Host& host) {
  check_solver_request(request);
  bodies_.load(request);
  const std::span<const Island> islands = finder_.find(request, bodies_);
  // joints of bodies that nothing pushes are in no island
  if (islands.size() == 1 && islands[0].discrepancies.size() == request.mode().size()) {
    whole_.report_to(&host);
    const SequentialSummary summary = whole_.solve(request);
    return write(whole_.solution(), summary.outcome(), reply);
  }
  set_all_unpushed(request, bodies_, &solution_);
  outcomes_.resize(islands.size());
  const auto solve_island = [&](std::uint64_t i) {
    thread_local IslandRequest part;
    thread_local SequentialSolver solver(settings_);
    solver.set(settings_);
    solver.report_to(&host);
    part.load(request, bodies_, islands[i]);
    outcomes_[i] = solver.solve(part.request()).outcome();
    part.store(solver.solution(), &solution_);
    host.mark_progress();
  };
  if (request.mode().size() + request.contact_key().size() >= kRowsForThreads) {
    host.parallel_for_each(islands.size(), solve_island);
  } else {
    for (std::uint64_t i = 0; i < islands.size(); ++i) solve_island(i);
  }
  SolverOutcome outcome;
  for (const SolverOutcome& one : outcomes_) {
    outcome.iterations = std::max(outcome.iterations, one.iterations);
    outcome.residual = std::max(outcome.residual, one.residual);
    outcome.stop_reason = together(outcome.stop_reason, one.stop_reason);
  }
  write(solution_, outcome, reply);
}

}  // namespace gravitas
