// Depths of the edge axes are found three at a time and compared by their squares, so that only those that may be the
// shallowest are made unit vectors (ERRATA of § 2.5.1.1: a cross product as short as its rounding is none, and an axis
// points from a to b).
#include "workers/collision/standard/box_axes.h"

#include <array>
#include <cmath>

namespace gravitas::collision {
namespace {

using Lanes = __m256d;

constexpr double kInfinity = std::numeric_limits<double>::infinity();
// Sine of the angle of two edges below which their cross product is rounding. What they stand for is a sliver: leaving
// it out costs less than 1e-8 of an edge length in depth.
constexpr double kParallel = 1e-8;

Lanes all(double x) { return _mm256_set1_pd(x); }
Lanes of(const Vector3& v) { return _mm256_set_pd(0.0, v.z(), v.y(), v.x()); }
Lanes absolute(Lanes v) { return _mm256_andnot_pd(all(-0.0), v); }
// (y, z, x) and (z, x, y)
Lanes next(Lanes v) { return _mm256_permute4x64_pd(v, _MM_SHUFFLE(3, 0, 2, 1)); }
Lanes after_next(Lanes v) { return _mm256_permute4x64_pd(v, _MM_SHUFFLE(3, 1, 0, 2)); }

// The sums over the lanes of u, v and w.
Lanes sums(Lanes u, Lanes v, Lanes w) {
  const Lanes uv = _mm256_hadd_pd(u, v), ww = _mm256_hadd_pd(w, _mm256_setzero_pd());
  return _mm256_add_pd(_mm256_permute2f128_pd(uv, ww, 0x20), _mm256_permute2f128_pd(uv, ww, 0x31));
}

Vector3 vector_of(Lanes v) {
  alignas(32) std::array<double, 4> x;
  _mm256_store_pd(x.data(), v);
  return {x[0], x[1], x[2]};
}

}  // namespace

BoxAxes::BoxAxes(const Shape& a, const Shape& b, const Placement& placement) : a_(a), b_(b) {
  const Matrix3 &R_WA = placement.R_WA, &R_WB = placement.R_WB;
  const Lanes x = _mm256_set_pd(0.0, R_WA(0, 2), R_WA(0, 1), R_WA(0, 0));
  const Lanes y = _mm256_set_pd(0.0, R_WA(1, 2), R_WA(1, 1), R_WA(1, 0));
  const Lanes z = _mm256_set_pd(0.0, R_WA(2, 2), R_WA(2, 1), R_WA(2, 0));
  const auto in_a = [&](const auto& v) -> Lanes { return x * all(v[0]) + y * all(v[1]) + z * all(v[2]); };
  for (int k = 0; k < 3; ++k) {
    columns_[static_cast<std::size_t>(k)] = in_a(R_WB.col(k));
    R_AB_.col(k) = vector_of(columns_[static_cast<std::size_t>(k)]);
  }
  p_ = in_a(placement.p_AB_W);
  p_AB_ = vector_of(p_);

  const auto& [c0, c1, c2] = columns_;
  const Lanes s0 = absolute(c0), s1 = absolute(c1), s2 = absolute(c2), half_a = of(a.size);
  const Vector3& half_b = b.size;
  depths_a_ = vector_of(half_a + s0 * all(half_b.x()) + s1 * all(half_b.y()) + s2 * all(half_b.z()) - absolute(p_));
  const Lanes p_B = sums(c0 * p_, c1 * p_, c2 * p_);
  p_AB_B_ = vector_of(p_B);
  depths_b_ = vector_of(of(half_b) + sums(s0 * half_a, s1 * half_a, s2 * half_a) - absolute(p_B));
}

EdgeAxis BoxAxes::across_edges(int i, int k) const {
  const Vector3 across = Vector3::Unit(i).cross(R_AB_.col(k));
  const double length = std::sqrt(across.squaredNorm());
  const Vector3 unit = across / (across.dot(p_AB_) < 0.0 ? -length : length);
  const double of_a = unit.cwiseAbs().dot(a_.size);
  double of_b = 0.0;
  for (int m = 0; m < 3; ++m) of_b += b_.size[m] * std::fabs(R_AB_.col(m).dot(unit));
  return {i, k, of_a + of_b - unit.dot(p_AB_), unit};
}

EdgeAxis BoxAxes::shallowest_edges(double below) const {
  const Lanes half_a = of(a_.size), half_1 = next(half_a), half_2 = after_next(half_a);
  const Lanes p_1 = next(p_), p_2 = after_next(p_);
  const Lanes size[3] = {absolute(columns_[0]), absolute(columns_[1]), absolute(columns_[2])};
  // what rounding may make of a depth before it is divided by the length of its axis
  const Lanes slack = all(1e-15 * (a_.size.sum() + b_.size.sum() + p_AB_.cwiseAbs().sum()));
  // x |x| grows with x, so that squares tell which depths count
  const Lanes bound = all(below * std::fabs(below));
  alignas(32) std::array<std::array<double, 4>, 3> depths;
  std::array<unsigned, 3> left{};
  for (std::size_t k = 0; k < 3; ++k) {
    // lane i: e_i x c, c being edge k of b
    const std::size_t k_1 = (k + 1) % 3, k_2 = (k + 2) % 3;
    const Lanes c_1 = next(columns_[k]), c_2 = after_next(columns_[k]);
    const Lanes reach = half_1 * absolute(c_2) + half_2 * absolute(c_1) +
                        all(b_.size[static_cast<int>(k_1)]) * size[k_2] +
                        all(b_.size[static_cast<int>(k_2)]) * size[k_1];
    const Lanes across = reach - absolute(p_2 * c_1 - p_1 * c_2) - slack;
    const Lanes squared = c_1 * c_1 + c_2 * c_2;
    const Lanes counts = _mm256_and_pd(_mm256_cmp_pd(across * absolute(across), bound * squared, _CMP_LT_OQ),
                                       _mm256_cmp_pd(squared, all(kParallel * kParallel), _CMP_GT_OQ));
    left[k] = static_cast<unsigned>(_mm256_movemask_pd(counts)) & 7U;
    if (left[k] != 0) _mm256_store_pd(depths[k].data(), across / _mm256_sqrt_pd(squared));
  }
  EdgeAxis best;
  best.depth = below;
  bool is_any = false;
  for (;;) {
    // the least of all, measured along its unit vector before it is believed
    double least = best.depth;
    std::size_t at_k = 3, at_i = 0;
    for (std::size_t k = 0; k < 3; ++k)
      for (std::size_t i = 0; left[k] >> i != 0; ++i)
        if ((left[k] >> i & 1U) != 0 && depths[k][i] < least) least = depths[k][i], at_k = k, at_i = i;
    if (at_k == 3) break;
    left[at_k] &= ~(1U << at_i);
    const EdgeAxis measured = across_edges(static_cast<int>(at_i), static_cast<int>(at_k));
    if (measured.depth < best.depth) best = measured, is_any = true;
  }
  if (!is_any) best.depth = kInfinity;
  return best;
}

}  // namespace gravitas::collision
