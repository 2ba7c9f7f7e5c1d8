// Islands (§ 2.6.7.3): bodies that joints and contacts connect, and that can be solved by themselves. Bodies that nothing
// pushes connect nothing: else the ground would make one island of all. (2.78) reads chi_i with chi_i, and (2.79) forgets
// where it was; what is meant is the transitive closure.
#pragma once

#include <cstdint>
#include <vector>

#include "plugin_sdk/solver/bodies.h"

namespace gravitas {

struct Island {
  std::vector<std::uint32_t> bodies;         // rows, rising
  std::vector<std::uint32_t> discrepancies;  // rows of the request, rising
  std::vector<std::uint32_t> contacts;
};

// In the order of their first bodies; bodies without joint or contact are in none, nor are rows that push no body. Union
// by smaller number with path halving: the same islands in whatever order rows come.
std::vector<Island> find_islands(const stage::SolverSolveRequest& request, const SolverBodies& bodies);

}  // namespace gravitas
