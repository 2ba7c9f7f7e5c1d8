// One island (islands.h) as a request by itself, so that a solver that is asked island by island needs not know of them.
// What it answers then goes by that island alone: no other's bodies, rows or sweeps show in it.
#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "plugin_sdk/solver/islands.h"
#include "plugin_sdk/solver/reply.h"

namespace gravitas {

class IslandRequest {
 public:
  // Bodies are the island's and those that nothing pushes and its rows name; bodies and rows keep their order.
  void load(const stage::SolverSolveRequest& whole, const SolverBodies& bodies, const Island& island);
  // Valid until the next load().
  stage::SolverSolveRequest request() const { return stage::SolverSolveRequest(columns_.data()); }
  // What was found for the island's bodies and rows, into the places of the whole request.
  void store(const SolverSolution& part, SolverSolution* whole) const;

 private:
  static constexpr std::size_t kColumns = stage::SolverSolveRequest::kColumnCount;

  void renumber(std::size_t column);

  const Island* island_ = nullptr;
  std::vector<std::uint32_t> bodies_;                        // rows of the whole request, rising
  std::array<std::vector<std::uint64_t>, kColumns> memory_;  // of the columns
  std::array<gravitas_column, kColumns> columns_{};
};

}  // namespace gravitas
