#include "services/scene/build_shapes.h"

#include <cmath>
#include <limits>
#include <span>

namespace gravitas::scene {
namespace {

using v1::Geometry;

// The numbers of a property in a flattened list, or none where the plugin does not declare it.
std::span<const double> numbers_of(const std::string& name, const std::vector<Property>& declared,
                                   std::span<const double> flat) {
  std::size_t begin = 0;
  for (const Property& property : declared) {
    std::size_t size = property.flat_size();
    if (property.kind == PropertyKind::kTable) size += property.columns * static_cast<std::size_t>(flat[begin]);
    if (property.name == name) return flat.subspan(begin, size);
    begin += size;
  }
  return {};
}

// Shapes are known by the names of INTERFACE; a plugin that declares them otherwise is taken at its
// word.
Solid read_solid(const TypeDeclaration& type, std::span<const double> flat) {
  const auto number = [&](const char* name) {
    const std::span<const double> numbers = numbers_of(name, type.properties, flat);
    return numbers.size() == 1 ? numbers[0] : 0.0;
  };
  Solid solid;
  if (type.name == "Halfspace") {
    solid.kind = Solid::Kind::kHalfspace;
  } else if (type.name == "Sphere") {
    solid.kind = Solid::Kind::kSphere;
    solid.size.x() = number("Radius");
  } else if (type.name == "Cylinder") {
    solid.kind = Solid::Kind::kCylinder;
    solid.size.x() = number("Radius"), solid.size.y() = number("Height");
  } else if (type.name == "Box") {
    const std::span<const double> half_extents = numbers_of("HalfExtents", type.properties, flat);
    solid.kind = Solid::Kind::kBox;
    if (half_extents.size() == 3) solid.size = {half_extents[0], half_extents[1], half_extents[2]};
  }
  return solid;
}

bool has_size(const Solid& solid) {
  switch (solid.kind) {
    case Solid::Kind::kSphere:
      return solid.size.x() > 0.0;
    case Solid::Kind::kCylinder:
      return solid.size.x() > 0.0 && solid.size.y() > 0.0;
    case Solid::Kind::kBox:
      return solid.size.minCoeff() > 0.0;
    case Solid::Kind::kUnknown:
    case Solid::Kind::kHalfspace:
      break;
  }
  return true;
}

Solid build_shape(const Geometry& geometry, const InstalledPlugin& collision, BuildContext* context) {
  Solid bad;
  bad.is_good = false;
  const TypeDeclaration* type = find_type(collision.declaration, geometry.type());
  if (type == nullptr) {
    std::vector<std::string> names;
    for (const TypeDeclaration& known : collision.declaration.types) names.push_back(known.name);
    const InstalledPlugin* other = context->catalog->find_type(Slot::kCollision, geometry.type());
    const std::string hint = other == nullptr ? ""
                                              : "; the plugin \"" + other->declaration.name +
                                                    "\" knows it: Plugin { Slot = \"collision\" Name = … }";
    context->diagnostics->error(place_of(geometry, Geometry::kTypeFieldNumber),
                                "the collision plugin \"" + collision.declaration.name + "\" knows no shape \"" +
                                    geometry.type() + "\"; " + allowed_names(geometry.type(), names) + hint);
    return bad;
  }
  kernel::ShapeDescription& shape = context->description.shapes.back();
  const std::string what = geometry.type() + " \"" + geometry.id() + '"';
  if (!context->flatten_properties(type->properties, geometry.custom_properties(), place_of(geometry.location()), what,
                                   &shape.parameters))
    return bad;
  const Solid solid = read_solid(*type, shape.parameters);
  if (has_size(solid)) return solid;
  context->diagnostics->error(place_of(geometry.location()), what + " has a size of zero or less; allowed: sizes > 0");
  return bad;
}

}  // namespace

MassProperties mass_properties(const Solid& solid, double density) {
  if (solid.kind == Solid::Kind::kSphere) return sphere_mass_properties(solid.size.x(), density);
  if (solid.kind == Solid::Kind::kBox) return box_mass_properties(solid.size, density);
  return cylinder_mass_properties(solid.size.x(), solid.size.y(), density);
}

kernel::LocalBound local_bound(const Solid& solid, const std::string& bounding_volume_type, const Pose& X_BG) {
  kernel::LocalBound bound;
  if (bounding_volume_type == "None" || !solid.has_mass()) return bound;
  bound.centre = X_BG.position;
  bound.orientation = X_BG.orientation;
  Vector3 half_extents = solid.size;
  if (solid.kind == Solid::Kind::kCylinder) half_extents = {solid.size.x(), solid.size.y() / 2, solid.size.x()};
  if (solid.kind == Solid::Kind::kSphere) {
    bound.kind = kernel::BoundKind::kSphere;
    bound.half_extents = {solid.size.x(), 0.0, 0.0};
  } else if (bounding_volume_type == "Sphere") {
    // of a cylinder: the rim, not the corner of its box
    const double across = solid.kind == Solid::Kind::kBox ? half_extents.z() : 0.0;
    bound.kind = kernel::BoundKind::kSphere;
    const double radius =
        std::sqrt(half_extents.x() * half_extents.x() + half_extents.y() * half_extents.y() + across * across);
    // no corner outside by a rounding
    bound.half_extents = {radius * (1.0 + 4.0 * std::numeric_limits<double>::epsilon()), 0.0, 0.0};
  } else {
    bound.kind = kernel::BoundKind::kBox;
    bound.half_extents = half_extents;
  }
  return bound;
}

std::vector<Solid> build_shapes(const InstalledPlugin* collision, BuildContext* context) {
  std::vector<Solid> solids;
  for (const Geometry& geometry : context->scene.geometries().geometry()) {
    context->description.shapes.push_back({geometry.id(), geometry.type(), {}});
    if (collision == nullptr) {
      solids.emplace_back().is_good = false;
    } else {
      solids.push_back(build_shape(geometry, *collision, context));
    }
  }
  return solids;
}

}  // namespace gravitas::scene
