// Gauss-Legendre quadrature with 16 points, exact for polynomials of degree 31. Where the integrand is analytic within the
// ellipse with foci at the ends whose half axes sum up to s half lengths, the error falls as s^-32. Source: Abramowitz and
// Stegun, Handbook of Mathematical Functions, 25.4.30.
#pragma once

#include <array>

namespace gravitas::math {

struct GaussPoint {
  double at, weight;  // on -1 ... 1
};

inline constexpr std::array<GaussPoint, 8> kPositiveGaussPoints = {{{0.09501250983763744, 0.1894506104550685},
                                                                    {0.2816035507792589, 0.18260341504492358},
                                                                    {0.45801677765722737, 0.16915651939500254},
                                                                    {0.6178762444026438, 0.14959598881657674},
                                                                    {0.755404408355003, 0.12462897125553388},
                                                                    {0.8656312023878318, 0.09515851168249279},
                                                                    {0.9445750230732326, 0.062253523938647894},
                                                                    {0.9894009349916499, 0.027152459411754096}}};

// Calls visit(x, weight) for points of begin ... end; the weights sum up to end - begin.
template <typename Visit>
void for_gauss_points(double begin, double end, Visit&& visit) {
  const double middle = 0.5 * (begin + end), half = 0.5 * (end - begin);
  for (const GaussPoint& point : kPositiveGaussPoints) {
    visit(middle - half * point.at, half * point.weight);
    visit(middle + half * point.at, half * point.weight);
  }
}

}  // namespace gravitas::math
