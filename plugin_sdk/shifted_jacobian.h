// For authors of implicit integrators with inner steps: (s - J) z = b for the Jacobian J of local_motion.h and a shift s (1/s),
// real or complex. Positions and attitudes are eliminated, so that the matrices have six rows a body: with P = (s - A)^-1,
// b = (p, q) and z = (x, v),
//
//   (s - D - C P) v = q + C P p,    x = P (p + v),    C = dv'/dx, D = dv'/dv,
//
// and P is 1/s for positions, for attitudes (1 + (s S + S^2)/(s^2 + |w|^2/4))/s with S = [w]/2. Complex systems are solved as
// real ones of twice the size: products of std::complex and Eigen's search for complex pivots call functions of the system.
#pragma once

#include <vector>

#include "plugin_sdk/local_motion.h"
#include "plugin_sdk/math/dense_lu.h"

namespace gravitas {

class ShiftedJacobian {
 public:
  // Call fix_eigen_blocks() once before. The motion must live as long as its J stays.
  void factorise(const LocalMotion& motion, double real, double imaginary = 0.0);

  // In place, b has all bodies' numbers; the imaginary part where the shift has one.
  void solve(Eigen::VectorXd* real, Eigen::VectorXd* imaginary = nullptr) const;

 private:
  // Numbers of a group are those of its bodies in order: all real parts, then all imaginary ones.
  struct Group {
    const std::vector<std::size_t>* body = nullptr;
    std::vector<Eigen::Matrix3d> turns[2];  // of P, for attitudes: real and imaginary parts
    Eigen::MatrixXd carried;                // C P
    DenseLu factors;
  };

  std::vector<Group> groups_;
  Eigen::Index parts_ = 1;
  double real_ = 1.0, imaginary_ = 0.0;  // 1/s
};

}  // namespace gravitas
