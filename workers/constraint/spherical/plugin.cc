// Constraint `Spherical` (§ 2.7.5.2, 2.83; § 2.7.5.6): a ball-and-socket joint, with a reach cone and twist limits if wanted.
// (The seed's glossary calls it a minimum distance; the points coincide.)
//
//        a1 ^   / a2          a1, a2: Axis as fixed in body 1 and in body 2; phi their angle, psi the
//            \ /              azimuth of a2 round a1; phi <= c(psi), a cone that is regular or not
//             o
//
// Freedoms. One point, fixed in both bodies, stays one point: three locked rows, rank 3. The cone is one one-sided row
// along its normal, the twist one limited row: rank 4 at the cone, 5 where the twist is at its limit too; swing along the
// cone stays free. (As printed, (2.87) locks swing and return: rank 5.)
// Cone. With t the direction of a2 across a1, n = a1 x t, e = dA2/dphi = cos(phi) t - sin(phi) a1 and the relative turning
// w, phi' = w.n and sin(phi) psi' = -w.e, so phi - c(psi) has the rate w.(n + c' e/sin(phi)). The row is that direction made
// unit, with sin(c) for sin(phi), which is the same at the cone and finite at the axis. Of an irregular cone c is linear
// between its points, round once; a regular one's row is that of a swing, exact for turns of any size. Azimuths count
// right-handed about Axis, from the world's x as seen along it (-z for an Axis within 1e-3 of x).
// Spring and damper: of the whole turn of body 2 against body 1 since the start, torque -k angle about its axis and -c w. They
// take no freedom.
// Drive: to an angular velocity of body 2 against body 1, three rows on velocities about axes that body 1 carries, those of the
// world at the start. MaximumTorque bounds each by itself, as a discrepancy bounds its axes (joint_laws.h): up to sqrt(3) of it
// between them. With a velocity of 0 it is the friction of the joint.
// Twist: limited_twist_row() of plugin_sdk/joint_rows.h, undefined at a swing of 180 degrees.
#include <cmath>
#include <vector>

#include "plugin_sdk/joint_coordinates.h"
#include "plugin_sdk/joint_rows.h"
#include "plugin_sdk/math/rotation.h"
#include "plugin_sdk/math/transcendental.h"

namespace gravitas {
namespace {

// c and dc/dpsi of a cone of points (azimuth, angle).
struct ConePoint {
  double angle, slope;
};
ConePoint cone_at(std::span<const double> cone, double azimuth) {
  const std::size_t count = cone.size() / 2;
  std::size_t next = 0;
  while (next < count && cone[2 * next] <= azimuth) ++next;
  const std::size_t last = next == 0 ? count - 1 : next - 1;
  const double from = cone[2 * last] - (next == 0 ? kWholeTurn : 0.0);
  const double to = next == count ? cone[0] + kWholeTurn : cone[2 * next];
  const double end = cone[2 * (next == count ? 0 : next) + 1];
  const double slope = (end - cone[2 * last + 1]) / (to - from);
  return {cone[2 * last + 1] + slope * (azimuth - from), slope};
}

class Spherical final : public ConstraintPlugin {
 public:
  static PluginDeclaration declaration() {
    return {
        .name = "Spherical",
        .version = "1.3",
        .slot = Slot::kConstraint,
        .meaning = "Ball-and-socket joint.",
        .capabilities = {"coordinates"},
        .types = {
            {"Spherical",
             "Two bodies share a point about which they turn, freely or within a reach cone and limits of twist.",
             {Property::vector("BindPoint", "m", "world").required().means("The shared point, at the start."),
              Property::number("ReachConeAngle", "rad")
                  .above(0.0)
                  .at_most(kHalfTurn)
                  .means("Largest angle of Axis in body 2 against Axis in body 1; none if absent."),
              Property::table("ReachCone", 2, "rad", "world")
                  .means("An irregular cone instead: azimuth, rising within 0 ... 2 pi, and largest angle there; three "
                         "rows at least, linear in the azimuth between them. Azimuths count right-handed about Axis "
                         "from the "
                         "world's x as seen along it; from -z where Axis is along x, to 1e-3."),
              Property::vector("Axis", "1", "world")
                  .means("Axis of cone and twist at the start, any length; what coordinates are counted from, of a "
                         "joint without limits, too."),
              Property::number("TwistLower", "rad")
                  .at_least(-kHalfTurn)
                  .at_most(0.0)
                  .means("Smallest twist of body 2 about its axis, 0 at the start; none if absent."),
              Property::number("TwistUpper", "rad")
                  .at_least(0.0)
                  .at_most(kHalfTurn)
                  .means("Largest twist; none if absent."),
              Property::number("Stiffness", "N*m/rad")
                  .at_least(0.0)
                  .means(
                      "Spring that turns body 2 back to how it was at the start, about whatever axis; none if absent."),
              Property::number("Damping", "N*m*s/rad")
                  .at_least(0.0)
                  .means("Damper of all its turning; none if absent."),
              Property::vector("AngularVelocity", "rad/s", "world")
                  .means(
                      "Angular velocity of body 2 relative to body 1 that a drive keeps, in axes that body 1 carries, "
                      "those of the world at the start; 0 for friction, no drive if absent."),
              Property::number("MaximumTorque", "N*m")
                  .at_least(0.0)
                  .means("Largest torque of the drive about each of these axes; unlimited if absent.")},
             {{"swing", "rad",
               "Angle of Axis in body 2 against Axis in body 1, which ReachConeAngle bounds, 0 ... pi; of a joint with "
               "Axis, as the others."},
              {"azimuth", "rad",
               "Where Axis in body 2 points round that in body 1, as azimuths of ReachCone count, above -pi up to pi; "
               "none while both point alike."},
              {"twist", "rad",
               "Twist of body 2 about its axis; the turn that TwistLower and TwistUpper are compared with, without "
               "them above -pi up to pi."}}}}};
  }
  explicit Spherical(PropertyCursor) {}

