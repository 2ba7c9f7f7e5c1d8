#include "plugin_sdk/solver/islands.h"

#include <algorithm>
#include <numeric>
#include <span>

#include "plugin_sdk/body.h"

namespace gravitas {

bool is_pushed(const stage::SolverReactionsRequest& request, std::size_t body) {
  if ((request.flags()[body] & kMovable) == 0 || (request.flags()[body] & kKinematic) != 0) return false;
  return request.inverse_mass()[body] > 0.0 || !vector_at(request.inverse_inertia(), body).isZero(0.0);
}

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
  is_pushed_.resize(bodies.count());
  for (std::uint32_t i = 0; i < bodies.count(); ++i) is_pushed_[i] = bodies[i].is_pushed() ? 1 : 0;
  return find(request.discrepancy_body(), request.contact_body());
}

std::span<const Island> IslandFinder::find(const stage::SolverReactionsRequest& request) {
  is_pushed_.resize(request.flags().size());
  for (std::size_t i = 0; i < is_pushed_.size(); ++i) is_pushed_[i] = is_pushed(request, i) ? 1 : 0;
  return find(request.discrepancy_body(), {});
}

std::span<const Island> IslandFinder::find(std::span<const std::uint32_t> joints,
                                           std::span<const std::uint32_t> contacts) {
  const std::size_t count = is_pushed_.size();
  joined_.reset(count);
  is_held_.assign(count, 0);
  const auto pushes = [&](std::uint32_t body) { return body != kNone && is_pushed_[body] != 0; };
  const auto connect = [&](std::span<const std::uint32_t> pairs) {
    for (std::size_t i = 0; i < pairs.size(); i += 2) {
      const std::uint32_t one = pairs[i], two = pairs[i + 1];
      if (pushes(one)) is_held_[one] = 1;
      if (pushes(two)) is_held_[two] = 1;
      if (pushes(one) && pushes(two)) joined_.join(one, two);
    }
  };
  connect(joints);
  connect(contacts);

  std::uint32_t found = 0;
  island_of_.assign(count, 0);
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
      const std::uint32_t one = pairs[i], two = pairs[i + 1];
      if (!pushes(one) && !pushes(two)) continue;
      const std::uint32_t root = joined_.root(pushes(one) ? one : two);
      (islands_[island_of_[root]].*rows).push_back(static_cast<std::uint32_t>(i / 2));
    }
  };
  distribute(joints, &Island::discrepancies);
  distribute(contacts, &Island::contacts);
  return {islands_.data(), found};
}

}  // namespace gravitas
