#include "workers/collision/gjk_only/sampled_map.h"

#include <array>
#include <cmath>

#include "plugin_sdk/math/rotation.h"

namespace gravitas::gjk_only {

SampledMap::SampledMap(const SupportMap& map) : SupportMap(map), map_(map) {}

void SampledMap::contour(const Vector3& n, double sine, Contour* out) const {
  out->count = 0;
  out->normal.setZero();
  out->code = 0;
  if (!(sine > 0.0)) {
    out->add(map_.support(n), 1);
    return;
  }
  constexpr double kDiagonal = 0.70710678118654752;
  constexpr std::array<std::array<double, 2>, 8> kRound = {{{1, 0},
                                                            {kDiagonal, kDiagonal},
                                                            {0, 1},
                                                            {-kDiagonal, kDiagonal},
                                                            {-1, 0},
                                                            {-kDiagonal, -kDiagonal},
                                                            {0, -1},
                                                            {kDiagonal, -kDiagonal}}};
  const TangentBasis basis = orthonormal_basis(n);
  const double same = 1e-9 * thinnest();
  const auto is_same = [same](const Vector3& a, const Vector3& b) { return (a - b).squaredNorm() <= same * same; };
  for (std::size_t i = 0; i < kRound.size(); ++i) {
    const Vector3 point = map_.support(n + sine * (kRound[i][0] * basis.first + kRound[i][1] * basis.second));
    if (out->count > 0 && is_same(point, out->points[out->count - 1])) continue;
    if (out->count > 1 && is_same(point, out->points[0])) continue;
    out->add(point, 1 + static_cast<std::uint32_t>(i));
  }
  Vector3 area = Vector3::Zero();
  for (std::size_t i = 1; i + 1 < out->count; ++i)
    area += (out->points[i] - out->points[0]).cross(out->points[i + 1] - out->points[0]);
  const double size = std::sqrt(area.squaredNorm());
  if (out->count < 3) return;
  // points that lie in no plane, or in one seen from its edge, are no face: the farthest alone is sure to be touched
  bool is_flat = size > same * same && area.dot(n) > 0.9 * size;
  for (std::size_t i = 1; i < out->count && is_flat; ++i)
    is_flat = std::fabs(area.dot(out->points[i] - out->points[0])) <= same * size;
  if (is_flat) {
    out->normal = area / size;
  } else {
    out->count = 0;
    out->add(map_.support(n), 1);
  }
}

}  // namespace gravitas::gjk_only
