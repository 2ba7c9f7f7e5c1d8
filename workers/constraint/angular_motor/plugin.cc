// Constraint `AngularMotor` (§ 2.7.5.5, 2.86): a hinge whose second body turns about the axis at a given speed
// relative to the first.
//
//            p3                two anchors on the axis, as for a hinge (d_s1, d_s2),
//             |                four driving points p_i = m + l_i about their midpoint m,
//      p2 ----m---- p1   (a^)  l_2 = -l_1, l_3 = l_1 x a^, l_4 = -l_3,
//             |                each driven to v_r = omega a^ x l_i (2.85)
//            p4
//
// Corrected: the drive acts along the tangent a^ x l_i alone (as printed it holds all three axes of each point
// and fights the anchors: 18 rows); rows are 6 + 4 = 10, of rank 6: five of the hinge (one of the two anchors'
// six is redundant, along the axis) and the drive. |l| is free; half the distance of the anchors keeps the rows
// of the anchors and of the drive of one size. MaximumTorque is shared by the four points, each with lever |l|.
#include "plugin_sdk/constraint.h"
#include "plugin_sdk/joint_rows.h"
#include "plugin_sdk/math/rotation.h"

namespace gravitas {
namespace {

constexpr int kDrivingPoints = 4;

class AngularMotor final : public ConstraintPlugin {
 public:
  static PluginDeclaration declaration() {
    return {.name = "AngularMotor",
            .version = "1.0",
            .slot = Slot::kConstraint,
            .meaning = "Hinge with a drive of constant speed.",
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
                            .means("Largest torque of the drive; unlimited if absent.")}}}};
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
                const double length = (point2 - point1).norm();
                if (!(length > 0.0))
                  throw Refusal("AngularMotor: BindAxisPoint1 and BindAxisPoint2 are the same point");
                for (const Vector3& point : {point1, point2}) {
                  out.vector(inverse_transform_point(bodies.pose1, point));
                  out.vector(inverse_transform_point(bodies.pose2, point));
                }
                out.vector(bodies.pose1.orientation.conjugate() * orthonormal_basis((point2 - point1) / length).first);
                out.number(0.5 * length);
                out.number(speed);
                out.number(torque == torque ? torque : kUnlimited);
              });
  }

  void discrepancies(const stage::ConstraintDiscrepanciesRequest& request,
                     const stage::ConstraintDiscrepanciesReply& reply, Host&) override {
    describe_each(request, reply, [](std::uint64_t, PropertyCursor bound, const JointBodies& bodies, auto&& emit) {
      describe(bound, bodies, emit);
    });
  }

 private:
  template <typename Emit>
  static void describe(PropertyCursor bound, const JointBodies& bodies, Emit&& emit) {
    Discrepancy anchor[2];
    for (Discrepancy& d : anchor) {
      const Vector3 on_body1 = bound.vector();
      const Vector3 on_body2 = bound.vector();
      d = point_discrepancy(on_body1, on_body2, bodies);
      emit(d);
    }
    const Vector3 lever_in_body1 = bound.vector();
    const double lever = bound.number();
    const double speed = bound.number();
    const double torque = bound.number();

    // axis and midpoint from the averages of the anchors, so that drift moves both bodies' share alike
    const Vector3 a1 = 0.5 * (anchor[0].point1 + anchor[0].point2);
    const Vector3 a2 = 0.5 * (anchor[1].point1 + anchor[1].point2);
    const Vector3 axis = (a2 - a1).normalized();
    const Vector3 middle = 0.5 * (a1 + a2);
    const Vector3 turned = bodies.pose1.orientation * lever_in_body1;
    const Vector3 first = (turned - turned.dot(axis) * axis).normalized();
    const Vector3 second = first.cross(axis);
    for (const Vector3& direction : {first, Vector3(-first), second, Vector3(-second)}) {
      const Vector3 tangent = axis.cross(direction);
      Matrix3 axes;
      axes << tangent, direction, tangent.cross(direction);
      Discrepancy drive;
      drive.point1 = drive.point2 = middle + lever * direction;
      drive.velocity = speed * lever * tangent;
      drive.axes = to_quaternion(axes);
      drive.modes = pack_modes(AxisMode::kDriven, AxisMode::kFree, AxisMode::kFree);
      if (torque < kUnlimited) drive.maximum_force = Vector3::Constant(torque / (kDrivingPoints * lever));
      emit(drive);
    }
  }
};

}  // namespace
}  // namespace gravitas

GRAVITAS_PLUGIN(gravitas::AngularMotor)
