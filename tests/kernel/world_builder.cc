#include "tests/kernel/world_builder.h"

#include <limits>
#include <stdexcept>

#include "plugin_sdk/geometry/mass_properties.h"
#include "plugin_sdk/library.h"
#include "tests/paths.h"

namespace gravitas::harness {
namespace {

// Declarations are read once per library and kept.
kernel::PluginChoice choice(const std::string& path, std::vector<double> settings) {
  std::string problem;
  static std::vector<std::pair<std::string, PluginDeclaration>> known;
  for (const auto& [name, declaration] : known)
    if (name == path) return {declaration, path, std::move(settings)};
  const PluginLibrary library = load_plugin_library(path, &problem);
  if (library.table == nullptr) throw std::runtime_error(problem);
  known.emplace_back(path, library.declaration);
  return {library.declaration, path, std::move(settings)};
}

}  // namespace

std::string plugin_path(const std::string& name) { return in_build("/lib/gravitas/") + name + ".so"; }

std::string faulty_plugin_path(const std::string& name) { return in_build("/lib/gravitas-faulty/") + name + ".so"; }

WorldBuilder::WorldBuilder(kernel::Hosting mode) {
  for (const Slot slot :
       {Slot::kSpace, Slot::kCollision, Slot::kConstraint, Slot::kForce, Slot::kSolver, Slot::kIntegrator})
    description_.slot(slot).hosting = mode;
  space("space_basic");
  integrator("integrator_semi_implicit_euler");
  plugin(Slot::kCollision, plugin_path("collision_standard"));
  plugin(Slot::kSolver, plugin_path("solver_sequential"), {200.0, 1.0, 0.0, 1.0, 0.0, 1.0});
  material({});
}

WorldBuilder& WorldBuilder::steps(std::uint32_t count, double time_step) {
  description_.steps = count;
  description_.time_step = description_.last_time_step = time_step;
  return *this;
}

WorldBuilder& WorldBuilder::hosting(Slot slot, kernel::Hosting mode) {
  description_.slot(slot).hosting = mode;
  return *this;
}

WorldBuilder& WorldBuilder::integrator(const std::string& library) {
  return plugin(Slot::kIntegrator, plugin_path(library));
}

WorldBuilder& WorldBuilder::space(const std::string& library) {
  const double absent = std::numeric_limits<double>::quiet_NaN();
  return plugin(Slot::kSpace, plugin_path(library),
                library == "space_grid" ? std::vector<double>{absent, 1.0} : std::vector<double>{});
}

WorldBuilder& WorldBuilder::plugin(Slot slot, const std::string& path, std::vector<double> settings) {
  description_.slot(slot).plugins = {choice(path, std::move(settings))};
  return *this;
}

WorldBuilder& WorldBuilder::material(const Material& m) {
  description_.material_pairs = {m.restitution,      m.static_friction,   m.dynamic_friction,
                                 m.rolling_friction, m.spinning_friction, m.perturbation};
  return *this;
}

WorldBuilder& WorldBuilder::threads(std::uint32_t count) {
  description_.threads = count;
  return *this;
}

void WorldBuilder::add_body(kernel::BodyDescription body, const std::string& type, std::vector<double> parameters) {
  body.id = "body" + std::to_string(description_.bodies.size());
  if (!type.empty()) {
    body.flags |= kHasShape;
    body.shape = static_cast<std::uint32_t>(description_.shapes.size());
    description_.shapes.push_back({"shape" + std::to_string(body.shape), type, std::move(parameters)});
  }
  description_.bodies.push_back(std::move(body));
}

WorldBuilder& WorldBuilder::ground() {
  kernel::BodyDescription body;
  body.flags = kUnbounded;
  body.mass = 0.0;
  body.inertia = Vector3::Zero();
  add_body(body, "Halfspace", {});
  return *this;
}

WorldBuilder& WorldBuilder::sphere(double radius, double mass, const Vector3& position, const Vector3& velocity) {
  kernel::BodyDescription body;
  body.mass = mass;
  body.inertia = Vector3::Constant(0.4 * mass * radius * radius);
  body.pose.position = position;
  body.twist.linear = velocity;
  body.bound = {BoundKind::kSphere, Vector3::Zero(), Quaternion::Identity(), Vector3::Constant(radius)};
  measure(Vector3::Constant(radius), &body.bound);
  body.bound.reach = radius;
  add_body(body, "Sphere", {radius});
  return *this;
}

WorldBuilder& WorldBuilder::box(const Vector3& half_extents, double mass, const Vector3& position,
                                const Vector3& velocity) {
  kernel::BodyDescription body;
  const Vector3 squares = half_extents.cwiseProduct(half_extents);
  body.mass = mass;
  body.inertia = mass / 3.0 * Vector3(squares.y() + squares.z(), squares.z() + squares.x(), squares.x() + squares.y());
  body.pose.position = position;
  body.twist.linear = velocity;
  body.bound = {BoundKind::kBox, Vector3::Zero(), Quaternion::Identity(), half_extents};
  measure(half_extents, &body.bound);
  add_body(body, "Box", {half_extents.x(), half_extents.y(), half_extents.z()});
  return *this;
}

WorldBuilder& WorldBuilder::point(double mass, const Vector3& inertia, const Vector3& position) {
  kernel::BodyDescription body;
  body.mass = mass;
  body.inertia = inertia;
  body.pose.position = position;
  add_body(body, "", {});
  return *this;
}

std::uint32_t WorldBuilder::plugin_index(Slot slot, const std::string& path) {
  std::vector<kernel::PluginChoice>& plugins = description_.slot(slot).plugins;
  for (std::size_t i = 0; i < plugins.size(); ++i)
    if (plugins[i].library == path) return static_cast<std::uint32_t>(i);
  plugins.push_back(choice(path, {}));
  return static_cast<std::uint32_t>(plugins.size() - 1);
}

WorldBuilder& WorldBuilder::gravity(const Vector3& g) {
  const std::uint32_t row = static_cast<std::uint32_t>(description_.forces.size());
  description_.forces.push_back(
      {"gravity", "Gravity", {g.x(), g.y(), g.z()}, plugin_index(Slot::kForce, plugin_path("force_gravity"))});
  for (kernel::BodyDescription& body : description_.bodies)
    if ((body.flags & kMovable) != 0) body.forces.push_back(row);
  return *this;
}

WorldBuilder& WorldBuilder::force(const std::string& type, const std::string& library, std::vector<double> parameters) {
  body().forces.push_back(static_cast<std::uint32_t>(description_.forces.size()));
  const std::uint32_t plugin = plugin_index(Slot::kForce, plugin_path(library));
  description_.forces.push_back(
      {"force" + std::to_string(description_.forces.size()), type, std::move(parameters), plugin});
  return *this;
}

WorldBuilder& WorldBuilder::joint(const std::string& type, const std::string& library, std::uint32_t body1,
                                  std::uint32_t body2, std::vector<double> parameters) {
  kernel::ConstraintDescription joint;
  joint.id = "joint" + std::to_string(description_.constraints.size());
  joint.type = type;
  joint.parameters = std::move(parameters);
  joint.body1 = body1;
  joint.body2 = body2;
  joint.plugin = plugin_index(Slot::kConstraint, plugin_path(library));
  description_.constraints.push_back(std::move(joint));
  return *this;
}

WorldBuilder busy_world(kernel::Hosting hosting, double breaking_force) {
  WorldBuilder builder(hosting);
  builder.steps(60, 1.0 / 120.0).material({.restitution = 0.3}).ground();
  builder.box(Vector3(0.5, 0.4, 0.3), 2.0, Vector3(0, 0.4, 0), Vector3(2, 0, 0.5))
      .sphere(0.5, 1.0, Vector3(3, 0.6, 0))
      .sphere(0.5, 1.0, Vector3(4.5, 0.9, 0), Vector3(0, 0, 1));
  builder.gravity(Vector3(0, -9.81, 0));
  builder.force("Basic", "force_basic", {0.1, 0, 0, 0, 0.1, 0, 0, 0, 0, 1, 0, 0});
  builder.force("Basic", "force_basic", {0.5, 0.2, 0, 0, 0, 0.1, 0, 0, 0, 0, 0, 1});
  builder.joint("Spherical", "constraint_spherical", 2, 3, {3.75, 0.75, 0});
  builder.description().constraints[0].breaking_force = breaking_force;
  return builder;
}

}  // namespace gravitas::harness
