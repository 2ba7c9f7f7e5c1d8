// Constraint `Rack`: a pinion (body 1) whose teeth mesh with those of a straight rack (body 2). It guides neither: the pinion
// has a bearing of its own, and the rack a guide along Direction.
//
//      ====P====> u  rack, Direction         k: Axis, up out of the page
//          | n, r
//          c   pinion                        r = Teeth Pitch/(2 pi)
//
// Units and frames. Axis, Direction and points are of the world at the start, Pitch in m a tooth along the rack. n points
// from the pinion's axis to the rack, on the side where BindPoint is, and u = n x k, Direction or against it; both turn with
// body 2, the axis with body 1.
//
// Phase. beta: the angle, about the axis, of n as body 1 sees it; x: the way of the rack along u past the axis point c; both 0
// at the start. What is off along the rack is e; its rate, while the axis is across u and n, e':
//   e = x - r beta modulo Teeth Pitch,    e' = u.(v2(P) - v1(P)),    P = c + r n,
// known from poses alone: nothing is counted, nothing drifts. The rack may move and turn with what carries it.
//
// Freedoms. One row of rank 1: along u at P. Its multiplier is the force that the pinion exerts on the rack along u; that along
// n, by which slanting flanks push both apart, is not modelled.
//
// Refused: an axis or a direction without direction, one not across the other, a BindPoint that tells no side.
#include <cmath>

#include "plugin_sdk/joint_rows.h"
#include "plugin_sdk/math/rotation.h"
#include "plugin_sdk/math/transcendental.h"

namespace gravitas {
namespace {

constexpr double kMostTeeth = 1e6;

class Rack final : public ConstraintPlugin {
 public:
  static PluginDeclaration declaration() {
    return {
        .name = "Rack",
        .version = "1.0",
        .slot = Slot::kConstraint,
        .meaning = "Mesh of a pinion and a rack.",
        .types = {
            {"Rack",
             "The first body is a pinion whose teeth move the second, a straight rack; each has a guide of its own.",
             {Property::vector("Axis", "1", "world")
                  .required()
                  .means("Direction of the pinion's axis at the start, any length."),
              Property::vector("Direction", "1", "world")
                  .required()
                  .means("Direction of the rack at the start, across Axis, any length."),
              Property::integer("Teeth").at_least(1.0).at_most(kMostTeeth).required().means("Teeth of the pinion."),
              Property::number("Pitch", "m")
                  .above(0.0)
                  .required()
                  .means("From tooth to tooth along the rack: a turn of the pinion moves it by Teeth times Pitch."),
              Property::vector("BindAxisPoint", "m", "world")
                  .means("Where the pinion's axis passes through the plane of the mesh, at the start; its centre "
                         "of mass if absent, of the world the origin."),
              Property::vector("BindPoint", "m", "world")
                  .means("A point on that side of the axis where the rack is, at the start; the rack's centre of "
                         "mass if absent, of the world the origin.")}}}};
  }
  explicit Rack(PropertyCursor) {}

  void bind(const stage::ConstraintBindRequest& request, const stage::ConstraintBindReply& reply, Host&) override {
    bind_each(request, reply,
              [](std::uint64_t type, PropertyCursor properties, const JointBodies& bodies, BoundWriter& out) {
                demand_type(type, "Rack");
                const Vector3 axis = unit_axis(properties.vector(), "Rack: Axis");
                const Vector3 direction = unit_axis(properties.vector(), "Rack: Direction");
                const auto teeth = static_cast<double>(properties.integer());
                const double pitch = properties.number();
                const Vector3 centre = point_or(properties.vector(), bodies.pose1.position);
                const Vector3 way = point_or(properties.vector(), bodies.pose2.position) - centre;
                if (!(teeth >= 1.0) || !(pitch > 0.0)) throw Refusal("Rack: Teeth must be 1 or more, Pitch above 0");
                if (!(std::fabs(axis.dot(direction)) <= kAcross)) throw Refusal("Rack: Direction is not across Axis");
                const Vector3 side = axis.cross(direction).normalized();
                const double beside = side.dot(way);
                if (!(std::fabs(beside) > kLeastOfWay * way.norm()))
                  throw Refusal("Rack: BindPoint is on neither side of the pinion's axis");
                const Vector3 normal = beside > 0.0 ? side : Vector3(-side);
                write_frame(bodies.pose1, cross_frame(centre, axis, normal), &out);
                write_frame(bodies.pose2, cross_frame(centre, normal.cross(axis), normal), &out);
                out.number(teeth * pitch / kWholeTurn);
              });
  }

  void discrepancies(const stage::ConstraintDiscrepanciesRequest& request,
                     const stage::ConstraintDiscrepanciesReply& reply, Host&) override {
    describe_each(request, reply, [](std::uint64_t, PropertyCursor bound, const JointBodies& bodies, auto&& emit) {
      const Pose one = read_frame(&bound, bodies.pose1), two = read_frame(&bound, bodies.pose2);
      const double radius = bound.number();
      const Vector3 along = two.orientation * Vector3::UnitX(), normal = two.orientation * Vector3::UnitY();
      const Vector3 seen = one.orientation.conjugate() * normal;
      const double error = along.dot(two.position - one.position) - radius * math::atan2(seen.z(), seen.y());
      emit(meshing_row(along, one.position + radius * normal, 0.0, error, kWholeTurn * radius, bodies));
    });
  }

 private:
  static constexpr double kAcross = 1e-6;
  static constexpr double kLeastOfWay = 1e-9;  // of the way from the axis to the point

  static Vector3 point_or(const Vector3& point, const Vector3& otherwise) { return point.hasNaN() ? otherwise : point; }
};

}  // namespace
}  // namespace gravitas

GRAVITAS_PLUGIN(gravitas::Rack)
