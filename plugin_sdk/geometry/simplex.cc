#include "plugin_sdk/geometry/simplex.h"

#include <algorithm>
#include <cmath>

namespace gravitas {
namespace {

const SimplexPoint& nearer(const SimplexPoint& x, const SimplexPoint& y) {
  return y.point.squaredNorm() < x.point.squaredNorm() ? y : x;
}

// Squares of sines below which a triangle is its edges, and a tetrahedron its faces: what their normals say is rounding.
constexpr double kSliver = 1e-22;
constexpr double kFlatSimplex = 1e-24;

// A point of a side as one of the whole: `rows` says which corners the side has.
template <std::size_t N>
SimplexPoint of_whole(const SimplexPoint& side, const std::array<std::size_t, N>& rows) {
  SimplexPoint whole{side.point, {}};
  for (std::size_t i = 0; i < N; ++i) whole.weight[rows[i]] = side.weight[i];
  return whole;
}

}  // namespace

SimplexPoint closest_on_segment(const Vector3& a, const Vector3& b) {
  const Vector3 ab = b - a;
  const double along = -a.dot(ab), length = ab.squaredNorm();
  if (!(along > 0.0)) return {a, {1.0}};
  if (!(along < length)) return {b, {0.0, 1.0}};
  const double t = along / length;
  return {a + t * ab, {1.0 - t, t}};
}

SimplexPoint closest_on_triangle(const Vector3& a, const Vector3& b, const Vector3& c) {
  const Vector3 ab = b - a, ac = c - a;
  const Vector3 normal = ab.cross(ac);
  const double area = normal.squaredNorm();
  const double longest = std::max({ab.squaredNorm(), ac.squaredNorm(), (ac - ab).squaredNorm()});
  // signed doubled areas of the origin's projection with each edge, times |normal|
  const double wa = normal.dot(b.cross(c)), wb = normal.dot(c.cross(a)), wc = normal.dot(a.cross(b));
  const double sum = wa + wb + wc;
  const bool is_sliver = !(area > kSliver * longest * longest);
  if (!is_sliver && wa > 0.0 && wb > 0.0 && wc > 0.0)
    return {normal * (normal.dot(a) / area), {wa / sum, wb / sum, wc / sum}};
  const SimplexPoint on_ab = of_whole<2>(closest_on_segment(a, b), {0, 1});
  const SimplexPoint on_bc = of_whole<2>(closest_on_segment(b, c), {1, 2});
  const SimplexPoint on_ca = of_whole<2>(closest_on_segment(c, a), {2, 0});
  return nearer(nearer(on_ab, on_bc), on_ca);
}

SimplexPoint closest_on_tetrahedron(const Vector3& a, const Vector3& b, const Vector3& c, const Vector3& d) {
  constexpr std::array<std::array<std::size_t, 4>, 4> kFaces = {
      {{0, 1, 2, 3}, {0, 1, 3, 2}, {0, 2, 3, 1}, {1, 2, 3, 0}}};
  const std::array<Vector3, 4> x = {a, b, c, d};
  SimplexPoint best;
  bool is_outside = false;
  std::array<double, 4> inside{};
  for (const auto& face : kFaces) {
    const Vector3& p = x[face[0]];
    const Vector3 normal = (x[face[1]] - p).cross(x[face[2]] - p);
    const double side_of_origin = -normal.dot(p), side_of_fourth = normal.dot(x[face[3]] - p);
    // a flat tetrahedron has no inside
    const double long_1 = (x[face[1]] - p).squaredNorm(), long_2 = (x[face[2]] - p).squaredNorm();
    const double area = normal.squaredNorm();
    const bool is_flat = !(area > kSliver * long_1 * long_2) ||
                         !(side_of_fourth * side_of_fourth > kFlatSimplex * area * (x[face[3]] - p).squaredNorm());
    if (!is_flat && side_of_origin * side_of_fourth > 0.0) {
      inside[face[3]] = side_of_origin / side_of_fourth;
      continue;
    }
    const SimplexPoint on_face =
        of_whole<3>(closest_on_triangle(p, x[face[1]], x[face[2]]), {face[0], face[1], face[2]});
    if (!is_outside || on_face.point.squaredNorm() < best.point.squaredNorm()) best = on_face;
    is_outside = true;
  }
  if (is_outside) return best;
  const double sum = inside[0] + inside[1] + inside[2] + inside[3];
  for (std::size_t i = 0; i < 4; ++i) best.weight[i] = inside[i] / sum;
  return best;
}

SimplexPoint closest_on_simplex(std::span<const Vector3> x) {
  switch (x.size()) {
    case 1:
      return {x[0], {1.0}};
    case 2:
      return closest_on_segment(x[0], x[1]);
    case 3:
      return closest_on_triangle(x[0], x[1], x[2]);
    default:
      return closest_on_tetrahedron(x[0], x[1], x[2], x[3]);
  }
}

std::optional<double> ray_on_triangle(const Vector3& origin, const Vector3& direction,
                                      const std::array<Vector3, 3>& corners) {
  const Vector3 ab = corners[1] - corners[0], ac = corners[2] - corners[0];
  const Vector3 p = direction.cross(ac);
  const double determinant = ab.dot(p);
  if (determinant == 0.0) return std::nullopt;
  const Vector3 arm = origin - corners[0];
  const Vector3 q = arm.cross(ab);
  const double u = arm.dot(p) / determinant, v = direction.dot(q) / determinant, t = ac.dot(q) / determinant;
  constexpr double kMostBorder = 2e-6;
  if (!(u >= -kMostBorder && v >= -kMostBorder && u + v <= 1.0 + kMostBorder && t >= 0.0)) return std::nullopt;
  // neighbours both take their border, wider by what far origins round off, so that no ray slips through between them
  const double longest = std::sqrt(std::max(ab.squaredNorm(), ac.squaredNorm()));
  const double rounded = std::sqrt(arm.squaredNorm() * direction.squaredNorm()) * longest / std::fabs(determinant);
  const double border = 1e-14 + std::min(1e-15 * rounded, 1e-6);  // what runs along the plane has no digits to tell
  if (!(u >= -border && v >= -border && u + v <= 1.0 + border)) return std::nullopt;
  return t;
}

}  // namespace gravitas
