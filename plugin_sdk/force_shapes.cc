#include "plugin_sdk/force_shapes.h"

#include <cmath>
#include <string>

#include "plugin_sdk/force.h"
#include "plugin_sdk/geometry/scene_shape.h"

namespace gravitas {
namespace {

// Read anew each time: a hundred faces are checked in some microseconds.
Surface polyhedron_surface(const BodyShape& shape) {
  std::string why;
  const std::optional<SceneShape> read = read_scene_shape(shape.type, shape.parameters, &why);
  if (!read) throw Refusal("a ConvexPolyhedron is none: " + why);
  Surface surface;
  surface.vertex = read->polyhedron->vertices;
  for (const ConvexPolyhedron::Face& face : read->polyhedron->faces) {
    const std::span<const std::uint32_t> corners = read->polyhedron->corners_of(face);
    surface.corner.insert(surface.corner.end(), corners.begin(), corners.end());
    surface.face_begin.push_back(static_cast<std::uint32_t>(surface.corner.size()));
  }
  return surface;
}

}  // namespace

BodyShape shape_of(const stage::ForceWrenchesRequest& request, std::uint32_t body) {
  require_shape(request, body);
  const std::uint32_t row = body < request.body_shape().size() ? request.body_shape()[body] : kNone;
  if (row == kNone) throw Refusal("body " + std::to_string(body) + " has no geometry, which this force needs");
  const std::span<const std::uint32_t> begin = request.shape_parameter_begin();
  return {request.shape_type()[row], request.shape_parameter().subspan(begin[row], begin[row + 1] - begin[row])};
}

void require_sizes(const BodyShape& shape, std::size_t count) {
  bool good = shape.parameters.size() == count;
  for (const double size : shape.parameters) good = good && size > 0.0 && std::isfinite(size);
  if (!good) throw Refusal("a shape's sizes are not " + std::to_string(count) + " numbers above 0");
}

std::optional<Surface> surface_of(const BodyShape& shape) {
  const std::span<const double> size = shape.parameters;
  if (shape.type == type_id("Box")) {
    require_sizes(shape, 3);
    return box_surface({size[0], size[1], size[2]});
  }
  if (shape.type == type_id("ConvexPolyhedron")) return polyhedron_surface(shape);
  if (shape.type != type_id("Cone")) return std::nullopt;
  require_sizes(shape, 2);
  return revolved_surface(std::initializer_list<MeridianPoint>{{size[0], -0.5 * size[1]}, {0.0, 0.5 * size[1]}},
                          kRoundSides);
}

Pose geometry_pose(const stage::ForceWrenchesRequest& request, std::uint32_t body) {
  const Pose in_body{vector_at(request.geometry_position(), body), quaternion_at(request.geometry_orientation(), body)};
  return compose({vector_at(request.position(), body), quaternion_at(request.orientation(), body)}, in_body);
}

}  // namespace gravitas
