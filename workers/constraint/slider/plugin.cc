// Constraint `Slider`: body 2 slides along an axis of body 1 and does not turn.
//
//      body 1 |====o====>====|  x = Axis      of body 2's frame in body 1's: the origin in y and z; x across y and
//                 body 2                      z of body 1's, y across its z
//
// Freedoms. The origin's two rows take the translations across the axis, the angles the turns about z, y and x: five rows
// of rank 5, none redundant, one freedom left. The rows are taken where body 2 is, so that a long way along the axis is no
// lever.
// The way along the axis, body 2 relative to body 1, 0 at the start, may have limits (one row, rank 6 at a limit; those that give
// way are a spring and a damper on what is beyond them, which push and never pull, and take no freedom) and a drive to a speed
// with a largest force (one row on the velocity, rank 6). A spring and a damper along it, force
// -k (way - RestPosition) - c way', take no freedom. A drive along a course over time (plugin_sdk/joint_motion.h) is one row, too: of
// the way, or with a largest force of the velocity.
#include "plugin_sdk/joint_coordinates.h"
#include "plugin_sdk/joint_motion.h"
#include "plugin_sdk/joint_rows.h"

namespace gravitas {
namespace {

class Slider final : public ConstraintPlugin {
 public:
  static PluginDeclaration declaration() {
    return {
        .name = "Slider",
        .version = "1.5",
        .slot = Slot::kConstraint,
        .meaning = "Straight guide.",
        .capabilities = {"coordinates"},
        .types = {
            {"Slider",
             "The second body slides along an axis of the first and does not turn against it.",
             {Property::vector("BindPoint", "m", "world").required().means("A point of the guide."),
              Property::vector("Axis", "1", "world").required().means("Its direction, any length."),
              Property::number("LowerLimit", "m")
                  .at_most(0.0)
                  .means("Smallest way of body 2 along the axis from the start; none if absent."),
              Property::number("UpperLimit", "m").at_least(0.0).means("Largest way; none if absent."),
              Property::number("Speed", "m/s")
                  .means("Speed of body 2 along the axis that a drive keeps; no drive if absent."),
              Property::number("MaximumForce", "N")
                  .at_least(0.0)
                  .means("Largest force of the drive; unlimited if absent."),
              Property::number("Stiffness", "N/m").at_least(0.0).means("Spring along the axis; none if absent."),
              Property::number("Damping", "N*s/m").at_least(0.0).means("Damper along the axis; none if absent."),
              Property::number("RestPosition", "m").defaults_to({0.0}).means("Way at which the spring pushes nothing."),
              restitution_property(),
              motion_property("m", "Way of body 2 along the axis from the start", "MaximumForce"),
              limit_stiffness_property("N/m"), limit_damping_property("N*s/m")},
             {{"displacement", "m", "Way of body 2 along the axis, relative to body 1, 0 at the start."}}}}};
  }
  explicit Slider(PropertyCursor) {}

  void bind(const stage::ConstraintBindRequest& request, const stage::ConstraintBindReply& reply, Host&) override {
    bind_each(
        request, reply, [](std::uint64_t type, PropertyCursor properties, const JointBodies& bodies, BoundWriter& out) {
          demand_type(type, "Slider");
          const Vector3 point = properties.vector();
          const Pose frame = frame_along(point, unit_axis(properties.vector(), "Slider: Axis"));
          const double lower = properties.number(), upper = properties.number();
          JointLimits limits = JointLimits::of(lower, upper, "Slider: LowerLimit", "Slider: UpperLimit");
          JointDrive drive = JointDrive::of(&properties);
          const JointSpring spring = JointSpring::of(&properties);
          const double rest = properties.at_end() ? 0.0 : properties.number();
          limits.restitution = read_restitution(&properties, "Slider", !limits.is_none(), "LowerLimit or UpperLimit");
          drive.follow(&properties, "Slider", "Speed", "MaximumForce");
          limits.spring =
              read_limit_spring(&properties, "Slider", limits, !limits.is_none(), "LowerLimit or UpperLimit");
          write_frame(bodies.pose1, frame, &out);
          write_frame(bodies.pose2, frame, &out);
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
      emit(held_point(one, two.position, {false, true, true}));
      hold_orientation(one, two, emit);

      const Vector3 axis = one.orientation * Vector3::UnitX();
      const JointLimits limits = read_soft_limits(&bound);
      const JointSpring spring = read_spring(&bound);
      const double rest = bound.number();
      const JointDrive drive = read_drive(&bound);
      if (!limits.is_none() && !drive.is_course_alone())
        emit(limited_way_row(axis, one.position, two.position, limits));
      if (!drive.motion.is_none()) {
        const CourseState course = drive.motion.at(bodies.time).within(limits);
        emit(followed_way(axis, one.position, two.position, bodies, course, drive.force));
      } else if (!drive.is_none()) {
        Discrepancy driven = row_along(axis, two.position, two.position, AxisMode::kDriven);
        driven.velocity = drive.speed * axis;
        driven.maximum_force.x() = drive.force;
        emit(driven);
      }
      if (!spring.is_none())
        emit(sprung(row_along(axis, one.position + rest * axis, two.position, AxisMode::kFree), spring));
    });
  }

  void coordinates(const stage::ConstraintDiscrepanciesRequest& request, const stage::ConstraintCoordinatesReply& reply,
                   Host&) override {
    measure_each(request, reply, [](std::uint64_t, PropertyCursor bound, const JointBodies& bodies, auto&& emit) {
      const Pose one = read_frame(&bound, bodies.pose1), two = read_frame(&bound, bodies.pose2);
      emit(0, way_along(one.orientation * Vector3::UnitX(), one.position, two.position, bodies));
    });
  }
};

}  // namespace
}  // namespace gravitas

GRAVITAS_PLUGIN(gravitas::Slider)
