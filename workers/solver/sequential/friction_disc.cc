// The two-by-two algebra of a friction disc.
#include "workers/solver/sequential/friction_disc.h"

#include <cmath>

namespace gravitas {

FrictionDisc FrictionDisc::of(const Eigen::Matrix2d& block) {
  FrictionDisc disc;
  const double a = block(0, 0);
  const double b = 0.5 * (block(0, 1) + block(1, 0));
  const double c = block(1, 1);
  const double half_difference = 0.5 * (a - c);
  disc.largest = 0.5 * (a + c) + std::sqrt(half_difference * half_difference + b * b);
  const double determinant = a * c - b * b;
  if (determinant > 1e-12 * disc.largest * disc.largest) {
    disc.inverse << c, -b, -b, a;
    disc.inverse /= determinant;
  } else if (disc.largest > 0.0) {
    disc.inverse.diagonal().setConstant(1.0 / disc.largest);
  }
  return disc;
}

Eigen::Vector2d FrictionDisc::updated(const Eigen::Vector2d& impulse, const Eigen::Vector2d& slip,
                                      double radius) const {
  if (!(largest > 0.0)) return impulse;
  const Eigen::Vector2d stopping = impulse - inverse * slip;
  if (stopping.squaredNorm() <= radius * radius) return stopping;
  const Eigen::Vector2d gradient = impulse - slip / largest;
  const double length = gradient.norm();
  return length > radius ? Eigen::Vector2d(gradient * (radius / length)) : gradient;
}

}  // namespace gravitas
