// Constraint `Axle`: a wheel (body 2) on a vehicle (body 1). It rolls about an axis of its own, steers about one of the
// vehicle, and may be sprung along the latter.
//
//        | s  steering axis, fixed in body 1; the wheel travels along it, on a spring and between stops
//      --o--- r  rolling axis, fixed in body 2; the angle between s and r stays that of the start
//
// Freedoms. The wheel's centre: three rows, or with a suspension the two across s (held where the wheel is) and a soft one
// along s, which takes no freedom. The angle between s and r changes at the rate w.n, n = s x r/|s x r|: one row about n.
// Four rows of rank 4, left are the turns about s and r; with a suspension rank 3 and a spring.
//
// Suspension. The way of the wheel along s, 0 at the start. The spring is at rest at -preload/k, so that it bears the preload at
// the start: -(k way + preload) - c way' on the wheel along s, and the opposite on the vehicle. Limits are one row more, active
// at a limit (rank 4 there): where they bear, the spring bears what it does at that way, and they the rest of the load. They alone make a free guide. Limits that
// give way are a spring and a damper more on what is beyond them, which push and never pull, and take no freedom.
//
// Steering. The angle about s from u, across s and the rolling axis of the start, to r: right-handed about s, zero at the
// start, however the wheel rolls. Limits are one row, active at a limit, on asin(sin(g) sin(angle)), where s and r make an angle
// g. They can tell less than a quarter turn either way: from behind, a limit is met half a turn on. A spring and a damper take no
// freedom: of e = angle - SteeringAngle, within a right angle, a torque -(k e + c e') (on_swing()). With a stiff spring
// SteeringAngle is the angle that the wheel is steered to.
//
// Drive. The wheel turns at w2 - w1 = p r + q s, where p is what it rolls at. So d = (r - (r.s) s)/sin^2 g has d.(w2 - w1) = p
// and d.s = 0: a torque T d does the work T p, and steers nothing, as a motor in the hub of a wheel that may steer does. It is one
// row on the velocity about d, made unit; with speed 0 it is a brake. Where r and s are across each other d is r.
//
// Rolling. What the wheel has rolled is the angle about r by which it sees s turned back: its rate is p, steering is none of it.
#include <cmath>
#include <string>

#include "plugin_sdk/joint_coordinates.h"
#include "plugin_sdk/joint_rows.h"
#include "plugin_sdk/math/rotation.h"
#include "plugin_sdk/math/transcendental.h"

namespace gravitas {
namespace {

constexpr double kMostSteering = 1.5;  // rad, short of a quarter turn

class Axle final : public ConstraintPlugin {
 public:
  static PluginDeclaration declaration() {
    return {
        .name = "Axle",
        .version = "1.4",
        .slot = Slot::kConstraint,
        .meaning = "Wheel that rolls, steers and is sprung.",
        .capabilities = {"coordinates"},
        .types = {
            {"Axle",
             "The second body is a wheel on the first: it rolls about one axis and steers about another.",
             {Property::vector("BindPoint", "m", "world").required().means("The wheel's centre."),
              Property::vector("SteeringAxis", "1", "world")
                  .required()
                  .means("Axis fixed in body 1 about which the wheel steers, any length."),
              Property::vector("RollingAxis", "1", "world")
                  .required()
                  .means("Axis fixed in body 2 about which the wheel rolls; not parallel to the other."),
              Property::number("SuspensionStiffness", "N/m")
                  .above(0.0)
                  .means("Spring along the steering axis. If absent the wheel is free between SuspensionLowerLimit and "
                         "SuspensionUpperLimit, and rigid without those."),
              Property::number("SuspensionDamping", "N*s/m")
                  .at_least(0.0)
                  .means("Damper along the steering axis; none if absent."),
              Property::number("SteeringLowerLimit", "rad")
                  .at_least(-kMostSteering)
                  .at_most(0.0)
                  .means("Smallest steering angle, right-handed about SteeringAxis, 0 at the start; none if absent. "
                         "One limit "
                         "alone is met from behind, too, half a turn on."),
              Property::number("SteeringUpperLimit", "rad")
                  .at_least(0.0)
                  .at_most(kMostSteering)
                  .means("Largest steering angle; none if absent."),
              Property::number("SteeringStiffness", "N*m/rad")
                  .at_least(0.0)
                  .means("Spring that steers to SteeringAngle; none if absent."),
              Property::number("SteeringDamping", "N*m*s/rad").at_least(0.0).means("Its damper; none if absent."),
              Property::number("SteeringAngle", "rad")
                  .at_least(-kMostSteering)
                  .at_most(kMostSteering)
                  .defaults_to({0.0})
                  .means("Steering angle at which the spring is at rest."),
              Property::number("AngularSpeed", "rad/s")
                  .means("Speed at which a drive rolls body 2 on body 1, right-handed about RollingAxis; no drive if "
                         "absent."),
              Property::number("MaximumTorque", "N*m")
                  .at_least(0.0)
                  .means("Largest torque of the drive about RollingAxis; unlimited if absent. Where that is askew to "
                         "SteeringAxis, drive_torque of --reactions is this over the sine of their angle, so that it "
                         "steers nothing."),
              Property::number("SuspensionLowerLimit", "m")
                  .at_most(0.0)
                  .means("Smallest way of the wheel along SteeringAxis, relative to body 1, 0 at the start; none if "
                         "absent."),
              Property::number("SuspensionUpperLimit", "m").at_least(0.0).means("Largest way; none if absent."),
              Property::number("SuspensionPreload", "N")
                  .at_least(0.0)
                  .defaults_to({0.0})
                  .means(
                      "Force with which the spring pushes body 1 along SteeringAxis, and the wheel against it, at the "
                      "start: it is at rest at a way of -SuspensionPreload/SuspensionStiffness."),
              restitution_property(), limit_stiffness_property("N/m", "Suspension"),
              limit_damping_property("N*s/m", "Suspension")},
             {{"steering", "rad",
               "Steering angle, right-handed about SteeringAxis, 0 at the start, above -pi up to pi."},
              {"suspension", "m",
               "Way of the wheel along SteeringAxis relative to body 1, 0 at the start; of a wheel that has a "
               "suspension."},
              {"rolling", "rad",
               "Angle by which the wheel has rolled, right-handed about RollingAxis, 0 at the start, above -pi up to "
               "pi."}}}}};
  }
  explicit Axle(PropertyCursor) {}

