// The shapes of a request as the narrow phase takes them, and what is kept of those that are dear to make: polyhedra,
// meshes with their trees, compounds. Kept by the hash of their content, so that a shape is made once.
#pragma once

#include <cstdint>
#include <deque>
#include <memory>
#include <vector>

#include "plugin_sdk/collision.h"
#include "plugin_sdk/geometry/convex_polyhedron.h"
#include "plugin_sdk/plugin.h"
#include "plugin_sdk/shape_cache.h"
#include "workers/collision/standard/composite_pairs.h"
#include "workers/collision/standard/shapes.h"

namespace gravitas::collision {

// Every type that read_shape() takes.
std::vector<TypeDeclaration> declared_shapes();

// A shape with what its pointers point to.
struct StoredShape {
  Shape shape;
  std::shared_ptr<const SceneShape> scene_shape;
  std::unique_ptr<SupportMap> map;
  std::shared_ptr<const ConvexPolyhedron> hull;
  std::unique_ptr<CompoundShape> compound;
  std::deque<StoredShape> children;
};

// Throws Refusal if the parameters make no shape of that type; `row` is the shape's, for the text.
StoredShape read_shape(std::uint64_t type, std::span<const double> parameters, std::size_t row);
// The shape of a scene, or of a child of a compound.
StoredShape store_shape(std::shared_ptr<const SceneShape> scene_shape);

class ShapeStore {
 public:
  // The shapes of a request, valid until the next call. Throws Refusal.
  const std::vector<Shape>& read(const ShapeColumns& shapes);

 private:
  std::vector<Shape> shapes_;
  ShapeCache<StoredShape> kept_;
};

}  // namespace gravitas::collision
