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
// Cone. A row of a swing (kSwingDiscrepancy), exact for turns of any size. Of an irregular cone c is linear between its points,
// round once, and the row is that of the regular cone that touches and bends as it does where a2 is: with t the direction of
// a2 across a1, u = a1 x t, s = sin(c) and e = cos(c) t - s a1, the edge p = cos(c) a1 + s t goes along c' e + s u, inward of
// it is n = (c' u - s e)/q, q^2 = s^2 + c'^2, and its curvature on the sphere is cot(r) = cos(c) (s^2 + 2 c'^2)/q^3; so the
// touching cone has the angle r about cos(r) p + sin(r) n. On the edge value, rate and second derivative are those of the
// irregular cone itself; what turns far round it in a step is off by the third power of that. A second row is that of the piece
// behind the nearer corner, as it is there, or carried on to where a2 is, where the corner's cone would cut into this piece; it
// holds where the corner points outwards. Azimuths count
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

// A piece of the edge of an irregular cone, of points (azimuth, angle): c and dc/dpsi, linear between two of them.
struct ConePiece {
  double begin, end;  // azimuths
  double angle;       // where it begins
  double slope;

  double reach(double azimuth) const { return angle + slope * (azimuth - begin); }
};
ConePiece piece_of(std::span<const double> cone, std::size_t last) {
  const std::size_t count = cone.size() / 2, next = last + 1 == count ? 0 : last + 1;
  const double begin = cone[2 * last], end = cone[2 * next] + (next == 0 ? kWholeTurn : 0.0);
  const double angle = cone[2 * last + 1];
  return {begin, end, angle, (cone[2 * next + 1] - angle) / (end - begin)};
}

// The regular cone that touches an irregular one at a point of its edge, in the direction `across` the axis there, and bends as
// it does: the unit axis and the angle of its circle.
struct RegularCone {
  Vector3 axis;
  double angle;
};
RegularCone osculating_cone(double reach, double slope, const Vector3& axis, const Vector3& across) {
  if (slope == 0.0) return {axis, reach};
  const math::SinCos at = math::sincos(reach);
  const double square = at.sin * at.sin + slope * slope, speed = std::sqrt(square);
  const Vector3 point = at.cos * axis + at.sin * across;
  const Vector3 away = at.cos * across - at.sin * axis;
  const Vector3 inward = (slope * axis.cross(across) - at.sin * away) / speed;
  const double angle = math::atan2(square * speed, at.cos * (square + slope * slope));
  const math::SinCos radius = math::sincos(angle);
  return {radius.cos * point + radius.sin * inward, angle};
}

class Spherical final : public ConstraintPlugin {
 public:
  static PluginDeclaration declaration() {
    return {
        .name = "Spherical",
        .version = "1.4",
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
                  .means(
                      "Axis of cone and twist at the start, any length; what coordinates are counted from, of a "
                      "joint without limits, too. Absent with limits: from BindPoint to the centre of mass of body 2 "
                      "(of body 1 where that is the world), if it is elsewhere."),
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
                  .means("Largest torque of the drive about each of these axes; unlimited if absent."),
              restitution_property()},
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
                Cone cone = read_cone(&properties, bodies.centre() - point);
                const JointSpring spring = JointSpring::of(&properties);
                BoundWriter drive;
                write_turning_drive(bodies, &properties, &drive);
                cone.twist.restitution = read_restitution(&properties, "Spherical", !cone.limits_nothing(),
                                                          "ReachConeAngle, ReachCone, TwistLower or TwistUpper");
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
      const JointLimits twist = read_limits(&bound);
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
    JointLimits twist;   // with the restitution of the cone, too
    double angle = 0.0;  // of a regular one, else 0
    std::span<const double> irregular;

    bool limits_nothing() const { return twist.is_none() && angle == 0.0 && irregular.empty(); }
  };