  void bind(const stage::ConstraintBindRequest& request, const stage::ConstraintBindReply& reply, Host&) override {
    bind_each(
        request, reply, [](std::uint64_t type, PropertyCursor properties, const JointBodies& bodies, BoundWriter& out) {
          demand_type(type, "Axle");
          const Vector3 point = properties.vector();
          const Vector3 steering = unit_axis(properties.vector(), "Axle: SteeringAxis");
          const Vector3 rolling = unit_axis(properties.vector(), "Axle: RollingAxis");
          const JointSpring suspension = JointSpring::of(&properties);
          if (steering.cross(rolling).norm() < 1e-6) throw Refusal("Axle: RollingAxis is parallel to SteeringAxis");
          JointLimits limits = read_limits_of(&properties, "Steering");
          const JointSpring spring = JointSpring::of(&properties);
          const double rest = properties.at_end() ? 0.0 : properties.number();
          BoundWriter drive;
          write_drive(&properties, "Axle", &drive);
          JointLimits travel = read_limits_of(&properties, "Suspension");
          if (suspension.stiffness == 0.0 && suspension.damping > 0.0 && travel.is_none())
            throw Refusal(
                "Axle: SuspensionDamping is given without SuspensionStiffness, SuspensionLowerLimit or "
                "SuspensionUpperLimit");
          const double preload = properties.at_end() ? 0.0 : properties.number();
          if (!(preload >= 0.0)) throw Refusal("Axle: SuspensionPreload is negative");
          if (preload > 0.0 && suspension.stiffness == 0.0)
            throw Refusal("Axle: SuspensionPreload is given without SuspensionStiffness");
          limits.restitution = travel.restitution =
              read_restitution(&properties, "Axle", !limits.is_none() || !travel.is_none(),
                               "SteeringLowerLimit, SteeringUpperLimit, SuspensionLowerLimit or SuspensionUpperLimit");
          // a Restitution may be of the steering's stops alone
          JointLimits giving_way = travel;
          if (!limits.is_none()) giving_way.restitution = 0.0;
          travel.spring = read_limit_spring(&properties, "Axle", giving_way, !travel.is_none(),
                                            "SuspensionLowerLimit or SuspensionUpperLimit", "Suspension");
          write_frame(bodies.pose1, cross_frame(point, steering, rolling), &out);
          const Pose wheel = frame_along(point, rolling);
          write_frame(bodies.pose2, wheel, &out);
          out.number(swing_between(steering, rolling).angle);
          write_spring(suspension, &out);
          out.number(preload > 0.0 ? -preload / suspension.stiffness : 0.0);
          write_soft_limits(travel, &out);
          write_limits(limits, &out);
          write_spring(spring, &out);
          out.number(rest);
          // where the wheel sees the steering axis
          const Vector3 seen = wheel.orientation.conjugate() * steering;
          out.number(math::atan2(seen.z(), seen.y()));
          for (const double number : drive.numbers()) out.number(number);
        });
  }

