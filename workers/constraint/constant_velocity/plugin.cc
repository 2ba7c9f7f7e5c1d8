// Constraint `ConstantVelocity`: two shafts that share a point and turn alike, whatever the bend between them.
// (The seed's glossary reads "continuous-velocity".)
//
//      Axis1 ------o            frame 2 is frame 1 bent: it has no twist against it
//                   \ Axis2
//
// Freedoms. The shared point takes the translations, one row the twist: w.(a1 + a2)/|a1 + a2|, w the relative turning, a1
// and a2 the shafts. A bend is a turn about an axis across both, and moving the bend round a1 turns by k (a1 - a2): neither
// has a part along a1 + a2, and all that do not are such turns. Four rows of rank 4, none redundant; left are the two
// bends. With w1 = O1 a1, w2 = O2 a2 and no bending the row says (O2 - O1)(1 + a1.a2) = 0: equal speeds.
// With a largest bend one row more, that of a reach cone round a1 (Spherical), active only there: rank 5.
// A spring against the bend, torque -k bend about the axis across both shafts, and a damper of all turning across shaft 1, -c w,
// take no freedom. Shafts that turn while they are bent move their bend round: the damper takes c W^2 sin^2(bend) of power then.
// Undefined at a bend of 180 degrees, which is refused at the start.
#include <cmath>
#include <string>

#include "plugin_sdk/joint_coordinates.h"
#include "plugin_sdk/joint_rows.h"
#include "plugin_sdk/math/rotation.h"
#include "plugin_sdk/math/transcendental.h"

namespace gravitas {
namespace {

class ConstantVelocity final : public ConstraintPlugin {
 public:
  static PluginDeclaration declaration() {
    return {.name = "ConstantVelocity",
            .version = "1.4",
            .slot = Slot::kConstraint,
            .meaning = "Joint of shafts that turn alike.",
            .capabilities = {"coordinates"},
            .types = {{"ConstantVelocity",
                       "Two shafts share a point and turn at one speed, at any bend.",
                       {Property::vector("BindPoint", "m", "world").required().means("The shared point, at the start."),
                        Property::vector("Axis1", "1", "world")
                            .required()
                            .means("Shaft of body 1, any length; both point the same way along the drive."),
                        Property::vector("Axis2", "1", "world").required().means("Shaft of body 2."),
                        Property::number("BendStiffness", "N*m/rad")
                            .at_least(0.0)
                            .means("Spring that straightens the shafts; none if absent."),
                        Property::number("BendDamping", "N*m*s/rad")
                            .at_least(0.0)
                            .means("Damper of their bending, and of the bend's going round Axis1, as while bent shafts "
                                   "turn; none if "
                                   "absent."),
                        Property::number("MaximumAngle", "rad")
                            .above(0.0)
                            .at_most(kHalfTurn)
                            .means("Largest bend, not below that of the start; none if absent."),
                        restitution_property()},
                       {{"bend", "rad", "Angle between the shafts, 0 ... pi."},
                        {"azimuth", "rad",
                         "Where shaft 2 points round Axis1 in body 1, right-handed about it from the world's x at the "
                         "start as seen along it, from -z where Axis1 is along x, to 1e-3; above -pi up to pi, none "
                         "while the shafts are straight."}}}}};
  }
  explicit ConstantVelocity(PropertyCursor) {}

  void bind(const stage::ConstraintBindRequest& request, const stage::ConstraintBindReply& reply, Host&) override {
    bind_each(request, reply,
              [](std::uint64_t type, PropertyCursor properties, const JointBodies& bodies, BoundWriter& out) {
                demand_type(type, "ConstantVelocity");
                const Vector3 point = properties.vector();
                const Vector3 axis1 = unit_axis(properties.vector(), "ConstantVelocity: Axis1");
                const Vector3 axis2 = unit_axis(properties.vector(), "ConstantVelocity: Axis2");
                if ((axis1 + axis2).norm() < 1e-6) throw Refusal("ConstantVelocity: Axis2 points against Axis1");
                const Pose frame1 = frame_along(point, axis1);
                const Swing bend = swing_between(axis1, axis2);
                write_frame(bodies.pose1, frame1, &out);
                write_frame(bodies.pose2, {point, exp_rotation(bend.angle * bend.axis) * frame1.orientation}, &out);
                write_spring(JointSpring::of(&properties), &out);
                // where azimuths are counted from
                const Vector3 start = azimuth_frame(point, axis1).orientation * Vector3::UnitY();
                const Vector3 zero = frame1.orientation.conjugate() * start;
                out.number(math::atan2(zero.z(), zero.y()));
                write_limit(&properties, bend.angle, &out);
              });
  }

  void discrepancies(const stage::ConstraintDiscrepanciesRequest& request,
                     const stage::ConstraintDiscrepanciesReply& reply, Host&) override {
    describe_each(request, reply, [](std::uint64_t, PropertyCursor bound, const JointBodies& bodies, auto&& emit) {
      const Pose one = read_frame(&bound, bodies.pose1), two = read_frame(&bound, bodies.pose2);
      double scale = 0.0;
      emit(held_point(one, two.position, {true, true, true}));
      emit(twist_row(one.orientation, two.orientation, AxisMode::kLocked, &scale));
      const JointSpring spring = read_spring(&bound);
      if (!spring.is_none()) {
        // across the shaft: about it, what the twist's row holds would be pushed by what the step foresees of the turn
        Discrepancy bend = turn_between(one.orientation, two.orientation);
        for (const int axis : {1, 2}) spring.yield_on(axis, &bend);
        emit(bend);
      }
      bound.number();  // of the coordinates alone
      if (bound.at_end()) return;
      const double most = bound.number(), restitution = bound.number();
      emit(cone_row(one.orientation * Vector3::UnitX(), two.orientation * Vector3::UnitX(), most, restitution));
    });
  }

  void coordinates(const stage::ConstraintDiscrepanciesRequest& request, const stage::ConstraintCoordinatesReply& reply,
                   Host&) override {
    measure_each(request, reply, [](std::uint64_t, PropertyCursor bound, const JointBodies& bodies, auto&& emit) {
      const Pose one = read_frame(&bound, bodies.pose1), two = read_frame(&bound, bodies.pose2);
      read_spring(&bound);
      const Vector3 axis1 = one.orientation * Vector3::UnitX(), axis2 = two.orientation * Vector3::UnitX();
      emit(0, swing_of(axis1, axis2, bodies));
      const math::SinCos zero = math::sincos(bound.number());
      const Vector3 start = one.orientation * Vector3(0.0, zero.cos, zero.sin);
      emit(1, azimuth_of(axis1, start, axis2, bodies.spin2 - bodies.spin1));
    });
  }

 private:
  // Nothing where there is none; a request that was recorded before there were any may end here.
  static void write_limit(PropertyCursor* properties, double start, BoundWriter* out) {
    constexpr double kRounding = 1e-9;  // rad, of axes that scenes give
    const double most = properties->at_end() ? std::nan("") : properties->number();
    const double restitution = read_restitution(properties, "ConstantVelocity", !std::isnan(most), "MaximumAngle");
    if (std::isnan(most)) return;
    if (!(most > 0.0 && most <= kHalfTurn)) throw Refusal("ConstantVelocity: MaximumAngle is outside 0 ... pi");
    if (start > most + kRounding)
      throw Refusal("ConstantVelocity: MaximumAngle " + std::to_string(most) + " lies below the bend of the start, " +
                    std::to_string(start));
    out->number(most);
    out->number(restitution);
  }
};

}  // namespace
}  // namespace gravitas

GRAVITAS_PLUGIN(gravitas::ConstantVelocity)
