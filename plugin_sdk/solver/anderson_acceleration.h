// Anderson acceleration of a fixed-point iteration x -> g(x), by which one that closes in slowly, or leads away slowly, ends
// in some steps more than it has slow directions.
//
//   next x = g_k - sum_i gamma_i (g_{i+1} - g_i),   gamma = argmin | f_k - sum_i gamma_i (f_{i+1} - f_i) |,   f = g(x) - x
//
// over the last kMemory images. Sources: Anderson, J. ACM 12 (1965) 547; Walker, Ni, SIAM J. Numer. Anal. 49 (2011) 1715.
#pragma once

#include <Eigen/Core>
#include <vector>

namespace gravitas {

class AndersonAcceleration {
 public:
  // Where to look next, after `image` = g(x): the image itself the first time, and where the images tell nothing.
  Eigen::VectorXd next(const Eigen::VectorXd& x, const Eigen::VectorXd& image);

 private:
  static constexpr std::size_t kMemory = 6;
  std::vector<Eigen::VectorXd> images_, changes_;  // g and f
};

}  // namespace gravitas
