// Gauss-Legendre quadrature with 16 points, exact for polynomials of degree 31. Where the integrand is analytic within the
// ellipse with foci at the ends whose half axes sum up to s half lengths, the error falls as s^-32. Source: Abramowitz and
// Stegun, Handbook of Mathematical Functions, 25.4.30.
#pragma once

#include <array>

namespace gravitas::math {

struct GaussPoint {
  double at, weight;  // on -1 ... 1
};

inline constexpr std::array<GaussPoint, 8> kPositiveGaussPoints = {{{0.095012509837637454, 0.18945061045506834},
                                                                    {0.28160355077925892, 0.18260341504492367},
                                                                    {0.45801677765722731, 0.16915651939500262},
                                                                    {0.61787624440264377, 0.14959598881657671},
                                                                    {0.75540440835500311, 0.12462897125553414},
                                                                    {0.86563120238783176, 0.095158511682492757},
                                                                    {0.9445750230732326, 0.062253523938647928},
                                                                    {0.98940093499164994, 0.02715245941175402}}};

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
