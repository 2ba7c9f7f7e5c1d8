// The pseudo-inverse of a patch: twelve rows at most, six independent, so plain loops do.
#include "workers/solver/sequential/contact_patch.h"

#include <algorithm>
#include <cmath>
#include <span>

namespace gravitas {
namespace {

using Rows = ContactPatch::Rows;
using Square = ContactPatch::Square;
using Basis = std::array<Rows, ContactPatch::kRank>;

constexpr double kLeast = 1e-8;  // share of the largest below which there is nothing

double dot(const Rows& a, const Rows& b, int rows) {
  double sum = 0.0;
  for (int i = 0; i < rows; ++i) sum += a[i] * b[i];
  return sum;
}

void add(double share, const Rows& a, int rows, Rows* sum) {
  for (int i = 0; i < rows; ++i) (*sum)[i] += share * a[i];
}

// Appends to the leading `rank` columns, which are orthonormal, those that span what `left` adds: Gram-Schmidt, the longest
// remainder first, each projected twice. Returns how many there are then.
int append_range(std::span<Rows> left, int rows, int rank, Basis* basis) {
  std::array<double, ContactPatch::kRows> squared;
  for (std::size_t i = 0; i < left.size(); ++i) squared[i] = dot(left[i], left[i], rows);
  double first = 0.0;
  for (; rank < ContactPatch::kRank; ++rank) {
    const auto end = squared.begin() + static_cast<std::ptrdiff_t>(left.size());
    const auto longest = static_cast<std::size_t>(std::max_element(squared.begin(), end) - squared.begin());
    const double length = std::sqrt(squared[longest]);
    if (first == 0.0) first = length;
    if (!(length > kLeast * first)) break;
    Rows& q = (*basis)[static_cast<std::size_t>(rank)];
    q = left[longest] / length;
    for (int k = 0; k < rank; ++k) {
      const Rows& other = (*basis)[static_cast<std::size_t>(k)];
      add(-dot(other, q, rows), other, rows, &q);
    }
    q /= std::sqrt(dot(q, q, rows));
    for (std::size_t i = 0; i < left.size(); ++i) {
      add(-dot(q, left[i], rows), q, rows, &left[i]);
      squared[i] = dot(left[i], left[i], rows);
    }
  }
  return rank;
}

// By Cholesky; false where it is not positive definite.
template <int kSize>
bool invert(const Square& matrix, Square* inverse) {
  std::array<std::array<double, kSize>, kSize> lower{};
  for (std::size_t j = 0; j < kSize; ++j) {
    const auto at = [&](std::size_t i) { return matrix(static_cast<Eigen::Index>(i), static_cast<Eigen::Index>(j)); };
    double pivot = at(j);
    for (std::size_t k = 0; k < j; ++k) pivot -= lower[j][k] * lower[j][k];
    if (!(pivot > 1e-14 * at(j))) return false;
    lower[j][j] = std::sqrt(pivot);
    for (std::size_t i = j + 1; i < kSize; ++i) {
      double entry = at(i);
      for (std::size_t k = 0; k < j; ++k) entry -= lower[i][k] * lower[j][k];
      lower[i][j] = entry / lower[j][j];
    }
  }
  for (std::size_t column = 0; column < kSize; ++column) {
    std::array<double, kSize> x{};
    x[column] = 1.0;
    for (std::size_t i = column; i < kSize; ++i) {
      for (std::size_t k = column; k < i; ++k) x[i] -= lower[i][k] * x[k];
      x[i] /= lower[i][i];
    }
    for (std::size_t i = kSize; i-- > 0;) {
      for (std::size_t k = i + 1; k < kSize; ++k) x[i] -= lower[k][i] * x[k];
      x[i] /= lower[i][i];
      (*inverse)(static_cast<Eigen::Index>(i), static_cast<Eigen::Index>(column)) = x[i];
    }
  }
  return true;
}

}  // namespace

ContactPatch ContactPatch::of_points(const std::array<Point, kPoints>& points, int count, const Square& mobility) {
  const auto used = static_cast<std::size_t>(count);
  Vector3 centre = Vector3::Zero();
  for (std::size_t i = 0; i < used; ++i) centre += points[i].place / count;
  // about the centre, displacements and turns move the rows by what is orthogonal; of points on a line one turn moves none
  Basis basis;
  basis.fill(Rows::Zero());
  std::array<Rows, 3> turns;
  turns.fill(Rows::Zero());
  for (std::size_t k = 0; k < 3; ++k) {
    const auto axis = static_cast<Eigen::Index>(k);
    for (std::size_t i = 0; i < used; ++i) {
      const auto row = static_cast<Eigen::Index>(3 * i);
      basis[k].segment<3>(row) = points[i].frame.row(axis).transpose() / std::sqrt(count);
      turns[k].segment<3>(row) = points[i].frame.transpose() * Vector3::Unit(axis).cross(points[i].place - centre);
    }
  }
  const int rows = 3 * count;
  std::array<Rows, 3> left = turns;
  const int rank = append_range(left, rows, 3, &basis);
  Square parts = Square::Zero();  // Q^T G
  parts.topLeftCorner<3, 3>() = std::sqrt(count) * Matrix3::Identity();
  for (int k = 3; k < rank; ++k)
    for (std::size_t axis = 0; axis < 3; ++axis)
      parts(k, 3 + static_cast<Eigen::Index>(axis)) = dot(basis[static_cast<std::size_t>(k)], turns[axis], rows);
  const Square core = parts * (mobility * parts.transpose());
  ContactPatch patch;
  patch.rows_ = rows;
  if (patch.set<kRank>(basis, rank, core)) return patch;
  Response response = Response::Zero();
  for (int i = 0; i < rank; ++i)
    for (int j = 0; j < rank; ++j)
      response += core(i, j) * basis[static_cast<std::size_t>(i)] * basis[static_cast<std::size_t>(j)].transpose();
  return of(response, rows);
}

ContactPatch ContactPatch::of(const Response& response, int rows) {
  Basis basis;
  basis.fill(Rows::Zero());
  std::array<Rows, kRows> left;
  for (int i = 0; i < rows; ++i) left[static_cast<std::size_t>(i)] = response.col(i);
  const int rank = append_range(std::span(left).first(static_cast<std::size_t>(rows)), rows, 0, &basis);
  Square core = Square::Zero();
  for (int j = 0; j < rank; ++j) {
    Rows image = Rows::Zero();
    for (int i = 0; i < rows; ++i) add(basis[static_cast<std::size_t>(j)][i], response.col(i), rows, &image);
    for (int i = 0; i < rank; ++i) core(i, j) = dot(basis[static_cast<std::size_t>(i)], image, rows);
  }
  ContactPatch patch;
  patch.rows_ = rows;
  rank <= 3 ? patch.set<3>(basis, rank, core) : patch.set<kRank>(basis, rank, core);
  return patch;
}

template <int kWidth>
bool ContactPatch::set(const std::array<Rows, kRank>& basis, int rank, Square core) {
  for (int k = rank; k < kWidth; ++k) {
    core.row(k).setZero(), core.col(k).setZero();
    core(k, k) = 1.0;
  }
  Square inverse;
  if (!invert<kWidth>(core, &inverse)) return false;
  width_ = kWidth;
  for (int i = 0; i < rows_; ++i) {
    double* own = &basis_[static_cast<std::size_t>(i * kWidth)];
    double* dual = &dual_[static_cast<std::size_t>(i * kWidth)];
    for (int k = 0; k < kWidth; ++k) own[k] = k < rank ? basis[static_cast<std::size_t>(k)][i] : 0.0;
    for (int j = 0; j < kWidth; ++j) {
      dual[j] = 0.0;
      for (int k = 0; k < kWidth; ++k) dual[j] += own[k] * inverse(k, j);
    }
  }
  return true;
}

bool ContactPatch::solve(const Rows& missing, Rows* change) const {
  if (width_ == 0) return false;
  return width_ == 3 ? solve_by<3>(missing, change) : solve_by<6>(missing, change);
}

template <int kWidth>
bool ContactPatch::solve_by(const Rows& missing, Rows* change) const {
  constexpr double kOutside = 1e-2;
  Eigen::Matrix<double, kWidth, 1> parts = Eigen::Matrix<double, kWidth, 1>::Zero();
  double whole = 0.0;
  for (int i = 0; i < rows_; ++i) {
    const double* own = &basis_[static_cast<std::size_t>(i * kWidth)];
    for (int k = 0; k < kWidth; ++k) parts[k] += missing[i] * own[k];
    whole += missing[i] * missing[i];
  }
  for (int i = 0; i < rows_; ++i) {
    double sum = 0.0;
    const double* dual = &dual_[static_cast<std::size_t>(i * kWidth)];
    for (int k = 0; k < kWidth; ++k) sum += parts[k] * dual[k];
    (*change)[i] = sum;
  }
  return whole - parts.squaredNorm() <= kOutside * kOutside * whole;
}

}  // namespace gravitas