  void bind(const stage::ConstraintBindRequest& request, const stage::ConstraintBindReply& reply, Host&) override {
    bind_each(request, reply,
              [](std::uint64_t type, PropertyCursor properties, const JointBodies& bodies, BoundWriter& out) {
                demand_type(type, "Spherical");
                const Vector3 point = properties.vector();
                out.vector(inverse_transform_point(bodies.pose1, point));
                out.vector(inverse_transform_point(bodies.pose2, point));
                // a request may end here: the joint that leaves all turns free
                if (properties.at_end()) return;
                const Cone cone = read_cone(&properties);
                const JointSpring spring = JointSpring::of(&properties);
                BoundWriter drive;
                write_turning_drive(bodies, &properties, &drive);
                if (!cone.has_axis && spring.is_none() && drive.numbers().empty()) return;
                const Pose frame = azimuth_frame(point, cone.axis);
                write_frame(bodies.pose1, frame, &out);
                write_frame(bodies.pose2, frame, &out);
                write_spring(spring, &out);
                write_cone(cone, &out);
                out.number(cone.has_axis ? 1.0 : 0.0);
                for (const double number : drive.numbers()) out.number(number);
              });
  }

  void discrepancies(const stage::ConstraintDiscrepanciesRequest& request,
                     const stage::ConstraintDiscrepanciesReply& reply, Host&) override {
    describe_each(request, reply, [](std::uint64_t, PropertyCursor bound, const JointBodies& bodies, auto&& emit) {
      const Vector3 anchor1 = bound.vector();
      const Vector3 anchor2 = bound.vector();
      emit(point_discrepancy(anchor1, anchor2, bodies));
      if (!bound.at_end()) describe_turns(bound, bodies, emit);
    });
  }

  void coordinates(const stage::ConstraintDiscrepanciesRequest& request, const stage::ConstraintCoordinatesReply& reply,
                   Host&) override {
    measure_each(request, reply, [](std::uint64_t, PropertyCursor bound, const JointBodies& bodies, auto&& emit) {
      for (int anchor = 0; anchor < 2; ++anchor) bound.vector();
      if (bound.at_end()) return;
      const Pose one = read_frame(&bound, bodies.pose1), two = read_frame(&bound, bodies.pose2);
      read_spring(&bound);
      JointLimits twist;
      twist.lower = bound.number();
      twist.upper = bound.number();
      bound.table(2);
      if (!bound.flag()) return;
      const Vector3 axis1 = one.orientation * Vector3::UnitX(), axis2 = two.orientation * Vector3::UnitX();
      emit(0, swing_of(axis1, axis2, bodies));
      emit(1, azimuth_of(axis1, one.orientation * Vector3::UnitY(), axis2, bodies.spin2 - bodies.spin1));
      emit(2, twist_of(one, two, twist, bodies));
    });
  }

 private:
  struct Cone {
    Vector3 axis = Vector3::UnitX();
    bool has_axis = false;
    JointLimits twist;
    double angle = 0.0;  // of a regular one, else 0
    std::span<const double> irregular;

    bool limits_nothing() const { return twist.is_none() && angle == 0.0 && irregular.empty(); }
  };

  static Cone read_cone(PropertyCursor* properties) {
    Cone cone;
    const double angle = properties->number();
    cone.irregular = properties->table(2);
    const Vector3 axis = properties->vector();
    const double lower = properties->number(), upper = properties->number();
    cone.twist = JointLimits::of(lower, upper, "Spherical: TwistLower", "Spherical: TwistUpper");
    if (!std::isnan(angle)) {
      if (!cone.irregular.empty()) throw Refusal("Spherical: ReachConeAngle and ReachCone are both given");
      if (!(angle > 0.0 && angle <= kHalfTurn)) throw Refusal("Spherical: ReachConeAngle is outside 0 ... pi");
      cone.angle = angle;
    }
    demand_cone(cone.irregular);
    cone.has_axis = axis.stableNorm() > 0.0 && axis.allFinite();
    if (cone.limits_nothing() && !cone.has_axis) return cone;
    if (axis.array().isNaN().all())
      throw Refusal("Spherical: Axis is missing, which reach cone and twist limits are measured from");
    cone.axis = unit_axis(axis, "Spherical: Axis");
    return cone;
  }

