// Flat faces of a mesh, of however many triangles: what lies over one has the contacts that it has with a thick box whose
// side is the face.
//
// A triangle alone knows neither which of its edges are edges of the face nor how the whole of a body lies to it. So a
// convex shape whose centre is before the face (of an open mesh: or behind it by less than half of the shape's least half
// extent), and of which all that comes within the margin lies over it, is held
// against a box that is wider and thicker than it. Elsewhere triangles tell their contacts one by one (composite_pairs.h),
// without those of edges and corners inside the face.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <span>

#include "plugin_sdk/geometry/manifold.h"
#include "plugin_sdk/geometry/support_map.h"
#include "plugin_sdk/geometry/triangle_mesh.h"
#include "plugin_sdk/math/pose.h"
#include "workers/collision/standard/seams.h"
#include "workers/collision/standard/shapes.h"

namespace gravitas::collision {

// A convex shape in the frame of the mesh.
struct OverMesh {
  const Shape& shape;
  const SupportMap& map;
  const Pose& X_MC;
  Matrix3 R;

  Vector3 centre() const { return X_MC.position + R * map.centre(); }
  // Of its surface, farthest along the unit vector n.
  Vector3 farthest(const Vector3& n) const {
    return X_MC.position + R * map.support(R.transpose() * n) + map.rounding() * n;
  }
  Box3 box() const;
};

class FlatFaces {
 public:
  FlatFaces(const TriangleMesh& mesh, const OverMesh& over, double margin)
      : mesh_(mesh), over_(over), margin_(margin), level_(1e-7 * over.map.thinnest()) {}

  struct Plane {
    Vector3 up, point;
    bool is_covered;  // by contacts that are told for the whole face
  };

  // Whether a point of the shape that is the lowest over the plane of triangle t, seen from the side of the shape's centre,
  // lies over t; then the contacts if all of the shape does that comes within the margin, else none. In the mesh's frame,
  // the normal from the mesh to the shape. `rests`: of the mesh, in a frame turned by `R_FM` against its own: what they may lay flush
  // with something else is left to the triangles.
  bool find(std::uint32_t t, std::span<const Rest> rests, const Matrix3& R_FM, Manifold* out);
  // The triangles of the plane of the last one that was found touch along its normal.
  void take(bool is_covered) {
    planes_[count_] = found_;
    planes_[count_++].is_covered = is_covered;
  }
  // The same of triangle t, with the normal `up`.
  void take(std::uint32_t t, const Vector3& up) {
    if (count_ < planes_.size() && holding(t) == nullptr) planes_[count_++] = {up, mesh_.corners(t)[0], false};
  }
  // The plane that was taken in which t lies, or null.
  const Plane* holding(std::uint32_t t) const;

 private:
  bool lies_in(const Plane& plane, std::uint32_t t) const;
  bool is_small_and_alone(const std::array<Vector3, 3>& x, std::uint32_t t) const;
  Vector3 entrance(const Vector3& p) const;
  bool are_over(const Plane& plane, std::span<const Vector3> points) const;

  const TriangleMesh& mesh_;
  const OverMesh& over_;
  double margin_;
  double level_;  // m: heights over a plane that count as none
  Plane found_;
  std::array<Plane, 8> planes_;
  std::size_t count_ = 0;
};

// Whether the contact feature of a triangle's face (contour_contacts.h) belongs to an edge or corner that is none of the
// flat face it is part of. `is_turned`: seen from its back.
bool is_inside_flat_face(const TriangleMesh& mesh, std::uint32_t t, bool is_turned, std::uint32_t feature);
// Whether the feature of triangle t farthest along n is such an edge or corner, or t itself.
bool leads_out_inside_flat_face(const TriangleMesh& mesh, std::uint32_t t, const Vector3& n);
// Whether a contact feature is of the triangle's face itself, under a corner of the other shape.
bool is_of_face(std::uint32_t feature);

}  // namespace gravitas::collision
