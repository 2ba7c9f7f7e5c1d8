// Random shapes and directions for the tests of geometry: the same numbers on every library.
#pragma once

#include <cmath>
#include <cstdint>
#include <memory>
#include <random>
#include <string>
#include <vector>

#include "plugin_sdk/geometry/scene_shape.h"

namespace gravitas::test {

class RandomShapes {
 public:
  explicit RandomShapes(std::uint64_t seed) : generator_(seed) {}

  double uniform(double low, double high) {
    return low + (high - low) * (static_cast<double>(generator_() >> 11) * 0x1p-53);
  }
  Vector3 vector(double low, double high) {
    const double x = uniform(low, high), y = uniform(low, high);
    return {x, y, uniform(low, high)};
  }
  Vector3 direction() {
    for (;;) {
      const Vector3 v = vector(-1, 1);
      if (v.norm() <= 1.0 && v.norm() > 0.1) return v.normalized();
    }
  }
  Quaternion rotation() {
    const Vector3 axis = direction();
    const double angle = uniform(0.0, 3.14159);
    return {std::cos(0.5 * angle), std::sin(0.5 * angle) * axis.x(), std::sin(0.5 * angle) * axis.y(),
            std::sin(0.5 * angle) * axis.z()};
  }

  // A convex bounded shape with sizes about a metre.
  SceneShape convex(SceneShape::Kind kind) {
    SceneShape shape;
    shape.kind = kind;
    const double radius = uniform(0.3, 1.2), half = uniform(0.3, 1.2);
    shape.size = Vector3(radius, half, radius);
    if (kind == SceneShape::Kind::kSphere) shape.size = Vector3::Constant(radius);
    if (kind == SceneShape::Kind::kBox) shape.size = vector(0.3, 1.2);
    if (kind == SceneShape::Kind::kConvexPolyhedron) shape.polyhedron = hull(14, Vector3(radius, half, 1.0));
    return shape;
  }

  std::shared_ptr<const ConvexPolyhedron> hull(int points, const Vector3& half_extents) {
    std::vector<Vector3> cloud;
    for (int i = 0; i < points; ++i) cloud.push_back(direction().cwiseProduct(half_extents));
    std::string why;
    auto made = convex_hull(cloud, &why);
    return made ? std::make_shared<ConvexPolyhedron>(std::move(*made)) : nullptr;
  }

 private:
  std::mt19937_64 generator_;
};

inline constexpr SceneShape::Kind kConvexKinds[] = {SceneShape::Kind::kSphere,   SceneShape::Kind::kBox,
                                                    SceneShape::Kind::kCylinder, SceneShape::Kind::kCapsule,
                                                    SceneShape::Kind::kCone,     SceneShape::Kind::kConvexPolyhedron};

}  // namespace gravitas::test
