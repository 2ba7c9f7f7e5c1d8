// Convex solids as distance methods see them: the point farthest along a direction, and the touching feature there.
//
// A solid is a core and a rounding: every point within `rounding` of the core. A ball is a point rounded, a capsule a
// segment, so that their curved surfaces cost nothing and are exact. Lengths in m, in the solid's own frame.
#pragma once

#include <array>
#include <cstdint>
#include <memory>
#include <vector>

#include "plugin_sdk/geometry/convex_polyhedron.h"
#include "plugin_sdk/geometry/scene_shape.h"

namespace gravitas {

// The part of a core's surface that meets a plane: one point, the ends of a line, or the corners of a flat face in
// order, counter-clockwise from outside.
struct Contour {
  static constexpr std::size_t kCapacity = 48;

  std::array<Vector3, kCapacity> points;
  // Name the vertex, and the edge from it to the next; unchanged while the solid moves. Below 2^15.
  std::array<std::uint32_t, kCapacity> codes;
  std::size_t count = 0;
  Vector3 normal = Vector3::Zero();  // of a face: unit, outward
  std::uint32_t code = 0;            // of the whole feature

  bool is_face() const { return count >= 3; }
  void add(const Vector3& point, std::uint32_t point_code) {
    if (count == kCapacity) return;
    points[count] = point, codes[count++] = point_code;
  }
};

class SupportMap {
 public:
  virtual ~SupportMap() = default;

  // A point of the core farthest along d (not zero, any length).
  virtual Vector3 support(const Vector3& d) const = 0;
  // The feature of the core that lies within an angle whose sine is `sine` of its supporting plane along the unit
  // vector n. Without an override: the support point.
  virtual void contour(const Vector3& n, double sine, Contour* out) const;

  double rounding() const { return rounding_; }
  // A point inside the core.
  const Vector3& centre() const { return centre_; }
  // Of the farthest point from the origin, the rounding included.
  double radius() const { return radius_; }
  // The least half extent: what tolerances are measured by. Never 0.
  double thinnest() const { return thinnest_; }

 protected:
  SupportMap() = default;
  SupportMap(const SupportMap&) = default;
  SupportMap& operator=(const SupportMap&) = default;

  double rounding_ = 0.0;
  double radius_ = 0.0;
  double thinnest_ = 0.0;
  Vector3 centre_ = Vector3::Zero();
};

// Of a sphere, box, cylinder, capsule, cone or polyhedron (which must outlive it); null for other kinds.
std::unique_ptr<SupportMap> make_support_map(const SceneShape& shape);

// A flat triangle, as a solid of no thickness.
class TriangleMap final : public SupportMap {
 public:
  // Codes of its face in contours, seen from its normal's side and from the other.
  static constexpr std::uint32_t kFront = 7, kBack = 8;

  // `normal`: unit, that of the corners' order.
  TriangleMap(const std::array<Vector3, 3>& corners, const Vector3& normal);
  Vector3 support(const Vector3& d) const override;
  void contour(const Vector3& n, double sine, Contour* out) const override;
  const std::array<Vector3, 3>& corners() const { return corners_; }
  const Vector3& normal() const { return normal_; }

 private:
  std::array<Vector3, 3> corners_;
  Vector3 normal_;
};

}  // namespace gravitas
