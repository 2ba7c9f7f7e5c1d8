// For authors of forces that act on a body's shape.
#pragma once

#include <cstddef>
#include <cstdint>
#include <optional>
#include <span>

#include "plugin_sdk/geometry/surface.h"
#include "plugin_sdk/math/pose.h"
#include "schemas/stage_frames.h"

namespace gravitas {

// The type of a body's shape (type_id of its name) and its flattened properties.
struct BodyShape {
  std::uint64_t type = 0;
  std::span<const double> parameters;
};

// Throws Refusal for a body without shape, and for an index outside the request.
BodyShape shape_of(const stage::ForceWrenchesRequest& request, std::uint32_t body);

// Refuses a shape whose parameters are not so many sizes above 0.
void require_sizes(const BodyShape& shape, std::size_t count);

// Sides of the polyhedron that stands for a cone.
inline constexpr std::uint32_t kRoundSides = 48;

// Surface of a Box or ConvexPolyhedron, exactly, and of a Cone, as a polyhedron of kRoundSides sides whose sections have the area of the
// cone's, in the frame of the geometry; nothing for other types. Throws Refusal for sizes that are not above 0, and for a polyhedron
// that is none.
std::optional<Surface> surface_of(const BodyShape& shape);

// Pose of a body's geometry in the world.
Pose geometry_pose(const stage::ForceWrenchesRequest& request, std::uint32_t body);

}  // namespace gravitas
