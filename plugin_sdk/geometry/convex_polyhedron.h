// Convex polyhedra: checked when they are made, so that everything that uses one may rely on its convexity.
//
// Lengths in m, in the polyhedron's own frame. The same input gives the same polyhedron, bit for bit.
#pragma once

#include <cstdint>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "plugin_sdk/math/types.h"

namespace gravitas {

struct ConvexPolyhedron {
  // A flat face: its corners run counter-clockwise seen from outside.
  struct Face {
    Vector3 normal;  // unit, outward
    double offset;   // m: normal . x <= offset for every vertex, with equality for the corners within rounding
    std::uint32_t begin;
    std::uint32_t count;
  };

  std::vector<Vector3> vertices;
  std::vector<Face> faces;
  std::vector<std::uint32_t> corners;  // of all faces: those of a face stand at begin … begin + count

  std::span<const std::uint32_t> corners_of(const Face& face) const {
    return std::span(corners).subspan(face.begin, face.count);
  }
  // A vertex farthest along d, which need not be a unit vector; the first of those that are equally far.
  std::uint32_t support(const Vector3& d) const;
  // Every face cut into triangles from its first corner.
  std::vector<std::uint32_t> triangles() const;
};

// The polyhedron with these faces, each a list of at least three indices of vertices in order round it; all lists run
// the same way, from outside or from inside. Coplanar neighbours are merged, vertices that belong to no face dropped.
//
// Nothing, and in *why the face (from 0) and what is wrong with it, if an index is none of a vertex or stands twice in
// a face, a face has no area or is not flat, an edge has not exactly one face on either side, the solid has no volume,
// or a vertex lies above a face by more than 1e-6 of the solid's extent (1e-3 of its thickness where that is less).
std::optional<ConvexPolyhedron> make_convex_polyhedron(std::span<const Vector3> vertices,
                                                       std::span<const std::vector<std::uint32_t>> faces,
                                                       std::string* why);

// The hull of points (by qhull). Nothing, and in *why the reason, if they are fewer than four, one is not finite, or
// all lie in one plane.
std::optional<ConvexPolyhedron> convex_hull(std::span<const Vector3> points, std::string* why);

}  // namespace gravitas
