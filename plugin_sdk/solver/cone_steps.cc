// The laws of ConeProblem: projections, and the linear equations of a Newton step.
#include <algorithm>
#include <cmath>
#include <limits>

#include "plugin_sdk/solver/cone_problem.h"

namespace gravitas {
namespace {

using Vector2 = Eigen::Vector2d;

double length_of(double a, double b) { return std::sqrt(a * a + b * b); }

}  // namespace

void ConeProblem::into_disc(double radius, double* v) {
  const double length = length_of(v[0], v[1]);
  if (length <= radius) return;
  const double share = length > 0.0 ? radius / length : 0.0;
  v[0] *= share, v[1] *= share;
}

JointLaw ConeProblem::scaled_law(std::uint32_t row) const {
  JointLaw law = rows[row].law;
  law.lower_target /= scale_[row], law.upper_target /= scale_[row], law.bound *= scale_[row];
  return law;
}

ConeProblem::Bounds ConeProblem::bounds_of(const Block& block) const {
  const ConeContact& contact = contacts[static_cast<std::size_t>(block.contact)];
  Bounds bounds;
  if (contact.has_friction) bounds.friction = contact.slides ? contact.dynamic_friction : contact.static_friction;
  if (contact.has_turning) {
    bounds.turning = contact.has_friction ? 3 : 1;
    const std::uint32_t r = other_[block.first];
    const double lever = scale_[r + bounds.turning] / scale_[r];
    bounds.spinning = contact.spinning_friction * lever, bounds.rolling = contact.rolling_friction * lever;
  }
  return bounds;
}

// Into what a contact's law allows at all: pushing, within the cones of that push.
void ConeProblem::confine(const Block& block, double* multipliers) const {
  const Bounds bounds = bounds_of(block);
  const double pressed = multipliers[0] = std::max(0.0, multipliers[0]);
  if (bounds.turning != 1 && block.count > 1) into_disc(bounds.friction * pressed, multipliers + 1);
  if (bounds.turning > 0) confine_turning(bounds, pressed, multipliers + bounds.turning);
}

void ConeProblem::confine_turning(const Bounds& bounds, double pressed, double* multipliers) {
  multipliers[0] = std::clamp(multipliers[0], -bounds.spinning * pressed, bounds.spinning * pressed);
  into_disc(bounds.rolling * pressed, multipliers + 1);
}

void ConeProblem::project(const Block& block, const double* lambda, const double* y, double* projected) const {
  if (block.contact < 0) {
    projected[0] = relaxed_multiplier(block.law, lambda[0], y[0], 1.0);
    return;
  }
  for (std::uint32_t k = 0; k < block.count; ++k) projected[k] = lambda[k] - y[k];
  projected[0] += block.target;
  confine(block, projected);
}

double ConeProblem::residual_of(const Eigen::VectorXd& lambda, const Eigen::VectorXd& y) const {
  double worst = 0.0;
  for (const Block& block : blocks_) {
    double projected[6];
    project(block, &lambda[block.first], &y[block.first], projected);
    for (std::uint32_t k = 0; k < block.count; ++k) {
      const std::uint32_t r = other_[block.first + k];
      const double missed = std::fabs(lambda[block.first + k] - projected[k]) * way_of(r);
      if (!std::isfinite(missed)) return std::numeric_limits<double>::infinity();
      worst = std::max(worst, missed);
    }
  }
  return worst;
}

// Equations of a step, d the change of lambda: a row that its law holds as y + W' d = target, any other as where its law
// puts it, alone or (in sliding_, and then true is returned) together with others. Rows of a contact that miss being held by
// no more than `corner` (m/s, m) are; with a corner sliding_ is not made. Multipliers that hold are `drawn` towards nought.
bool ConeProblem::linearise(const Eigen::VectorXd& lambda, const Eigen::VectorXd& y, double corner, double drawn) {
  const Eigen::Index count = lambda.size();
  const bool may_slide = corner == 0.0;
  bool any_slides = false;
  kinds_.resize(other_.size());
  side_of_step_.resize(count);
  const auto note = [&](Eigen::Index i, RowKind kind, double side) {
    kinds_[static_cast<std::size_t>(i)] = kind;
    side_of_step_[i] = side;
  };
  const auto hold = [&](Eigen::Index i, double missing) { note(i, RowKind::kHeld, missing - drawn * lambda[i]); };
  const auto put = [&](Eigen::Index i, double place) { note(i, RowKind::kPut, place - lambda[i]); };
  const auto start_sliding = [&](Eigen::Index i, double side) {
    if (!any_slides && may_slide) sliding_.resize(count, count);
    any_slides = true;
    note(i, RowKind::kSliding, side);
    return may_slide;
  };
  // two rows that slide along z against a radius mu lambda_N:
  //   (1 - K) d + K W' d - mu dir d_N = mu lambda_N dir - lambda,  K = radius/|z| (1 - dir dir^T)
  const auto slide = [&](Eigen::Index i, Eigen::Index normal, double mu, double radius) {
    const Vector2 z(lambda[i] - y[i], lambda[i + 1] - y[i + 1]);
    const double length = z.norm();
    const Vector2 direction = z / length;
    const double share = std::min(1.0, radius / length);
    const Eigen::Matrix2d across = share * (Eigen::Matrix2d::Identity() - direction * direction.transpose());
    for (int a = 0; a < 2; ++a) {
      if (!start_sliding(i + a, mu * lambda[normal] * direction[a] - lambda[i + a])) continue;
      sliding_.row(i + a) = across(a, 0) * response_.row(i) + across(a, 1) * response_.row(i + 1);
      for (int b = 0; b < 2; ++b) sliding_(i + a, i + b) += (a == b ? 1.0 : 0.0) - across(a, b) * (1.0 - proximal_);
      sliding_(i + a, normal) -= mu * direction[a];
    }
  };
  const auto disc = [&](Eigen::Index i, Eigen::Index normal, double mu, double normal_after) {
    const double radius = mu * normal_after, slack = corner / scale_[other_[static_cast<std::size_t>(i)]];
    if (length_of(lambda[i] - y[i], lambda[i + 1] - y[i + 1]) <= radius + slack) {
      for (int a = 0; a < 2; ++a) hold(i + a, -y[i + a]);
    } else {
      slide(i, normal, mu, radius);
    }
  };

  for (const Block& block : blocks_) {
    const auto i = static_cast<Eigen::Index>(block.first);
    double projected[6];
    project(block, &lambda[i], &y[i], projected);
    if (block.contact < 0) {
      const JointLaw& law = block.law;
      const double to_lower = law.lower_target - y[i], to_upper = law.upper_target - y[i];
      const double slack = corner / scale_[other_[block.first]];
      const bool is_within = std::fabs(projected[0]) < law.bound, is_at_corner = !may_slide && is_within;
      if (is_within && (projected[0] != 0.0 || law.is_equality())) {
        hold(i, projected[0] - lambda[i]);
      } else if (is_at_corner && law.has_lower && lambda[i] + to_lower > -slack) {
        hold(i, to_lower);
      } else if (is_at_corner && law.has_upper && lambda[i] + to_upper < slack) {
        hold(i, to_upper);
      } else {
        put(i, projected[0]);
      }
      continue;
    }
    const double pressed = projected[0], missing = block.target - y[i];
    if (!(pressed > 0.0) && !(lambda[i] + missing > -corner / scale_[other_[block.first]])) {
      for (std::uint32_t k = 0; k < block.count; ++k) put(i + k, 0.0);
      continue;
    }
    hold(i, pressed > 0.0 ? pressed - lambda[i] : missing);
    const Bounds bounds = bounds_of(block);
    if (bounds.turning != 1 && block.count > 1) disc(i + 1, i, bounds.friction, pressed);
    if (bounds.turning == 0) continue;
    const Eigen::Index k = i + bounds.turning;
    const double wanted = lambda[k] - y[k], slack = corner / scale_[other_[static_cast<std::size_t>(k)]];
    if (std::fabs(wanted) <= bounds.spinning * pressed + slack) {
      hold(k, -y[k]);
    } else {
      const double bound = std::copysign(bounds.spinning, wanted);
      if (start_sliding(k, bound * lambda[i] - lambda[k])) {
        sliding_.row(k).setZero();
        sliding_(k, k) = 1.0;
        sliding_(k, i) = -bound;
      }
    }
    disc(k + 1, i, bounds.rolling, pressed);
  }
  return any_slides;
}

// False, with nothing done, if the step is not finite. `proximal` is added to the diagonal of its matrix, which is 1.
bool ConeProblem::newton_step(double proximal, Eigen::VectorXd* lambda, Eigen::VectorXd* y, double corner,
                              double drawn) {
  proximal_ = proximal;
  const Eigen::Index count = lambda->size();
  const bool any_slides = linearise(*lambda, *y, corner, drawn);
  if (any_slides && corner > 0.0) return false;
  // what is put somewhere goes to the right
  coupled_.clear();
  step_.setZero(count);
  for (Eigen::Index i = 0; i < count; ++i) {
    if (kinds_[static_cast<std::size_t>(i)] == RowKind::kPut) {
      step_[i] = side_of_step_[i];
    } else {
      coupled_.push_back(i);
    }
  }
  const bool any_put = static_cast<Eigen::Index>(coupled_.size()) < count;
  rest_.resize(coupled_.size());
  for (std::size_t a = 0; a < coupled_.size(); ++a) {
    const Eigen::Index i = coupled_[a];
    rest_[a] = side_of_step_[i];
    if (any_put)
      rest_[a] -= kinds_[static_cast<std::size_t>(i)] == RowKind::kHeld ? response_.col(i).dot(step_)
                                                                        : sliding_.row(i).dot(step_);
  }
  if (any_slides) {
    solve_sliding();
  } else {
    solve_sticking();
  }
  if (!step_.allFinite()) return false;
  for (const double change : rest_)
    if (!std::isfinite(change)) return false;
  for (std::size_t a = 0; a < coupled_.size(); ++a) step_[coupled_[a]] = rest_[a];
  *lambda += step_;
  *y = start_others_ + response_ * *lambda;
  return true;
}

// True if the last linearisation had rows that slide.
bool ConeProblem::slides() const { return std::ranges::find(kinds_, RowKind::kSliding) != kinds_.end(); }

// Of the solutions around one, that whose multipliers are least: which one is found goes by the order of the rows and by the
// guess. False if it is there already or lost on the way, or, unless `may_differ`, if other rows hold or slide in it.
bool ConeProblem::settle(double enough, bool may_differ, Eigen::VectorXd* lambda, Eigen::VectorXd* y) {
  // what is drawn moves by 1e-8 where the rows determine it, and by the rounding of that where they do not; then it is held
  constexpr double kDrawn = 1e-8, kHeld = 1e-6, kEnds = 1e-8;
  constexpr int kRounds = 6, kBack = 4;
  const double size = lambda->cwiseAbs().maxCoeff();
  const auto differs = [&] { return !may_differ && kinds_ != kinds_before_; };
  for (int round = 0; round < kRounds; ++round) {
    const bool is_step = newton_step(kDrawn, lambda, y, 0.0, kDrawn);
    if (round == 0) kinds_before_ = kinds_;
    if (!is_step || differs()) return false;
    if (step_.cwiseAbs().maxCoeff() > kEnds * size) continue;
    if (round == 0) return false;
    break;
  }
  for (int round = 0; round < kBack && residual_of(*lambda, *y) > enough; ++round)
    if (!newton_step(kHeld, lambda, y)) return false;
  if (!(residual_of(*lambda, *y) <= enough)) return false;
  linearise(*lambda, *y);
  return !differs();
}

// Steps that are kept only where they shorten the residual; the diagonal grows where they do not.
std::uint32_t ConeProblem::descend(double enough, Eigen::VectorXd* lambda, Eigen::VectorXd* y) {
  constexpr std::uint32_t kSteps = 12;
  constexpr int kRejections = 3;
  double residual = residual_of(*lambda, *y), proximal = 1e-3;
  int rejected = 0;
  std::uint32_t steps = 0;
  while (steps < kSteps && rejected < kRejections && residual > enough) {
    Eigen::VectorXd next = *lambda, next_y = *y;
    if (!newton_step(proximal, &next, &next_y)) break;
    ++steps;
    const double after = residual_of(next, next_y);
    if (after < 0.9 * residual) {
      residual = after, *lambda = next, *y = next_y;
      proximal *= 0.1, rejected = 0;
    } else {
      proximal *= 10.0, ++rejected;
    }
  }
  return steps;
}

void ConeProblem::solve_sliding() {
  const auto size = static_cast<Eigen::Index>(coupled_.size());
  core_.resize(size, size);
  for (Eigen::Index a = 0; a < size; ++a) {
    const Eigen::Index i = coupled_[static_cast<std::size_t>(a)];
    const bool is_held = kinds_[static_cast<std::size_t>(i)] == RowKind::kHeld;
    for (Eigen::Index b = 0; b < size; ++b) {
      const Eigen::Index j = coupled_[static_cast<std::size_t>(b)];
      core_(a, b) = is_held ? response_(j, i) : sliding_(i, j);
    }
    if (is_held) core_(a, a) += proximal_;
  }
  Eigen::Map<Eigen::VectorXd> rest(rest_.data(), size);
  if (size == 0) return;
  lu_.factorise(core_);
  rest = lu_.solve(rest);
}

// Symmetric, and a contact's rows meet only those of its two bodies: a stack costs what a band costs.
void ConeProblem::solve_sticking() {
  if (coupled_.empty()) return;
  if (coupled_ != factored_ || proximal_ != factored_proximal_) {
    std::vector<std::size_t> first(coupled_.size());
    for (std::size_t a = 0; a < coupled_.size(); ++a)
      while (first[a] < a && response_(coupled_[first[a]], coupled_[a]) == 0.0) ++first[a];
    sticking_.start(first);
    for (std::size_t a = 0; a < coupled_.size(); ++a) {
      for (std::size_t b = first[a]; b <= a; ++b) sticking_.entry(a, b) = response_(coupled_[b], coupled_[a]);
      sticking_.entry(a, a) += proximal_;
    }
    sticking_.factorise();
    factored_ = coupled_;
    factored_proximal_ = proximal_;
  }
  sticking_.solve(&rest_);
}

// The laws as the path knows them.
ConePath ConeProblem::path() const {
  constexpr double kInfinity = std::numeric_limits<double>::infinity();
  ConePath path(response_, start_others_);
  for (const Block& block : blocks_) {
    const auto i = static_cast<Eigen::Index>(block.first);
    if (block.contact < 0) {
      const JointLaw& law = block.law;
      path.add_scalar(i, law.has_lower ? law.lower_target : -kInfinity, law.has_upper ? law.upper_target : kInfinity,
                      law.bound);
      continue;
    }
    path.add_scalar(i, block.target, kInfinity, kInfinity);
    const Bounds bounds = bounds_of(block);
    if (bounds.turning != 1 && block.count > 1) path.add_disc(i + 1, 2, i, bounds.friction);
    if (bounds.turning == 0) continue;
    path.add_disc(i + bounds.turning, 1, i, bounds.spinning);
    path.add_disc(i + bounds.turning + 1, 2, i, bounds.rolling);
  }
  return path;
}

bool ConeProblem::let_slide(const Eigen::VectorXd& lambda, const Eigen::VectorXd& y, double slip) {
  bool any = false;
  for (const Block& block : blocks_) {
    if (block.contact < 0 || !(lambda[block.first] > 0.0)) continue;
    ConeContact& contact = contacts[static_cast<std::size_t>(block.contact)];
    if (contact.slides || !(contact.dynamic_friction < contact.static_friction)) continue;
    if (length_of(y[block.first + 1], y[block.first + 2]) * scale_[other_[block.first]] <= slip) continue;
    contact.slides = any = true;
  }
  return any;
}

// Takes away what rounding left outside of the laws.
void ConeProblem::into_cones(Eigen::VectorXd* lambda) const {
  for (const Block& block : blocks_) {
    double* at = &(*lambda)[block.first];
    if (block.contact >= 0) {
      confine(block, at);
      continue;
    }
    const JointLaw& law = block.law;
    if (!law.has_lower) at[0] = std::min(at[0], 0.0);
    if (!law.has_upper) at[0] = std::max(at[0], 0.0);
    at[0] = std::clamp(at[0], -law.bound, law.bound);
  }
}

}  // namespace gravitas
