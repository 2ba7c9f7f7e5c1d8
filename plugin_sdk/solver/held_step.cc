#include "plugin_sdk/solver/held_step.h"

#include <algorithm>
#include <cmath>

namespace gravitas {
namespace {

using Block = Eigen::Matrix<double, 6, 6>;
using Numbers = Eigen::Matrix<double, 6, 1>;

// Lower C with C C^T = a, of a positive semidefinite matrix: what has no pivot adds nothing.
Matrix3 root_of(const Matrix3& a) {
  Matrix3 c = Matrix3::Zero();
  for (int j = 0; j < 3; ++j) {
    double pivot = a(j, j);
    for (int k = 0; k < j; ++k) pivot -= c(j, k) * c(j, k);
    if (!(pivot > 0.0)) continue;
    c(j, j) = std::sqrt(pivot);
    for (int i = j + 1; i < 3; ++i) {
      double entry = a(i, j);
      for (int k = 0; k < j; ++k) entry -= c(i, k) * c(j, k);
      c(i, j) = entry / c(j, j);
    }
  }
  return c;
}

// Lower L with L L^T = a, in the place of a. False without a pivot.
bool factorise_block(Block* a) {
  for (int j = 0; j < 6; ++j) {
    for (int k = 0; k < j; ++k) a->col(j).tail(6 - j) -= (*a)(j, k) * a->col(k).tail(6 - j);
    const double pivot = (*a)(j, j);
    if (!(pivot > 0.0) || !std::isfinite(pivot)) return false;
    a->col(j).tail(6 - j) /= std::sqrt(pivot);
  }
  return true;
}

// x with x L^T = b, in the place of b.
void divide_by_transposed(const Block& l, Block* b) {
  for (int j = 0; j < 6; ++j) {
    for (int k = 0; k < j; ++k) b->col(j) -= l(j, k) * b->col(k);
    b->col(j) /= l(j, j);
  }
}

// block += a b^T
void add_product(const Numbers& a, const Numbers& b, Block* block) {
  for (int j = 0; j < 6; ++j) block->col(j) += b[j] * a;
}

void solve_lower(const Block& l, Numbers* x) {
  for (int j = 0; j < 6; ++j) {
    (*x)[j] /= l(j, j);
    for (int i = j + 1; i < 6; ++i) (*x)[i] -= l(i, j) * (*x)[j];
  }
}

void solve_lower_transposed(const Block& l, Numbers* x) {
  for (int j = 5; j >= 0; --j) {
    for (int i = j + 1; i < 6; ++i) (*x)[j] -= l(i, j) * (*x)[i];
    (*x)[j] /= l(j, j);
  }
}

}  // namespace

void HeldStep::start(const SolverBodies& bodies) {
  rows_.clear();
  roots_.clear();
  place_of_body_.assign(bodies.count() + 1, kNowhere);
  for (std::uint32_t i = 0; i < bodies.count(); ++i) {
    const SolverBody& body = bodies[i];
    if (!body.is_pushed()) continue;
    place_of_body_[i] = static_cast<std::uint32_t>(roots_.size());
    roots_.push_back({std::sqrt(body.inverse_mass), root_of(body.inverse_inertia)});
  }
}

void HeldStep::add(std::uint32_t body1, std::uint32_t body2, const ConstraintDirection& direction, double scale,
                   double softness) {
  Row& row = rows_.emplace_back();
  row.place1 = place_of_body_[body1], row.place2 = place_of_body_[body2];
  row.softness = softness;
  const auto set = [&](std::uint32_t place, double sign, const Vector3& angular, Numbers* part) {
    part->setZero();
    if (place == kNowhere) return;
    const Root& root = roots_[place];
    part->head<3>() = (sign * root.of_mass / scale) * direction.linear;
    part->tail<3>() = root.of_inertia.transpose() * angular / scale;
  };
  set(row.place1, -1.0, direction.angular1, &row.part1);
  set(row.place2, 1.0, direction.angular2, &row.part2);
  if (row.place1 != row.place2 || row.place1 == kNowhere) return;
  row.part1 += row.part2;
  row.place2 = kNowhere;
}

bool HeldStep::factorise() {
  const auto count = static_cast<std::uint32_t>(roots_.size());
  first_.resize(count);
  for (std::uint32_t i = 0; i < count; ++i) first_[i] = i;
  for (const Row& row : rows_) {
    if (row.place1 == kNowhere || row.place2 == kNowhere) continue;
    std::uint32_t& first = first_[std::max(row.place1, row.place2)];
    first = std::min({first, row.place1, row.place2});
  }
  begin_.assign(count + 1, 0);
  for (std::uint32_t i = 0; i < count; ++i) begin_[i + 1] = begin_[i] + (i - first_[i] + 1);
  blocks_.assign(begin_.back(), Block::Zero());
  for (std::uint32_t i = 0; i < count; ++i) block(i, i).setIdentity();
  for (const Row& row : rows_) {
    const Numbers part1 = row.part1 / row.softness, part2 = row.part2 / row.softness;
    if (row.place1 != kNowhere) add_product(part1, row.part1, &block(row.place1, row.place1));
    if (row.place2 != kNowhere) add_product(part2, row.part2, &block(row.place2, row.place2));
    if (row.place1 == kNowhere || row.place2 == kNowhere) continue;
    if (row.place1 > row.place2)
      add_product(part1, row.part2, &block(row.place1, row.place2));
    else
      add_product(part2, row.part1, &block(row.place2, row.place1));
  }
  for (std::uint32_t i = 0; i < count; ++i) {
    Block& own = block(i, i);
    for (std::uint32_t j = first_[i]; j < i; ++j) {
      Block& entry = block(i, j);
      for (std::uint32_t k = std::max(first_[i], first_[j]); k < j; ++k)
        entry.noalias() -= block(i, k) * block(j, k).transpose();
      divide_by_transposed(block(j, j), &entry);
      own.noalias() -= entry * entry.transpose();
    }
    if (!factorise_block(&own)) return false;
  }
  return true;
}

void HeldStep::solve(std::vector<double>* side) {
  const auto count = static_cast<std::uint32_t>(roots_.size());
  motion_.assign(count, Numbers::Zero());
  for (std::size_t r = 0; r < rows_.size(); ++r) {
    const Row& row = rows_[r];
    const double push = (*side)[r] / row.softness;
    if (row.place1 != kNowhere) motion_[row.place1] += push * row.part1;
    if (row.place2 != kNowhere) motion_[row.place2] += push * row.part2;
  }
  for (std::uint32_t i = 0; i < count; ++i) {
    for (std::uint32_t j = first_[i]; j < i; ++j) motion_[i].noalias() -= block(i, j) * motion_[j];
    solve_lower(block(i, i), &motion_[i]);
  }
  for (std::uint32_t i = count; i-- > 0;) {
    solve_lower_transposed(block(i, i), &motion_[i]);
    for (std::uint32_t j = first_[i]; j < i; ++j) motion_[j].noalias() -= block(i, j).transpose() * motion_[i];
  }
  for (std::size_t r = 0; r < rows_.size(); ++r) {
    const Row& row = rows_[r];
    double left = (*side)[r];
    if (row.place1 != kNowhere) left -= row.part1.dot(motion_[row.place1]);
    if (row.place2 != kNowhere) left -= row.part2.dot(motion_[row.place2]);
    (*side)[r] = left / row.softness;
  }
}

}  // namespace gravitas
