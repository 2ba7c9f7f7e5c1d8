// Constraint `Winch`: a rope that winds on a drum (body 1) and holds a point of body 2. It is no bearing: the drum has its own, or
// flies. Two on one drum make a pulley, with radii of their own a differential one or a block and tackle, r1 : r2.
//
//         .--. n              k: Axis, up out of the page; n from the axis point c to where the rope leaves, T = c + r n,
//        ( c  )T              u = n x k from there to P
//         '--' |              a drum that turns right-handed about k winds up
//              | u
//              P  body 2
//
// Why not over points of the world: a discrepancy pushes its two bodies against each other (discrepancy.h), and what a guide
// would bear is on neither. A drum is a body: its bearing bears that.
//
// Length. beta: the angle of n about k as body 1 sees it, 0 at the start; L the free length |P - T|, L0 what is paid out at the
// start. What is too long is
//   e = L - L0 - r beta modulo 2 pi r,   e <= 0,
// known from poses alone: nothing is counted, nothing drifts. P runs on involutes of the drum, and winds the rope up where it goes
// round. Which turn e is in is told by what the step made: rigid ropes are too long by a tenth of a turn at most, or else slack;
// ones with a stiffness stretched or slack by half of one. A rope that is slack by more has lost a turn. With Taut e = 0.
//
// Freedoms. One one-sided row, rank 1 while taut: along the gradient of e by P as body 1 sees it. With z = k.(P - c), l the length
// across k and R = |P - c| there,
//   grad e = u - (1 - l/L) R/l (R)^ + z/L k,   which has the torque r about k, and is u in the plane of the drum.
// The row is radial (discrepancy.h), about a point at the distance L behind P, where rope and involute have their centre. In the plane
// of the drum it has e to the second order, too; what e curves otherwise where ropes slant is told as an acceleration (bend()). The
// groove bears what slanting ropes ask for along k.
// With a stiffness it is a spring and a damper, as a `Distance`.
//
// Where P comes into the drum (R < r) all is wound up, L = 0, and the rope pulls about the axis, along n x k with n towards P; on the
// axis it has no direction, and pulls nothing.
//
// Refused: an axis without direction, a BindPoint on it, Slack of more than 0.8 turns, with a stiffness 0.4.
#include <algorithm>
#include <cmath>
#include <string>

#include "plugin_sdk/joint_rows.h"
#include "plugin_sdk/math/rotation.h"
#include "plugin_sdk/math/transcendental.h"

namespace gravitas {
namespace {

// How the rope lies: n, the gradient of e by P, L. Its end is outside of the drum, or all of it is wound up.
struct Rope {
  Vector3 normal = Vector3::Zero(), gradient = Vector3::Zero();
  double length = 0.0, across = 0.0;  // L, l
  bool is_free = false;
};

class Winch final : public ConstraintPlugin {
 public:
  static PluginDeclaration declaration() {
    return {
        .name = "Winch",
        .version = "1.1",
        .slot = Slot::kConstraint,
        .meaning = "Rope on a drum.",
        .types = {
            {"Winch",
             "A rope winds on a drum, the first body, which has a bearing of its own, and holds a point of the second; "
             "two on one drum are a pulley.",
             {Property::vector("Axis", "1", "world")
                  .required()
                  .means("Axis of the drum at the start, any length: a right-handed turn about it winds up."),
              Property::number("Radius", "m").above(0.0).required().means("Radius at which the rope lies."),
              Property::vector("BindPoint", "m", "world")
                  .required()
                  .means("Point of body 2 that the rope holds, at the start; outside of the drum, as a rule."),
              Property::vector("BindAxisPoint", "m", "world")
                  .means("Where the axis passes through the plane of the rope, at the start; the drum's centre of mass "
                         "if absent, of the world the origin."),
              Property::number("Slack", "m")
                  .at_least(0.0)
                  .defaults_to({0.0})
                  .means("By how much the rope is longer than taut at the start: 0.8 turns at most, with Stiffness "
                         "0.4."),
              Property::number("Stiffness", "N/m").above(0.0).means("Of what is stretched; rigid if absent."),
              Property::number("Damping", "N*s/m").at_least(0.0).means("Its damping; none if absent."),
              Property::flag("Taut").defaults_to({0.0}).means(
                  "True: it is never slack, and would push, as what a tensioner keeps tight."),
              restitution_property()}}}};
  }
  explicit Winch(PropertyCursor) {}

