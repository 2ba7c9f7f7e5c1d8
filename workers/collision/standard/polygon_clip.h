// Clipping in a plane: a convex polygon to a rectangle (Sutherland and Hodgman, "Reentrant polygon
// clipping", CACM 17, 1974), a segment to a strip or a circle. Coordinates in m, no heap.
#pragma once

#include <array>
#include <cstddef>

namespace gravitas::collision {

// ---- polygon to rectangle ----

// Sides of the rectangle as line labels, in the order of the edges of BoxFace: v = +, u = -, v = -,
// u = +. Smaller labels are edges of the polygon that is clipped.
inline constexpr int kFirstSide = 4;

// A vertex and the label of the line on which the edge to the next vertex lies.
struct ClipVertex {
  double x = 0.0;
  double y = 0.0;
  int line_out = 0;
};

// A quadrilateral gains at most one vertex per side; twice that leaves room for doubled ones.
struct ClippedPolygon {
  static constexpr int kCapacity = 16;
  std::array<ClipVertex, kCapacity> vertices;
  int count = 0;

  const ClipVertex& operator[](int i) const { return vertices[static_cast<std::size_t>(i)]; }
  void push(const ClipVertex& vertex) {
    if (count < kCapacity) vertices[static_cast<std::size_t>(count++)] = vertex;
  }
};

// Clips to |x| <= half_u, |y| <= half_v. A vertex outside by no more than `tolerance` is kept as it
// is. May leave nothing.
void clip_to_rectangle(double half_u, double half_v, double tolerance, ClippedPolygon* polygon);

// The index in BoxFace::vertices of the corner in the quadrant of (x, y).
inline int rectangle_corner(double x, double y) {
  if (y >= 0.0) return x >= 0.0 ? 0 : 1;
  return x < 0.0 ? 2 : 3;
}

// ---- segments and points ----

// Parameters along a segment from 0 to 1.
struct Interval {
  double from;
  double to;
  bool empty() const { return !(from <= to); }
};

// Keeps the part of `interval` where the coordinate, running linearly from `start` to `end`, lies
// in [-half, half].
void clip_to_slab(double start, double end, double half, Interval* interval);

struct FlatPoint {
  double x = 0.0;
  double y = 0.0;
};
using FlatPolygon = std::array<FlatPoint, 4>;

// Where the line p + s d is inside the circle about the origin; empty if nowhere. A zero d gives
// all parameters or none.
Interval circle_crossings(const FlatPoint& p, const FlatPoint& d, double radius);

// Whether the point lies inside the convex quadrilateral of either orientation, or outside by no
// more than `tolerance`.
bool polygon_contains(const FlatPolygon& polygon, const FlatPoint& p, double tolerance);

}  // namespace gravitas::collision
