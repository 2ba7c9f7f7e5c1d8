// Constraint `Universal`: Hooke's joint. A cross whose one bar is fixed in body 1 and whose other in body 2.
//
//      Axis1 (body 1)  --+--  Axis2 (body 2)      the points coincide, and the bars keep their angle
//
// Freedoms. The shared point takes the translations. The angle of the bars changes at the rate w.n, n = a1 x a2/|a1 x a2|:
// one turn, about the normal of both bars. Four rows of rank 4 while the bars are not parallel, none redundant; left are the
// turns about either bar.
// Limits. The angle about a bar is by how much the other has turned round it since the start, as coordinates tell it, known within
// one turn; each bar's are one row, active only at a limit: rank 5 or 6 there. It is the swing of the other bar from the direction
// a right angle behind an angle z, in the body of the bar, counted from a right angle: asin(sin(g) sin(angle - z)), exact for
// turns of any size, and right within a right angle of z. So z is the middle of limits that are no more than that apart, else
// the nearer limit (which limits nothing from further away), and half of the way back to it where a step went far beyond.
// A spring and a damper about either bar take no freedom. Their angle is that of the coordinates, within a right angle of the
// start, as the swing of a bar from across the other tells it (on_swing()): beyond, they pull on.
// Drives. Body 2 turns on body 1 at p a1 + q a2, with p and q what it turns about the bars. So d1 = (a1 - (a1.a2) a2)/sin^2 g has
// d1.w = p and no part along a2: a torque T d1 does the work T p, as a motor or friction between body 1 and the cross does, and d2
// alike between the cross and body 2. Each is one row on the velocity about its d, made unit; with a speed of 0 it is the friction
// of a bearing, of at most its torque. d1 is told as across a2 and the normal in body 1, d2 as across a1 and the normal in body 2,
// which they turn with where the bars are square; of others to first order.
// Shafts that are across the bars turn by tan(phi2) = tan(phi1)/cos(bend), not evenly; ConstantVelocity does.
#include <algorithm>
#include <array>
#include <cmath>
#include <optional>
#include <string>

#include "plugin_sdk/joint_coordinates.h"
#include "plugin_sdk/joint_rows.h"
#include "plugin_sdk/math/rotation.h"
#include "plugin_sdk/math/transcendental.h"

namespace gravitas {
namespace {

// A bar of the cross, and the other one, which turns round it by an angle.
struct Bar {
  Vector3 axis, start;  // unit, of one body; where the other bar was at the start, as far as it is across the axis
  Vector3 other;        // unit, of the other body
  Vector3 turning;      // of that body against this one, rad/s
  bool is_of_body1;

