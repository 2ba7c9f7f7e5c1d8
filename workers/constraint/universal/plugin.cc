// Constraint `Universal`: Hooke's joint. A cross whose one bar is fixed in body 1 and whose other in body 2.
//
//      Axis1 (body 1)  --+--  Axis2 (body 2)      the points coincide, and the bars keep their angle
//
// Freedoms. The shared point takes the translations. The angle of the bars changes at the rate w.n, n = a1 x a2/|a1 x a2|:
// one turn, about the normal of both bars. Four rows of rank 4 while the bars are not parallel, none redundant; left are the
// turns about either bar.
// A spring and a damper about either bar take no freedom. Their angle is that by which one bar has turned about the other
// since the start, asin(sin(g) sin(angle)) where the bars make an angle g: within a right angle, beyond which they pull on.
// Drives. Body 2 turns on body 1 at p a1 + q a2, with p and q what it turns about the bars. So d1 = (a1 - (a1.a2) a2)/sin^2 g has
// d1.w = p and no part along a2: a torque T d1 does the work T p, as a motor or friction between body 1 and the cross does, and d2
// alike between the cross and body 2. Each is one row on the velocity about its d, made unit; with a speed of 0 it is the friction
// of a bearing, of at most its torque.
// Shafts that are across the bars turn by tan(phi2) = tan(phi1)/cos(bend), not evenly; ConstantVelocity does.
#include <string>

#include "plugin_sdk/joint_coordinates.h"
#include "plugin_sdk/joint_rows.h"

namespace gravitas {
namespace {

class Universal final : public ConstraintPlugin {
 public:
  static PluginDeclaration declaration() {
    return {
        .name = "Universal",
        .version = "1.2",
        .slot = Slot::kConstraint,
        .meaning = "Hooke's joint.",
        .capabilities = {"coordinates"},
        .types = {
            {"Universal",
             "Two bodies share a point; an axis of the first and one of the second keep their angle.",
             {Property::vector("BindPoint", "m", "world").required().means("The shared point, at the start."),
              Property::vector("Axis1", "1", "world")
                  .required()
                  .means("Bar of the cross that is fixed in body 1, any length."),
              Property::vector("Axis2", "1", "world")
                  .required()
                  .means("Bar that is fixed in body 2; not parallel to Axis1, as a rule across it."),
              Property::number("Stiffness1", "N*m/rad")
                  .at_least(0.0)
                  .means("Spring about Axis1, at rest at the start; none if absent."),
              Property::number("Damping1", "N*m*s/rad").at_least(0.0).means("Damper about Axis1; none if absent."),
              Property::number("Stiffness2", "N*m/rad")
                  .at_least(0.0)
                  .means("Spring about Axis2, at rest at the start; none if absent."),
              Property::number("Damping2", "N*m*s/rad").at_least(0.0).means("Damper about Axis2; none if absent."),
              Property::number("AngularSpeed1", "rad/s")
                  .means(
                      "Speed of body 2 relative to body 1 about Axis1 that a drive keeps; 0 for friction, no drive if "
                      "absent."),
              Property::number("MaximumTorque1", "N*m")
                  .at_least(0.0)
                  .means("Largest torque of that drive; unlimited if absent."),
              Property::number("AngularSpeed2", "rad/s").means("The same about Axis2."),
              Property::number("MaximumTorque2", "N*m")
                  .at_least(0.0)
                  .means("Largest torque of that drive; unlimited if absent.")},
             {{"angle1", "rad",
               "Turn of the cross, and of body 2 with it, about Axis1, relative to body 1, right-handed, 0 at the "
               "start, above -pi up to pi."},
              {"angle2", "rad",
               "Turn of body 2 about Axis2, relative to the cross, right-handed, 0 at the start, above -pi up to "
               "pi."}}}}};
  }
  explicit Universal(PropertyCursor) {}