  // `outward`: from the shared point to the centre of mass.
  static Cone read_cone(PropertyCursor* properties, const Vector3& outward) {
    constexpr double kShortest = 1e-6;  // m, that still is a direction
    Cone cone;
    const double angle = properties->number();
    cone.irregular = properties->table(2);
    const Vector3 axis = properties->vector();
    const double lower = properties->number(), upper = properties->number();
    cone.twist = JointLimits::of_turn(lower, upper, "Spherical: TwistLower", "Spherical: TwistUpper");
    if (!std::isnan(angle)) {
      if (!cone.irregular.empty()) throw Refusal("Spherical: ReachConeAngle and ReachCone are both given");
      if (!(angle > 0.0 && angle <= kHalfTurn)) throw Refusal("Spherical: ReachConeAngle is outside 0 ... pi");
      cone.angle = angle;
    }
    demand_cone(cone.irregular);
    cone.has_axis = axis.stableNorm() > 0.0 && axis.allFinite();
    if (cone.limits_nothing() && !cone.has_axis) return cone;
    const bool is_absent = axis.array().isNaN().all();
    if (is_absent && !(outward.norm() > kShortest))
      throw Refusal("Spherical: Axis is missing, which reach cone and twist limits are measured from");
    cone.axis = is_absent ? Vector3(outward.normalized()) : unit_axis(axis, "Spherical: Axis");
    cone.has_axis = true;
    return cone;
  }

  static void write_cone(const Cone& cone, BoundWriter* out) {
    write_limits(cone.twist, out);
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
    const JointLimits twist = read_limits(&bound);
    const std::span<const double> cone = bound.table(2);
    if (!cone.empty()) emit_cone(cone, twist.restitution, one.orientation, two.orientation, emit);
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

  template <typename Emit>
  static void emit_cone(std::span<const double> cone, double restitution, const Quaternion& one, const Quaternion& two,
                        Emit&& emit) {
    const Vector3 a1 = one * Vector3::UnitX(), a2 = two * Vector3::UnitX();
    if (cone.size() == 2) return emit(cone_row(a1, a2, cone[1], restitution));
    const Vector3 from = one * Vector3::UnitY(), to = one * Vector3::UnitZ();
    const Vector3 across = swing_between(a1, a2).axis.cross(a1);
    double azimuth = math::atan2(to.dot(across), from.dot(across));
    if (azimuth < 0.0) azimuth += kWholeTurn;
    if (azimuth < cone[0]) azimuth += kWholeTurn;
    const std::size_t count = cone.size() / 2;
    std::size_t last = 0;
    while (last + 1 < count && cone[2 * last + 2] <= azimuth) ++last;
    const ConePiece here = piece_of(cone, last);
    const RegularCone touching = osculating_cone(here.reach(azimuth), here.slope, a1, across);
    emit(cone_row(touching.axis, a2, touching.angle, restitution));
    // at a corner outwards the piece behind it, too
    const bool is_past = azimuth - here.begin < here.end - azimuth;
    const ConePiece next = piece_of(cone, is_past ? (last + count - 1) % count : (last + 1) % count);
    const bool is_outward = is_past ? next.slope > here.slope : next.slope < here.slope;
    const double corner = is_past ? here.begin : here.end;
    const math::SinCos at = math::sincos(corner);
    RegularCone other = osculating_cone(here.reach(corner), next.slope, a1, at.cos * from + at.sin * to);
    bool bounds = is_outward;
    // far from the corner that circle may cut into what this piece allows; carried on to where a2 is, the other piece does not
    constexpr double kRounding = 1e-9;  // rad
    const auto passed = [&](const RegularCone& one) { return swing_between(one.axis, a2).angle - one.angle; };
    if (is_outward && passed(other) > passed(touching) + kRounding) {
      const double beyond = here.reach(corner) + next.slope * (azimuth - corner);
      bounds = beyond < kHalfTurn;
      if (bounds) other = osculating_cone(beyond, next.slope, a1, across);
    }
    Discrepancy beside = cone_row(other.axis, a2, other.angle, restitution);
    if (!bounds) beside.upper.x() = kUnlimited;
    emit(beside);
  }
};

}  // namespace
}  // namespace gravitas

GRAVITAS_PLUGIN(gravitas::Spherical)
