// How joints that hold the same freedoms share their load.
#include <algorithm>
#include <numeric>
#include <span>

#include "workers/solver/sequential/sequential.h"

namespace gravitas {
namespace {

constexpr std::uint32_t kFreedoms = 6;

// All rows of two bodies, or of a body and the ground.
struct Link {
  std::vector<std::uint32_t> rows;
  bool is_left = true;

  // What several joints hold is no end.
  int weight() const { return rows.size() > kFreedoms ? 2 : 1; }
};

// Places of the rows that are left without bodies that hang on one joint, one after the other: these bear one load only. Empty
// where there are no more of them than their bodies have freedoms.
std::vector<std::uint32_t> that_may_share(std::span<const RowEnds> rows) {
  std::vector<std::uint32_t> order(rows.size());
  std::iota(order.begin(), order.end(), 0);
  const auto pair_of = [&](std::uint32_t row) { return RowEnds(std::minmax(rows[row].first, rows[row].second)); };
  std::ranges::stable_sort(order, {}, pair_of);
  std::vector<Link> links;
  for (const std::uint32_t row : order) {
    if (links.empty() || pair_of(links.back().rows.front()) != pair_of(row)) links.emplace_back();
    links.back().rows.push_back(row);
  }
  std::uint32_t count = 0;
  for (const auto& [one, two] : rows)
    for (const std::uint32_t body : {one, two}) count = body == kNone ? count : std::max(count, body + 1);
  std::vector<std::vector<std::uint32_t>> links_of(count);
  std::vector<int> held(count, 0);
  const auto bodies_of = [&](const Link& link) {
    std::vector<std::uint32_t> bodies;
    for (const std::uint32_t body : {rows[link.rows.front()].first, rows[link.rows.front()].second})
      if (body != kNone) bodies.push_back(body);
    return bodies;
  };
  for (std::uint32_t i = 0; i < links.size(); ++i)
    for (const std::uint32_t body : bodies_of(links[i])) links_of[body].push_back(i), held[body] += links[i].weight();

  std::vector<std::uint32_t> ends;
  for (std::uint32_t body = 0; body < count; ++body)
    if (held[body] == 1) ends.push_back(body);
  while (!ends.empty()) {
    const std::uint32_t end = ends.back();
    ends.pop_back();
    for (const std::uint32_t i : links_of[end]) {
      if (!links[i].is_left) continue;
      links[i].is_left = false;
      for (const std::uint32_t body : bodies_of(links[i])) {
        held[body] -= links[i].weight();
        if (held[body] == 1) ends.push_back(body);
      }
    }
  }
  std::vector<std::uint32_t> left;
  for (const Link& link : links)
    if (link.is_left) left.insert(left.end(), link.rows.begin(), link.rows.end());
  std::ranges::sort(left);
  const auto bodies = static_cast<std::size_t>(std::ranges::count_if(held, [](int weight) { return weight > 0; }));
  if (left.size() <= kFreedoms * bodies) left.clear();
  return left;
}

}  // namespace

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
  if (held_ends_ != known_ends_) sharing_ = that_may_share(held_ends_), known_ends_ = held_ends_;
  if (sharing_.empty()) return;
  std::vector<std::uint32_t> rows;
  for (const std::uint32_t place : sharing_) rows.push_back(held_rows_[place]);
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
