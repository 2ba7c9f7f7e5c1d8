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
// spreads evenly. Points that overlap by different amounts move by a little that is no motion of two rigid bodies which meet
// in one place: it is left for the next sweep.
#pragma once

#include <Eigen/Core>
#include <array>

#include "plugin_sdk/math/types.h"

namespace gravitas {

class ContactPatch {
 public:
  static constexpr int kPoints = 4;
  static constexpr int kRows = 3 * kPoints;
  static constexpr int kRank = 6;
  using Rows = Eigen::Matrix<double, kRows, 1>;
  using Response = Eigen::Matrix<double, kRows, kRows>;
  using Square = Eigen::Matrix<double, kRank, kRank>;

  // A point of contact and the axes (columns) of its three rows, world.
  struct Point {
    Vector3 place;  // m, from the same origin for all
    Matrix3 frame;
  };

  // Three rows for each point: W = G K G^T, G_i = frame_i^T [1, -[r_i]], r_i from the points' centre. K: relative velocity
  // there and relative spin by an impulse there and one of torque.
  static ContactPatch of_points(const std::array<Point, kPoints>& points, int count, const Square& mobility);
  // Any rows, by the leading `rows` x `rows` block of the symmetric, positive semidefinite W. Directions
  // whose share of W is below 1e-8 of the largest are left out.
  static ContactPatch of(const Response& response, int rows);

  // False if a hundredth of `missing` and more is no motion that the bodies can make (lies outside W's range), or W is too
  // ill-conditioned to say; `change` is meaningless then.
  bool solve(const Rows& missing, Rows* change) const;

 private:
  // By leading columns of Q, and Q^T W Q; false where that is not positive definite.
  template <int kWidth>
  bool set(const std::array<Rows, kRank>& basis, int rank, Square core);
  template <int kWidth>
  bool solve_by(const Rows& missing, Rows* change) const;

  int rows_ = 0, width_ = 0;                 // width: 3 or 6, the rank or more; 0: ill-conditioned
  std::array<double, kRows * kRank> basis_;  // Q, row by row, of that width; nothing behind them
  std::array<double, kRows * kRank> dual_;   // Q (Q^T W Q)^-1, in the same way
};

}  // namespace gravitas
