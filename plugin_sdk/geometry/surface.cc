#include "plugin_sdk/geometry/surface.h"

#include <cmath>
#include <numbers>

#include "plugin_sdk/math/transcendental.h"

namespace gravitas {

void Surface::add_face(std::initializer_list<std::uint32_t> corners) {
  corner.insert(corner.end(), corners);
  face_begin.push_back(static_cast<std::uint32_t>(corner.size()));
}

Surface box_surface(const Vector3& half_extents) {
  Surface box;
  for (std::uint32_t i = 0; i < 8; ++i)
    box.vertex.push_back(half_extents.cwiseProduct(
        Vector3((i & 1) != 0 ? 1.0 : -1.0, (i & 2) != 0 ? 1.0 : -1.0, (i & 4) != 0 ? 1.0 : -1.0)));
  box.add_face({0, 4, 6, 2}), box.add_face({1, 3, 7, 5});
  box.add_face({0, 1, 5, 4}), box.add_face({2, 6, 7, 3});
  box.add_face({0, 2, 3, 1}), box.add_face({4, 5, 7, 6});
  return box;
}

Surface revolved_surface(std::span<const MeridianPoint> meridian, std::uint32_t sides) {
  const double step = 2.0 * std::numbers::pi / sides;
  const double widened = std::sqrt(step / math::sin(step));
  Surface surface;
  // a ring of vertices per point, all of them the same at the axis
  for (const MeridianPoint& point : meridian) {
    for (std::uint32_t i = 0; i < sides; ++i) {
      const math::SinCos angle = math::sincos(i * step);
      const double radius = widened * point.radius;
      surface.vertex.emplace_back(radius * angle.sin, point.height, radius * angle.cos);
    }
  }
  for (std::uint32_t ring = 0; ring + 1 < meridian.size(); ++ring) {
    for (std::uint32_t i = 0; i < sides; ++i) {
      const std::uint32_t next = (i + 1) % sides, below = ring * sides, above = below + sides;
      if (meridian[ring].radius == 0.0) {
        surface.add_face({below + i, above + next, above + i});
      } else if (meridian[ring + 1].radius == 0.0) {
        surface.add_face({below + i, below + next, above + i});
      } else {
        surface.add_face({below + i, below + next, above + next, above + i});
      }
    }
  }
  const auto last = static_cast<std::uint32_t>((meridian.size() - 1) * sides);
  if (meridian.front().radius > 0.0) {
    for (std::uint32_t i = sides; i-- > 0;) surface.corner.push_back(i);
    surface.face_begin.push_back(static_cast<std::uint32_t>(surface.corner.size()));
  }
  if (meridian.back().radius > 0.0) {
    for (std::uint32_t i = 0; i < sides; ++i) surface.corner.push_back(last + i);
    surface.face_begin.push_back(static_cast<std::uint32_t>(surface.corner.size()));
  }
  return surface;
}

void clip_polygon(std::span<const Vector3> polygon, std::span<const double> values, std::vector<Vector3>* out) {
  for (std::size_t i = 0; i < polygon.size(); ++i) {
    const std::size_t next = i + 1 == polygon.size() ? 0 : i + 1;
    const double here = values[i], there = values[next];
    if (here <= 0.0) out->push_back(polygon[i]);
    if ((here < 0.0 && there > 0.0) || (here > 0.0 && there < 0.0))
      out->push_back(polygon[i] + here / (here - there) * (polygon[next] - polygon[i]));
  }
}

}  // namespace gravitas