  std::optional<Coordinate> angle() const { return azimuth_of(axis, start, other, turning); }
  // One row, whose error is asin(sin(g) sin(angle - zero)).
  Discrepancy row_from(double zero) const {
    const math::SinCos behind = math::sincos(zero - kQuarterTurn);
    const Vector3 from = behind.cos * start + behind.sin * axis.cross(start);
    return is_of_body1 ? swing_row(from, other, kQuarterTurn, AxisMode::kLimited)
                       : swing_row(other, from, kQuarterTurn, AxisMode::kLimited);
  }
};

class Universal final : public ConstraintPlugin {
 public:
  static PluginDeclaration declaration() {
    return {
        .name = "Universal",
        .version = "1.5",
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
                  .means("Largest torque of that drive; unlimited if absent."),
              Property::number("LowerLimit1", "rad")
                  .at_most(0.0)
                  .means("Smallest angle of body 2 relative to body 1 about Axis1, right-handed, 0 at the start; none "
                         "if absent."),
              Property::number("UpperLimit1", "rad")
                  .at_least(0.0)
                  .means("Largest angle; none if absent. Less than a full turn above LowerLimit1."),
              Property::number("LowerLimit2", "rad").at_most(0.0).means("The same about Axis2; none if absent."),
              Property::number("UpperLimit2", "rad")
                  .at_least(0.0)
                  .means("Largest angle; none if absent. Less than a full turn above LowerLimit2."),
              restitution_property()},
             {{"angle1", "rad",
               "Turn of the cross, and of body 2 with it, about Axis1, relative to body 1, right-handed, 0 at the "
               "start; the turn that limits are compared with, without them above -pi up to pi."},
              {"angle2", "rad",
               "Turn of body 2 about Axis2, relative to the cross, right-handed, 0 at the start; the turn that limits "
               "are compared with, without them above -pi up to pi."}}}}};
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
                write_drives_and_limits(&properties, &out);
              });
  }

  void discrepancies(const stage::ConstraintDiscrepanciesRequest& request,
                     const stage::ConstraintDiscrepanciesReply& reply, Host&) override {
    describe_each(request, reply, [](std::uint64_t, PropertyCursor bound, const JointBodies& bodies, auto&& emit) {
      const Pose one = read_frame(&bound, bodies.pose1), two = read_frame(&bound, bodies.pose2);
      emit(held_point(one, two.position, {true, true, true}));
      const Vector3 axis1 = one.orientation * Vector3::UnitX(), axis2 = two.orientation * Vector3::UnitX();
      const double between = bound.number();
      emit(swing_row(axis1, axis2, between));
      // of a direction of either body, across each other at the start
      const Vector3 across1 = one.orientation * Vector3::UnitZ(), across2 = two.orientation * Vector3::UnitZ();
      const double held = math::sin(between);
      const auto spring_against = [&](const Vector3& first, const Vector3& second, const JointSpring& spring) {
        if (spring.is_none()) return;
        const double swing = swing_between(first, second).angle - kQuarterTurn;
        emit(sprung(swing_row(first, second, kQuarterTurn), on_swing(spring, held, swing)));
      };
      const JointSpring spring1 = read_spring(&bound), spring2 = read_spring(&bound);
      spring_against(across1, axis2, spring1);
      spring_against(axis1, across2, spring2);
      if (bound.at_end()) return;
      PropertyCursor drive1(bound.table(2)), drive2(bound.table(2));
      const Vector3 normal = swing_between(axis1, axis2).axis;
      const double sine = axis1.cross(axis2).norm();
      drive_across(-normal, axis2, sine, &drive1, emit);
      drive_across(-axis1, normal, sine, &drive2, emit);
      if (bound.at_end()) return;
      const std::array<Bar, 2> bars = bars_of(one, two, bodies.spin2 - bodies.spin1),
                               start = bars_of(one, two, bodies.start_spin2 - bodies.start_spin1);
      for (std::size_t bar = 0; bar < 2; ++bar) {
        const JointLimits limits = read_limits(&bound);
        if (!limits.is_none()) emit(limited_row(bars[bar], start[bar].angle(), limits, between, bodies.elapsed));
      }
    });
  }

  void coordinates(const stage::ConstraintDiscrepanciesRequest& request, const stage::ConstraintCoordinatesReply& reply,
                   Host&) override {
    measure_each(request, reply, [](std::uint64_t, PropertyCursor bound, const JointBodies& bodies, auto&& emit) {
      const Pose one = read_frame(&bound, bodies.pose1), two = read_frame(&bound, bodies.pose2);
      bound.number();
      for (int bar = 0; bar < 2; ++bar) read_spring(&bound);
      const std::array<Bar, 2> bars = bars_of(one, two, bodies.spin2 - bodies.spin1);
      std::array<JointLimits, 2> limits;
      if (!bound.at_end())
        for (int bar = 0; bar < 2; ++bar) bound.table(2);
      for (std::uint32_t bar = 0; bar < 2; ++bar) {
        if (!bound.at_end()) limits[bar] = read_limits(&bound);
        std::optional<Coordinate> angle = bars[bar].angle();
        // where it is: no step is to be foretold
        if (angle) angle->value = limits[bar].turn(angle->value, 0.0);
        emit(bar, angle);
      }
    });
  }

 private:
  // Of either bar a table of one row or none, and its limits, if there are any; nothing where there are neither.
  static void write_drives_and_limits(PropertyCursor* properties, BoundWriter* out) {
    BoundWriter first, second;
    write_drive(properties, "Universal", &first, "1");
    write_drive(properties, "Universal", &second, "2");
    JointLimits limits1 = limits_of(properties, "1"), limits2 = limits_of(properties, "2");
    const bool has_limits = !limits1.is_none() || !limits2.is_none();
    limits1.restitution = limits2.restitution =
        read_restitution(properties, "Universal", has_limits, "LowerLimit1, UpperLimit1, LowerLimit2 or UpperLimit2");
    if (first.numbers().empty() && second.numbers().empty() && !has_limits) return;
    for (const BoundWriter* drive : {&first, &second}) {
      out->number(drive->numbers().empty() ? 0.0 : 1.0);
      for (const double number : drive->numbers()) out->number(number);
    }
    if (!has_limits) return;
    write_limits(limits1, out);
    write_limits(limits2, out);
  }

  // A request that was recorded before there were any may end before.
  static JointLimits limits_of(PropertyCursor* properties, const std::string& which) {
    if (properties->at_end()) return {};
    const double lower = properties->number(), upper = properties->number();
    return JointLimits::of_turn(lower, upper, "Universal: LowerLimit" + which, "Universal: UpperLimit" + which);
  }

  // Body 2 turns about its bar as that sees the other one turn back.
  static std::array<Bar, 2> bars_of(const Pose& one, const Pose& two, const Vector3& turning) {
    const Vector3 axis1 = one.orientation * Vector3::UnitX(), axis2 = two.orientation * Vector3::UnitX();
    return {Bar{axis1, one.orientation * Vector3::UnitY(), axis2, turning, true},
            Bar{-axis2, two.orientation * Vector3::UnitY(), axis1, -turning, false}};
  }

  // `between`: the angle that the bars are held at, which the solution brings them back to. `start`: by the rates where the step
  // begins.
  static Discrepancy limited_row(const Bar& bar, const std::optional<Coordinate>& start, const JointLimits& limits,
                                 double between, double elapsed) {
    const std::optional<Coordinate> angle = bar.angle();
    const StepTurn way = angle && start ? StepTurn::of(start->rate, angle->rate, elapsed) : StepTurn{};
    const double turned = angle ? limits.limited_turn(angle->value, way) : 0.0;
    const double zero = zero_of(limits, turned);
    const bool is_told = angle && std::fabs(turned - zero) <= kQuarterTurn;
    const double sine = math::sin(between);
    const auto bound = [&](double limit, double none) {
      const bool is_near = is_told && std::fabs(limit - zero) <= kQuarterTurn;
      return is_near ? math::asin(sine * math::sin(limit - zero)) : none;
    };
    Discrepancy row = bar.row_from(zero);
    row.lower.x() = bound(limits.lower, -kUnlimited);
    row.upper.x() = bound(limits.upper, kUnlimited);
    row.restitution = limits.restitution;
    return row;
  }

  // The angle that the row's error is counted from.
  static double zero_of(const JointLimits& limits, double turned) {
    const double middle = 0.5 * (limits.lower + limits.upper);
    if (limits.upper - limits.lower <= kQuarterTurn && std::fabs(turned - middle) <= kQuarterTurn) return middle;
    const bool is_upper = limits.upper - turned < turned - limits.lower;
    const double limit = is_upper ? limits.upper : limits.lower, beyond = is_upper ? turned - limit : limit - turned;
    return beyond > kQuarterTurn ? 0.5 * (turned + limit) : limit;
  }
};

}  // namespace
}  // namespace gravitas

GRAVITAS_PLUGIN(gravitas::Universal)
