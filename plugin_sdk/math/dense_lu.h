// Square systems A x = b of any size: Eigen's LU with partial pivoting, compiled once for all who need it.
#pragma once

#include <Eigen/LU>

namespace gravitas {

class DenseLu {
 public:
  DenseLu() = default;
  explicit DenseLu(const Eigen::MatrixXd& a) { factorise(a); }

  // Precondition: a is square. A singular one gives numbers that are not finite, or some solution
  // where b has nothing of what it lacks.
  void factorise(const Eigen::MatrixXd& a);
  // Precondition: factorised, b of that size.
  Eigen::VectorXd solve(const Eigen::VectorXd& b) const;

 private:
  Eigen::PartialPivLU<Eigen::MatrixXd> factors_;
};

}  // namespace gravitas
