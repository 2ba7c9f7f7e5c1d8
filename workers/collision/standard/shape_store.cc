#include "workers/collision/standard/shape_store.h"

#include <algorithm>
#include <cmath>
#include <memory>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "plugin_sdk/body.h"
#include "plugin_sdk/collision.h"
#include "plugin_sdk/geometry/convex_polyhedron.h"
#include "plugin_sdk/geometry/scene_shape.h"
#include "plugin_sdk/geometry/support_map.h"
#include "workers/collision/standard/detector_table.h"

namespace gravitas::collision {
namespace {

[[noreturn]] void refuse(std::size_t row, const std::string& why) {
  throw Refusal("shape " + std::to_string(row) + (why.starts_with("has ") || why.starts_with("is ") ? " " : ": ") +
                why);
}

ShapeType type_of_kind(SceneShape::Kind kind) {
  switch (kind) {
    case SceneShape::Kind::kSphere:
      return ShapeType::kSphere;
    case SceneShape::Kind::kBox:
      return ShapeType::kBox;
    case SceneShape::Kind::kCylinder:
      return ShapeType::kCylinder;
    case SceneShape::Kind::kHalfspace:
      return ShapeType::kHalfspace;
    case SceneShape::Kind::kCapsule:
      return ShapeType::kCapsule;
    case SceneShape::Kind::kCone:
      return ShapeType::kCone;
    case SceneShape::Kind::kConvexPolyhedron:
      return ShapeType::kConvexPolyhedron;
    case SceneShape::Kind::kTriangleMesh:
      return ShapeType::kTriangleMesh;
    case SceneShape::Kind::kCompound:
      break;
  }
  return ShapeType::kCompound;
}

// The primitives cost little more to make than to find, so that nothing of them is kept. False for another type. Without
// the heap. Throws Refusal.
bool read_primitive(std::uint64_t type, std::span<const double> numbers, std::size_t row, Shape* out) {
  Shape& shape = *out = Shape();
  const auto require = [&](std::size_t count) {
    if (numbers.size() < count) refuse(row, "has fewer numbers than its properties take");
  };
  if (type == type_id("Sphere")) {
    require(1);
    shape.size = Vector3::Constant(numbers[0]);
  } else if (type == type_id("Box")) {
    require(3);
    shape.type = ShapeType::kBox;
    shape.size = Vector3(numbers[0], numbers[1], numbers[2]);
  } else if (type == type_id("Halfspace")) {
    shape.type = ShapeType::kHalfspace;
    shape.size = Vector3::Ones();
  } else if (type == type_id("Cylinder") || type == type_id("Capsule") || type == type_id("Cone")) {
    require(2);
    shape.size = Vector3(numbers[0], 0.5 * numbers[1], numbers[0]);
    shape.type = type == type_id("Cylinder")  ? ShapeType::kCylinder
                 : type == type_id("Capsule") ? ShapeType::kCapsule
                                              : ShapeType::kCone;
  } else {
    return false;
  }
  if (!shape.size.allFinite() || !(shape.size.minCoeff() > 0.0))
    refuse(row, "has a size that is not finite and positive");
  return true;
}

// A closed mesh as a polyhedron, if it is convex. Every vertex is held against every face: nothing of large ones.
std::shared_ptr<const ConvexPolyhedron> convex_polyhedron_of(const TriangleMesh& mesh) {
  constexpr std::size_t kMostTriangles = 2000;
  if (!mesh.is_closed() || mesh.triangles().size() > kMostTriangles) return nullptr;
  const double level = 1e-6 * mesh.box().half_extents().maxCoeff();
  std::vector<std::vector<std::uint32_t>> faces;
  for (std::uint32_t t = 0; t < mesh.triangles().size(); ++t) {
    const TriangleMesh::Triangle& corners = mesh.triangles()[t];
    faces.emplace_back(corners.begin(), corners.end());
    for (int k = 0; k < 3; ++k)
      for (const Vector3& corner : mesh.corners(mesh.neighbour(t, k)))
        if (mesh.normal(t).dot(corner - mesh.vertices()[corners[0]]) > level) return nullptr;
  }
  std::string why;
  std::optional<ConvexPolyhedron> made = make_convex_polyhedron(mesh.vertices(), faces, &why);
  return made ? std::make_shared<const ConvexPolyhedron>(std::move(*made)) : nullptr;
}

StoredShape registered_shape(const RegisteredShape& kind, ShapeType type, std::span<const double> parameters) {
  StoredShape stored;
  stored.map = kind.read(PropertyCursor(parameters));
  stored.shape = {type, Vector3(stored.map->radius(), stored.map->thinnest(), 0.0), stored.map.get()};
  return stored;
}

}  // namespace

std::vector<TypeDeclaration> declared_shapes() {
  std::vector<TypeDeclaration> types = scene_shape_types();
  for (const RegisteredShape& shape : registered_shapes()) types.push_back(shape.declaration());
  return types;
}

StoredShape store_shape(std::shared_ptr<const SceneShape> scene_shape) {
  StoredShape stored;
  stored.scene_shape = std::move(scene_shape);
  const SceneShape& scene = *stored.scene_shape;
  Shape& shape = stored.shape;
  shape.scene = &scene;
  shape.type = type_of_kind(scene.kind);
  shape.size = scene.size;
  if (scene.kind == SceneShape::Kind::kConvexPolyhedron) {
    stored.map = make_support_map(scene);
    shape.map = stored.map.get();
    shape.size = Vector3(shape.map->radius(), shape.map->thinnest(), 0.0);
  } else if (scene.mesh) {
    shape.mesh = scene.mesh.get();
    double radius = 0.0;
    for (const Vector3& v : scene.mesh->vertices()) radius = std::max(radius, v.squaredNorm());
    shape.size = Vector3(std::sqrt(radius), scene.mesh->box().half_extents().maxCoeff(), 0.0);
    stored.hull = convex_polyhedron_of(*scene.mesh);
    if (stored.hull != nullptr) {
      SceneShape hull;
      hull.kind = SceneShape::Kind::kConvexPolyhedron, hull.polyhedron = stored.hull;
      stored.map = make_support_map(hull);
      shape.hull = stored.map.get();
    }
  } else if (scene.kind == SceneShape::Kind::kCompound) {
    stored.compound = std::make_unique<CompoundShape>();
    shape.size = Vector3(0.0, std::numeric_limits<double>::infinity(), 0.0);
    for (const SceneShape::Child& child : scene.children) {
      const Shape& own = stored.children.emplace_back(store_shape(child.shape)).shape;
      stored.compound->children.push_back({own, child.pose});
      shape.size.x() = std::max(shape.size.x(), std::sqrt(child.pose.position.squaredNorm()) + bounding_radius(own));
      shape.size.y() = std::min(shape.size.y(), smallest_half_extent(own));
    }
    shape.compound = stored.compound.get();
  }
  return stored;
}

StoredShape read_shape(std::uint64_t type, std::span<const double> parameters, std::size_t row) {
  const std::span<const RegisteredShape> registered = registered_shapes();
  for (std::size_t i = 0; i < registered.size(); ++i)
    if (type_id(registered[i].declaration().name) == type)
      return registered_shape(registered[i],
                              static_cast<ShapeType>(static_cast<std::size_t>(ShapeType::kRegistered) + i), parameters);
  std::string why;
  std::optional<SceneShape> scene = read_scene_shape(type, parameters, &why);
  if (!scene) refuse(row, why);
  StoredShape stored = store_shape(std::make_shared<SceneShape>(std::move(*scene)));
  if (!std::isfinite(bounding_radius(stored.shape)) && stored.shape.type != ShapeType::kHalfspace)
    refuse(row, "has a size that is not finite and positive");
  return stored;
}

const std::vector<Shape>& ShapeStore::read(const ShapeColumns& shapes) {
  shapes_.resize(shapes.shape_type.size());
  kept_.begin();
  for (std::size_t i = 0; i < shapes.shape_type.size(); ++i) {
    const std::uint64_t type = shapes.shape_type[i];
    const std::span<const double> parameters = shapes.parameters(i);
    if (read_primitive(type, parameters, i, &shapes_[i])) continue;
    shapes_[i] =
        kept_.get(shapes.shape_hash[i], type, parameters.size(), [&] { return read_shape(type, parameters, i); }).shape;
  }
  kept_.end();
  return shapes_;
}

}  // namespace gravitas::collision
