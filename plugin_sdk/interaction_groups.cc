#include "plugin_sdk/interaction_groups.h"

#include <algorithm>
#include <span>

#include "plugin_sdk/solver/islands.h"

namespace gravitas {
namespace {

constexpr double kMoved = 1e-3;

BodyState moved(const BodyState& state) {
  const Vector3 by = Vector3::Constant(kMoved);
  return {displaced(state.pose, by, by), {state.twist.linear + by, state.twist.angular + by}};
}

}  // namespace

std::vector<std::vector<std::size_t>> interaction_groups(const stage::IntegratorIntegrateRequest& request,
                                                         Derivatives* derivatives, double time,
                                                         const TrialColumns& trial) {
  std::vector<std::size_t> movable;
  for (std::size_t i = 0; i < derivatives->size(); ++i)
    if ((request.flags()[i] & kMovable) != 0) movable.push_back(i);

  bool interact = false;
  if (request.wrench_is_constant() == 0 && movable.size() > 1) {
    const std::span<const double> answer = derivatives->wrenches(time, trial);
    const std::vector<double> before(answer.begin(), answer.end());
    TrialColumns shifted = trial;
    for (std::size_t bit = 1; bit < movable.size() && !interact; bit *= 2) {
      for (const std::size_t side : {std::size_t{0}, bit}) {
        for (std::size_t k = 0; k < movable.size(); ++k)
          shifted.set(movable[k], (k & bit) == side ? moved(trial.at(movable[k])) : trial.at(movable[k]));
        const std::span<const double> after = derivatives->wrenches(time, shifted);
        for (std::size_t k = 0; k < movable.size(); ++k)
          if ((k & bit) != side)
            interact = interact || !std::ranges::equal(after.subspan(6 * movable[k], 6),
                                                       std::span(before).subspan(6 * movable[k], 6));
      }
    }
  }
  if (interact) return {movable};
  std::vector<std::vector<std::size_t>> groups;
  for (const std::size_t row : movable) groups.push_back({row});
  return groups;
}

std::vector<std::vector<std::size_t>> interaction_groups(const stage::IntegratorIntegrateRequest& request,
                                                         const WrenchJacobian& jacobian) {
  const std::span<const std::uint32_t> flags = request.flags();
  BodyUnion joined(flags.size());
  for (std::size_t i = 0; i < jacobian.size(); ++i)
    if ((flags[jacobian.body(i)] & flags[jacobian.by(i)] & kMovable) != 0)
      joined.join(jacobian.body(i), jacobian.by(i));
  std::vector<std::vector<std::size_t>> groups;
  std::vector<std::size_t> group_of(flags.size());
  for (std::uint32_t row = 0; row < flags.size(); ++row) {
    if ((flags[row] & kMovable) == 0) continue;
    const std::uint32_t root = joined.root(row);
    if (root == row) group_of[row] = groups.size(), groups.emplace_back();
    groups[group_of[root]].push_back(row);
  }
  return groups;
}

}  // namespace gravitas
