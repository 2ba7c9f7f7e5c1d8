// Closed polyhedra as faces, and parts of their faces, for forces that act on a body's surface.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "plugin_sdk/math/types.h"

namespace gravitas {

// Faces are planar and convex, counter-clockwise seen from outside. Face i has the corners
// corner[face_begin[i]] ... corner[face_begin[i + 1] - 1], rows of `vertex`.
struct Surface {
  std::vector<Vector3> vertex;  // m
  std::vector<std::uint32_t> face_begin = {0};
  std::vector<std::uint32_t> corner;

  std::size_t faces() const { return face_begin.size() - 1; }
  void add_face(std::initializer_list<std::uint32_t> corners);
};

// A box about the origin.
Surface box_surface(const Vector3& half_extents);

// A point (radius, height) of a meridian, m.
struct MeridianPoint {
  double radius;
  double height;
};

// The body of revolution about y of a meridian from its lower end to its upper one, as polyhedron of `sides` (>= 3)
// sides, widened so that every section has the circle's area: the volume of a cylinder or cone is exact. Ends with a
// radius above 0 are closed by a face.
Surface revolved_surface(std::span<const MeridianPoint> meridian, std::uint32_t sides);

// Appends to *out the corners of the part of a convex polygon where a linear function, given by its values at the
// corners, is <= 0. Sutherland and Hodgman's clipping.
void clip_polygon(std::span<const Vector3> polygon, std::span<const double> values, std::vector<Vector3>* out);

}  // namespace gravitas
