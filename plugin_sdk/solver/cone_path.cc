#include "plugin_sdk/solver/cone_path.h"

#include <algorithm>
#include <cmath>

#include "plugin_sdk/math/dense_lu.h"

namespace gravitas {
namespace {

// Largest share of the way to a border that a step takes.
constexpr double kShare = 0.99;

// max(0, t) with its corner rounded, and its slope.
struct Rounded {
  double value, slope;
  Rounded(double t, double width) {
    const double root = std::sqrt(0.25 * t * t + width * width);
    value = t > 0.0 ? 0.5 * t + root : width * width / (root - 0.5 * t);
    slope = 0.5 + 0.25 * t / root;
  }
};

double square(double a) { return a * a; }

}  // namespace

void ConePath::add_scalar(Eigen::Index row, double lower, double upper, double bound) {
  if (std::isinf(bound) && std::isinf(upper)) {
    add_normal(row, lower);
  } else {
    scalars_.push_back({row, lower, upper, bound});
  }
}

void ConePath::add_normal(Eigen::Index row, double target) { normals_.push_back({.row = row, .target = target}); }

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
  double last = 0.9, product = load_ * speed_;
  std::uint32_t steps = 0, stuck = 0;
  while (steps < kSteps && stuck < kStuck) {
    ++steps;
    product = normals_.empty() ? 0.01 * product : mean_product(*lambda);
    if (!(product > end)) break;
    // far, when the last step could be whole
    const double aim = std::clamp(square(1.0 - last), 0.01, 0.9) * product;
    linearise(aim, *lambda, *y);
    const Eigen::VectorXd step = DenseLu(matrix_).solve(side_);
    if (!step.allFinite()) break;
    last = find_share(aim, *lambda, step);
    stuck = last < kLittle ? stuck + 1 : 0;
    *lambda += last * step;
    for (Normal& normal : normals_) normal.slack += last * normal.slack_step;
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
    for (const Normal& normal : normals_) side_[normal.row] += normal.target;
    for (const Scalar& scalar : scalars_)
      side_[scalar.row] += std::isfinite(scalar.lower) ? scalar.lower : scalar.upper;
    speed_ = std::max(start_.cwiseAbs().maxCoeff(), side_.cwiseAbs().maxCoeff());
    load_ = std::max(speed_, DenseLu(matrix_).solve(side_).cwiseAbs().maxCoeff());
  }
  lambda->setZero();
  for (Normal& normal : normals_) (*lambda)[normal.row] = load_, normal.slack = speed_;
  for (Disc& disc : discs_) disc.slip = speed_ / (square(disc.factor) * load_);
  *y = start_ + response_ * *lambda;
}

// Mean of what is to be g.
double ConePath::mean_product(const Eigen::VectorXd& lambda) const {
  double sum = 0.0;
  for (const Normal& normal : normals_) sum += lambda[normal.row] * normal.slack;
  for (const Disc& disc : discs_) sum += disc.slip * disc.room(lambda);
  return sum / static_cast<double>(normals_.size() + discs_.size());
}

// matrix d = side, d the change of lambda; slacks and slips are eliminated.
void ConePath::linearise(double aim, const Eigen::VectorXd& lambda, const Eigen::VectorXd& y) {
  matrix_ = response_;
  for (const Normal& normal : normals_) {
    const double l = lambda[normal.row];
    matrix_(normal.row, normal.row) += normal.slack / l;
    side_[normal.row] = normal.target - y[normal.row] + aim / l;
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
  for (const Scalar& scalar : scalars_) linearise(scalar, std::sqrt(aim), lambda, y);
}

void ConePath::linearise(const Scalar& scalar, double width, const Eigen::VectorXd& lambda, const Eigen::VectorXd& y) {
  const Eigen::Index i = scalar.row;
  const double z = lambda[i] - y[i];
  double to = z + scalar.lower, slope = 1.0;
  if (scalar.lower != scalar.upper) {
    to = slope = 0.0;
    if (std::isfinite(scalar.lower)) {
      const Rounded up(z + scalar.lower, width);
      to += up.value, slope += up.slope;
    }
    if (std::isfinite(scalar.upper)) {
      const Rounded down(-z - scalar.upper, width);
      to -= down.value, slope += down.slope;
    }
  }
  if (std::isfinite(scalar.bound)) {
    const Rounded above(to - scalar.bound, width), below(-to - scalar.bound, width);
    to += below.value - above.value;
    slope *= std::max(0.0, 1.0 - above.slope - below.slope);
  }
  slope = std::min(slope, 1.0);
  matrix_.row(i) *= slope;
  matrix_(i, i) += 1.0 - slope;
  side_[i] = to - lambda[i];
}

double ConePath::find_share(double aim, const Eigen::VectorXd& lambda, const Eigen::VectorXd& step) {
  double share = 1.0;
  const auto keep_positive = [&](double now, double change) {
    if (change < 0.0) share = std::min(share, -kShare * now / change);
  };
  for (Normal& normal : normals_) {
    const double l = lambda[normal.row], change = step[normal.row];
    normal.slack_step = (aim - normal.slack * change) / l - normal.slack;
    keep_positive(l, change);
    keep_positive(normal.slack, normal.slack_step);
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
