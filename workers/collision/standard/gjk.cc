// It never needs an exact answer about a sliver: a result that is not closer than the previous one ends the search with
// the previous one.
#include "workers/collision/standard/gjk.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <span>

#include "plugin_sdk/geometry/simplex.h"

namespace gravitas::collision {

GjkResult gjk_separation(const ConvexPair& pair, const Vector3& first_direction) {
  constexpr int kIterationLimit = 64;
  const double touching = 1e-11 * pair.reach;
  // points of A - B that carry the closest one
  std::array<Vector3, 4> simplex;
  std::size_t count = 1;
  simplex[0] = pair.support_difference(first_direction);
  Vector3 closest = simplex[0];
  for (int i = 0; i < kIterationLimit; ++i) {
    const double squared = closest.squaredNorm();
    if (squared <= touching * touching) return {false, Vector3::UnitY()};

    // the supporting plane towards the origin bounds the distance from below: stop when it is met
    const Vector3 w = pair.support_difference(-closest);
    const double gap = squared - w.dot(closest);
    if (gap <= 1e-15 * pair.reach * std::sqrt(squared) || gap <= 1e-14 * squared) break;
    if (std::find(simplex.begin(), simplex.begin() + static_cast<std::ptrdiff_t>(count), w) !=
        simplex.begin() + static_cast<std::ptrdiff_t>(count))
      break;

    simplex[count] = w;
    const SimplexPoint found = closest_on_simplex(std::span(simplex.data(), count + 1));
    if (count == 3 && found.point.isZero(0.0)) {
      // a sliver may seem to contain the origin although the supporting plane keeps it out
      if (w.dot(closest) <= 0.0) return {false, Vector3::UnitY()};
      break;
    }
    if (!(found.point.squaredNorm() < squared)) break;
    closest = found.point;
    std::size_t kept = 0;
    for (std::size_t k = 0; k <= count; ++k)
      if (found.weight[k] > 0.0) simplex[kept++] = simplex[k];
    count = kept;
  }
  return {true, -closest / std::sqrt(closest.squaredNorm())};
}

}  // namespace gravitas::collision
