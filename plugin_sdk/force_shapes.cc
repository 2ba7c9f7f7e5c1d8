#include "plugin_sdk/force_shapes.h"

#include <cmath>
#include <numbers>
#include <string>

#include "plugin_sdk/force.h"
#include "plugin_sdk/geometry/scene_shape.h"
#include "plugin_sdk/math/transcendental.h"

namespace gravitas {
namespace {

constexpr int kCapRings = 12;

void require_sizes(const BodyShape& shape, std::size_t count) {
  bool good = shape.parameters.size() == count;
  for (const double size : shape.parameters) good = good && size > 0.0 && std::isfinite(size);
  if (!good) throw Refusal("a shape's sizes are not " + std::to_string(count) + " numbers above 0");
}

// A half circle's meridian of radius 1, from its pole to its rim, with all but the rim moved out by `share`.
std::vector<MeridianPoint> cap_meridian(double share) {
  std::vector<MeridianPoint> meridian;
  for (int i = 0; i <= kCapRings; ++i) {
    const math::SinCos angle = math::sincos(0.5 * std::numbers::pi * i / kCapRings);
    const double size = i == kCapRings ? 1.0 : 1.0 + share;
    meridian.push_back({i == 0 ? 0.0 : size * angle.sin, i == kCapRings ? 0.0 : -size * angle.cos});
  }
  return meridian;
}

double volume_of(const std::vector<MeridianPoint>& meridian) {
  double sum = 0.0;
  for (std::size_t i = 1; i < meridian.size(); ++i) {
    const double a = meridian[i - 1].radius, b = meridian[i].radius;
    sum += std::numbers::pi / 3.0 * (a * a + a * b + b * b) * (meridian[i].height - meridian[i - 1].height);
  }
  return sum;
}

// By how much a cap's points lie out of the sphere, so that its volume is that of the half ball.
double cap_outset() {
  double low = 0.0, high = 0.1;
  for (int halving = 0; halving < 60; ++halving) {
    const double middle = 0.5 * (low + high);
    (volume_of(cap_meridian(middle)) < 2.0 / 3.0 * std::numbers::pi ? low : high) = middle;
  }
  return 0.5 * (low + high);
}

Surface capsule_surface(double radius, double height) {
  static const std::vector<MeridianPoint> cap = cap_meridian(cap_outset());
  std::vector<MeridianPoint> meridian;
  for (const MeridianPoint& point : cap)
    meridian.push_back({radius * point.radius, radius * point.height - 0.5 * height});
  for (int i = kCapRings; i >= 0; --i) {
    const MeridianPoint below = meridian[static_cast<std::size_t>(i)];
    meridian.push_back({below.radius, -below.height});
  }
  return revolved_surface(meridian, kRoundSides);
}

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

std::optional<Surface> surface_of(const BodyShape& shape) {
  const std::span<const double> size = shape.parameters;
  if (shape.type == type_id("Box")) {
    require_sizes(shape, 3);
    return box_surface({size[0], size[1], size[2]});
  }
  if (shape.type == type_id("ConvexPolyhedron")) return polyhedron_surface(shape);
  if (shape.type != type_id("Cylinder") && shape.type != type_id("Cone") && shape.type != type_id("Capsule"))
    return std::nullopt;
  require_sizes(shape, 2);
  if (shape.type == type_id("Capsule")) return capsule_surface(size[0], size[1]);
  const double top = shape.type == type_id("Cone") ? 0.0 : size[0];
  return revolved_surface(std::initializer_list<MeridianPoint>{{size[0], -0.5 * size[1]}, {top, 0.5 * size[1]}},
                          kRoundSides);
}

Pose geometry_pose(const stage::ForceWrenchesRequest& request, std::uint32_t body) {
  const Pose in_body{vector_at(request.geometry_position(), body), quaternion_at(request.geometry_orientation(), body)};
  return compose({vector_at(request.position(), body), quaternion_at(request.orientation(), body)}, in_body);
}

}  // namespace gravitas
