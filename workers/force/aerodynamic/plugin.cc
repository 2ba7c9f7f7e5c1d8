// Force `Aerodynamic`: pressure of a flow on the faces of a body that look into it. Where a face with the outward unit
// normal n has the velocity u against the fluid and n.u > 0, the pressure is that on a flat plate,
//
//   f = -integral over such parts of rho/2 C_D (n.u)^2 n dA          torque about the centre of mass likewise.
//
// u varies over a face as the body turns; the parts are cut out exactly and the integrals, cubic at most, are exact on
// polyhedra: Box, ConvexPolyhedron, and a Cone as one of 48 sides whose sections have the area of its own. Sphere, Cylinder and
// Capsule are exact, too (round_faces.h). A plate held against the flow has rho/2 C_D A u^2, a Sphere rho/2 C_D (pi r^2/2) u^2.
// Convex bodies only: no face shades another; no suction behind, no friction along faces, no lift from circulation. No potential.
// The seed defers "geometry-based aerodynamic friction" to future work (§§ 4.2, 6.2.3).
#include "plugin_sdk/plugin.h"

#include <array>
#include <vector>

#include "plugin_sdk/body.h"
#include "plugin_sdk/force.h"
#include "plugin_sdk/force_jacobians.h"
#include "plugin_sdk/force_shapes.h"
#include "workers/force/aerodynamic/round_faces.h"

namespace gravitas {
namespace {

// Quadrature on a triangle, exact to degree 4: weight and the barycentric coordinate that two corners share. Source:
// Dunavant, Int. J. Numer. Meth. Eng. 21 (1985) 1129.
struct TriangleRule {
  double weight, shared;
};
constexpr std::array<TriangleRule, 2> kRule = {
    {{0.22338158967801146570, 0.44594849091596488632}, {0.10995174365532186764, 0.09157621350977074346}}};

struct Flow {
  double density;
  Vector3 velocity;
  double drag;
};

// Adds integral (n.u)^2 n dA and its moment over a triangle, points relative to the centre of mass.
void add_triangle(const Vector3& a, const Vector3& b, const Vector3& c, const Vector3& normal, const Slip& slip,
                  Wrench* sum) {
  const double area = 0.5 * (b - a).cross(c - a).dot(normal);
  for (const TriangleRule& rule : kRule) {
    for (const Vector3* corner : {&a, &b, &c}) {
      const Vector3 point = rule.shared * (a + b + c) + (1.0 - 3.0 * rule.shared) * *corner;
      const double speed = normal.dot(slip.at(point));
      const Vector3 push = rule.weight * area * speed * speed * normal;
      sum->force += push;
      sum->torque += point.cross(push);
    }
  }
}

Wrench on_surface(const Surface& surface, const Pose& from_centre, const Slip& slip) {
  Wrench sum;
  std::vector<Vector3> polygon, part;
  std::vector<double> leaving;
  for (std::size_t face = 0; face < surface.faces(); ++face) {
    polygon.clear(), leaving.clear(), part.clear();
    for (std::uint32_t k = surface.face_begin[face]; k < surface.face_begin[face + 1]; ++k)
      polygon.push_back(transform_point(from_centre, surface.vertex[surface.corner[k]]));
    Vector3 normal = Vector3::Zero();
    for (std::size_t i = 2; i < polygon.size(); ++i)
      normal += (polygon[i - 1] - polygon[0]).cross(polygon[i] - polygon[0]);
    normal.stableNormalize();
    for (const Vector3& corner : polygon) leaving.push_back(-normal.dot(slip.at(corner)));
    clip_polygon(polygon, leaving, &part);
    for (std::size_t i = 2; i < part.size(); ++i) add_triangle(part[0], part[i - 1], part[i], normal, slip, &sum);
  }
  return sum;
}

class Aerodynamic final : public OwnStateForce {
 public:
  static PluginDeclaration declaration() {
    return {.name = "Aerodynamic",
            .version = "1.1",
            .slot = Slot::kForce,
            .meaning = "Pressure of a flow on the faces that look into it.",
            .capabilities = {"jacobians"},
            .types = {{"Aerodynamic",
                       "Pushes against the faces of a body that move into the fluid.",
                       {Property::number("FluidDensity", "kg/m^3").above(0.0).required().means("Density of the fluid."),
                        Property::vector("FluidVelocity", "m/s", "world").required().means("Flow."),
                        Property::number("DragCoefficient", "1")
                            .at_least(0.0)
                            .defaults_to({1})
                            .means("Pressure on a face held against the flow, over rho/2 u^2.")}}}};
  }
  explicit Aerodynamic(PropertyCursor) {}

  void wrenches(const stage::ForceWrenchesRequest& request, const stage::ForceWrenchesReply& reply, Host&) override {
    for_each_application(request, reply, [&](std::uint64_t, PropertyCursor cursor, std::uint32_t body) {
      Flow flow{cursor.number(), Vector3::Zero(), 0.0};
      flow.velocity = cursor.vector();
      flow.drag = cursor.number();
      return answer(flow, request, body);
    });
  }

 private:
  static ApplicationAnswer answer(const Flow& flow, const stage::ForceWrenchesRequest& request, std::uint32_t body) {
    const BodyShape shape = shape_of(request, body);
    const Slip slip{vector_at(request.linear_velocity(), body) - flow.velocity,
                    vector_at(request.angular_velocity(), body)};
    Pose pose = geometry_pose(request, body);
    pose.position -= vector_at(request.position(), body);
    Wrench push;
    if (shape.type == type_id("Sphere")) {
      if (shape.parameters.size() != 1 || !(shape.parameters[0] > 0.0))
        throw Refusal("a Sphere's Radius is not above 0");
      push = on_ball(shape.parameters[0], pose.position, slip);
    } else if (shape.type == type_id("Cylinder") || shape.type == type_id("Capsule")) {
      require_sizes(shape, 2);
      const Vector3 axis = pose.orientation * Vector3::UnitY();
      push = shape.type == type_id("Capsule")
                 ? on_capsule(shape.parameters[0], shape.parameters[1], pose.position, axis, slip)
                 : on_cylinder(shape.parameters[0], shape.parameters[1], pose.position, axis, slip);
    } else {
      const std::optional<Surface> surface = surface_of(shape);
      if (!surface) throw Refusal("Aerodynamic knows Sphere, Box, ConvexPolyhedron, Cylinder, Cone and Capsule");
      push = on_surface(*surface, pose, slip);
    }
    const double pressure = -0.5 * flow.density * flow.drag;
    return {.wrench = {pressure * push.force, pressure * push.torque}};
  }
};

}  // namespace
}  // namespace gravitas

GRAVITAS_PLUGIN(gravitas::Aerodynamic)
