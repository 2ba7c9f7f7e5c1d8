#include "plugin_sdk/solver/islands.h"

#include <algorithm>
#include <numeric>
#include <span>

namespace gravitas {

void BodyUnion::reset(std::size_t count) {
  parent_.resize(count);
  std::iota(parent_.begin(), parent_.end(), 0U);
}

std::uint32_t BodyUnion::root(std::uint32_t body) {
  while (parent_[body] != body) body = parent_[body] = parent_[parent_[body]];
  return body;
}

void BodyUnion::join(std::uint32_t body1, std::uint32_t body2) {
  const std::uint32_t root1 = root(body1), root2 = root(body2);
  parent_[std::max(root1, root2)] = std::min(root1, root2);
}

std::span<const Island> IslandFinder::find(const stage::SolverSolveRequest& request, const SolverBodies& bodies) {
  const std::size_t count = bodies.count();
  joined_.reset(count + 1);
  is_held_.assign(count + 1, 0);
  const auto connect = [&](std::span<const std::uint32_t> pairs) {
    for (std::size_t i = 0; i < pairs.size(); i += 2) {
      const std::uint32_t one = bodies.row(pairs[i]), two = bodies.row(pairs[i + 1]);
      const bool first = bodies[one].is_pushed(), second = bodies[two].is_pushed();
      if (first) is_held_[one] = 1;
      if (second) is_held_[two] = 1;
      if (first && second) joined_.join(one, two);
    }
  };
  connect(request.discrepancy_body());
  connect(request.contact_body());

  std::uint32_t found = 0;
  island_of_.assign(count + 1, 0);
  for (std::uint32_t i = 0; i < count; ++i) {
    if (is_held_[i] == 0) continue;
    const std::uint32_t root = joined_.root(i);
    if (root == i) {
      island_of_[i] = found++;
      if (islands_.size() < found) islands_.emplace_back();
      Island& island = islands_[found - 1];
      island.bodies.clear(), island.discrepancies.clear(), island.contacts.clear();
    }
    islands_[island_of_[root]].bodies.push_back(i);
  }
  const auto distribute = [&](std::span<const std::uint32_t> pairs, std::vector<std::uint32_t> Island::*rows) {
    for (std::size_t i = 0; i < pairs.size(); i += 2) {
      const std::uint32_t one = bodies.row(pairs[i]), two = bodies.row(pairs[i + 1]);
      if (!bodies[one].is_pushed() && !bodies[two].is_pushed()) continue;
      const std::uint32_t root = joined_.root(bodies[one].is_pushed() ? one : two);
      (islands_[island_of_[root]].*rows).push_back(static_cast<std::uint32_t>(i / 2));
    }
  };
  distribute(request.discrepancy_body(), &Island::discrepancies);
  distribute(request.contact_body(), &Island::contacts);
  return {islands_.data(), found};
}

}  // namespace gravitas
