// What the tests of the narrow phase share: short names for shapes and poses, reproducible random
// pairs, and a second opinion on every answer that uses nothing of the narrow phase but the shapes'
// support values (themselves checked against sampled points).
#pragma once

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <limits>
#include <random>

#include "workers/collision/standard/narrow_phase.h"

namespace gravitas::collision::test {

inline Shape sphere(double radius) { return {ShapeType::kSphere, Vector3(radius, 0, 0)}; }
inline Shape box(double x, double y, double z) { return {ShapeType::kBox, Vector3(x, y, z)}; }
inline Shape cylinder(double radius, double half_height) {
  return {ShapeType::kCylinder, Vector3(radius, half_height, 0)};
}
inline Shape halfspace() { return {ShapeType::kHalfspace, Vector3::Zero()}; }

inline Pose at(double x, double y, double z) { return {Vector3(x, y, z), Quaternion::Identity()}; }
inline Pose at(const Vector3& p, const Vector3& axis, double angle) {
  return {p, Quaternion(Eigen::AngleAxisd(angle, axis.normalized()))};
}

inline Manifold contacts_of(const Shape& a, const Pose& X_WA, const Shape& b, const Pose& X_WB, double margin = 0.0) {
  Manifold manifold;
  collide(a, X_WA, b, X_WB, margin, &manifold);
  return manifold;
}

inline const ContactPoint& contact(const Manifold& manifold, int i) {
  return manifold.contacts[static_cast<std::size_t>(i)];
}

inline double deepest(const Manifold& manifold) {
  double depth = -std::numeric_limits<double>::infinity();
  for (int i = 0; i < manifold.count; ++i) depth = std::max(depth, contact(manifold, i).depth);
  return depth;
}

// Uniform numbers from the raw generator: the same on every library.
class Random {
 public:
  explicit Random(std::uint64_t seed) : generator_(seed) {}

  double uniform(double low, double high) {
    return low + (high - low) * (static_cast<double>(generator_() >> 11) * 0x1p-53);
  }
  Vector3 vector(double low, double high) {
    const double x = uniform(low, high);
    const double y = uniform(low, high);
    return Vector3(x, y, uniform(low, high));
  }
  Vector3 direction() {
    for (;;) {
      const Vector3 v = vector(-1, 1);
      if (v.norm() <= 1.0 && v.norm() > 0.1) return v.normalized();
    }
  }
  Quaternion rotation() {
    for (;;) {
      const Vector3 v = vector(-1, 1);
      const double w = uniform(-1, 1);
      const double norm = std::sqrt(v.squaredNorm() + w * w);
      if (norm <= 1.0 && norm > 0.1) {
        return Quaternion(w / norm, v.x() / norm, v.y() / norm, v.z() / norm);
      }
    }
  }

 private:
  std::mt19937_64 generator_;
};

// Distance (m) of the supporting plane with outward unit normal n_S from the centre.
inline double support_of(const Shape& shape, const Vector3& n_S) {
  if (shape.type == ShapeType::kSphere) return shape.size.x();
  if (shape.type == ShapeType::kHalfspace) {
    return n_S.y() > 1.0 - 1e-12 ? 0.0 : std::numeric_limits<double>::infinity();
  }
  return support_value(shape, n_S);
}

// The translation of b along n (world, unit) that separates the pair, m.
inline double depth_along(const Shape& a, const Pose& X_WA, const Shape& b, const Pose& X_WB, const Vector3& n) {
  return support_of(a, X_WA.orientation.conjugate() * n) + support_of(b, X_WB.orientation.conjugate() * -n) -
         n.dot(X_WB.position - X_WA.position);
}

// The least depth over `samples` random directions and a random descent from the best of them: an
// upper bound of the least depth over all directions.
inline double sampled_depth(const Shape& a, const Pose& X_WA, const Shape& b, const Pose& X_WB, int samples,
                            Random* random) {
  Vector3 best = Vector3::UnitX();
  double depth = std::numeric_limits<double>::infinity();
  const auto try_direction = [&](const Vector3& n) {
    const double h = depth_along(a, X_WA, b, X_WB, n);
    if (!(h < depth)) return false;
    depth = h;
    best = n;
    return true;
  };
  for (int i = 0; i < samples; ++i) try_direction(random->direction());
  for (double radius = 0.1; radius > 1e-7;) {
    bool improved = false;
    for (int i = 0; i < 12; ++i) {
      improved |= try_direction((best + radius * random->direction()).normalized());
    }
    if (!improved) radius *= 0.7;
  }
  return depth;
}

// Signed distance (m) of p_S from the surface of the shape, < 0 inside.
inline double distance_to_surface(const Shape& shape, const Vector3& p_S) {
  switch (shape.type) {
    case ShapeType::kSphere:
      return p_S.norm() - shape.size.x();
    case ShapeType::kBox: {
      const Vector3 beyond = p_S.cwiseAbs() - shape.size;
      return beyond.cwiseMax(0.0).norm() + std::min(beyond.maxCoeff(), 0.0);
    }
    case ShapeType::kCylinder: {
      const double side = std::hypot(p_S.x(), p_S.z()) - shape.size.x();
      const double cap = std::fabs(p_S.y()) - shape.size.y();
      return std::hypot(std::max(side, 0.0), std::max(cap, 0.0)) + std::min(std::max(side, cap), 0.0);
    }
    default:
      break;
  }
  return p_S.y();
}

}  // namespace gravitas::collision::test