  void bind(const stage::ConstraintBindRequest& request, const stage::ConstraintBindReply& reply, Host&) override {
    bind_each(request, reply,
              [](std::uint64_t type, PropertyCursor properties, const JointBodies& bodies, BoundWriter& out) {
                demand_type(type, "Winch");
                const Vector3 axis = unit_axis(properties.vector(), "Winch: Axis");
                const double radius = properties.number();
                const Vector3 end = properties.vector(), given = properties.vector();
                const Vector3 centre = given.hasNaN() ? bodies.pose1.position : given;
                const double slack = properties.number();
                const JointSpring spring = JointSpring::of(&properties);
                const bool is_taut = properties.flag();
                const double restitution =
                    read_restitution(&properties, "Winch", !is_taut && spring.is_none(),
                                     "a rope that stops dead: with Taut, Stiffness or Damping it does not");
                if (!(radius > 0.0)) throw Refusal("Winch: Radius must be above 0");
                if (spring.stiffness == 0.0 && spring.damping > 0.0)
                  throw Refusal("Winch: Damping is given without Stiffness");
                if (is_taut && slack > 0.0) throw Refusal("Winch: Slack is given with Taut");
                const double most = spring.is_none() ? kMostSlack : kMostSlackOfSprings;
                if (!(slack >= 0.0 && slack <= most * kWholeTurn * radius))
                  throw Refusal("Winch: Slack " + std::to_string(slack) + " is not within 0 ... " +
                                std::to_string(most) + " turns of the drum");
                const Rope rope = lying(centre, axis, radius, end);
                if (rope.normal.isZero(0.0)) throw Refusal("Winch: BindPoint lies on the axis");
                write_frame(bodies.pose1, cross_frame(centre, axis, rope.normal), &out);
                out.vector(inverse_transform_point(bodies.pose2, end));
                out.number(radius);
                out.number(rope.length + slack);
                write_spring(spring, &out);
                out.number(is_taut ? 1.0 : 0.0);
                out.number(restitution);
              });
  }

  void discrepancies(const stage::ConstraintDiscrepanciesRequest& request,
                     const stage::ConstraintDiscrepanciesReply& reply, Host&) override {
    describe_each(request, reply, [](std::uint64_t, PropertyCursor bound, const JointBodies& bodies, auto&& emit) {
      const Pose drum = read_frame(&bound, bodies.pose1);
      const Vector3 end = transform_point(bodies.pose2, bound.vector());
      const double radius = bound.number(), paid_out = bound.number();
      const JointSpring spring = read_spring(&bound);
      const bool is_taut = bound.number() != 0.0, is_symmetric = is_taut || !spring.is_none();
      const Rope rope = lying(drum.position, drum.orientation * Vector3::UnitX(), radius, end);
      const double steepness = rope.gradient.norm();
      if (steepness == 0.0 || !std::isfinite(steepness)) return;  // it ends on the axis
      const Vector3 along = rope.gradient / steepness, seen = drum.orientation.conjugate() * rope.normal;
      Discrepancy d = row_along(along, end - rope.length * along, end, AxisMode::kLimited);
      const double made = bodies.elapsed * steepness *
                          jacobian_row(d, along, bodies.pose1.position, bodies.pose2.position)
                              .velocity(bodies.velocity1, bodies.spin1, bodies.velocity2, bodies.spin2);
      const double error = in_its_turn(rope.length - paid_out - radius * math::atan2(seen.z(), seen.y()), made,
                                       kWholeTurn * radius, is_symmetric);
      if (rope.is_free) {
        d.modes |= kRadialDiscrepancy;
        const Vector3 far = end - bodies.pose1.position;
        const Vector3 moving = bodies.velocity2 + bodies.spin2.cross(end - bodies.pose2.position) - bodies.velocity1 -
                               bodies.spin1.cross(far);
        d.acceleration = -bend(rope, drum.orientation * Vector3::UnitX(), radius, end - drum.position, moving) * along;
      }
      d.upper.x() = rope.length - error / steepness;
      d.lower.x() = is_taut ? d.upper.x() : -kUnlimited;
      if (spring.stiffness > 0.0) d.compliance.x() = 1.0 / (spring.stiffness * steepness * steepness);
      d.damping.x() = spring.damping * steepness * steepness;
      d.restitution = bound.number();
      emit(d);
    });
  }

