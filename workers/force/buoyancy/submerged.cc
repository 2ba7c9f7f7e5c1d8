#include "workers/force/buoyancy/submerged.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <vector>

namespace gravitas {
namespace {

// Volume and first moment about `apex` of the pyramids over the triangles of a polygon.
void add_pyramids(std::span<const Vector3> polygon, double* volume, Vector3* moment) {
  for (std::size_t i = 2; i < polygon.size(); ++i) {
    const Vector3 &a = polygon[0], &b = polygon[i - 1], &c = polygon[i];
    const double part = a.dot(b.cross(c)) / 6.0;
    *volume += part;
    *moment += 0.25 * part * (a + b + c);
  }
}

}  // namespace

Submerged submerged_ball(const Vector3& centre, double radius, const Vector3& up, double level) {
  Submerged result;
  result.whole_volume = 4.0 / 3.0 * std::numbers::pi * radius * radius * radius;
  const double depth = std::clamp(radius - (up.dot(centre) - level), 0.0, 2.0 * radius);
  result.volume = std::numbers::pi * depth * depth * (3.0 * radius - depth) / 3.0;
  const double left = 2.0 * radius - depth;
  const double below = depth > 0.0 ? 3.0 * left * left / (4.0 * (3.0 * radius - depth)) : 0.0;
  result.centre = centre - below * up;
  return result;
}

Submerged submerged_polyhedron(const Surface& surface, const Pose& pose, const Vector3& up, double level) {
  // from the point of the plane next to the frame's origin
  const Vector3 apex = pose.position - (up.dot(pose.position) - level) * up;
  std::vector<Vector3> from_apex, polygon, part;
  std::vector<double> heights, height;
  for (const Vector3& vertex : surface.vertex) {
    from_apex.push_back(pose.orientation * vertex + (pose.position - apex));
    heights.push_back(up.dot(from_apex.back()));
  }
  double volume = 0.0, whole = 0.0;
  Vector3 moment = Vector3::Zero(), whole_moment = Vector3::Zero();
  for (std::size_t face = 0; face < surface.faces(); ++face) {
    polygon.clear(), height.clear(), part.clear();
    for (std::uint32_t k = surface.face_begin[face]; k < surface.face_begin[face + 1]; ++k) {
      polygon.push_back(from_apex[surface.corner[k]]);
      height.push_back(heights[surface.corner[k]]);
    }
    clip_polygon(polygon, height, &part);
    add_pyramids(part, &volume, &moment);
    add_pyramids(polygon, &whole, &whole_moment);
  }
  Submerged result;
  result.whole_volume = whole;
  result.volume = std::clamp(volume, 0.0, whole);
  result.centre = apex + (volume > 0.0 ? Vector3(moment / volume) : Vector3(whole_moment / whole));
  return result;
}

}  // namespace gravitas
