// Constraint `AngularMotor` (§ 2.7.5.5, 2.86): a hinge whose second body turns about the axis at a given speed
// relative to the first.
//
//      body 1  --------m--a-->-----  body 2      m, a: the hinge of a `Revolute`, with its five rows
//                                                a (w_2 - w_1) = omega: the drive
//
// The seed drives four points p_i = m + l_i about the axis to v_r = omega a x l_i (2.85) in all directions: 18 rows, and
// those along l_i and a fight the anchors. What is left of them, along the tangents a x l_i, is one row four times,
//   (a x l).(v_2 + w_2 x (m + l - x_2) - v_1 - w_1 x (m + l - x_1)) = |l|^2 a.(w_2 - w_1) + (a x l).(slip at m),
// and m does not slip. So it is one row about a: six rows of rank 6, whatever |l|, its multiplier the torque itself,
// bounded by MaximumTorque. Where on the axis the scene's points lie is nothing to the rows, as for a `Revolute`.
#include "plugin_sdk/joint_coordinates.h"
#include "plugin_sdk/joint_rows.h"

namespace gravitas {
namespace {

class AngularMotor final : public ConstraintPlugin {
 public:
  static PluginDeclaration declaration() {
    return {.name = "AngularMotor",
            .version = "1.1",
            .slot = Slot::kConstraint,
            .meaning = "Hinge with a drive of constant speed.",
            .capabilities = {"coordinates"},
            .types = {{"AngularMotor",
                       "The second body turns about an axis, shared by both, at a given speed relative to the first.",
                       {Property::vector("BindAxisPoint1", "m", "world")
                            .required()
                            .means("First point of the axis, at the start."),
                        Property::vector("BindAxisPoint2", "m", "world").required().means("Second point of the axis."),
                        Property::number("AngularSpeed", "rad/s")
                            .required()
                            .means("Speed of body 2 relative to body 1, right-handed about point 1 -> point 2."),
                        Property::number("MaximumTorque", "N*m")
                            .at_least(0.0)
                            .means("Largest torque of the drive; unlimited if absent.")},
                       {{"angle", "rad",
                         "Angle of body 2 relative to body 1, right-handed about point 1 -> point 2, 0 at the start, "
                         "above -pi up to pi."}}}}};
  }
  explicit AngularMotor(PropertyCursor) {}

  void bind(const stage::ConstraintBindRequest& request, const stage::ConstraintBindReply& reply, Host&) override {
    bind_each(request, reply,
              [](std::uint64_t type, PropertyCursor properties, const JointBodies& bodies, BoundWriter& out) {
                demand_type(type, "AngularMotor");
                const Vector3 point1 = properties.vector();
                const Vector3 point2 = properties.vector();
                const double speed = properties.number();
                const double torque = properties.number();
                const Pose frame = hinge_frame(point1, point2, bodies, "AngularMotor");
                write_frame(bodies.pose1, frame, &out);
                write_frame(bodies.pose2, frame, &out);
                out.number(speed);
                out.number(torque == torque ? torque : kUnlimited);
              });
  }

  void discrepancies(const stage::ConstraintDiscrepanciesRequest& request,
                     const stage::ConstraintDiscrepanciesReply& reply, Host&) override {
    describe_each(request, reply, [](std::uint64_t, PropertyCursor bound, const JointBodies& bodies, auto&& emit) {
      const Pose one = read_frame(&bound, bodies.pose1), two = read_frame(&bound, bodies.pose2);
      hold_hinge(one, two, emit);
      drive_about(axis_between(one, two), 1.0, &bound, emit);
    });
  }

  void coordinates(const stage::ConstraintDiscrepanciesRequest& request, const stage::ConstraintCoordinatesReply& reply,
                   Host&) override {
    measure_each(request, reply, [](std::uint64_t, PropertyCursor bound, const JointBodies& bodies, auto&& emit) {
      const Pose one = read_frame(&bound, bodies.pose1), two = read_frame(&bound, bodies.pose2);
      emit(0, twist_of(one, two, {}, bodies));
    });
  }
};

}  // namespace
}  // namespace gravitas

GRAVITAS_PLUGIN(gravitas::AngularMotor)
