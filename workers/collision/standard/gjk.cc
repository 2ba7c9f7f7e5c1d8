// GJK with closest points taken region by region (C. Ericson, Real-Time Collision Detection, §
// 5.1), every degenerate simplex falling back on its edges. It never needs an exact answer about a
// sliver: a result that is not closer than the previous one ends the search with the previous one.
#include "workers/collision/standard/gjk.h"

#include <array>
#include <cmath>

namespace gravitas::collision {
namespace {

constexpr int kIterationLimit = 64;

// Up to four points of A - B.
struct Simplex {
  std::array<Vector3, 4> points;
  int count = 0;

  const Vector3& operator[](int i) const { return points[static_cast<std::size_t>(i)]; }
  void push(const Vector3& w) { points[static_cast<std::size_t>(count++)] = w; }
};

// The point of a simplex closest to the origin, and the vertices that carry it.
struct Closest {
  Vector3 point;
  Simplex carrier;
  double squared() const { return point.squaredNorm(); }
};

Closest closest_on_point(const Vector3& a) {
  Closest result{a, {}};
  result.carrier.push(a);
  return result;
}

Closest closest_on_segment(const Vector3& a, const Vector3& b) {
  const Vector3 ab = b - a;
  const double along = -a.dot(ab);
  const double length = ab.squaredNorm();
  if (!(along > 0.0)) return closest_on_point(a);
  if (along >= length) return closest_on_point(b);
  Closest result{a + ab * (along / length), {}};
  result.carrier.push(a);
  result.carrier.push(b);
  return result;
}

const Closest& nearer(const Closest& x, const Closest& y) { return y.squared() < x.squared() ? y : x; }

Closest closest_on_triangle(const Vector3& a, const Vector3& b, const Vector3& c) {
  const Vector3 normal = (b - a).cross(c - a);
  const double area = normal.squaredNorm();
  // signed doubled areas of the origin's projection with each edge, times |normal|
  const double wa = normal.dot(b.cross(c));
  const double wb = normal.dot(c.cross(a));
  const double wc = normal.dot(a.cross(b));
  if (wa > 0.0 && wb > 0.0 && wc > 0.0 && area > 0.0) {
    Closest result{normal * (normal.dot(a) / area), {}};
    result.carrier.push(a);
    result.carrier.push(b);
    result.carrier.push(c);
    return result;
  }
  return nearer(nearer(closest_on_segment(a, b), closest_on_segment(b, c)), closest_on_segment(c, a));
}

// false if the origin is inside; otherwise `out` is the closest point
bool closest_on_tetrahedron(const Simplex& s, Closest* out) {
  constexpr int kFaces[4][4] = {{0, 1, 2, 3}, {0, 1, 3, 2}, {0, 2, 3, 1}, {1, 2, 3, 0}};
  bool outside = false;
  for (const auto& face : kFaces) {
    const Vector3& a = s[face[0]];
    const Vector3 normal = (s[face[1]] - a).cross(s[face[2]] - a);
    const double side_of_origin = -normal.dot(a);
    const double side_of_fourth = normal.dot(s[face[3]] - a);
    // a flat tetrahedron has side_of_fourth = 0 and so no inside
    if (side_of_origin * side_of_fourth > 0.0) continue;
    const Closest candidate = closest_on_triangle(a, s[face[1]], s[face[2]]);
    if (!outside || candidate.squared() < out->squared()) *out = candidate;
    outside = true;
  }
  return outside;
}

bool closest_on_simplex(const Simplex& s, Closest* out) {
  switch (s.count) {
    case 1:
      *out = closest_on_point(s[0]);
      return true;
    case 2:
      *out = closest_on_segment(s[0], s[1]);
      return true;
    case 3:
      *out = closest_on_triangle(s[0], s[1], s[2]);
      return true;
    default:
      return closest_on_tetrahedron(s, out);
  }
}

bool contains(const Simplex& s, const Vector3& w) {
  for (int i = 0; i < s.count; ++i) {
    if (s[i] == w) return true;
  }
  return false;
}

}  // namespace

GjkResult gjk_separation(const ConvexPair& pair, const Vector3& first_direction) {
  const double touching = 1e-11 * pair.reach;
  Closest closest = closest_on_point(pair.support_difference(first_direction));
  for (int i = 0; i < kIterationLimit; ++i) {
    const double squared = closest.squared();
    if (squared <= touching * touching) return {false, Vector3::UnitY()};

    // the supporting plane towards the origin bounds the distance from below: stop when it is met
    const Vector3 w = pair.support_difference(-closest.point);
    const double gap = squared - w.dot(closest.point);
    if (gap <= 1e-15 * pair.reach * std::sqrt(squared) || gap <= 1e-14 * squared) break;
    if (contains(closest.carrier, w)) break;

    Simplex grown = closest.carrier;
    grown.push(w);
    Closest next = closest;
    if (!closest_on_simplex(grown, &next)) {
      // a sliver may seem to contain the origin although the supporting plane keeps it out
      if (w.dot(closest.point) <= 0.0) return {false, Vector3::UnitY()};
      break;
    }
    if (!(next.squared() < squared)) break;
    closest = next;
  }
  return {true, -closest.point / std::sqrt(closest.squared())};
}

}  // namespace gravitas::collision