  static void write_cone(const Cone& cone, BoundWriter* out) {
    out->number(cone.twist.lower);
    out->number(cone.twist.upper);
    const bool is_regular = cone.angle > 0.0;
    out->number(is_regular ? 1.0 : static_cast<double>(cone.irregular.size() / 2));
    if (is_regular) out->number(0.0), out->number(cone.angle);
    for (const double number : cone.irregular) out->number(number);
  }

  static void write_turning_drive(const JointBodies& bodies, PropertyCursor* properties, BoundWriter* out) {
    if (properties->at_end()) return;
    const Vector3 velocity = properties->vector();
    const double torque = properties->number();
    if (velocity.hasNaN()) {
      if (!std::isnan(torque)) throw Refusal("Spherical: MaximumTorque is given without AngularVelocity");
      return;
    }
    write_frame(bodies.pose1, {bodies.pose1.position, Quaternion::Identity()}, out);
    out->vector(velocity);
    out->number(std::isnan(torque) ? kUnlimited : torque);
  }

  static void demand_cone(std::span<const double> cone) {
    if (cone.empty()) return;
    if (cone.size() < 6) throw Refusal("Spherical: ReachCone has fewer than three rows");
    for (std::size_t i = 0; i < cone.size(); i += 2) {
      if (!(cone[i] >= 0.0 && cone[i] < kWholeTurn) || (i > 0 && !(cone[i] > cone[i - 2])))
        throw Refusal("Spherical: ReachCone has azimuths that do not rise within 0 ... 2 pi");
      if (!(cone[i + 1] > 0.0 && cone[i + 1] <= kHalfTurn))
        throw Refusal("Spherical: ReachCone has an angle outside 0 ... pi");
    }
  }

  template <typename Emit>
  static void describe_turns(PropertyCursor bound, const JointBodies& bodies, Emit&& emit) {
    const Pose one = read_frame(&bound, bodies.pose1), two = read_frame(&bound, bodies.pose2);
    const JointSpring spring = read_spring(&bound);
    if (!spring.is_none()) emit(sprung_turn(one.orientation, two.orientation, spring));
    JointLimits twist;
    twist.lower = bound.number();
    twist.upper = bound.number();
    const std::span<const double> cone = bound.table(2);
    if (!cone.empty()) emit(cone_row(cone, one.orientation, two.orientation));
    if (!twist.is_none()) emit(limited_twist_row(one.orientation, two.orientation, bodies, twist));
    if (bound.at_end()) return;
    bound.flag();  // has an axis
    if (bound.at_end()) return;
    Discrepancy drive;
    drive.axes = read_frame(&bound, bodies.pose1).orientation;
    drive.modes = pack_modes(AxisMode::kDriven, AxisMode::kDriven, AxisMode::kDriven, true);
    drive.velocity = drive.axes * bound.vector();
    drive.maximum_force = Vector3::Constant(bound.number());
    emit(drive);
  }

  static Discrepancy cone_row(std::span<const double> cone, const Quaternion& one, const Quaternion& two) {
    const Vector3 a1 = one * Vector3::UnitX(), a2 = two * Vector3::UnitX();
    if (cone.size() == 2) {
      Discrepancy row = swing_row(a1, a2, cone[1], AxisMode::kLimited);
      row.lower.x() = -kUnlimited;
      return row;
    }
    const Swing swing = swing_between(a1, a2);
    const Vector3 across = swing.axis.cross(a1);
    double azimuth = math::atan2((one * Vector3::UnitZ()).dot(across), (one * Vector3::UnitY()).dot(across));
    if (azimuth < 0.0) azimuth += kWholeTurn;
    const ConePoint reach = cone_at(cone, azimuth);
    const math::SinCos swung = math::sincos(swing.angle);
    const Vector3 outward = swung.cos * across - swung.sin * a1;
    const double steepness = reach.slope == 0.0 ? 0.0 : reach.slope / math::sin(reach.angle);
    const Vector3 normal = swing.axis + steepness * outward;
    const double length = normal.norm();
    Discrepancy row = row_about(normal / length, (swing.angle - reach.angle) / length, AxisMode::kLimited);
    row.lower.x() = -kUnlimited;
    return row;
  }
};

}  // namespace
}  // namespace gravitas

GRAVITAS_PLUGIN(gravitas::Spherical)
