// What ConeProblem's first guess is right about, or nearly: found from the motions of the bodies alone, without the matrix
// of how rows feel each other. What rests, and what hangs together while it moves, ends here.
#include <algorithm>
#include <cmath>

#include "plugin_sdk/solver/cone_problem.h"

namespace gravitas {
namespace {

// Of the largest terms of a row's sum, what a guess may be wrong by: as if its multipliers were, by 2e-13 of themselves. A
// stack at rest keeps its impulses then, in place of finding them anew for what rounding moves its contacts.
constexpr double kGuessRounding = 1024.0 * kEpsilon;

constexpr std::uint32_t kTries = 6;

}  // namespace

void ConeProblem::set_multipliers() {
  for (std::size_t o = 0; o < other_.size(); ++o)
    rows[other_[o]].multiplier = lambda_[static_cast<Eigen::Index>(o)] / scale_[other_[o]];
}

// The steps are those of kNewton as long as nothing slides, so that they end at once where laws stay as they are. One more
// than enough costs little and ends at rounding: what a guess is off by adds up from step to step.
bool ConeProblem::is_solved_near_guess(const SolverBodies& bodies, const BodyMotion& x0, double tolerance,
                                       const ConeSettings& settings, ConeSummary* summary) {
  if (!held_.empty()) return false;
  const Eigen::VectorXd guess = lambda_;
  Eigen::VectorXd y(lambda_.size());
  double sum = 0.0, enough = 0.0;
  std::uint32_t done = 0;
  const auto look = [&](double rounding) {
    set_multipliers();
    BodyMotion x = x0;
    push(bodies, &x);
    find_values(x, &y);
    if (done < 2) sum = largest_sum(bodies);
    enough = std::max(tolerance, rounding * sum);
    return residual_of(lambda_, y);
  };
  double least = look(settings.may_rest ? kGuessRounding : kSumRounding);
  Eigen::VectorXd best = lambda_, best_y = y;
  if (least > enough && tolerance > 0.0) {
    // an earlier round's factors will mostly do
    HeldFactors& factors = held_factors_[contacts.empty() ? 0 : 1];
    bool is_old = !factors.rows.empty();
    for (bool is_last = false; done < kTries && take_held_step(bodies, settings.proximal, tolerance, y, &factors);) {
      ++done;
      const double residual = look(kSumRounding);
      const bool is_nearing = residual < 0.5 * least;
      if (residual < least) least = residual, best = lambda_, best_y = y;
      if (is_last || least <= kEpsilon * sum || (!is_nearing && !is_old)) break;
      is_last = least <= enough;
      if (!is_nearing) is_old = false, factors.rows.clear();
    }
  }
  if (least > enough || let_slide(best, best_y, kSlip * enough)) {
    lambda_ = guess;
    return false;
  }
  lambda_ = best;
  into_cones(&lambda_);
  set_multipliers();
  summary->iterations += done;
  summary->residual = least;
  return true;
}

// False, with nothing done, where a row slides or the step is not finite. What touches without a push is held, too, until
// it pulls: a stack that is let go is then found in a step, not in one for each body.
bool ConeProblem::take_held_step(const SolverBodies& bodies, double proximal, double corner, const Eigen::VectorXd& y,
                                 HeldFactors* factors) {
  if (linearise(lambda_, y, corner)) return false;
  coupled_.clear();
  rest_.clear();
  BodyMotion put(bodies.count() + 1);
  for (std::size_t o = 0; o < other_.size(); ++o) {
    const ConeRow& row = rows[other_[o]];
    const auto i = static_cast<Eigen::Index>(o);
    if (kinds_[o] == RowKind::kHeld) {
      coupled_.push_back(i);
      rest_.push_back(side_of_step_[i]);
    } else if (side_of_step_[i] != 0.0) {
      row.direction.push(side_of_step_[i] / scale_[other_[o]], bodies[row.body1].inverse_mass,
                         bodies[row.body2].inverse_mass, put[row.body1], put[row.body2]);
    }
  }
  HeldStep& held = factors->step;
  if (coupled_ != factors->rows) {
    factors->rows = coupled_;
    held.start(bodies);
    for (const Eigen::Index i : coupled_) {
      const std::uint32_t r = other_[static_cast<std::size_t>(i)];
      const double softness = proximal + rows[r].law.gamma / (scale_[r] * scale_[r]);
      held.add(rows[r].body1, rows[r].body2, rows[r].direction, scale_[r], softness);
    }
    if (!held.factorise()) {
      factors->rows.clear();
      return false;
    }
  }
  for (std::size_t a = 0; a < coupled_.size(); ++a) {
    const std::uint32_t r = other_[static_cast<std::size_t>(coupled_[a])];
    rest_[a] -= rows[r].direction.along(put[rows[r].body1], put[rows[r].body2]) / scale_[r];
  }
  // factors of no rows may be those of others, which were dropped
  if (!coupled_.empty()) held.solve(&rest_);
  for (const double change : rest_)
    if (!std::isfinite(change)) return false;
  for (std::size_t o = 0; o < other_.size(); ++o)
    if (kinds_[o] == RowKind::kPut)
      lambda_[static_cast<Eigen::Index>(o)] += side_of_step_[static_cast<Eigen::Index>(o)];
  for (std::size_t a = 0; a < coupled_.size(); ++a) lambda_[coupled_[a]] += rest_[a];
  return true;
}

// Largest of what a row's value is summed from by way of the bodies' motions, m/s.
double ConeProblem::largest_sum(const SolverBodies& bodies) const {
  BodyMotion terms(bodies.count() + 1);
  for (const ConeRow& row : rows) {
    const double push = std::fabs(row.multiplier);
    const auto add = [&](std::uint32_t body, const Vector3& turn) {
      terms[body].linear += bodies[body].inverse_mass * push * row.direction.linear.cwiseAbs();
      terms[body].angular += push * turn.cwiseAbs();
    };
    add(row.body1, row.direction.turn1);
    add(row.body2, row.direction.turn2);
  }
  double sum = 0.0;
  for (const std::uint32_t r : other_) {
    const ConstraintDirection& d = rows[r].direction;
    const double term = d.linear.cwiseAbs().dot(terms[rows[r].body1].linear + terms[rows[r].body2].linear) +
                        d.angular1.cwiseAbs().dot(terms[rows[r].body1].angular) +
                        d.angular2.cwiseAbs().dot(terms[rows[r].body2].angular);
    sum = std::max(sum, (std::fabs(free_[r]) + term) * rows[r].length);
  }
  return sum;
}

}  // namespace gravitas
