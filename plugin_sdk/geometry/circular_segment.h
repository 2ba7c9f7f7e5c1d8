// The part y <= d of a disc of radius R about the origin, of which x is the other axis. With the half chord h, h^2 = R^2 - d^2, and the
// angle t = pi/2 + atan2(d, h):
//
//   area = R^2 t + d h      integral of y = -2/3 h^3      of y^2 = R^4 t/4 - d h (R^2 - 2 d^2)/4
//   integral of y^3 = -2/3 R^2 h^3 + 2/5 h^5              of x^2 + y^2 = R^4 t/2 + d^3 h/2 + d h^3/6
#pragma once

#include <numbers>

#include "plugin_sdk/math/transcendental.h"

namespace gravitas {

struct CircularSegment {
  double radius, offset, half_chord;  // R, d, h >= 0
  double angle = 0.5 * std::numbers::pi + math::atan2(offset, half_chord);

  double area() const { return radius * radius * angle + offset * half_chord; }
  double first_moment() const { return -2.0 / 3.0 * half_chord * half_chord * half_chord; }
  double second_moment() const {
    const double square = radius * radius;
    return 0.25 * (square * square * angle - offset * half_chord * (square - 2.0 * offset * offset));
  }
  double third_moment() const {
    const double h2 = half_chord * half_chord;
    return h2 * half_chord * (0.4 * h2 - 2.0 / 3.0 * radius * radius);
  }
  double polar_moment() const {
    const double square = radius * radius;
    return 0.5 * square * square * angle +
           offset * half_chord * (0.5 * offset * offset + half_chord * half_chord / 6.0);
  }
};

}  // namespace gravitas
