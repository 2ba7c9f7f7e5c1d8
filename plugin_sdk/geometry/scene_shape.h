// The shapes of the scene language as a collision plugin receives them, and what is known of each: mass, bounds,
// support. A plugin that declares scene_shape_types() reads its request with read_scene_shape(); the scene reader takes
// masses and bounds from the same object.
//
// Lengths in m, in the shape's own frame.
#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "plugin_sdk/geometry/convex_polyhedron.h"
#include "plugin_sdk/geometry/mass_properties.h"
#include "plugin_sdk/geometry/triangle_mesh.h"
#include "plugin_sdk/math/pose.h"
#include "plugin_sdk/plugin.h"

namespace gravitas {

struct SceneShape {
  enum class Kind : std::uint32_t {
    kSphere,            // size.x: radius
    kBox,               // size: half extents
    kCylinder,          // size.x: radius, size.y: half height; axis y
    kHalfspace,         // y <= 0 is solid
    kCapsule,           // size.x: radius, size.y: half the distance of the cap centres; axis y
    kCone,              // size.x: radius, size.y: half height; axis y, apex at +y
    kConvexPolyhedron,  // polyhedron
    kTriangleMesh,      // mesh
    kCompound           // children
  };
  struct Child {
    std::shared_ptr<const SceneShape> shape;
    Pose pose;             // of the child's frame
    double density = 0.0;  // kg/m^3; 0: that of the whole
  };

  Kind kind = Kind::kSphere;
  Vector3 size = Vector3::Zero();
  std::shared_ptr<const ConvexPolyhedron> polyhedron;
  std::shared_ptr<const TriangleMesh> mesh;
  std::vector<Child> children;

  bool is_unbounded() const { return kind == Kind::kHalfspace; }
};

// Declarations of all kinds, in the order of Kind. A row of a compound's Children is the type_id of the child's type in
// two halves of 32 bits (high, low), the row of Parameters at which its own parameters begin (they end where the next
// child's begin), position, orientation (w, x, y, z), and density.
const std::vector<TypeDeclaration>& scene_shape_types();

// The shape of these flattened properties. Nothing, and in *why what is wrong, if a size is not finite and positive, the
// polyhedron or mesh is none (see their headers), or a compound is empty, unbounded or nested more than eight deep, or
// names a type that is none of these. Throws std::out_of_range (PropertyCursor) where numbers are missing.
std::optional<SceneShape> read_scene_shape(std::uint64_t type, std::span<const double> parameters, std::string* why);

// The properties that give this shape again.
std::vector<double> flattened_shape(const SceneShape& shape);
std::uint64_t type_of(const SceneShape& shape);

// Of a bounded shape. A mesh that is not closed has no volume: it counts as a shell of thin triangles,
// its density being one of area (kg/m^2).
MassProperties mass_properties(const SceneShape& shape, double density);

// Tight boxes of a bounded shape: along the axes of its frame, and of the frame R turned against it (columns: axes).
Box3 local_box(const SceneShape& shape);
Box3 local_box(const SceneShape& shape, const Matrix3& R);

// A ball that holds a bounded shape: about the centre of local_box(), as small as that allows.
struct Ball {
  Vector3 centre = Vector3::Zero();
  double radius = 0.0;
};
Ball bounding_ball(const SceneShape& shape);

}  // namespace gravitas
