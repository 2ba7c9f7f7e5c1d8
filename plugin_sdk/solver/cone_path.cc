#include "plugin_sdk/solver/cone_path.h"

#include <algorithm>
#include <cmath>

#include "plugin_sdk/math/dense_lu.h"

namespace gravitas {
namespace {

// Largest share of the way to a border that a step takes.
constexpr double kShare = 0.99;

double square(double a) { return a * a; }

}  // namespace

bool ConePath::Side::is_bounded() const { return std::isfinite(bound); }

double ConePath::Side::stiffness() const { return slack / push + (is_bounded() ? excess / (bound - push) : 0.0); }

double ConePath::Side::missing(double aim, double y) const {
  return sign * (target - y) + aim / push - (is_bounded() ? aim / (bound - push) : 0.0);
}

void ConePath::add_scalar(Eigen::Index row, double lower, double upper, double bound) {
  if (!(bound > 0.0)) {
    none_.push_back(row);
    return;
  }
  if (std::isfinite(lower)) sides_.push_back({.row = row, .sign = 1.0, .target = lower, .bound = bound});
  if (std::isfinite(upper)) sides_.push_back({.row = row, .sign = -1.0, .target = upper, .bound = bound});
}

void ConePath::add_disc(Eigen::Index row, int count, Eigen::Index normal, double factor) {
  if (factor > 0.0) {
    discs_.push_back({.row = row, .normal = normal, .count = count, .factor = factor});
  } else {
    for (int k = 0; k < count; ++k) none_.push_back(row + k);
  }
}

std::uint32_t ConePath::next(double smallest, Eigen::VectorXd* lambda, Eigen::VectorXd* y) {
  constexpr std::uint32_t kSteps = 60, kStuck = 5;
  constexpr double kLittle = 0.02, kEnd = 1e-10;
  enter(lambda, y);
  const double near = kEnd * load_ * speed_, end = discs_.empty() ? std::min(near, square(smallest)) : near;
  double last = 0.9;
  std::uint32_t steps = 0, stuck = 0;
  while (steps < kSteps && stuck < kStuck) {
    ++steps;
    const double product = mean_product(*lambda);
    if (!(product > end)) break;
    // far, when the last step could be whole
    const double aim = std::clamp(square(1.0 - last), 0.01, 0.9) * product;
    linearise(aim, *lambda, *y);
    const Eigen::VectorXd step = DenseLu(matrix_).solve(side_);
    if (!step.allFinite()) break;
    last = find_share(aim, *lambda, *y, step);
    stuck = last < kLittle ? stuck + 1 : 0;
    *lambda += last * step;
    for (Side& side : sides_) {
      side.push += last * side.push_step;
      side.slack += last * side.slack_step;
      side.excess += last * side.excess_step;
    }
    for (Disc& disc : discs_) disc.slip += last * disc.slip_step;
    *y = start_ + response_ * *lambda;
  }
  if (rounds_ > 0) shift_slips(*y);
  ++rounds_;
  return steps;
}

// The middle of all cones, at the size of what it takes to hold every row.
void ConePath::enter(Eigen::VectorXd* lambda, Eigen::VectorXd* y) {
  if (rounds_ == 0) {
    matrix_ = response_;
    matrix_.diagonal().array() += 1e-8;
    side_ = -start_;
    for (std::size_t i = sides_.size(); i-- > 0;) side_[sides_[i].row] = sides_[i].target - start_[sides_[i].row];
    speed_ = std::max(start_.cwiseAbs().maxCoeff(), side_.cwiseAbs().maxCoeff());
    load_ = std::max(speed_, DenseLu(matrix_).solve(side_).cwiseAbs().maxCoeff());
  }
  lambda->setZero();
  for (Side& side : sides_) {
    side.push = side.is_bounded() ? std::min(load_, 0.5 * side.bound) : load_;
    side.slack = speed_;
    side.excess = side.is_bounded() ? speed_ : 0.0;
    (*lambda)[side.row] += side.sign * side.push;
  }
  for (Disc& disc : discs_) disc.slip = speed_ / (square(disc.factor) * load_);
  *y = start_ + response_ * *lambda;
}

// Mean of what is to be g.
double ConePath::mean_product(const Eigen::VectorXd& lambda) const {
  double sum = 0.0;
  std::size_t count = sides_.size() + discs_.size();
  for (const Side& side : sides_) {
    sum += side.push * side.slack;
    if (!side.is_bounded()) continue;
    sum += (side.bound - side.push) * side.excess;
    ++count;
  }
  for (const Disc& disc : discs_) sum += disc.slip * disc.room(lambda);
  return sum / static_cast<double>(count);
}

// matrix d = side, d the change of lambda; slacks and slips are eliminated.
void ConePath::linearise(double aim, const Eigen::VectorXd& lambda, const Eigen::VectorXd& y) {
  matrix_ = response_;
  for (std::size_t i = 0; i < sides_.size();) {
    const Eigen::Index row = sides_[i].row;
    double compliance = 0.0, reach = 0.0;
    for (; i < sides_.size() && sides_[i].row == row; ++i) {
      const Side& side = sides_[i];
      const double stiffness = side.stiffness();
      compliance += 1.0 / stiffness;
      reach += side.sign * side.missing(aim, y[row]) / stiffness;
    }
    matrix_(row, row) += 1.0 / compliance;
    side_[row] = reach / compliance;
  }
  for (const Disc& disc : discs_) {
    const double room = disc.room(lambda), pull = 2.0 * disc.slip / room, l = lambda[disc.normal];
    const double square_factor = square(disc.factor);
    for (int a = 0; a < disc.count; ++a) {
      const Eigen::Index i = disc.row + a;
      for (int b = 0; b < disc.count; ++b) matrix_(i, disc.row + b) += pull * lambda[i] * lambda[disc.row + b];
      matrix_(i, i) += disc.slip;
      matrix_(i, disc.normal) -= pull * square_factor * l * lambda[i];
      side_[i] = -y[i] - lambda[i] * aim / room;
      // the convex problem's matrix is symmetric
      if (rounds_ > 0) matrix_(disc.normal, i) -= pull * square_factor * l * lambda[i];
    }
    if (rounds_ == 0) continue;
    matrix_(disc.normal, disc.normal) += square_factor * (pull * square_factor * l * l - disc.slip);
    side_[disc.normal] += square_factor * l * aim / room - disc.factor * disc.shift;
  }
  for (const Eigen::Index i : none_) {
    matrix_.row(i).setZero();
    matrix_(i, i) = 1.0;
    side_[i] = -lambda[i];
  }
}

double ConePath::find_share(double aim, const Eigen::VectorXd& lambda, const Eigen::VectorXd& y,
                            const Eigen::VectorXd& step) {
  double share = 1.0;
  const auto keep_positive = [&](double now, double change) {
    if (change < 0.0) share = std::min(share, -kShare * now / change);
  };
  for (std::size_t i = 0; i < sides_.size(); ++i) {
    Side& side = sides_[i];
    side.push_step = side.sign * step[side.row];
    if (i + 1 == sides_.size() || sides_[i + 1].row != side.row) continue;
    // of two, what the stiffer one gives way to is known to its digits
    Side& other = sides_[++i];
    const double change = response_.col(side.row).dot(step);
    Side &stiff = side.stiffness() > other.stiffness() ? side : other, &soft = &stiff == &side ? other : side;
    stiff.push_step = (stiff.missing(aim, y[side.row]) - stiff.sign * change) / stiff.stiffness();
    soft.push_step = stiff.push_step + soft.sign * step[side.row];
  }
  for (Side& side : sides_) {
    const double push = side.push, change = side.push_step;
    side.slack_step = (aim - side.slack * change) / push - side.slack;
    keep_positive(push, change);
    keep_positive(side.slack, side.slack_step);
    if (!side.is_bounded()) continue;
    const double left = side.bound - push;
    side.excess_step = (aim + side.excess * change) / left - side.excess;
    keep_positive(left, -change);
    keep_positive(side.excess, side.excess_step);
  }
  for (Disc& disc : discs_) {
    // room + 2 half t + curve t^2 after a share t of the step
    const double room = disc.room(lambda), square_factor = square(disc.factor), change = step[disc.normal];
    const double along = lambda.segment(disc.row, disc.count).dot(step.segment(disc.row, disc.count));
    const double half = square_factor * lambda[disc.normal] * change - along;
    const double curve = square_factor * square(change) - square(disc.length(step));
    disc.slip_step = (aim - 2.0 * disc.slip * half) / room - disc.slip;
    keep_positive(disc.slip, disc.slip_step);
    for (int tries = 0; tries < 200; ++tries) {
      if (room + share * (2.0 * half + share * curve) > (1.0 - kShare) * room) break;
      share *= 0.8;
    }
  }
  return share;
}

// The next sigma.
void ConePath::shift_slips(const Eigen::VectorXd& y) {
  double alike = 0.0;
  for (Disc& disc : discs_) {
    const double error = disc.length(y) - disc.shift;
    alike += error * disc.error;
    disc.error = error;
  }
  if (rounds_ > 1) relaxation_ = std::clamp((alike > 0.0 ? 2.0 : 0.5) * relaxation_, 0.125, 8.0);
  for (Disc& disc : discs_) disc.shift = std::max(0.0, disc.shift + relaxation_ * disc.error);
}

}  // namespace gravitas
