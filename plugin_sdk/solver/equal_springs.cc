#include "plugin_sdk/solver/equal_springs.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "plugin_sdk/dynamics.h"

namespace gravitas {
namespace {

double largest(const std::vector<double>& numbers) {
  double most = 0.0;
  for (const double number : numbers) most = std::max(most, std::fabs(number));
  return most;
}

}  // namespace

void EqualSprings::start(std::size_t bodies) {
  rows_.clear();
  freedom_.assign(bodies, kNone);
  freedoms_ = 0;
}

Matrix3 EqualSprings::turnable(double inverse_mass, const Matrix3& inverse_inertia) {
  constexpr double kFlat = 1e-12;  // of the cube of the mean moment
  const double mean = inverse_inertia.trace() / 3.0;
  if (!(mean > 0.0)) return Matrix3::Zero();
  const double radius = radius_of_gyration(inverse_mass, mean);
  if (inverse_inertia.determinant() > kFlat * mean * mean * mean) return Matrix3::Identity() / radius;
  return inverse_inertia / (mean * radius);
}

void EqualSprings::factorise() {
  std::vector<std::size_t> first(freedoms_);
  for (std::size_t i = 0; i < freedoms_; ++i) first[i] = i - i % 6;
  for (const Row& row : rows_) {
    if (row.one.freedom == kNone || row.two.freedom == kNone) continue;
    const auto [low, high] = std::minmax(row.one.freedom, row.two.freedom);
    for (std::size_t i = high; i < high + 6; ++i) first[i] = std::min(first[i], low);
  }
  factor_.start(first);
  const auto add_product = [&](double stiffness, const End& a, const End& b) {
    for (std::size_t i = 0; i < 6; ++i) {
      const double share = stiffness * a.direction[static_cast<Eigen::Index>(i)];
      double* entries = &factor_.entry(a.freedom + i, b.freedom);
      for (std::size_t j = 0; j < (a.freedom == b.freedom ? i + 1 : 6); ++j)
        entries[j] += share * b.direction[static_cast<Eigen::Index>(j)];
    }
  };
  for (const Row& row : rows_) {
    if (row.one.freedom != kNone) add_product(row.stiffness, row.one, row.one);
    if (row.two.freedom != kNone) add_product(row.stiffness, row.two, row.two);
    if (row.one.freedom == kNone || row.two.freedom == kNone || row.one.freedom == row.two.freedom) continue;
    const bool is_later = row.one.freedom > row.two.freedom;
    add_product(row.stiffness, is_later ? row.one : row.two, is_later ? row.two : row.one);
  }
  for (std::size_t body = 0; body < freedoms_; body += 6) {
    constexpr double kSoft = 1e-11;
    double stiffest = 0.0;
    for (std::size_t i = body; i < body + 6; ++i) stiffest = std::max(stiffest, factor_.entry(i, i));
    for (std::size_t i = body; i < body + 6; ++i) factor_.entry(i, i) += kSoft * stiffest;
  }
  factor_.factorise();
}

double EqualSprings::along(const Row& row, const std::vector<double>& motion) const {
  double sum = 0.0;
  for (const End* end : {&row.one, &row.two})
    if (end->freedom != kNone) sum += end->direction.dot(Vector6::Map(&motion[end->freedom]));
  return sum;
}

void EqualSprings::push(const Row& row, double amount, std::vector<double>* load) {
  for (const End* end : {&row.one, &row.two})
    if (end->freedom != kNone) Vector6::Map(&(*load)[end->freedom]) += amount * end->direction;
}

std::vector<double> EqualSprings::motion_under(std::vector<double>* load) const {
  constexpr int kMostRounds = 6;
  constexpr double kFalls = 0.5, kNothing = 1e-15;
  std::vector<double> motion(freedoms_, 0.0);
  const double asked = largest(*load);
  double before = std::numeric_limits<double>::infinity(), left = asked;
  for (int round = 0; round < kMostRounds && left < kFalls * before && left > kNothing * asked; ++round) {
    before = left;
    std::vector<double> change = *load;
    factor_.solve(&change);
    for (std::size_t i = 0; i < freedoms_; ++i) motion[i] += change[i];
    for (const Row& row : rows_) push(row, -row.stiffness * along(row, change), load);
    left = largest(*load);
  }
  return motion;
}

void EqualSprings::fit(std::vector<double>* t) const {
  std::vector<double> load(freedoms_, 0.0);
  for (std::size_t i = 0; i < rows_.size(); ++i) push(rows_[i], rows_[i].stiffness * (*t)[i], &load);
  const std::vector<double> motion = motion_under(&load);
  for (std::size_t i = 0; i < rows_.size(); ++i)
    if (rows_[i].stiffness > 0.0) (*t)[i] = along(rows_[i], motion);
}

bool EqualSprings::share(std::vector<double>* multipliers) const {
  constexpr double kSame = 1e-8;  // of what rows push
  std::vector<double> load(freedoms_, 0.0);
  double pushed = 0.0;
  for (std::size_t i = 0; i < rows_.size(); ++i) {
    if (!(rows_[i].stiffness > 0.0)) continue;
    push(rows_[i], (*multipliers)[i], &load);
    for (const End* end : {&rows_[i].one, &rows_[i].two})
      pushed = std::max(pushed, std::fabs((*multipliers)[i]) * end->direction.cwiseAbs().maxCoeff());
  }
  const std::vector<double> motion = motion_under(&load);
  if (!(largest(load) <= kSame * pushed)) return false;
  for (std::size_t i = 0; i < rows_.size(); ++i)
    if (rows_[i].stiffness > 0.0) (*multipliers)[i] = rows_[i].stiffness * along(rows_[i], motion);
  return true;
}

}  // namespace gravitas
