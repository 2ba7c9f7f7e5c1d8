#include "plugin_sdk/conformance/solids.h"

#include <algorithm>
#include <bit>
#include <cmath>

#include "plugin_sdk/conformance/sample_values.h"

namespace gravitas::conformance {
namespace {

constexpr stage::Method kManifoldsOfSolids = stage::Method::kCollisionManifolds;

const TypeDeclaration& type_named(const PluginDeclaration& declaration, const char* name) {
  const TypeDeclaration* type = find_type(declaration, name);
  if (type == nullptr) throw Finding("type " + std::string(name) + " is not declared");
  return *type;
}

// Outside the distance from the nearest point of the two bounds, inside that to the nearer.
double between(double side, double cap) {
  return Vector3(std::max(side, 0.0), std::max(cap, 0.0), 0.0).norm() + std::min(std::max(side, cap), 0.0);
}

// Distance of (x, y), x >= 0, from the segment between two points of the half-plane.
double from_segment(const Vector3& p, const Vector3& from, const Vector3& to) {
  const Vector3 line = to - from;
  const double t = std::clamp(line.dot(p - from) / line.squaredNorm(), 0.0, 1.0);
  return (from + t * line - p).norm();
}

// The corners and faces of a tetrahedron that holds a ball of 0.2 m about the origin, each corner about a metre away.
struct Tetrahedron {
  std::vector<PropertyValue> vertices, faces;
  double radius = 0.0;
};

Tetrahedron random_tetrahedron(Draw* draw) {
  Tetrahedron made;
  const double corners[4][3] = {{1, 1, 1}, {1, -1, -1}, {-1, 1, -1}, {-1, -1, 1}};
  for (const auto& corner : corners) {
    const Vector3 vertex = draw->uniform(0.8, 1.0) * Vector3(corner[0], corner[1], corner[2]) + draw->vector(0.1);
    made.vertices.push_back(PropertyValue::numbers({vertex.data(), 3}));
    made.radius = std::max(made.radius, vertex.norm());
  }
  const double faces[4][3] = {{0, 1, 2}, {0, 3, 1}, {0, 2, 3}, {1, 3, 2}};
  for (const auto& face : faces) made.faces.push_back(PropertyValue::numbers(face));
  return made;
}

// A polyhedron or a closed mesh.
Solid make_tetrahedron(const TypeDeclaration& type, Draw* draw) {
  Tetrahedron made = random_tetrahedron(draw);
  return {type.name,
          flattened(type, {{"Vertices", PropertyValue::of(std::move(made.vertices)), {}},
                           {"Faces", PropertyValue::of(std::move(made.faces)), {}}}),
          {},
          made.radius,
          0.0};
}

// Two balls as one, in the form in which a plugin receives them.
Solid make_dumbbell(const TypeDeclaration& type, Draw* draw) {
  const double radius = draw->uniform(0.3, 0.6), arm = draw->uniform(0.3, 0.6);
  const auto sphere = type_id("Sphere");
  std::vector<PropertyValue> children, parameters;
  for (const double side : {-1.0, 1.0}) {
    const double row[] = {static_cast<double>(sphere >> 32),
                          static_cast<double>(sphere & 0xFFFFFFFFU),
                          static_cast<double>(parameters.size()),
                          side * arm,
                          0,
                          0,
                          1,
                          0,
                          0,
                          0,
                          0};
    children.push_back(PropertyValue::numbers(row));
    parameters.push_back(PropertyValue::of(radius));
  }
  return {type.name,
          flattened(type, {{"Children", PropertyValue::of(std::move(children)), {}},
                           {"Parameters", PropertyValue::of(std::move(parameters)), {}}}),
          {},
          radius + arm,
          0.0};
}

bool has_properties(const TypeDeclaration& type, const char* first, std::uint32_t columns, const char* second) {
  return type.properties.size() >= 2 && type.properties[0].name == first && type.properties[0].columns == columns &&
         type.properties[1].name == second;
}

}  // namespace

Solid make_sphere(const PluginDeclaration& declaration, double radius) {
  return {"Sphere", flattened(type_named(declaration, "Sphere"), {given("Radius", radius)}),
          [radius](const Vector3& p) { return p.norm() - radius; }, radius, radius};
}

Solid make_box(const PluginDeclaration& declaration, const Vector3& half_extents) {
  return {"Box", flattened(type_named(declaration, "Box"), {given("HalfExtents", half_extents)}),
          [half = half_extents](const Vector3& p) {
            const Vector3 beyond = p.cwiseAbs() - half;
            return beyond.cwiseMax(0.0).norm() + std::min(beyond.maxCoeff(), 0.0);
          },
          half_extents.norm(), half_extents.minCoeff()};
}

Solid make_cylinder(const PluginDeclaration& declaration, double radius, double height) {
  const double half = 0.5 * height;
  return {"Cylinder",
          flattened(type_named(declaration, "Cylinder"), {given("Radius", radius), given("Height", height)}),
          [=](const Vector3& p) { return between(Vector3(p.x(), 0, p.z()).norm() - radius, std::fabs(p.y()) - half); },
          Vector3(radius, half, 0).norm(), std::min(radius, half)};
}

Solid make_halfspace(const PluginDeclaration& declaration) {
  return {"Halfspace", flattened(type_named(declaration, "Halfspace"), {}), [](const Vector3& p) { return p.y(); }, 0.0,
          0.0};
}

Solid make_capsule(const PluginDeclaration& declaration, double radius, double height) {
  const double half = 0.5 * height;
  return {"Capsule", flattened(type_named(declaration, "Capsule"), {given("Radius", radius), given("Height", height)}),
          [=](const Vector3& p) { return (p - Vector3(0, std::clamp(p.y(), -half, half), 0)).norm() - radius; },
          radius + half, radius};
}

Solid make_cone(const PluginDeclaration& declaration, double radius, double height) {
  const double half = 0.5 * height, slant = std::sqrt(radius * radius + height * height);
  // of the profile: the triangle of apex, rim and centre of the base
  const auto distance = [=](const Vector3& p) {
    const Vector3 flat(Vector3(p.x(), 0, p.z()).norm(), p.y(), 0);
    const Vector3 apex(0, half, 0), rim(radius, -half, 0), base(0, -half, 0);
    const double side = (height * flat.x() + radius * (flat.y() - half)) / slant;
    const double away = std::min(from_segment(flat, apex, rim), from_segment(flat, rim, base));
    return side <= 0.0 && flat.y() >= -half ? -away : away;
  };
  return {"Cone", flattened(type_named(declaration, "Cone"), {given("Radius", radius), given("Height", height)}),
          distance, Vector3(radius, half, 0).norm(), -distance(Vector3::Zero())};
}

Solid random_solid(const PluginDeclaration& declaration, const TypeDeclaration& type, Draw* draw) {
  const auto size = [draw] { return draw->uniform(0.4, 1.2); };
  if (type.name == "Sphere") return make_sphere(declaration, size());
  if (type.name == "Halfspace") return make_halfspace(declaration);
  if (type.name == "Box") {
    const double x = size(), y = size();
    return make_box(declaration, {x, y, size()});
  }
  if (type.name == "Cylinder") {
    const double radius = size();
    return make_cylinder(declaration, radius, 2.0 * size());
  }
  if (type.name == "Capsule" || type.name == "Cone") {
    const double radius = size(), height = 2.0 * size();
    return type.name == "Cone" ? make_cone(declaration, radius, height) : make_capsule(declaration, radius, height);
  }
  const bool has_faces = has_properties(type, "Vertices", 3, "Faces");
  if (has_faces && (type.name == "ConvexPolyhedron" || type.name == "TriangleMesh"))
    return make_tetrahedron(type, draw);
  if (type.name == "Compound" && has_properties(type, "Children", 11, "Parameters")) return make_dumbbell(type, draw);
  return {type.name, sample_values(type.properties, draw), {}, 1e3, 0.0};
}

Solids Solids::two(const Solid& a, const Pose& pose_a, const Solid& b, const Pose& pose_b, double margin) {
  Solids world;
  world.margin = margin;
  world.solids = {a, b};
  world.bodies = {{.solid = 0, .pose = pose_a}, {.solid = 1, .pose = pose_b}};
  world.pairs = {0, 1};
  return world;
}

MessageColumns Solids::request() const {
  MessageColumns columns = empty_request(kManifoldsOfSolids);
  columns.f64("margin") = {margin};
  columns.u32("shape_parameter_begin") = {0};
  for (const Solid& solid : solids) {
    columns.u64("shape_type").push_back(type_id(solid.type));
    std::vector<double>& all = columns.f64("shape_parameter");
    all.insert(all.end(), solid.parameters.begin(), solid.parameters.end());
    columns.u32("shape_parameter_begin").push_back(static_cast<std::uint32_t>(all.size()));
  }
  hash_shapes(&columns);
  for (const SolidBody& body : bodies) {
    columns.u32("body_shape").push_back(body.solid);
    append(&columns.f64("geometry_position"), body.geometry.position);
    append(&columns.f64("geometry_orientation"), body.geometry.orientation);
    append(&columns.f64("position"), body.pose.position);
    append(&columns.f64("orientation"), body.pose.orientation);
    append(&columns.f64("linear_velocity"), body.twist.linear);
    append(&columns.f64("angular_velocity"), body.twist.angular);
  }
  columns.u32("pair") = pairs;
  return columns;
}

std::vector<Touch> Solids::ask(Inquiry* inquiry) const {
  const MessageColumns reply = inquiry->answer(kManifoldsOfSolids, request());
  inquiry->expect_unit("normal", reply.f64("normal"), 3);
  std::vector<Touch> touches;
  for (std::size_t i = 0; i < reply.f64("depth").size(); ++i) {
    const Touch touch{
        reply.u32("contact_pair")[i],     reply.u32("feature")[i], vector_at(reply.f64("normal"), i),
        vector_at(reply.f64("point"), i), reply.f64("depth")[i],   vector_at(reply.f64("relative_velocity"), i)};
    const std::string row = " of contact " + std::to_string(i) + " is ";
    inquiry->expect(touch.pair < pairs.size() / 2, "pair" + row + std::to_string(touch.pair) + ", which was not asked");
    inquiry->expect(touches.empty() || std::make_pair(touches.back().pair, touches.back().feature) <
                                           std::make_pair(touch.pair, touch.feature),
                    "(pair, feature)" + row + "(" + std::to_string(touch.pair) + ", " + std::to_string(touch.feature) +
                        "): not ascending, or twice");
    // rounding of sizes about a metre
    inquiry->expect(touch.depth >= -margin - 1e-9,
                    "depth" + row + number_text(touch.depth) + ": a gap beyond the margin " + number_text(margin));
    touches.push_back(touch);
  }
  return touches;
}

void hash_shapes(MessageColumns* request) {
  const std::vector<std::uint64_t>& types = request->u64("shape_type");
  const std::vector<std::uint32_t>& begin = request->u32("shape_parameter_begin");
  const std::vector<double>& parameters = request->f64("shape_parameter");
  std::vector<std::uint64_t> hashes;
  for (std::size_t shape = 0; shape < types.size(); ++shape) {
    std::uint64_t hash = types[shape];
    for (std::size_t i = begin[shape]; i < begin[shape + 1]; ++i)
      hash = (hash ^ std::bit_cast<std::uint64_t>(parameters[i])) * 0x9E3779B97F4A7C15ULL ^ (hash >> 29);
    hashes.push_back(hash);
  }
  request->u64("shape_hash") = hashes;
}

const Touch* deepest(const std::vector<Touch>& touches) {
  const auto most = std::ranges::max_element(touches, {}, &Touch::depth);
  return most == touches.end() ? nullptr : &*most;
}

}  // namespace gravitas::conformance
