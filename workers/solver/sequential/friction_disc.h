// Friction in two components: the impulse that stops the slip where a disc allows it, else the one
// on the disc's rim against the slip. No direction is preferred: a pyramid of two bounded rows lets
// a body pushed along its diagonal stick to 1.41 times the coefficient, or never start at all.
#pragma once

#include <Eigen/Core>

namespace gravitas {

struct FrictionDisc {
  Eigen::Matrix2d inverse = Eigen::Matrix2d::Zero();  // of the tangential block K of J M^-1 J^T
  double largest = 0.0;                               // eigenvalue of K; 0: nothing can move

  // From the symmetric positive definite K. A block that is singular to 1e-12 is used by its
  // eigenvalue only.
  static FrictionDisc of(const Eigen::Matrix2d& block);

  // The impulse after one update, from the present one and the slip it leaves. If the impulse that
  // stops the slip, lambda - K^-1 slip, is within `radius` it is taken: exact. Else
  //   lambda <- radius g/|g|,  g = lambda - slip/k,  k the largest eigenvalue of K:
  // a projected gradient step, whose fixed point is slip = -c lambda, c >= 0, |lambda| = radius.
  Eigen::Vector2d updated(const Eigen::Vector2d& impulse, const Eigen::Vector2d& slip, double radius) const;
};

}  // namespace gravitas
