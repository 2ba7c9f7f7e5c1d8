// Constraint `Revolute` (§ 2.7.5.3, 2.84): a hinge. A point and the direction of an axis, fixed in both bodies, stay the same.
//
//      body 1  --------o--a-->-----  body 2      o: the point of the axis that lies nearest to the centre of body 2 (of
//                                                   body 1 where body 2 is the world) at the start
//
// Freedoms. The point takes the translations; a across two directions of body 1 that are across it takes the two turns
// across the axis: five rows of rank 5, none redundant, one freedom left, the turn about a. (The seed holds two points, six
// rows; 2.84 puts the arm of body 1 on both bodies; each has its own.) Where the scene's points lie on the axis is nothing
// to the rows: with a point far out, ways and turns could not be told apart.
// With limits one row more about a, active only at a limit: rank 6 there. The angle is that of body 2 relative to body 1,
// right-handed about point 1 -> point 2, zero at the start, known within one turn: two limits may span less than that.
// Two that give way are a spring and a damper on what is beyond them, which push and never pull, and take no freedom.
// A spring and a damper about a, torque -k (angle - RestAngle) - c angle', take no freedom. Beyond half a turn from RestAngle
// (from the middle of the limits, where there are some) the angle, and so the spring, goes on from the other side.
// A drive to a speed with a largest torque is one row on the velocity about a (rank 6), as in an `AngularMotor`; at a limit that it
// drives against it stalls, and with speed 0 it is a brake.
// A drive along a course over time (plugin_sdk/joint_motion.h) is one row, too: of the angle, or with a largest torque of the
// velocity.
#include "plugin_sdk/joint_coordinates.h"
#include "plugin_sdk/joint_motion.h"
#include "plugin_sdk/joint_rows.h"
#include "plugin_sdk/math/rotation.h"

namespace gravitas {
namespace {

class Revolute final : public ConstraintPlugin {
 public:
  static PluginDeclaration declaration() {
    return {
        .name = "Revolute",
        .version = "1.6",
        .slot = Slot::kConstraint,
        .meaning = "Hinge.",
        .capabilities = {"coordinates"},
        .types = {{"Revolute",
                   "Two bodies share an axis about which they turn, freely or within limits.",
                   {Property::vector("BindAxisPoint1", "m", "world")
                        .required()
                        .means("First point of the axis, at the start."),
                    Property::vector("BindAxisPoint2", "m", "world").required().means("Second point of the axis."),
                    Property::number("LowerLimit", "rad")
                        .at_most(0.0)
                        .means("Smallest angle of body 2 relative to body 1, right-handed about point 1 -> point 2, "
                               "0 at the start; none if absent."),
                    Property::number("UpperLimit", "rad")
                        .at_least(0.0)
                        .means("Largest angle; none if absent. Less than a full turn above LowerLimit."),
                    Property::number("Stiffness", "N*m/rad").at_least(0.0).means("Torsion spring; none if absent."),
                    Property::number("Damping", "N*m*s/rad").at_least(0.0).means("Torsion damper; none if absent."),
                    Property::number("RestAngle", "rad")
                        .defaults_to({0.0})
                        .means("Angle at which the spring pushes nothing."),
                    Property::number("AngularSpeed", "rad/s")
                        .means("Speed of body 2 relative to body 1 about the axis that a drive keeps; no drive if "
                               "absent."),
                    Property::number("MaximumTorque", "N*m")
                        .at_least(0.0)
                        .means("Largest torque of the drive; unlimited if absent."),
                    restitution_property(),
                    motion_property("rad", "Angle, counted as by the limits but through any number of turns,",
                                    "MaximumTorque"),
                    limit_stiffness_property("N*m/rad", {}, "LowerLimit and UpperLimit"),
                    limit_damping_property("N*m*s/rad")},
                   {{"angle", "rad",
                     "Angle of body 2 relative to body 1, right-handed about point 1 -> point 2, 0 at the start; the "
                     "turn that limits are compared with, without them above -pi up to pi."}}}}};
  }
  explicit Revolute(PropertyCursor) {}

  void bind(const stage::ConstraintBindRequest& request, const stage::ConstraintBindReply& reply, Host&) override {
    bind_each(
        request, reply, [](std::uint64_t type, PropertyCursor properties, const JointBodies& bodies, BoundWriter& out) {
          demand_type(type, "Revolute");
          const Vector3 point1 = properties.vector(), point2 = properties.vector();
          const double lower = properties.number(), upper = properties.number();
          JointLimits limits = JointLimits::of_turn(lower, upper, "Revolute: LowerLimit", "Revolute: UpperLimit");
          const JointSpring spring = JointSpring::of(&properties);
          const Pose frame = hinge_frame(point1, point2, bodies, "Revolute");
          write_frame(bodies.pose1, frame, &out);
          write_frame(bodies.pose2, frame, &out);
          const double rest = properties.at_end() ? 0.0 : properties.number();
          JointDrive drive = JointDrive::of(&properties);
          limits.restitution = read_restitution(&properties, "Revolute", !limits.is_none(), "LowerLimit or UpperLimit");
          drive.follow(&properties, "Revolute", "AngularSpeed", "MaximumTorque");
          // what is far beyond a single one cannot be told from what comes to it from behind
          limits.spring =
              read_limit_spring(&properties, "Revolute", limits, limits.has_both(), "LowerLimit and UpperLimit");
          write_soft_limits(limits, &out);
          write_spring(spring, &out);
          out.number(rest);
          write_drive(drive, &out);
        });
  }

  void discrepancies(const stage::ConstraintDiscrepanciesRequest& request,
                     const stage::ConstraintDiscrepanciesReply& reply, Host&) override {
    describe_each(request, reply, [](std::uint64_t, PropertyCursor bound, const JointBodies& bodies, auto&& emit) {
      const Pose one = read_frame(&bound, bodies.pose1), two = read_frame(&bound, bodies.pose2);
      hold_hinge(one, two, emit);
      const JointLimits limits = read_soft_limits(&bound);
      const JointSpring spring = read_spring(&bound);
      const double rest = bound.number();
      const JointDrive drive = read_drive(&bound);
      if (!limits.is_none() && !drive.is_course_alone())
        emit(limited_twist_row(one.orientation, two.orientation, bodies, limits));
      if (!spring.is_none()) emit(sprung_twist_row(one.orientation, two.orientation, bodies, limits, rest, spring));
      if (!drive.motion.is_none())
        emit(followed_twist(one, two, bodies, limits, drive.motion.at(bodies.time).within(limits), drive.force));
      else if (!drive.is_none())
        emit(driven_row(axis_between(one, two), drive.speed, drive.force));
    });
  }

  void coordinates(const stage::ConstraintDiscrepanciesRequest& request, const stage::ConstraintCoordinatesReply& reply,
                   Host&) override {
    measure_each(request, reply, [](std::uint64_t, PropertyCursor bound, const JointBodies& bodies, auto&& emit) {
      const Pose one = read_frame(&bound, bodies.pose1), two = read_frame(&bound, bodies.pose2);
      const JointLimits limits = read_limits(&bound);
      emit(0, twist_of(one, two, limits, bodies));
    });
  }
};

}  // namespace
}  // namespace gravitas

GRAVITAS_PLUGIN(gravitas::Revolute)
