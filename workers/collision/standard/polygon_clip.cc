// Clipping in a plane.
#include "workers/collision/standard/polygon_clip.h"

#include <algorithm>
#include <cmath>
#include <limits>

namespace gravitas::collision {
namespace {

// signed distance beyond side `side` of the rectangle, > 0 outside
double beyond(const ClipVertex& vertex, int side, double half_u, double half_v) {
  switch (side) {
    case 0:
      return vertex.y - half_v;
    case 1:
      return -vertex.x - half_u;
    case 2:
      return -vertex.y - half_v;
    default:
      return vertex.x - half_u;
  }
}

ClipVertex crossing(const ClipVertex& p, const ClipVertex& q, double at_p, double at_q, int line_out) {
  const double s = std::clamp(at_p / (at_p - at_q), 0.0, 1.0);
  return {p.x + s * (q.x - p.x), p.y + s * (q.y - p.y), line_out};
}

}  // namespace

void clip_to_rectangle(double half_u, double half_v, double tolerance, ClippedPolygon* polygon) {
  for (int side = 0; side < 4; ++side) {
    ClippedPolygon kept;
    for (int i = 0; i < polygon->count; ++i) {
      const ClipVertex& p = (*polygon)[i];
      const ClipVertex& q = (*polygon)[(i + 1) % polygon->count];
      const double at_p = beyond(p, side, half_u, half_v);
      const double at_q = beyond(q, side, half_u, half_v);
      const bool p_inside = at_p <= tolerance;
      const bool q_inside = at_q <= tolerance;
      if (p_inside) kept.push(p);
      if (p_inside && !q_inside) kept.push(crossing(p, q, at_p, at_q, kFirstSide + side));
      if (!p_inside && q_inside) kept.push(crossing(p, q, at_p, at_q, p.line_out));
    }
    *polygon = kept;
  }
}

void clip_to_slab(double start, double end, double half, Interval* interval) {
  const double run = end - start;
  if (run == 0.0) {
    if (std::fabs(start) > half) *interval = {1.0, 0.0};
    return;
  }
  const double s = (-half - start) / run;
  const double t = (half - start) / run;
  interval->from = std::max(interval->from, std::min(s, t));
  interval->to = std::min(interval->to, std::max(s, t));
}

Interval circle_crossings(const FlatPoint& p, const FlatPoint& d, double radius) {
  const double dd = d.x * d.x + d.y * d.y;
  const double pp = p.x * p.x + p.y * p.y;
  if (!(dd > 0.0)) {
    if (pp > radius * radius) return {1.0, 0.0};
    return {-std::numeric_limits<double>::infinity(), std::numeric_limits<double>::infinity()};
  }
  // the distance of the line from the centre, from the cross product: the usual discriminant loses
  // its digits for a small circle far away
  const double length = std::sqrt(dd);
  const double distance = std::fabs(p.x * d.y - p.y * d.x) / length;
  if (distance > radius) return {1.0, 0.0};
  const double half_chord = std::sqrt((radius - distance) * (radius + distance));
  const double nearest = -(p.x * d.x + p.y * d.y) / dd;
  return {nearest - half_chord / length, nearest + half_chord / length};
}

bool polygon_contains(const FlatPolygon& polygon, const FlatPoint& p, double tolerance) {
  double area = 0.0;
  for (std::size_t i = 0; i < 4; ++i) {
    const FlatPoint& q = polygon[i];
    const FlatPoint& r = polygon[(i + 1) % 4];
    area += q.x * r.y - q.y * r.x;
  }
  const double turn = area < 0.0 ? -1.0 : 1.0;
  for (std::size_t i = 0; i < 4; ++i) {
    const FlatPoint& q = polygon[i];
    const FlatPoint& r = polygon[(i + 1) % 4];
    const double dx = r.x - q.x;
    const double dy = r.y - q.y;
    const double left = turn * (dx * (p.y - q.y) - dy * (p.x - q.x));
    if (left < -tolerance * std::sqrt(dx * dx + dy * dy)) return false;
  }
  return true;
}

}  // namespace gravitas::collision
