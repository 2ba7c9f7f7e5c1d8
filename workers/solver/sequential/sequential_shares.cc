// How joints that hold the same freedoms share their load.
#include <algorithm>

#include "workers/solver/sequential/sequential.h"

namespace gravitas {

// Told as equal springs would bear what moves the bodies alike. Not beside drives, as in ConeProblem.
void SequentialSolver::share_out() {
  if (std::ranges::any_of(velocity_laws_, &JointLaw::is_unbounded_drive)) return;
  const auto ends_of = [&](std::uint32_t row) {
    const RelaxationDiscrepancy& d = directed_[row / 3];
    const auto end = [&](std::uint32_t body) { return bodies_[body].is_pushed() ? body : kNone; };
    return RowEnds(end(d.body1), end(d.body2));
  };
  held_rows_.clear(), held_ends_.clear();
  for (std::uint32_t i = 0; i < velocity_laws_.size(); ++i)
    if (velocity_laws_[i].is_rigid()) held_rows_.push_back(i), held_ends_.push_back(ends_of(i));
  std::vector<std::uint32_t> rows;
  for (const std::uint32_t place : rows_in_loops_.find(held_ends_)) rows.push_back(held_rows_[place]);
  if (rows.empty()) return;
  sharing_order_.arrange(ends_of, &rows);

  equal_springs_.start(bodies_.count() + 1);
  std::vector<double> impulses;
  for (const std::uint32_t row : rows) {
    const ConeRow one = row_of(directed_[row / 3], row % 3, velocity_laws_[row]);
    equal_springs_.add(one, bodies_, EqualSprings::stiffness(one.length));
    impulses.push_back(solution_.joint_impulse[row]);
  }
  equal_springs_.factorise();
  if (!equal_springs_.share(&impulses)) return;
  for (std::size_t i = 0; i < rows.size(); ++i) solution_.joint_impulse[rows[i]] = impulses[i];
}

}  // namespace gravitas
