// Force `Buoyancy`: Archimedes' lift on the part of a body below the surface of a fluid at rest or in uniform flow, and
// its drag there. Up is against gravity g; with V the submerged volume, b its centroid and s = V over the whole volume,
//
//   f = -rho V g - s c_L (v_b - u)           at b, with v_b the velocity of the body there and u that of the fluid
//   torque also -s c_A w
//   U = rho |g| V (level - up.b)             so that f = -dU/dx, torque = -dU/dturn without drag
//
// Exact for Sphere, Box, ConvexPolyhedron, Cylinder and Capsule cut by the surface (submerged.h); a Cone is a polyhedron of 48
// sides whose sections have the area of its own. Other shapes are refused. A floating body finds its depth and rocks back upright
// by itself, since b moves. Region bounds the fluid: where b is outside nothing is felt, which is a jump at its sides.
// Level is along up through the world's origin. The seed leaves buoyancy to future work (§ 6.2.3).
#include "plugin_sdk/plugin.h"

#include <cmath>

#include "plugin_sdk/body.h"
#include "plugin_sdk/force.h"
#include "plugin_sdk/force_jacobians.h"
#include "plugin_sdk/force_shapes.h"
#include "workers/force/buoyancy/submerged.h"

namespace gravitas {
namespace {

struct Fluid {
  double density, level;
  Vector3 gravity;
  std::span<const double> region;  // rows min, max
  Vector3 velocity;
  double linear_drag, angular_drag;
};

Fluid read(PropertyCursor cursor) {
  Fluid f;
  f.density = cursor.number(), f.level = cursor.number();
  f.gravity = cursor.vector();
  f.region = cursor.table(3);
  f.velocity = cursor.vector();
  f.linear_drag = cursor.number(), f.angular_drag = cursor.number();
  const auto is_box = [](std::span<const double> r) {
    return r.size() == 6 && r[0] <= r[3] && r[1] <= r[4] && r[2] <= r[5];
  };
  if (!f.region.empty() && !is_box(f.region))
    throw Refusal("Region: allowed are two rows, {min} and {max}, with min <= max");
  return f;
}

bool contains(const Fluid& fluid, const Vector3& point) {
  if (fluid.region.empty()) return true;
  for (std::size_t k = 0; k < 3; ++k) {
    const double x = point[static_cast<Eigen::Index>(k)];
    if (!(x >= fluid.region[k] && x <= fluid.region[3 + k])) return false;
  }
  return true;
}

class Buoyancy final : public OwnStateForce {
 public:
  static PluginDeclaration declaration() {
    return {.name = "Buoyancy",
            .version = "1.2",
            .slot = Slot::kForce,
            .meaning = "Lift and drag of a fluid on the submerged part of a body.",
            .capabilities = {"potential", "jacobians"},
            .types = {
                {"Buoyancy",
                 "Lifts a body by the weight of the fluid that it displaces.",
                 {Property::number("FluidDensity", "kg/m^3").above(0.0).required().means("Density of the fluid."),
                  Property::number("FluidLevel", "m").required().means("Height of its surface along up."),
                  Property::vector("Gravity", "m/s^2", "world")
                      .means("What makes the weight; up is against it. Absent: the sum of the body's Gravity forces."),
                  Property::table("Region", 3, "m", "world")
                      .means("{min} and {max} of the box that holds the fluid: what has the centre of its submerged "
                             "part in it "
                             "is lifted; absent: everywhere."),
                  Property::vector("FluidVelocity", "m/s", "world").defaults_to({0, 0, 0}).means("Flow."),
                  Property::number("LinearDrag", "N*s/m")
                      .at_least(0.0)
                      .defaults_to({0})
                      .means("Force per speed against the flow, of a body wholly submerged."),
                  Property::number("AngularDrag", "N*m*s")
                      .at_least(0.0)
                      .defaults_to({0})
                      .means("Torque per angular speed, of a body wholly submerged.")}}}};
  }
  explicit Buoyancy(PropertyCursor) {}

  void wrenches(const stage::ForceWrenchesRequest& request, const stage::ForceWrenchesReply& reply, Host&) override {
    for_each_application(request, reply, [&](std::uint64_t, PropertyCursor cursor, std::uint32_t body) {
      return answer(read(cursor), request, body);
    });
  }

 private:
  static ApplicationAnswer answer(const Fluid& fluid, const stage::ForceWrenchesRequest& request, std::uint32_t body) {
    const Pose pose = geometry_pose(request, body);
    const BodyShape shape = shape_of(request, body);
    const double weight = std::isnan(fluid.gravity.x()) ? 0.0 : fluid.gravity.stableNorm();
    if (weight == 0.0) return {.flags = kHasPotential};
    const Vector3 up = fluid.gravity / -weight;
    const Submerged part = submerged(shape, pose, up, fluid.level);
    if (part.volume == 0.0 || !contains(fluid, part.centre)) return {.flags = kHasPotential};

    const Vector3 arm = part.centre - vector_at(request.position(), body);
    const Vector3 w = vector_at(request.angular_velocity(), body);
    const Vector3 slip = vector_at(request.linear_velocity(), body) + w.cross(arm) - fluid.velocity;
    const double share = part.volume / part.whole_volume;
    const Vector3 force = -fluid.density * part.volume * fluid.gravity - share * fluid.linear_drag * slip;
    return {.wrench = {force, arm.cross(force) - share * fluid.angular_drag * w},
            .potential = fluid.density * weight * part.volume * (fluid.level - up.dot(part.centre)),
            .flags = kHasPotential};
  }

  static Submerged submerged(const BodyShape& shape, const Pose& pose, const Vector3& up, double level) {
    const std::span<const double> size = shape.parameters;
    if (shape.type == type_id("Sphere")) {
      if (size.size() != 1 || !(size[0] > 0.0)) throw Refusal("a Sphere's Radius is not above 0");
      return submerged_ball(pose.position, size[0], up, level);
    }
    if (shape.type == type_id("Cylinder") || shape.type == type_id("Capsule")) {
      require_sizes(shape, 2);
      return shape.type == type_id("Capsule") ? submerged_capsule(size[0], size[1], pose, up, level)
                                              : submerged_cylinder(size[0], size[1], pose, up, level);
    }
    const std::optional<Surface> surface = surface_of(shape);
    if (!surface) throw Refusal("Buoyancy knows Sphere, Box, ConvexPolyhedron, Cylinder, Cone and Capsule");
    return submerged_polyhedron(*surface, pose, up, level);
  }
};

}  // namespace
}  // namespace gravitas

GRAVITAS_PLUGIN(gravitas::Buoyancy)
