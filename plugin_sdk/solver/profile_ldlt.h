// A symmetric positive semidefinite matrix, factorised as L D L^T within its profile, that bears dependent rows.
//
// Row i of L reaches from its first entry to the diagonal; nothing outside is stored or computed, so a chain of joints in
// order costs what a band costs. A row is a combination of rows before it to rounding, and left out, if its pivot falls
// below 1e-12 of its diagonal, or below what rounding may have left there: the pivot is z^T A z, with z the row less its
// combination, whose terms are of size z_k^2 a_kk (where other rows are almost dependent, z is large). Its unknown is 0. What
// it would have added is the same, if the right-hand side agrees; if not, the side is first projected to the nearest one
// (least squares) that does.
#pragma once

#include <cstddef>
#include <vector>

#include "plugin_sdk/math/types.h"

namespace gravitas {

class ProfileLdlt {
 public:
  // Starts a matrix of zeros; first[i] <= i is the first column of row i that may have an entry. Throws Refusal where that
  // is more than 2 GB.
  void start(const std::vector<std::size_t>& first);
  // Entry of the lower triangle, within the profile.
  double& entry(std::size_t row, std::size_t column) { return values_[begin_[row] + column - first_[row]]; }

  // Rows whose pivot is at most `least` of their diagonal are left out, too.
  void factorise(double least = 0.0);

  std::size_t size() const { return first_.size(); }
  // Smallest pivot of a row that is not left out, as a share of its diagonal; 1 if there is none.
  double least_pivot() const { return least_pivot_; }
  // Its row.
  std::size_t weakest() const { return weakest_; }
  std::size_t dropped() const { return dropped_.size(); }
  // x with A x = b; entries of dropped rows are 0 and not looked at.
  void solve(std::vector<double>* b) const;
  // Is there an x with A x = b, but for rounding and for `enough` in any row?
  bool is_consistent(const std::vector<double>& b, double enough = 0.0) const;
  // The side nearest to b that A x can be. Returns the distance; 0, and leaves b, where it is only of rounding.
  double make_consistent(std::vector<double>* b) const;

 private:
  // Zero before `first` and after the numbers.
  struct NullVector {
    std::size_t first = 0;
    std::vector<double> number;
  };
  static double product(const NullVector& a, const NullVector& b);
  // b += share a
  static void add(double share, const NullVector& a, NullVector* b);

  // 1 at the row, and minus its combination of the rows before.
  std::vector<double> difference(std::size_t row) const;
  // May the pivot of a row be what rounding left there?
  bool is_rounding(std::size_t row, double pivot);
  double project(std::vector<double>* b) const;
  std::vector<double> largest_of_parts(const std::vector<double>& b) const;
  void find_parts() const;
  void find_null_space() const;
  // L^-T applied in place.
  void solve_transposed(std::vector<double>* x) const;

  std::vector<std::size_t> first_, begin_;
  std::vector<double> values_, pivot_;  // 0: dropped
  std::vector<double> combination_;     // scratch
  std::vector<double> scaled_;          // scratch: l_ij d_j of a row
  double least_pivot_ = 1.0;
  std::size_t weakest_ = 0;
  std::vector<std::size_t> dropped_;
  // found when asked for
  mutable std::vector<NullVector> null_;   // orthonormal: what is missing of the range
  mutable std::vector<std::size_t> part_;  // by row, the last of those that are connected with it
};

}  // namespace gravitas
