// Rows, their elimination, and the order of the solution; the laws' steps are in cone_steps.cc.
#include "plugin_sdk/solver/cone_problem.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "plugin_sdk/plugin.h"

namespace gravitas {
namespace {

// True if a residual that shrinks at a rate is enough after so many times more.
bool will_do(double residual, double rate, double enough, std::uint32_t times) {
  if (!(rate < 1.0)) return false;
  for (; times > 0 && residual > enough; --times) residual *= rate;
  return residual <= enough;
}

}  // namespace

void ConeProblem::start(const Host* host) {
  host_ = host;
  for (HeldFactors& factors : held_factors_) factors.rows.clear();
}

void ConeProblem::mark_progress() const {
  if (host_ != nullptr) host_->mark_progress();
}

double ConeProblem::value(const BodyMotion& x, std::uint32_t r) const {
  const ConeRow& row = rows[r];
  return row.start + row.direction.along(x[row.body1], x[row.body2]);
}

void ConeProblem::push(const SolverBodies& bodies, BodyMotion* x) const {
  for (const ConeRow& row : rows) {
    if (row.multiplier == 0.0) continue;
    row.direction.push(row.multiplier, bodies[row.body1].inverse_mass, bodies[row.body2].inverse_mass, (*x)[row.body1],
                       (*x)[row.body2]);
  }
}

// Scales, free values, and who is held.
void ConeProblem::classify(const SolverBodies& bodies, const BodyMotion& x0) {
  scale_.assign(rows.size(), 0.0);
  free_.assign(rows.size(), 0.0);
  held_.clear(), other_.clear(), blocks_.clear();
  motion_ = 0.0;
  const auto response = [&](std::uint32_t r) {
    const ConeRow& row = rows[r];
    const double own =
        row.body1 == row.body2
            ? coupling(row, row, bodies)
            : row.direction.product(row.direction, bodies[row.body1].inverse_mass + bodies[row.body2].inverse_mass);
    const double all = own + row.law.gamma;
    return all > 0.0 && std::isfinite(all) && std::isfinite(1.0 / all) ? all : 0.0;
  };
  speeds_.clear();
  for (const Twist& x : x0) speeds_.emplace_back(x.linear.norm(), x.angular.norm());
  for (std::uint32_t r = 0; r < rows.size(); ++r) {
    const ConeRow& row = rows[r];
    free_[r] = value(x0, r);
    const auto& [speed1, spin1] = speeds_[row.body1];
    const auto& [speed2, spin2] = speeds_[row.body2];
    double size = std::fabs(row.start) + row.direction.linear.norm() * (speed1 + speed2);
    if (spin1 != 0.0) size += row.direction.angular1.norm() * spin1;
    if (spin2 != 0.0) size += row.direction.angular2.norm() * spin2;
    motion_ = std::max(motion_, size * row.length);
  }
  if (!std::isfinite(motion_)) throw Refusal("velocities, errors or arms so large that their products are not finite");

  const std::uint32_t scalars = contacts.empty() ? static_cast<std::uint32_t>(rows.size()) : contacts.front().first;
  for (std::uint32_t r = 0; r < scalars; ++r) {
    const JointLaw& law = rows[r].law;
    scale_[r] = std::sqrt(response(r));
    if (scale_[r] == 0.0 || !law.is_active()) {
      rows[r].multiplier = 0.0;
      continue;
    }
    if (law.is_equality() && law.bound == std::numeric_limits<double>::infinity()) {
      held_.push_back(r);
      continue;
    }
    blocks_.push_back({.first = static_cast<std::uint32_t>(other_.size()), .law = scaled_law(r)});
    other_.push_back(r);
  }
  for (std::size_t c = 0; c < contacts.size(); ++c) {
    const ConeContact& contact = contacts[c];
    const std::uint32_t slip = contact.has_friction ? 3 : 1;
    const double normal = response(contact.first);
    double largest = normal, turning = 0.0;
    for (std::uint32_t k = 1; k < slip; ++k) largest = std::max(largest, response(contact.first + k));
    for (std::uint32_t k = slip; k < contact.count(); ++k) turning = std::max(turning, response(contact.first + k));
    const bool is_pushed = normal > 0.0 && (!contact.has_turning || turning > 0.0);
    const double root = std::sqrt(largest), root_of_turning = std::sqrt(turning);
    for (std::uint32_t k = 0; k < contact.count(); ++k) {
      const std::uint32_t r = contact.first + k;
      if (!is_pushed) rows[r].multiplier = 0.0;
      scale_[r] = is_pushed ? (k < slip ? root : root_of_turning) : 0.0;
    }
    if (!is_pushed) continue;
    blocks_.push_back({.first = static_cast<std::uint32_t>(other_.size()),
                       .contact = static_cast<std::int32_t>(c),
                       .count = contact.count(),
                       .target = contact.target / root});
    for (std::uint32_t k = 0; k < contact.count(); ++k) other_.push_back(contact.first + k);
  }
}

// What the other rows feel of each other while the held ones hold.
void ConeProblem::reduce(const SolverBodies& bodies) {
  const auto count = static_cast<Eigen::Index>(other_.size());
  const auto held = static_cast<Eigen::Index>(held_.size());
  clear_lists(other_.size(), &to_held_);
  carried_.resize(held, count);
  start_others_.resize(count);
  std::vector<double> holding = side_;
  factor_.solve(&holding);
  std::vector<double> column(held_.size());
  for (std::size_t o = 0; o < other_.size(); ++o) {
    const ConeRow& row = rows[other_[o]];
    std::fill(column.begin(), column.end(), 0.0);
    for (const std::uint32_t body : {row.body1, row.body2}) {
      for (const std::uint32_t i : held_of_body_[body]) {
        if (column[i] != 0.0) continue;  // reached through the other body
        column[i] = coupling(rows[held_[i]], rows[other_[o]], bodies) / (scale_[held_[i]] * scale_[other_[o]]);
        if (column[i] != 0.0) to_held_[o].emplace_back(i, column[i]);
      }
    }
    double start = free_[other_[o]] / scale_[other_[o]];
    for (const auto& [i, entry] : to_held_[o]) start += entry * holding[i];
    start_others_[static_cast<Eigen::Index>(o)] = start;
    if (held > 0) {
      factor_.solve(&column);
      for (Eigen::Index i = 0; i < held; ++i)
        carried_(i, static_cast<Eigen::Index>(o)) = column[static_cast<std::size_t>(i)];
    }
  }
  // only rows of one body meet, unless held rows carry from one to the other
  factored_.clear();
  response_.setZero(count, count);
  clear_lists(bodies.count() + 1, &others_of_body_);
  for (std::uint32_t a = 0; a < other_.size(); ++a) {
    const std::uint32_t r = other_[a];
    for (const std::uint32_t body : {rows[r].body1, rows[r].body2}) {
      if (!bodies[body].is_pushed()) continue;
      std::vector<std::uint32_t>& list = others_of_body_[body];
      if (list.empty() || list.back() != a) list.push_back(a);
      for (const std::uint32_t b : list)
        response_(a, b) = coupling(rows[r], rows[other_[b]], bodies) / (scale_[r] * scale_[other_[b]]);
    }
    response_(a, a) = (coupling(rows[r], rows[r], bodies) + rows[r].law.gamma) / (scale_[r] * scale_[r]);
  }
  for (Eigen::Index a = 0; a < count; ++a) {
    for (Eigen::Index b = 0; b <= a; ++b) {
      for (const auto& [i, share] : to_held_[static_cast<std::size_t>(a)]) response_(a, b) -= share * carried_(i, b);
      response_(b, a) = response_(a, b);
    }
  }
}

bool ConeProblem::is_solved_by_nothing(double smallest) const {
  double worst = 0.0;
  for (const std::uint32_t r : held_)
    worst = std::max(worst, std::fabs(rows[r].law.lower_target - free_[r]) * rows[r].length);
  const auto count = static_cast<Eigen::Index>(other_.size());
  Eigen::VectorXd y(count);
  for (Eigen::Index o = 0; o < count; ++o) {
    const std::uint32_t r = other_[static_cast<std::size_t>(o)];
    y[o] = free_[r] / scale_[r];
  }
  if (count > 0) worst = std::max(worst, residual_of(Eigen::VectorXd::Zero(count), y));
  return worst <= std::max(smallest, kEpsilon * motion_);
}

// The response that a contact or a limit keeps at least, of its way, 1/kg: a share of what moving all bodies together gives it.
double ConeProblem::least_response(const SolverBodies& bodies) const {
  constexpr double kOfWhole = 1e-5;
  double mass = 0.0;
  for (std::uint32_t i = 0; i < bodies.count(); ++i)
    if (bodies[i].inverse_mass > 0.0) mass += 1.0 / bodies[i].inverse_mass;
  return mass > 0.0 ? kOfWhole / mass : 0.0;
}

// Is a row missed that what holds always leaves next to no motion?
bool ConeProblem::is_out_of_reach(double least, double tolerance) const {
  return std::ranges::any_of(blocks_, [&](const Block& block) {
    const auto i = static_cast<Eigen::Index>(block.first);
    const std::uint32_t r = other_[block.first];
    if (response_(i, i) * way_of(r) * way_of(r) > least) return false;
    const double lower = block.contact < 0 ? block.law.lower_target : block.target;
    const bool has_lower = block.contact >= 0 || block.law.has_lower;
    const double below = has_lower ? lower - start_others_[i] : 0.0;
    const double above = block.contact < 0 && block.law.has_upper ? start_others_[i] - block.law.upper_target : 0.0;
    return std::max(below, above) * way_of(r) > tolerance;
  });
}

// A contact that moves with nothing but what joints hold (a wheel that touches its own chassis) depends on their rows, but
// not quite, as these are taken where the step ends: it would ask for motions without end. It gets the compliance that keeps
// its response.
void ConeProblem::give_way(double least) {
  for (const Block& block : blocks_) {
    const bool is_one_sided = block.contact >= 0 || block.law.has_lower != block.law.has_upper;
    if (!is_one_sided) continue;
    const auto i = static_cast<Eigen::Index>(block.first);
    const std::uint32_t r = other_[block.first];
    const double missing = std::max(least / (way_of(r) * way_of(r)) - response_(i, i), rows[r].softness);
    if (!(missing > 0.0)) continue;
    response_(i, i) += missing;
    rows[r].law.gamma += missing * scale_[r] * scale_[r];
  }
}

// y of the other rows.
void ConeProblem::find_values(const BodyMotion& x, Eigen::VectorXd* y) const {
  for (std::size_t o = 0; o < other_.size(); ++o) {
    const std::uint32_t r = other_[o];
    (*y)[static_cast<Eigen::Index>(o)] = (value(x, r) + rows[r].law.gamma * rows[r].multiplier) / scale_[r];
  }
}

// The largest of what meets in a row, and is asked of one; m/s, m. What a spring asks for, its error over the step, is without
// end the shorter the step: of that what reaches the bodies counts, where these are told.
double ConeProblem::size(const SolverBodies* bodies) const {
  double size = motion_;
  for (const std::uint32_t r : held_) {
    const JointLaw& law = rows[r].law;
    const bool is_shared = bodies != nullptr && law.gamma > 0.0;
    const double share = is_shared ? law.share_of_bodies(coupling(rows[r], rows[r], *bodies)) : 1.0;
    size = std::max(size, share * std::fabs(law.lower_target) * rows[r].length);
  }
  return size;
}

ConeSummary ConeProblem::solve(const SolverBodies& bodies, const BodyMotion& x0, double smallest,
                               const ConeSettings& settings) {
  ConeSummary summary;
  classify(bodies, x0);
  if (is_solved_by_nothing(smallest)) {
    for (ConeRow& row : rows) row.multiplier = 0.0;
    return summary;
  }
  order_held(bodies);
  factorise(bodies);
  summary.contradiction = make_consistent(bodies, smallest);
  const double tolerance = std::max(smallest, settings.tolerance * size(&bodies));
  lambda_.resize(static_cast<Eigen::Index>(other_.size()));
  for (std::size_t o = 0; o < other_.size(); ++o)
    lambda_[static_cast<Eigen::Index>(o)] = rows[other_[o]].multiplier * scale_[other_[o]];
  into_cones(&lambda_);

  if (is_solved_near_guess(bodies, x0, tolerance, settings, &summary)) return summary;
  if (other_.size() > kDenseRows) {
    solve_large(bodies, x0, settings, tolerance, &summary);
  } else if (!other_.empty()) {
    reduce(bodies);
    const double least = held_.empty() ? 0.0 : least_response(bodies);
    if (settings.gives_up && is_out_of_reach(least, tolerance)) {
      summary.has_converged = false;
      summary.residual = std::numeric_limits<double>::infinity();
      return summary;
    }
    give_way(least);
    solve_dense(settings, tolerance, &summary);
  }
  set_multipliers();
  if (held_.empty()) return summary;
  summary.iterations += 1;
  if (other_.empty()) {
    factor_.solve(&side_);
    for (std::size_t i = 0; i < held_.size(); ++i) rows[held_[i]].multiplier = side_[i] / scale_[held_[i]];
  } else {
    for (const std::uint32_t r : held_) rows[r].multiplier = 0.0;
    refine_held(bodies, x0);
  }
  if (settings.is_rough) return summary;
  refine(bodies, x0, smallest, settings, &summary);
  share_out(bodies);
  return summary;
}

void ConeProblem::solve_dense(const ConeSettings& settings, double tolerance, ConeSummary* summary) {
  // Newton steps without a residual half as large before the next guess
  constexpr int kPatience = 7;
  // much holds the multipliers of rows that depend on each other where they are (1e-6: directions of friction, too, which a
  // slip that ends needs to 1e-9), little lets those that nearly do settle
  const auto proximal_after = [&](int without) { return without < 2 ? settings.proximal : without < 5 ? 1e-8 : 1e-10; };
  // Guesses that find nothing better show how far rounding lets it come: this many are enough where so many times what
  // counts as rounding are left, and so many are rounding.
  constexpr int kIdleGuesses = 3;
  constexpr double kNearly = 1e4, kRounded = 8.0;
  // sweeps of kGaussSeidel before it is asked if they will do: what some steps of Newton's cost
  constexpr std::uint32_t kLeastTrial = 64;
  // with more rows the least forces are not looked for after Newton's steps: in heaps other rows hold there nearly always
  constexpr Eigen::Index kSettledRows = 96;
  // sweeps in place of a guess, by rows; what they count as, in steps; and how often the best of them is looked for
  constexpr Eigen::Index kSweepsOfRow = 5, kLooks = 8;
  constexpr std::uint32_t kStepsOfSweeps = 12;
  constexpr double kGrowth = 100.0;        // the best is kept
  constexpr std::size_t kTriedRows = 192;  // more are swept before the first step
  constexpr std::uint32_t kMostTries = 8, kTrySweeps = 32;
  const std::uint32_t trial = std::max(kLeastTrial, static_cast<std::uint32_t>(other_.size()));
  // where sweeps will not, steps take over; of large problems down to a fifth, so that what has no end takes a second or two
  constexpr double kRowsOfAll = 368.0, kLeastShare = 0.2;
  // With friction of many rows sweeps come nearer than guesses, in less time: they come first, then in turn; of more than
  // kRowsOfAll alone.
  constexpr double kGuessedRows = 96.0;
  const bool any_friction =
      std::ranges::any_of(contacts, [](const ConeContact& c) { return c.has_friction || c.has_turning; });
  const auto rubbing = static_cast<double>(any_friction ? other_.size() : 0);
  const bool only_sweeps = rubbing > kRowsOfAll;
  const auto are_swept = [&](std::uint32_t guess) {
    return only_sweeps || (rubbing > kGuessedRows ? guess % 2 == 0 : guess % 3 == 2);
  };
  const double fewer = kRowsOfAll / static_cast<double>(lambda_.size());
  const double share = std::clamp(fewer * fewer * fewer, kLeastShare, 1.0);
  const auto affordable = [&](std::uint32_t steps) { return static_cast<std::uint32_t>(std::ceil(share * steps)); };
  bool is_newton = settings.method == ConeMethod::kNewton;
  std::uint32_t most_steps = is_newton ? affordable(settings.iterations) : settings.iterations;
  double most = 0.0;
  for (const std::uint32_t r : other_) most = std::max(most, way_of(r));
  own_.clear();
  for (;;) {
    Eigen::VectorXd lambda = lambda_, y = start_others_ + response_ * lambda;
    double best = residual_of(lambda, y);
    // a guess that is worse than none, as the impulses of a step a million times as long are
    if (residual_of(Eigen::VectorXd::Zero(lambda.size()), start_others_) < 0.1 * best)
      lambda.setZero(), y = start_others_, best = residual_of(lambda, y);
    Eigen::VectorXd best_lambda = lambda, best_y = y;
    const auto keep_better = [&] {
      const double residual = residual_of(lambda, y);
      if (residual < best) best = residual, best_lambda = lambda, best_y = y;
      return residual;
    };
    ConePath guesses = path();
    Eigen::VectorXd start = lambda;
    Sweeps swept{kGrowth};  // from the first guess on
    swept.start(lambda, y);
    int without = 0;
    bool holds = true;  // of kGaussSeidel: nothing has slid yet
    double attempt = best;
    std::uint32_t done = 0, guess = 0, sweeps = 0;
    double found = std::numeric_limits<double>::infinity();  // since when guesses have not halved it
    int idle = 0;
    double swept_to = best;
    const auto start_newton = [&] {
      is_newton = true;
      lambda = start = best_lambda, y = best_y;
      attempt = best;
      summary->iterations += done;
      most_steps = affordable(ConeSettings{}.iterations);
      done = 0, without = 0;
    };
    // what touches without a push is held, too, at first: a stack that is let go is found in a step, not in one for each body
    const auto takes_step = [&] {
      const bool may_hold = is_newton ? done == 0 : holds && without < kPatience;
      if (may_hold && newton_step(proximal_after(without), &lambda, &y, tolerance)) return true;
      return is_newton && without < kPatience && newton_step(proximal_after(without), &lambda, &y);
    };
    // what rounding leaves of sums of large terms is no violation
    double enough = std::max(tolerance, kSumRounding * largest_sum(lambda));
    // what hardly pushes each other is done in fewer sweeps than a step costs
    for (std::uint32_t tries = other_.size() > kTriedRows ? kMostTries : 0; tries > 0 && best > enough; --tries) {
      const double from = best;
      for (std::uint32_t i = 0; i < kTrySweeps; ++i) sweep(&swept);
      summary->iterations += kTrySweeps;
      lambda = swept.lambda, y = start_others_ + response_ * lambda;
      keep_better();
      if (!will_do(best, best / from, enough, tries)) break;
    }
    // steps settle sooner from the guess than from what sweeps have not finished
    if (best > enough && lambda != start) lambda = start, y = start_others_ + response_ * lambda;
    while (best > enough && (!is_newton || (done < most_steps && (without < kPatience || guesses.has_next())))) {
      const double before = best;
      if (!is_newton && done >= most_steps) start_newton();
      if (takes_step()) {
        ++done, ++without;
      } else if (!is_newton) {
        if (holds) {
          swept.start(best_lambda, best_y);
          holds = false, swept_to = best;
        }
        ++done, ++sweeps;
        sweep(&swept);
        lambda = swept.lambda, y = swept.y;
      } else {
        if (best < 0.5 * found) {
          found = best, idle = 0;
        } else if (++idle >= kIdleGuesses && (only_sweeps || best <= kNearly * enough)) {
          break;
        }
        const bool sweeps_on = are_swept(guess++);
        mark_progress();
        if (!sweeps_on || rubbing <= kGuessedRows) {
          lambda = start, y = start_others_ + response_ * lambda;
          done += descend(enough, &lambda, &y);
          if (keep_better() <= enough) break;
        }
        if (!sweeps_on) {
          done += guesses.next(enough / most, &lambda, &y);
        } else {
          done += kStepsOfSweeps;
          for (Eigen::Index i = 0; i < kSweepsOfRow * swept.lambda.size() && best > enough; ++i) {
            sweep(&swept);
            if (i % kLooks == 0) lambda = swept.lambda, y = swept.y, keep_better();
          }
          lambda = best_lambda, y = start_others_ + response_ * best_lambda;
        }
        without = 0;
        attempt = std::numeric_limits<double>::infinity();
      }
      const double residual = keep_better();
      if (residual < 0.5 * attempt) without = 0;
      if (residual < attempt) attempt = residual, start = lambda;
      if (!is_newton && !holds && sweeps % trial == 0) {
        if (!will_do(best, best / swept_to, enough, (most_steps - done) / trial)) start_newton();
        swept_to = best;
      }
      if (best < before) enough = std::max(tolerance, kSumRounding * largest_sum(best_lambda));
    }
    const double reached = (idle >= kIdleGuesses ? kRounded : 1.0) * enough;
    const bool has_new = best <= reached && done > 0;
    bool ends_with_step = is_newton || sweeps == 0;
    if (has_new && blocks_.size() > 1 && (sweeps > 0 || (lambda.size() <= kSettledRows && slides()))) {
      lambda = best_lambda, y = best_y;
      if (settle(reached, sweeps > 0, &lambda, &y)) {
        best_lambda = lambda, best_y = y, best = residual_of(lambda, y), ends_with_step = true;
      } else {
        lambda = best_lambda, y = best_y;
      }
    }
    // one step more costs little and ends at rounding
    if (has_new && ends_with_step && newton_step(proximal_after(without), &lambda, &y)) keep_better();
    summary->iterations += done;
    summary->residual = best;
    summary->has_converged = best <= reached;
    lambda_ = best_lambda;
    if (let_slide(best_lambda, best_y, kSlip * std::max(best, tolerance))) continue;
    into_cones(&lambda_);
    return;
  }
}

// Largest of what a row's value is summed from, m/s.
double ConeProblem::largest_sum(const Eigen::VectorXd& lambda) const {
  double most = 0.0;
  for (Eigen::Index i = 0; i < lambda.size(); ++i) {
    const std::uint32_t r = other_[static_cast<std::size_t>(i)];
    const double sum = std::fabs(start_others_[i]) + response_.col(i).cwiseAbs().dot(lambda.cwiseAbs());
    most = std::max(most, sum * way_of(r));
  }
  return most;
}

// Held rows and the others in turn.
void ConeProblem::solve_large(const SolverBodies& bodies, const BodyMotion& x0, const ConeSettings& settings,
                              double tolerance, ConeSummary* summary) {
  own_.clear();
  for (const Block& block : blocks_) {
    Eigen::MatrixXd own(block.count, block.count);
    for (std::uint32_t i = 0; i < block.count; ++i) {
      for (std::uint32_t j = 0; j < block.count; ++j) {
        const std::uint32_t r = other_[block.first + i], s = other_[block.first + j];
        const double gamma = i == j ? rows[r].law.gamma : 0.0;
        own(i, j) = (coupling(rows[r], rows[s], bodies) + gamma) / (scale_[r] * scale_[s]);
      }
    }
    own_.emplace_back(own);
  }
  set_multipliers();
  Eigen::VectorXd y(lambda_.size()), best = lambda_;
  BodyMotion x;
  constexpr double kGrowth = 10.0;
  Sweeps swept{kGrowth};
  summary->has_converged = false;
  summary->residual = std::numeric_limits<double>::infinity();
  const std::uint32_t sweeps = 10 * settings.iterations;
  constexpr std::uint32_t kMarks = 64;
  constexpr std::uint32_t kIdleSweeps = 1000;  // that have not halved the residual
  double halved = std::numeric_limits<double>::infinity();
  std::uint32_t last_halved = 0;
  for (std::uint32_t done = 0; done < sweeps; ++done) {
    if (summary->iterations++ % kMarks == 0) mark_progress();
    if (!held_.empty()) refine_held(bodies, x0);
    x = x0;
    push(bodies, &x);
    find_values(x, &y);
    const double residual = residual_of(lambda_, y);
    if (residual < 0.5 * halved) halved = residual, last_halved = done;
    if (residual < summary->residual) summary->residual = residual, best = lambda_;
    summary->has_converged = residual <= tolerance;
    const bool ends = summary->has_converged || done - last_halved == kIdleSweeps;
    if ((ends || done == sweeps / 2) && let_slide(lambda_, y, kSlip * std::max(residual, tolerance))) {
      summary->residual = halved = std::numeric_limits<double>::infinity();
      swept.acceleration.forget();
      continue;
    }
    if (ends) break;
    swept.lambda = lambda_;
    if (done > 0) swept.acceleration.note(swept, residual);
    swept.acceleration.go_ahead(&swept);
    if (swept.lambda != lambda_) {
      lambda_ = swept.lambda;
      set_multipliers();
      if (!held_.empty()) refine_held(bodies, x0);
      x = x0;
      push(bodies, &x);
    }
    for (std::size_t b = 0; b < blocks_.size(); ++b) {
      const Block& block = blocks_[b];
      double at[6];
      for (std::uint32_t k = 0; k < block.count; ++k) {
        const std::uint32_t r = other_[block.first + k];
        at[k] = (value(x, r) + rows[r].law.gamma * rows[r].multiplier) / scale_[r];
      }
      relax(block, own_[b], &lambda_[block.first], at);
      for (std::uint32_t k = 0; k < block.count; ++k) {
        ConeRow& row = rows[other_[block.first + k]];
        const double now = lambda_[block.first + k] / scale_[other_[block.first + k]];
        row.direction.push(now - row.multiplier, bodies[row.body1].inverse_mass, bodies[row.body2].inverse_mass,
                           x[row.body1], x[row.body2]);
        row.multiplier = now;
      }
    }
  }
  lambda_ = best;
  into_cones(&lambda_);
}

}  // namespace gravitas
