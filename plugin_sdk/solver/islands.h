// Islands (§ 2.6.7.3): bodies that joints and contacts connect, and that can be solved by themselves. Bodies that nothing
// pushes connect nothing: else the ground would make one island of all. (2.78) reads chi_i with chi_i, and (2.79) forgets
// where it was; what is meant is the transitive closure.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>
#include <vector>

#include "plugin_sdk/solver/bodies.h"

namespace gravitas {

// Can anything push a body? Not one that is immovable or kinematic, whatever its columns say.
bool is_pushed(const stage::SolverReactionsRequest& request, std::size_t body);

// Sets of numbered bodies, by the smallest number in each: the same whatever the order of join().
class BodyUnion {
 public:
  explicit BodyUnion(std::size_t count) { reset(count); }
  // Each body by itself again.
  void reset(std::size_t count);
  std::uint32_t root(std::uint32_t body);
  void join(std::uint32_t body1, std::uint32_t body2);

 private:
  std::vector<std::uint32_t> parent_;
};

struct Island {
  std::vector<std::uint32_t> bodies;         // rows, rising
  std::vector<std::uint32_t> discrepancies;  // rows of the request, rising
  std::vector<std::uint32_t> contacts;
};

// Keeps the memory of the islands that it finds.
class IslandFinder {
 public:
  // In the order of their first bodies; bodies without joint or contact are in none, nor are rows that push no body.
  // The same islands in whatever order rows come. Valid until the next find().
  std::span<const Island> find(const stage::SolverSolveRequest& request, const SolverBodies& bodies);
  // By joints alone.
  std::span<const Island> find(const stage::SolverReactionsRequest& request);

 private:
  std::span<const Island> find(std::span<const std::uint32_t> joints, std::span<const std::uint32_t> contacts);

  std::vector<std::uint8_t> is_pushed_;
  BodyUnion joined_{0};
  std::vector<std::uint8_t> is_held_;
  std::vector<std::uint32_t> island_of_;
  std::vector<Island> islands_;  // those found, and memory of others
};

}  // namespace gravitas