  void discrepancies(const stage::ConstraintDiscrepanciesRequest& request,
                     const stage::ConstraintDiscrepanciesReply& reply, Host&) override {
    describe_each(request, reply, [](std::uint64_t, PropertyCursor bound, const JointBodies& bodies, auto&& emit) {
      const Pose one = read_frame(&bound, bodies.pose1), two = read_frame(&bound, bodies.pose2);
      const double angle = bound.number();
      const JointSpring suspension = read_spring(&bound);
      const double rest_way = bound.number();
      const JointLimits travel = read_soft_limits(&bound);
      const Vector3 steering = one.orientation * Vector3::UnitX(), rolling = two.orientation * Vector3::UnitX();
      const bool is_rigid = suspension.is_none() && travel.is_none();
      emit(held_point(one, two.position, {is_rigid, true, true}));
      emit(swing_row(steering, rolling, angle));
      if (!suspension.is_none())
        emit(
            sprung(row_along(steering, one.position + rest_way * steering, two.position, AxisMode::kFree), suspension));
      if (!travel.is_none()) emit(limited_way_row(steering, one.position, two.position, travel));
      const Vector3 across = -(one.orientation * Vector3::UnitZ());
      const JointLimits limits = read_limits(&bound);
      if (!limits.is_none()) {
        Discrepancy limit = swing_row(across, rolling, kQuarterTurn, AxisMode::kLimited);
        const double sine = math::sin(angle);
        const auto counted = [&](double of) {
          return std::fabs(of) < kUnlimited ? math::asin(sine * math::sin(of)) : of;
        };
        limit.lower.x() = counted(limits.lower);
        limit.upper.x() = counted(limits.upper);
        limit.restitution = limits.restitution;
        emit(limit);
      }
      const JointSpring held = read_spring(&bound);
      const double rest = bound.number();
      if (!held.is_none()) {
        const Vector3 at_rest = exp_rotation(rest * steering) * across;
        const double swing = swing_between(at_rest, rolling).angle - kQuarterTurn;
        emit(sprung(swing_row(at_rest, rolling, kQuarterTurn), on_swing(held, math::sin(angle), swing)));
      }
      if (bound.at_end()) return;
      bound.number();  // of the coordinates alone
      if (bound.at_end()) return;
      const Vector3 normal = swing_between(steering, rolling).axis;
      drive_across(-steering, normal, steering.cross(rolling).norm(), &bound, emit);
    });
  }

  void coordinates(const stage::ConstraintDiscrepanciesRequest& request, const stage::ConstraintCoordinatesReply& reply,
                   Host&) override {
    measure_each(request, reply, [](std::uint64_t, PropertyCursor bound, const JointBodies& bodies, auto&& emit) {
      const Pose one = read_frame(&bound, bodies.pose1), two = read_frame(&bound, bodies.pose2);
      bound.number();
      const JointSpring suspension = read_spring(&bound);
      bound.number();  // where that is at rest
      const JointLimits travel = read_soft_limits(&bound);
      read_limits(&bound);
      // the steering's spring and its angle
      for (int i = 0; i < 3; ++i) bound.number();
      const math::SinCos start = math::sincos(bound.number());
      const Vector3 steering = one.orientation * Vector3::UnitX(), rolling = two.orientation * Vector3::UnitX();
      const Vector3 turning = bodies.spin2 - bodies.spin1;
      emit(0, azimuth_of(steering, one.orientation * Vector3::UnitY(), rolling, turning));
      if (!suspension.is_none() || !travel.is_none()) emit(1, way_along(steering, one.position, two.position, bodies));
      emit(2, reversed(azimuth_of(rolling, two.orientation * Vector3(0.0, start.cos, start.sin), steering, -turning)));
    });
  }

 private:
  // The next two properties; a request that was recorded before the joint had them may end here.
  static JointLimits read_limits_of(PropertyCursor* properties, const std::string& what) {
    if (properties->at_end()) return {};
    const double lower = properties->number(), upper = properties->number();
    return JointLimits::of(lower, upper, "Axle: " + what + "LowerLimit", "Axle: " + what + "UpperLimit");
  }
};

}  // namespace
}  // namespace gravitas

GRAVITAS_PLUGIN(gravitas::Axle)
