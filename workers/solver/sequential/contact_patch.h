// The contacts of one pair of bodies as a whole: the change of their impulses that makes all of
// them right at once.
//
// Four corners of a box have twelve rows of rank six, and swept one by one they converge at the
// pace of their overlap: thousands of sweeps for a pole on its foot or five boxes in a stack. A
// patch that rests, sticks or lands flat is an equality for all its rows,
//
//   W d = missing,   W = J M^-1 J^T,   d = W^+ missing = Q (Q^T W Q)^-1 Q^T missing,
//
// Q an orthonormal basis of W's range: the smallest of the changes that do it, so that the load
// spreads evenly.
#pragma once

#include <Eigen/Core>

namespace gravitas {

class ContactPatch {
 public:
  static constexpr int kRows = 12;
  static constexpr int kRank = 6;
  using Rows = Eigen::Matrix<double, kRows, 1>;
  using Response = Eigen::Matrix<double, kRows, kRows>;

  // From the leading `rows` x `rows` block of the symmetric, positive semidefinite W. Directions
  // whose share of W is below 1e-8 of the largest are left out.
  static ContactPatch of(const Response& response, int rows);

  // Sets `change`; entries of `missing` behind the rows are zero. False if `missing` is no motion that the bodies can make
  // (more than 1e-9 of it lies outside W's range) or W is too ill-conditioned to say: nothing is
  // set then.
  bool solve(const Rows& missing, Rows* change) const;

 private:
  int rank_ = 0;
  Eigen::Matrix<double, kRows, kRank> basis_ = Eigen::Matrix<double, kRows, kRank>::Zero();
  Eigen::Matrix<double, kRank, kRank> inverse_ = Eigen::Matrix<double, kRank, kRank>::Zero();
};

}  // namespace gravitas
