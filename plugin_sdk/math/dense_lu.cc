#include "plugin_sdk/math/dense_lu.h"

namespace gravitas {

void DenseLu::factorise(const Eigen::MatrixXd& a) { factors_.compute(a); }

Eigen::VectorXd DenseLu::solve(const Eigen::VectorXd& b) const { return factors_.solve(b); }

}  // namespace gravitas
