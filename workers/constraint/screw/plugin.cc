// Constraint `Screw`: a nut (body 2) on a spindle (body 1): it keeps to the axis, and goes along it by Lead a turn.
//
//      ==/=/=[/=/]=/=/==> k        x = Lead theta/(2 pi)
//            body 2                a positive Lead is a right-handed thread
//
// Units and frames. The points of the axis are of the world at the start, Lead in m a turn. x is the way of body 2 along the
// axis, theta its turn about it, both relative to body 1 and 0 at the start.
//
// Freedoms. Across the axis as `Revolute`: two rows hold the point of the axis in body 2, two the axis. The fifth is of the
// thread, p = Lead/(2 pi): a point has one axis to push along, so it is of one beside the axis, along a thread of 45 degrees,
//   r = |p| n,  a = (k - sign(p) t)/sqrt(2),  n and t = k x n across the axis,
//   a.(v + w x r) = (k.v - p k.w - sign(p) t.v - |p| t.w)/sqrt(2),    v, w of body 2 in body 1, v at the point of the axis,
// whose last two terms are held at nought by the other rows. Rank 5, left is one freedom. What the five exert together is an
// axial force F, a torque -F p about the axis, and what bears loads across; without friction, so no thread holds itself.
//
// Phase. theta is known within a turn, x as a whole: x - p theta = 0 modulo Lead, from poses alone. Nothing is counted, nothing
// drifts. Which turn a free trial state is in is told by what the step made (meshing_row() of joint_rows.h).
//
// Refused: points that name no axis, a Lead of 0.
#include <cmath>

#include "plugin_sdk/joint_coordinates.h"
#include "plugin_sdk/joint_rows.h"
#include "plugin_sdk/math/rotation.h"

namespace gravitas {
namespace {

class Screw final : public ConstraintPlugin {
 public:
  static PluginDeclaration declaration() {
    return {
        .name = "Screw",
        .version = "1.1",
        .slot = Slot::kConstraint,
        .meaning = "Nut on a threaded spindle.",
        .capabilities = {"coordinates"},
        .types = {
            {"Screw",
             "The second body is a nut on the first: it keeps to an axis and moves along it as it turns.",
             {Property::vector("BindAxisPoint1", "m", "world")
                  .required()
                  .means("First point of the axis, at the start."),
              Property::vector("BindAxisPoint2", "m", "world").required().means("Second point of the axis."),
              Property::number("Lead", "m")
                  .required()
                  .means("Way of body 2 toward point 2 with a turn, right-handed about point 1 -> point 2, relative "
                         "to body 1; negative for a left-handed thread, not 0.")},
             {{"displacement", "m", "Way of body 2 toward point 2, relative to body 1, 0 at the start."},
              {"angle", "rad",
               "Angle of body 2 relative to body 1, right-handed about point 1 -> point 2, 0 at the start, above -pi "
               "up to pi."}}}}};
  }
  explicit Screw(PropertyCursor) {}

  void bind(const stage::ConstraintBindRequest& request, const stage::ConstraintBindReply& reply, Host&) override {
    bind_each(request, reply,
              [](std::uint64_t type, PropertyCursor properties, const JointBodies& bodies, BoundWriter& out) {
                demand_type(type, "Screw");
                const Vector3 point1 = properties.vector();
                const Vector3 point2 = properties.vector();
                const double lead = properties.number();
                if (lead == 0.0) throw Refusal("Screw: Lead is 0; it must be above or below");
                const Pose frame = hinge_frame(point1, point2, bodies, "Screw");
                write_frame(bodies.pose1, frame, &out);
                write_frame(bodies.pose2, frame, &out);
                out.number(lead / kWholeTurn);
              });
  }

  void discrepancies(const stage::ConstraintDiscrepanciesRequest& request,
                     const stage::ConstraintDiscrepanciesReply& reply, Host&) override {
    describe_each(request, reply, [](std::uint64_t, PropertyCursor bound, const JointBodies& bodies, auto&& emit) {
      const Pose one = read_frame(&bound, bodies.pose1), two = read_frame(&bound, bodies.pose2);
      const double lead = bound.number(), radius = std::fabs(lead), hand = std::copysign(1.0, lead);
      emit(held_point(one, two.position, {false, true, true}));
      hold_axis(one, two, emit);
      const Vector3 axis = one.orientation * Vector3::UnitX(), normal = one.orientation * Vector3::UnitY(),
                    tangent = one.orientation * Vector3::UnitZ();
      const Vector3 way = two.position - one.position;
      const double turn = twist_between(one.orientation, two.orientation);
      const double tilt = normal.dot(two.orientation * Vector3::UnitX());
      const double share = std::sqrt(0.5);
      const double error = share * (axis.dot(way) - hand * tangent.dot(way) - radius * tilt - lead * turn);
      emit(meshing_row(share * (axis - hand * tangent), two.position + radius * normal, 0.0, error,
                       share * kWholeTurn * radius, bodies));
    });
  }

  void coordinates(const stage::ConstraintDiscrepanciesRequest& request, const stage::ConstraintCoordinatesReply& reply,
                   Host&) override {
    measure_each(request, reply, [](std::uint64_t, PropertyCursor bound, const JointBodies& bodies, auto&& emit) {
      const Pose one = read_frame(&bound, bodies.pose1), two = read_frame(&bound, bodies.pose2);
      emit(0, way_along(one.orientation * Vector3::UnitX(), one.position, two.position, bodies));
      emit(1, twist_of(one, two, {}, bodies));
    });
  }
};

}  // namespace
}  // namespace gravitas

GRAVITAS_PLUGIN(gravitas::Screw)
