// Shapes of the scene language for the tests of the narrow phase: kept alive, and made in one line.
#pragma once

#include <algorithm>
#include <array>
#include <deque>
#include <memory>
#include <vector>

#include "plugin_sdk/body.h"
#include "tests/plugin_sdk/geometry/random_shapes.h"
#include "tests/workers/collision/standard/narrow_phase_fixture.h"
#include "workers/collision/standard/shape_store.h"

namespace gravitas::collision::test {

// Makes shapes that live as long as this.
class Shapes {
 public:
  const Shape& of(SceneShape shape) {
    return kept_.emplace_back(store_shape(std::make_shared<SceneShape>(std::move(shape)))).shape;
  }
  const Shape& primitive(SceneShape::Kind kind, const Vector3& size) {
    SceneShape shape;
    shape.kind = kind, shape.size = size;
    return of(std::move(shape));
  }
  const Shape& capsule(double radius, double half) {
    return primitive(SceneShape::Kind::kCapsule, {radius, half, radius});
  }
  const Shape& cone(double radius, double half) { return primitive(SceneShape::Kind::kCone, {radius, half, radius}); }
  const Shape& hull(const std::vector<Vector3>& points) {
    std::string why;
    SceneShape shape;
    shape.kind = SceneShape::Kind::kConvexPolyhedron;
    shape.size.setOnes();
    shape.polyhedron = std::make_shared<ConvexPolyhedron>(*convex_hull(points, &why));
    return of(std::move(shape));
  }
  const Shape& box_hull(const Vector3& half) { return hull(corners(half)); }
  const Shape& mesh(const std::vector<Vector3>& vertices, const std::vector<TriangleMesh::Triangle>& triangles) {
    std::string why;
    SceneShape shape;
    shape.kind = SceneShape::Kind::kTriangleMesh;
    shape.size.setOnes();
    shape.mesh = std::make_shared<TriangleMesh>(*TriangleMesh::make(vertices, triangles, {}, &why));
    return of(std::move(shape));
  }
  // A box as a closed mesh.
  const Shape& box_mesh(const Vector3& half) {
    return mesh(corners(half), {{0, 4, 6},
                                {0, 6, 2},
                                {1, 3, 7},
                                {1, 7, 5},
                                {0, 1, 5},
                                {0, 5, 4},
                                {2, 6, 7},
                                {2, 7, 3},
                                {0, 2, 3},
                                {0, 3, 1},
                                {4, 5, 7},
                                {4, 7, 6}});
  }
  // A level field of n x n squares of 1 m, y = 0, its middle at the origin.
  const Shape& field(std::uint32_t n) {
    std::vector<Vector3> vertices;
    std::vector<TriangleMesh::Triangle> triangles;
    for (std::uint32_t i = 0; i <= n; ++i)
      for (std::uint32_t k = 0; k <= n; ++k) vertices.emplace_back(i - 0.5 * n, 0.0, k - 0.5 * n);
    for (std::uint32_t i = 0; i < n; ++i) {
      for (std::uint32_t k = 0; k < n; ++k) {
        const std::uint32_t a = i * (n + 1) + k, b = a + n + 1;
        triangles.push_back({a, a + 1, b + 1});
        triangles.push_back({a, b + 1, b});
      }
    }
    return mesh(vertices, triangles);
  }
  const Shape& compound(const std::vector<std::pair<const Shape*, Pose>>& children) {
    SceneShape whole;
    whole.kind = SceneShape::Kind::kCompound;
    whole.size.setOnes();
    for (const auto& child : children) {
      const auto found =
          std::find_if(kept_.begin(), kept_.end(), [&](const auto& kept) { return &kept.shape == child.first; });
      whole.children.push_back({found->scene_shape, child.second, 0.0});
    }
    return of(std::move(whole));
  }
  const Shape& random(SceneShape::Kind kind, gravitas::test::RandomShapes* random) { return of(random->convex(kind)); }

  static std::vector<Vector3> corners(const Vector3& half) {
    std::vector<Vector3> all;
    for (int i = 0; i < 8; ++i)
      all.emplace_back((i & 1) ? half.x() : -half.x(), (i & 2) ? half.y() : -half.y(), (i & 4) ? half.z() : -half.z());
    return all;
  }

 private:
  std::deque<StoredShape> kept_;
};

inline ContactList all_contacts(const Shape& a, const Pose& X_WA, const Shape& b, const Pose& X_WB,
                                double margin = 0.0) {
  ContactList contacts;
  collide(a, X_WA, b, X_WB, margin, &contacts);
  return contacts;
}

}  // namespace gravitas::collision::test
