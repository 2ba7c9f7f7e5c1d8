#include "plugin_sdk/geometry/lane_points.h"

#include <immintrin.h>

#include <limits>

namespace gravitas {

void LanePoints::add(const Vector3& point) {
  const std::size_t lane = count_++ % 4;
  if (lane == 0) coordinates_.resize(coordinates_.size() + 12);
  double* const group = coordinates_.data() + coordinates_.size() - 12;
  for (int axis = 0; axis < 3; ++axis)
    for (std::size_t k = lane; k < 4; ++k) group[4 * static_cast<std::size_t>(axis) + k] = point[axis];
}

std::uint32_t LanePoints::farthest(const Vector3& d) const {
  const __m256d x = _mm256_set1_pd(d.x()), y = _mm256_set1_pd(d.y()), z = _mm256_set1_pd(d.z());
  const __m256d infinity = _mm256_set1_pd(std::numeric_limits<double>::infinity()), step = _mm256_set1_pd(4.0);
  __m256d best = -infinity, row = _mm256_setzero_pd(), here = _mm256_set_pd(3.0, 2.0, 1.0, 0.0);
  const double* const end = coordinates_.data() + coordinates_.size();
  for (const double* group = coordinates_.data(); group != end; group += 12) {
    const __m256d along = _mm256_loadu_pd(group) * x + _mm256_loadu_pd(group + 4) * y + _mm256_loadu_pd(group + 8) * z;
    row = _mm256_blendv_pd(row, here, _mm256_cmp_pd(along, best, _CMP_GT_OQ));
    best = _mm256_max_pd(along, best);
    here = here + step;
  }
  // of the lanes that are farthest the first row; a repeated point comes after the one that it repeats
  __m256d most = _mm256_max_pd(best, _mm256_permute2f128_pd(best, best, 0x01));
  most = _mm256_max_pd(most, _mm256_permute_pd(most, 0x5));
  row = _mm256_blendv_pd(infinity, row, _mm256_cmp_pd(best, most, _CMP_EQ_OQ));
  row = _mm256_min_pd(row, _mm256_permute2f128_pd(row, row, 0x01));
  row = _mm256_min_pd(row, _mm256_permute_pd(row, 0x5));
  const double first = _mm256_cvtsd_f64(row);
  // along a direction that is no number nothing is farthest
  return first < static_cast<double>(count_) ? static_cast<std::uint32_t>(first) : 0;
}

}  // namespace gravitas
