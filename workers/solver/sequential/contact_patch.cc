// The pseudo-inverse of a patch: twelve rows at most, six independent, so plain loops do.
#include "workers/solver/sequential/contact_patch.h"

#include <algorithm>
#include <cmath>

namespace gravitas {
namespace {

using Basis = Eigen::Matrix<double, ContactPatch::kRows, ContactPatch::kRank>;
using Square = Eigen::Matrix<double, ContactPatch::kRank, ContactPatch::kRank>;

// Orthonormal columns that span the range of W: Gram-Schmidt over its columns, the longest
// remainder first, each projected twice.
int range_of(const ContactPatch::Response& response, int rows, Basis* basis) {
  ContactPatch::Response left = response;
  double first = 0.0;
  int rank = 0;
  for (; rank < ContactPatch::kRank; ++rank) {
    int longest = 0;
    for (int i = 1; i < rows; ++i)
      if (left.col(i).squaredNorm() > left.col(longest).squaredNorm()) longest = i;
    const double length = left.col(longest).norm();
    if (rank == 0) first = length;
    if (!(length > 1e-8 * first)) break;
    ContactPatch::Rows q = left.col(longest) / length;
    for (int k = 0; k < rank; ++k) q -= basis->col(k) * basis->col(k).dot(q);
    q /= q.norm();
    basis->col(rank) = q;
    for (int i = 0; i < rows; ++i) left.col(i) -= q * q.dot(left.col(i));
  }
  return rank;
}

// Inverse of the leading block by Cholesky; false where it is not positive definite.
bool invert(const Square& matrix, int size, Square* inverse) {
  Square lower = Square::Zero();
  for (int j = 0; j < size; ++j) {
    double pivot = matrix(j, j);
    for (int k = 0; k < j; ++k) pivot -= lower(j, k) * lower(j, k);
    if (!(pivot > 1e-14 * matrix(j, j))) return false;
    lower(j, j) = std::sqrt(pivot);
    for (int i = j + 1; i < size; ++i) {
      double entry = matrix(i, j);
      for (int k = 0; k < j; ++k) entry -= lower(i, k) * lower(j, k);
      lower(i, j) = entry / lower(j, j);
    }
  }
  for (int column = 0; column < size; ++column) {
    Eigen::Matrix<double, ContactPatch::kRank, 1> x = Eigen::Matrix<double, ContactPatch::kRank, 1>::Zero();
    x(column) = 1.0;
    for (int i = 0; i < size; ++i) {
      for (int k = 0; k < i; ++k) x(i) -= lower(i, k) * x(k);
      x(i) /= lower(i, i);
    }
    for (int i = size - 1; i >= 0; --i) {
      for (int k = i + 1; k < size; ++k) x(i) -= lower(k, i) * x(k);
      x(i) /= lower(i, i);
    }
    inverse->col(column) = x;
  }
  return true;
}

}  // namespace

ContactPatch ContactPatch::of(const Response& response, int rows) {
  ContactPatch patch;
  Response used = Response::Zero();
  used.topLeftCorner(rows, rows) = response.topLeftCorner(rows, rows);
  patch.rank_ = range_of(used, rows, &patch.basis_);
  const Square core = patch.basis_.transpose() * (used * patch.basis_);
  if (!invert(core, patch.rank_, &patch.inverse_)) patch.rank_ = 0;
  return patch;
}

// Rows and columns that are not there are zero, so that all sums have the same length.
bool ContactPatch::solve(const Rows& missing, Rows* change) const {
  if (rank_ == 0) return false;
  const Eigen::Matrix<double, kRank, 1> parts = basis_.transpose() * missing;
  const Rows outside = missing - basis_ * parts;
  // noise of rounding is as large as what is missing when nothing is
  const double largest = outside.cwiseAbs().maxCoeff();
  if (largest > 1e-9 * missing.cwiseAbs().maxCoeff() && largest > 0.0) return false;
  const Eigen::Matrix<double, kRank, 1> weights = inverse_ * parts;
  change->noalias() = basis_ * weights;
  return true;
}

}  // namespace gravitas