  void bind(const stage::ConstraintBindRequest& request, const stage::ConstraintBindReply& reply, Host&) override {
    bind_each(request, reply,
              [](std::uint64_t type, PropertyCursor properties, const JointBodies& bodies, BoundWriter& out) {
                demand_type(type, "Universal");
                const Vector3 point = properties.vector();
                const Vector3 axis1 = unit_axis(properties.vector(), "Universal: Axis1");
                const Vector3 axis2 = unit_axis(properties.vector(), "Universal: Axis2");
                if (axis1.cross(axis2).norm() < 1e-6) throw Refusal("Universal: Axis2 is parallel to Axis1");
                write_frame(bodies.pose1, cross_frame(point, axis1, axis2), &out);
                write_frame(bodies.pose2, cross_frame(point, axis2, axis1), &out);
                out.number(swing_between(axis1, axis2).angle);
                for (int bar = 0; bar < 2; ++bar) write_spring(JointSpring::of(&properties), &out);
                write_drives(&properties, &out);
              });
  }

  void discrepancies(const stage::ConstraintDiscrepanciesRequest& request,
                     const stage::ConstraintDiscrepanciesReply& reply, Host&) override {
    describe_each(request, reply, [](std::uint64_t, PropertyCursor bound, const JointBodies& bodies, auto&& emit) {
      const Pose one = read_frame(&bound, bodies.pose1), two = read_frame(&bound, bodies.pose2);
      emit(held_point(one, two.position, {true, true, true}));
      const Vector3 axis1 = one.orientation * Vector3::UnitX(), axis2 = two.orientation * Vector3::UnitX();
      emit(swing_row(axis1, axis2, bound.number()));
      const JointSpring spring1 = read_spring(&bound), spring2 = read_spring(&bound);
      // of a direction of either body, across each other at the start
      const Vector3 across1 = one.orientation * Vector3::UnitZ(), across2 = two.orientation * Vector3::UnitZ();
      if (!spring1.is_none()) emit(sprung(swing_row(across1, axis2, kQuarterTurn), spring1));
      if (!spring2.is_none()) emit(sprung(swing_row(axis1, across2, kQuarterTurn), spring2));
      if (bound.at_end()) return;
      PropertyCursor drive1(bound.table(2)), drive2(bound.table(2));
      const Vector3 normal = swing_between(axis1, axis2).axis;
      const double sine = axis1.cross(axis2).norm();
      drive_about(axis2.cross(normal), sine, &drive1, emit);
      drive_about(normal.cross(axis1), sine, &drive2, emit);
    });
  }

  void coordinates(const stage::ConstraintDiscrepanciesRequest& request, const stage::ConstraintCoordinatesReply& reply,
                   Host&) override {
    measure_each(request, reply, [](std::uint64_t, PropertyCursor bound, const JointBodies& bodies, auto&& emit) {
      const Pose one = read_frame(&bound, bodies.pose1), two = read_frame(&bound, bodies.pose2);
      const Vector3 axis1 = one.orientation * Vector3::UnitX(), axis2 = two.orientation * Vector3::UnitX();
      const Vector3 turning = bodies.spin2 - bodies.spin1;
      // the second axis of either frame is where the other bar was at the start
      emit(0, azimuth_of(axis1, one.orientation * Vector3::UnitY(), axis2, turning));
      emit(1, reversed(azimuth_of(axis2, two.orientation * Vector3::UnitY(), axis1, -turning)));
    });
  }

 private:
  // Of either bar a table of one row or none; nothing where neither has a drive.
  static void write_drives(PropertyCursor* properties, BoundWriter* out) {
    BoundWriter first, second;
    write_drive(properties, "Universal", &first, "1");
    write_drive(properties, "Universal", &second, "2");
    if (first.numbers().empty() && second.numbers().empty()) return;
    for (const BoundWriter* drive : {&first, &second}) {
      out->number(drive->numbers().empty() ? 0.0 : 1.0);
      for (const double number : drive->numbers()) out->number(number);
    }
  }
};

}  // namespace
}  // namespace gravitas

GRAVITAS_PLUGIN(gravitas::Universal)
