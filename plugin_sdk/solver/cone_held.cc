// Rows that hold always: their factors, what of them contradicts itself, and what rounding leaves of them.
#include <algorithm>
#include <cmath>

#include "plugin_sdk/solver/cone_problem.h"

namespace gravitas {
namespace {

// What is left of held rows is rounding where it is this many units of what their multipliers do.
constexpr double kRefined = 4.0;

}  // namespace

void ConeProblem::order_held(const SolverBodies& bodies) {
  const auto end = [&](std::uint32_t body) { return bodies[body].is_pushed() ? body : kNone; };
  const auto ends_of = [&](std::uint32_t r) { return RowEnds(end(rows[r].body1), end(rows[r].body2)); };
  const bool is_new = elimination_.arrange(ends_of, &held_);
  if (!is_new && held_of_body_.size() == bodies.count() + 1 && first_held_.size() == held_.size()) return;
  first_held_.clear();  // shorter than held_ until all is there
  clear_lists(bodies.count() + 1, &held_of_body_);
  for (std::uint32_t i = 0; i < held_.size(); ++i) {
    std::size_t first = i;
    const RowEnds& ends = elimination_.ends(i);
    for (const std::uint32_t body : {ends.first, ends.second}) {
      if (body == kNone) continue;
      std::vector<std::uint32_t>& list = held_of_body_[body];
      if (!list.empty()) first = std::min<std::size_t>(first, list.front());
      list.push_back(i);
    }
    first_held_.push_back(first);
  }
}

// W_EE = L D L^T, and the side of the held rows.
void ConeProblem::factorise(const SolverBodies& bodies) {
  side_.resize(held_.size());
  factor_.start(first_held_);
  for (std::size_t i = 0; i < held_.size(); ++i) {
    const ConeRow& row = rows[held_[i]];
    const double scale = scale_[held_[i]];
    side_[i] = (row.law.lower_target - free_[held_[i]]) / scale;
    for (std::size_t j = first_held_[i]; j <= i; ++j) {
      double entry = coupling(row, rows[held_[j]], bodies);
      if (i == j) entry += row.law.gamma;
      factor_.entry(i, j) = entry / (scale * scale_[held_[j]]);
    }
  }
  factor_.factorise();
  has_nearest_ = false;
}

double ConeProblem::reconcile(const SolverBodies& bodies, const BodyMotion& x0, double smallest) {
  constexpr double kMostEntries = 2e7;  // a second or two
  classify(bodies, x0);
  order_held(bodies);
  double entries = 0.0;
  for (std::size_t i = 0; i < held_.size(); ++i) entries += static_cast<double>(i - first_held_[i]);
  if (entries > kMostEntries) return 0.0;
  factorise(bodies);
  const double contradiction = make_consistent(bodies, smallest);
  for (std::size_t i = 0; i < held_.size() && contradiction > 0.0; ++i) {
    JointLaw& law = rows[held_[i]].law;
    law.lower_target = law.upper_target = free_[held_[i]] + scale_[held_[i]] * side_[i];
  }
  return contradiction;
}

double ConeProblem::make_consistent(const SolverBodies& bodies, double smallest) {
  if (factor_.dropped() == 0) return 0.0;
  double largest = 0.0;
  for (const std::uint32_t r : held_) largest = std::max(largest, way_of(r));
  const double distance = largest * make_consistent(bodies, &side_);
  // what gives way counts whole on both sides
  return distance > std::max(smallest, 1e-9 * size(nullptr)) ? distance : 0.0;
}

// Where many rows depend on each other equal springs tell the nearest side; the factors, what lies where their dependence and
// that of the springs differ.
double ConeProblem::make_consistent(const SolverBodies& bodies, std::vector<double>* side) {
  constexpr std::size_t kMany = 32;
  // of a side: what rounding may leave of it, which dependent rows of a large wall amplify
  constexpr double kRounded = 1e-7;
  if (factor_.dropped() < kMany || factor_.is_consistent(*side)) return factor_.make_consistent(side);
  if (!has_nearest_) {
    nearest_.start(bodies.count() + 1);
    for (const std::uint32_t r : held_)
      nearest_.add(rows[r], bodies, rows[r].law.gamma > 0.0 ? 0.0 : 1.0 / (scale_[r] * scale_[r]));
    nearest_.factorise();
    has_nearest_ = true;
  }
  std::vector<double> fitted(held_.size());
  for (std::size_t i = 0; i < held_.size(); ++i) fitted[i] = (*side)[i] * scale_[held_[i]];
  nearest_.fit(&fitted);
  double squared = 0.0, largest = 0.0;
  for (std::size_t i = 0; i < held_.size(); ++i) {
    const double way = fitted[i] / scale_[held_[i]] - (*side)[i];
    largest = std::max(largest, std::fabs((*side)[i]));
    (*side)[i] += way;
    squared += way * way;
  }
  const double left = factor_.is_consistent(*side, kRounded * largest) ? 0.0 : factor_.make_consistent(side);
  return std::sqrt(squared) + left;
}

// Held rows that depend on each other bear as equal springs would, moments by way of their rows' lengths. Not beside drives:
// what these bear moves the bodies, what joints bear does not.
void ConeProblem::share_out(const SolverBodies& bodies) {
  const auto drives = [&](std::uint32_t r) { return rows[r].law.is_velocity_only; };
  if (factor_.dropped() == 0 || std::ranges::any_of(held_, drives)) return;
  shares_.start(bodies.count() + 1);
  std::vector<double> multipliers;
  for (const std::uint32_t r : held_) {
    const ConeRow& row = rows[r];
    shares_.add(row, bodies, row.law.gamma > 0.0 ? 0.0 : EqualSprings::stiffness(row.length));
    multipliers.push_back(row.multiplier);
  }
  shares_.factorise();
  if (!shares_.share(&multipliers)) return;
  for (std::size_t i = 0; i < held_.size(); ++i) rows[held_[i]].multiplier = multipliers[i];
}

void ConeProblem::refine(const SolverBodies& bodies, const BodyMotion& x0, double smallest,
                         const ConeSettings& settings, ConeSummary* summary) {
  if (held_.empty()) return;
  const double tolerance = std::max(smallest, settings.tolerance * size(&bodies));
  // what a row's own multiplier does to it is what rounding goes by
  const auto summed = [&] {
    double most = 0.0;
    for (const std::uint32_t r : held_)
      most = std::max(most, scale_[r] * scale_[r] * std::fabs(rows[r].multiplier) * rows[r].length);
    return most;
  };
  // once for what rounding left of the answer: twice if that was much
  double missing = 0.0;
  for (int repeat = 0; repeat < 2; ++repeat) {
    const double rounding = kRefined * kEpsilon * summed();
    missing = refine_held(bodies, x0);
    if (missing <= rounding) break;
  }
  summary->residual = std::max(summary->residual, missing);
  summary->has_converged =
      summary->has_converged && missing <= std::max(tolerance, 64.0 * kEpsilon * largest_held_sum());
}

// A row's value is summed from what all rows of its bodies push: a hinge's turn about a thin rod is, too, from what holds the
// rod's end, whatever its own torque.
double ConeProblem::largest_held_sum() {
  const auto pushed = [&](const std::vector<std::uint32_t>& list) {
    double most = 0.0;
    for (const std::uint32_t i : list) most = std::max(most, scale_[held_[i]] * std::fabs(rows[held_[i]].multiplier));
    return most;
  };
  pushed_.resize(held_of_body_.size());
  std::ranges::transform(held_of_body_, pushed_.begin(), pushed);
  double most = 0.0;
  for (const std::uint32_t r : held_)
    most = std::max(most, way_of(r) * std::max(pushed_[rows[r].body1], pushed_[rows[r].body2]));
  return most;
}

void ConeProblem::find_missing_of_held(const SolverBodies& bodies, const BodyMotion& x0) {
  x_ = x0;
  push(bodies, &x_);
  side_.resize(held_.size());
  for (std::size_t i = 0; i < held_.size(); ++i) {
    const ConeRow& row = rows[held_[i]];
    side_[i] = (row.law.lower_target - value(x_, held_[i]) - row.law.gamma * row.multiplier) / scale_[held_[i]];
  }
}

void ConeProblem::add_to_held() {
  factor_.solve(&side_);
  for (std::size_t i = 0; i < held_.size(); ++i) rows[held_[i]].multiplier += side_[i] / scale_[held_[i]];
}

double ConeProblem::refine_held(const SolverBodies& bodies, const BodyMotion& x0) {
  find_missing_of_held(bodies, x0);
  if (factor_.dropped() > 0) make_consistent(bodies, &side_);
  double largest = 0.0;
  for (std::size_t i = 0; i < held_.size(); ++i)
    largest = std::max(largest, std::fabs(side_[i]) * scale_[held_[i]] * rows[held_[i]].length);
  add_to_held();
  return largest;
}

double ConeProblem::correct(const SolverBodies& bodies, const BodyMotion& x0, double smallest) {
  find_missing_of_held(bodies, x0);
  const double contradiction = make_consistent(bodies, smallest);
  add_to_held();
  return contradiction;
}

}  // namespace gravitas
