#include "plugin_sdk/geometry/contour_contacts.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "plugin_sdk/math/rotation.h"

namespace gravitas::collision {
namespace {

// Faces and lines within this of lying flat on each other touch as such (sine of the angle): where an edge meets a face or
// another edge, the rest of two faces that are nearly parallel is known to the solver, too, else bodies rock from edge to
// edge. So near a face's normal may be preferred to the least, too.
constexpr double kFlat = 0.2;
constexpr double kFacePreference = 0.01;
constexpr double kFaceTie = 1e-7;

// Features within this angle (its sine) of the plane touch as such: at the far end of a tilted face the gap decides.
constexpr double kFacing = 0.2;

using Vector2 = Eigen::Vector2d;

double cross(const Vector2& u, const Vector2& v) { return u.x() * v.y() - u.y() * v.x(); }

// How far along the normal the surface of a rounded line lies from its core, `from_end` of the `run` that the line has across the
// normal from the end that is nearer to the surface; it rises by `rise` along the normal.
double rounded_height(double radius, double rise, double run, double from_end) {
  if (!(run > 0.0)) return radius;
  const double slope = rise / run, stretch = std::sqrt(1.0 + slope * slope);
  const double of_cap = radius * slope / stretch;  // where the ball around that end is the surface
  return from_end < of_cap ? from_end * slope + std::sqrt(radius * radius - from_end * from_end) : radius * stretch;
}

// A contour seen along the normal.
class FlatContour {
 public:
  FlatContour(const Contour& contour, double rounding, const Vector3& normal, const TangentBasis& basis)
      : contour_(contour), normal_(normal), rounding_(rounding) {
    for (std::size_t i = 0; i < contour.count; ++i)
      points_[i] = {basis.first.dot(contour.points[i]), basis.second.dot(contour.points[i])};
    double area = 0.0;
    for (std::size_t i = 1; i + 1 < contour.count; ++i)
      area += cross(points_[i] - points_[0], points_[i + 1] - points_[0]);
    turn_ = area < 0.0 ? -1.0 : 1.0;
  }

  std::size_t count() const { return contour_.count; }
  std::size_t edges() const { return count() >= 3 ? count() : count() - 1; }
  const Vector2& point(std::size_t i) const { return points_[i]; }
  const Vector2& end_of_edge(std::size_t i) const { return points_[(i + 1) % count()]; }
  std::uint32_t code(std::size_t i) const { return contour_.codes[i]; }
  // Of the edge from corner i to the next: that of a line does not depend on where it begins.
  std::uint32_t edge_code(std::size_t i) const { return count() == 2 ? contour_.code : contour_.codes[i]; }
  std::uint32_t own_code() const { return contour_.code; }
  const Vector3& place(std::size_t i) const { return contour_.points[i]; }

  // Whether x lies over the feature, or beside it by no more than `tolerance`.
  bool holds(const Vector2& x, double tolerance) const {
    if (count() == 1) return (x - points_[0]).squaredNorm() <= tolerance * tolerance;
    if (count() == 2) {
      const double t = std::clamp(along_line(x), 0.0, 1.0);
      return (points_[0] + t * (points_[1] - points_[0]) - x).squaredNorm() <= tolerance * tolerance;
    }
    for (std::size_t i = 0; i < count(); ++i) {
      const Vector2 edge = end_of_edge(i) - points_[i];
      const double length = std::sqrt(edge.squaredNorm());
      if (turn_ * cross(edge, x - points_[i]) < -tolerance * length) return false;
    }
    return true;
  }

  // The surface's coordinate along the normal over x, without the rounding; `at` is a place that lies over it.
  double height(const Vector2& x, const Vector3& at) const {
    if (count() == 1) return normal_.dot(contour_.points[0]);
    if (count() == 2) {
      const double t = std::clamp(along_line(x), 0.0, 1.0);
      return (1.0 - t) * normal_.dot(contour_.points[0]) + t * normal_.dot(contour_.points[1]);
    }
    return normal_.dot(at) + contour_.normal.dot(contour_.points[0] - at) / contour_.normal.dot(normal_);
  }
  // With it: on the side where the normal points to, or (`side` = -1) the other.
  double surface(const Vector2& x, const Vector3& at, double side) const {
    double rounding = rounding_;
    if (count() == 2 && rounding > 0.0) {
      const double rise = side * normal_.dot(contour_.points[1] - contour_.points[0]);
      const double run = (points_[1] - points_[0]).norm(), t = std::clamp(along_line(x), 0.0, 1.0);
      rounding = rounded_height(rounding, std::fabs(rise), run, run * (rise > 0.0 ? 1.0 - t : t));
    }
    return height(x, at) + side * rounding;
  }

