// What the narrow phase answers for one pair of shapes: at most four contact points. Four suffice
// to hold a body on a face; the capacity is fixed so that a query never touches the heap.
#pragma once

#include <array>
#include <cstdint>

#include "plugin_sdk/math/types.h"

namespace gravitas::collision {

inline constexpr int kManifoldCapacity = 4;

// One contact between shapes a and b.
struct ContactPoint {
  // World (m). Midway between the point of a's surface and the point of b's surface that touch:
  // these are point + normal * depth / 2 and point - normal * depth / 2.
  Vector3 point = Vector3::Zero();
  // World, unit, from a to b: moving b along it separates the pair.
  Vector3 normal = Vector3::UnitY();
  // m, > 0 when overlapping, < 0 for a gap.
  double depth = 0.0;
  // Names the features (vertices, edges, faces, caps, rims) that touch. Unique inside the manifold,
  // and unchanged by a small motion that leaves the same features in touch.
  std::uint32_t feature = 0;
};

// The contacts of one pair in ascending order of `feature`; those from `count` on mean nothing.
struct Manifold {
  std::array<ContactPoint, kManifoldCapacity> contacts;
  int count = 0;
};

}  // namespace gravitas::collision