 private:
  static constexpr double kMostSlack = 0.8, kMostSlackOfSprings = 0.4;  // turns
  static constexpr double kLeastLength = 1e-6;                          // of the radius, that has a direction

  static Rope lying(const Vector3& centre, const Vector3& axis, double radius, const Vector3& end) {
    const Vector3 way = end - centre;
    const double beside = axis.dot(way);
    const Vector3 across = way - beside * axis;
    const double far = across.norm();
    if (far == 0.0) return {};
    const Vector3 outward = across / far, round = outward.cross(axis);
    const double length = std::sqrt(std::max(0.0, far - radius) * (far + radius));
    if (!(length > kLeastLength * radius)) return {outward, radius / far * round, 0.0, 0.0, false};
    const double whole = std::sqrt(length * length + beside * beside);
    const double cosine = radius / far, sine = length / far;
    const Vector3 tangent = sine * outward + cosine * round;
    return {cosine * outward - sine * round, tangent - (1.0 - length / whole) / sine * outward + beside / whole * axis,
            whole, length, true};
  }

  // What the velocity of P, as the drum sees it, makes of e'' along the row, beyond what it makes of the row's, m/s^2. With R and round as
  // lying() has them, P at (R, z) and moving by (a, b, c) along R^, k x R^ and k:
  //   d2e = (1/L - R^2/L^3 + r^2 (l^2 + R^2)/(R^2 l^3)) a^2 - 2 R z/L^3 a c + l^2/L^3 c^2 + (1/L - r^2/(R^2 l)) b^2 + 2 r/R^2 a b
  static double bend(const Rope& rope, const Vector3& axis, double radius, const Vector3& way, const Vector3& moving) {
    const double beside = axis.dot(way), whole = rope.length, length = rope.across;
    const Vector3 across = way - beside * axis;
    const double far = across.norm(), steepness = rope.gradient.norm();
    const double a = across.dot(moving) / far, b = axis.cross(across).dot(moving) / far, c = axis.dot(moving);
    const double cube = whole * whole * whole, of_drum = radius / far * (radius / far);
    const double out =
        (beside - radius) * (beside + radius) / cube + of_drum * (1.0 + far / length * (far / length)) / length;
    const double bent = out * a * a - 2.0 * far * beside / cube * a * c + length * length / cube * c * c +
                        (1.0 / whole - of_drum / length) * b * b + 2.0 * of_drum / radius * a * b;
    const double along = rope.gradient.dot(moving) / steepness;
    return bent / steepness - (moving.squaredNorm() - along * along) / whole;
  }

  // Of error + k period what the step made: see the head. What is off a rigid rope by more than an integrator leaves of
  // it in a trial, and shortens as only what is slack would, comes from behind.
  static double in_its_turn(double error, double made, double period, bool is_symmetric) {
    constexpr double kTooLong = 0.1, kStretched = 0.5;  // turns
    constexpr double kOff = 1e-3, kMoves = 1e-2;        // turns; of how far it is off
    const double middle = ((is_symmetric ? kStretched : kTooLong) - 0.5) * period;
    const double begun = error - made, known = begun - period * std::round((begun - middle) / period);
    const bool comes_from_behind = !is_symmetric && known > kOff * period && -made > kMoves * known && -made < known;
    return known + made - (comes_from_behind ? period : 0.0);
  }
};

}  // namespace
}  // namespace gravitas

GRAVITAS_PLUGIN(gravitas::Winch)