 private:
  double along_line(const Vector2& x) const {
    const Vector2 line = points_[1] - points_[0];
    const double squared = line.squaredNorm();
    return squared > 0.0 ? line.dot(x - points_[0]) / squared : 0.0;
  }

  const Contour& contour_;
  const Vector3& normal_;
  std::array<Vector2, Contour::kCapacity> points_;
  double rounding_;
  double turn_ = 1.0;
};

// 15 bits of each.
std::uint32_t feature_of(std::uint32_t a, std::uint32_t b) { return (a & 0x7FFFU) << 15 | (b & 0x7FFFU); }

struct Patch {
  const FlatContour& a;
  const FlatContour& b;
  const Vector3& normal;
  const TangentBasis& basis;
  ContactCandidates* out;

  void add(const Vector3& at, std::uint32_t feature) const {
    const Vector2 x(basis.first.dot(at), basis.second.dot(at));
    const double high = a.surface(x, at, 1.0), low = b.surface(x, at, -1.0);
    out->add({at + normal * (0.5 * (high + low) - normal.dot(at)), normal, high - low, feature});
  }
};

double shallower_by(const PlacedPair& pair, double earlier) {
  return std::max(kFaceTie * pair.thinnest(), 1e-14 * pair.reach()) + kFacePreference * std::max(earlier, 0.0);
}

}  // namespace

void place_contour(const Matrix3& R_AB, const Vector3& p_AB, Contour* contour) {
  for (std::size_t i = 0; i < contour->count; ++i) contour->points[i] = p_AB + R_AB * contour->points[i];
  contour->normal = R_AB * contour->normal;
}

void add_contour_contacts(const Contour& a, double rounding_a, const Contour& b, double rounding_b,
                          const Vector3& normal, double tolerance, ContactCandidates* out) {
  const TangentBasis basis = orthonormal_basis(normal);
  const FlatContour flat_a(a, rounding_a, normal, basis), flat_b(b, rounding_b, normal, basis);
  const Patch patch{flat_a, flat_b, normal, basis, out};
  // two lines that are nearly parallel touch along their overlap, although they cross in a point at most
  double beside = tolerance;
  if (a.count == 2 && b.count == 2) {
    const Vector2 u = flat_a.point(1) - flat_a.point(0), v = flat_b.point(1) - flat_b.point(0);
    const double lengths = std::sqrt(u.squaredNorm() * v.squaredNorm());
    if (std::fabs(cross(u, v)) <= 0.02 * lengths)
      beside = std::max(tolerance, 0.02 * std::sqrt(std::min(u.squaredNorm(), v.squaredNorm())));
  }
  for (std::size_t i = 0; i < b.count; ++i)
    if (flat_a.holds(flat_b.point(i), beside))
      patch.add(flat_b.place(i), feature_of(flat_a.own_code(), flat_b.code(i)));
  for (std::size_t i = 0; i < a.count; ++i)
    if (flat_b.holds(flat_a.point(i), beside))
      patch.add(flat_a.place(i), feature_of(flat_a.code(i), flat_b.own_code()));
  if (beside > tolerance && out->count() > 0) return;
  for (std::size_t i = 0; i < flat_a.edges(); ++i) {
    const Vector2& p = flat_a.point(i);
    const Vector2 u = flat_a.end_of_edge(i) - p;
    for (std::size_t k = 0; k < flat_b.edges(); ++k) {
      const Vector2& q = flat_b.point(k);
      const Vector2 v = flat_b.end_of_edge(k) - q;
      const double turn = cross(u, v);
      if (!(std::fabs(turn) > 1e-9 * std::sqrt(u.squaredNorm() * v.squaredNorm()))) continue;
      const double s = cross(q - p, v) / turn, t = cross(q - p, u) / turn;
      if (!(s >= 0.0 && s <= 1.0 && t >= 0.0 && t <= 1.0)) continue;
      const Vector3& from = flat_a.place(i);
      const Vector3& to = flat_a.place((i + 1) % a.count);
      patch.add(from + s * (to - from), feature_of(0x4000U | flat_a.edge_code(i), 0x4000U | flat_b.edge_code(k)));
    }
  }
}

void collide_support_maps(const PlacedPair& pair, double margin, Manifold* out) {
  out->count = 0;
  const Separation least = find_separation(pair, margin);
  if (!(least.depth >= -margin)) return;
  const double tie = std::max(1e-9 * pair.thinnest(), 1e-14 * pair.reach());

  const auto contours = [&](const Vector3& n, double sine, Contour* a, Contour* b) {
    pair.a.contour(n, sine, a);
    pair.b.contour(pair.R_AB.transpose() * -n, sine, b);
    place_contour(pair.R_AB, pair.p_AB, b);
  };
  Contour a, b;
  contours(least.normal, kFlat, &a, &b);
  // a face of a before one of b, and both before the least, unless the later is shallower by more than the preference
  Vector3 normal = least.normal;
  double depth = least.depth;
  const auto offer = [&](const Vector3& face, double* best, Vector3* chosen) {
    const double along = pair.depth_along(face);
    if (std::isfinite(*best) && !(along < *best - shallower_by(pair, *best))) return;
    *best = along, *chosen = face;
  };
  double face_depth = std::numeric_limits<double>::infinity();
  Vector3 face = least.normal;
  if (a.is_face()) offer(a.normal, &face_depth, &face);
  if (b.is_face()) offer(-b.normal, &face_depth, &face);
  if (std::isfinite(face_depth) && !(depth < face_depth - shallower_by(pair, face_depth)))
    normal = face, depth = face_depth;

  ContactCandidates candidates(margin, tie, std::max(1e-6 * pair.thinnest(), tie));
  const double equal = std::max(1e-6 * pair.thinnest(), tie);
  const auto try_normal = [&](const Vector3& n, double wanted) {
    candidates.clear();
    contours(n, kFlat, &a, &b);
    add_contour_contacts(a, pair.a.rounding(), b, pair.b.rounding(), n, tie, &candidates);
    return candidates.deepest() >= wanted - equal;
  };
  if (!try_normal(normal, depth) && (normal == least.normal || !try_normal(least.normal, least.depth))) {
    // the deepest place lies beside the features: the points that touch there
    contours(least.normal, 0.0, &a, &b);
    const Vector3& n = least.normal;
    const Vector3 middle = 0.5 * (least.point_a + least.point_b);
    const double level =
        0.5 * (n.dot(pair.support_a(n)) + pair.a.rounding() + n.dot(pair.support_b(n)) - pair.b.rounding());
    candidates.add({middle + n * (level - n.dot(middle)), n, least.depth, feature_of(a.code, b.code)});
  }
  candidates.reduce_to(out);
}

void collide_halfspace_support_map(const Vector3& up, const SupportMap& map, const Matrix3& R, const Vector3& p,
                                   double margin, Manifold* out) {
  const Vector3 down = -(R.transpose() * up);
  const double tie = 1e-9 * map.thinnest();
  ContactCandidates candidates(margin, tie, tie);
  const auto add = [&](const Vector3& point, std::uint32_t code, double rounding) {
    const Vector3 x = p + R * point - rounding * up;
    const double depth = -up.dot(x);
    candidates.add({x + (0.5 * depth) * up, up, depth, code});
  };
  Contour contour;
  map.contour(down, kFacing, &contour);
  // of a feature that does not lie flat the deepest point may be another
  double deepest = -std::numeric_limits<double>::infinity();
  for (std::size_t i = 0; i < contour.count; ++i) deepest = std::max(deepest, down.dot(contour.points[i]));
  const Vector3 support = map.support(down);
  if (down.dot(support) > deepest + tie) {
    Contour point;
    map.contour(down, 0.0, &point);
    add(support, point.count == 1 ? point.codes[0] : 0x7FFFU, map.rounding());
  }
  const bool is_line = contour.count == 2 && map.rounding() > 0.0;
  const Vector3 line = is_line ? Vector3(contour.points[1] - contour.points[0]) : Vector3(Vector3::Zero());
  const double fall = down.dot(line), run = (line - fall * down).norm();
  for (std::size_t i = 0; i < contour.count; ++i) {
    const bool is_upper = is_line && (i == 0) == (fall > 0.0);
    add(contour.points[i], contour.codes[i],
        is_upper ? rounded_height(map.rounding(), std::fabs(fall), run, run) : map.rounding());
  }
  candidates.reduce_to(out);
}

}  // namespace gravitas::collision
