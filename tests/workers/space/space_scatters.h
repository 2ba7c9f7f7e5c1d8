// How bodies may lie, for tests of spaces: each scatter draws one body.
#pragma once

#include <cmath>
#include <limits>

#include "plugin_sdk/conformance/draw.h"
#include "tests/workers/space/space_problem.h"

namespace gravitas::test {

using Scatter = BoundedBody (*)(conformance::Draw* random);

inline BoundedBody spread(conformance::Draw* random) { return cube(random->vector(10.0), random->uniform(0.2, 1.5)); }
inline BoundedBody clustered(conformance::Draw* random) {
  const Vector3 centre{random->below(3) * 50.0, random->below(2) * -50.0, 0.0};
  return cube(centre + random->vector(1.0), random->uniform(0.1, 0.6));
}
inline BoundedBody huge_and_small(conformance::Draw* random) {
  const double size = std::ldexp(1.0, static_cast<int>(random->below(40)) - 25);
  return cube(random->vector(5.0), size);
}
inline BoundedBody flat_and_long(conformance::Draw* random) {
  const Vector3 centre = random->vector(10.0);
  Vector3 half = random->vector(0.5).cwiseAbs();
  half[static_cast<int>(random->below(3))] *= 200.0;
  return {centre - half, centre + half};
}
inline BoundedBody in_one_place(conformance::Draw*) { return cube({3.25, -1.5, 7.0}, 0.5); }
inline BoundedBody points(conformance::Draw* random) {
  const Vector3 p{random->below(4) * 1.0, random->below(4) * 1.0, random->below(2) * 1.0};
  return {p, p};
}
// Bounds on the borders of cells and on planes, where bodies touch exactly.
inline BoundedBody on_a_lattice(conformance::Draw* random) {
  const Vector3 lower{random->below(8) - 4.0, random->below(8) - 4.0, random->below(4) - 2.0};
  return {lower, lower + Vector3{random->below(3), random->below(3), random->below(3)}};
}
inline BoundedBody far_away(conformance::Draw* random) {
  const double scale = std::ldexp(1.0, static_cast<int>(random->below(4)) * 20);
  return cube(scale * random->vector(2.0), scale * random->uniform(0.1, 1.0));
}
// As far as doubles go, where a cell's number no longer fits.
inline BoundedBody at_the_end_of_the_world(conformance::Draw* random) {
  const double place = random->below(2) == 0 ? 1e300 : -1e300;
  return cube(Vector3(place, 1e18 * random->uniform(-1, 1), 0), random->uniform(0.5, 1e17));
}
inline BoundedBody unbounded(conformance::Draw* random) {
  constexpr double kInfinity = std::numeric_limits<double>::infinity();
  BoundedBody body = spread(random);
  if (random->below(4) != 0) return body;
  for (int k = 0; k < 3; ++k) {
    if (random->below(3) != 0) body.lower[k] = -kInfinity;
    if (random->below(3) != 0) body.upper[k] = kInfinity;
  }
  return body;
}
// Numbers that are none, bounds upside down, infinities of the wrong sign.
inline BoundedBody nonsense(conformance::Draw* random) {
  BoundedBody body = spread(random);
  constexpr double kNonsense[] = {std::numeric_limits<double>::quiet_NaN(), std::numeric_limits<double>::infinity(),
                                  -std::numeric_limits<double>::infinity(), std::numeric_limits<double>::max(), 0.0};
  if (random->below(3) == 0) std::swap(body.lower, body.upper);
  Vector3& bound = random->below(2) == 0 ? body.lower : body.upper;
  bound[static_cast<int>(random->below(3))] = kNonsense[random->below(5)];
  return body;
}

struct ScatterKind {
  const char* name;
  Scatter scatter;
};
inline constexpr ScatterKind kScatters[] = {{"spread", spread},
                                            {"clustered", clustered},
                                            {"huge and small", huge_and_small},
                                            {"flat and long", flat_and_long},
                                            {"in one place", in_one_place},
                                            {"points", points},
                                            {"on a lattice", on_a_lattice},
                                            {"far away", far_away},
                                            {"at the end of the world", at_the_end_of_the_world},
                                            {"unbounded", unbounded},
                                            {"nonsense", nonsense}};

// Now and then other flags and filters.
inline void give_filters(conformance::Draw* random, BoundedBody* body) {
  if (random->below(4) == 0) body->flags = random->below(32);
  if (random->below(3) == 0) {
    body->group = random->below(8);
    body->mask = random->below(8);
  }
}

}  // namespace gravitas::test
