// Constraint `Gear`: two wheels with teeth that mesh, on parallel axes or on axes that meet. It holds neither on its axis: each
// has its own bearing, in the world, in a frame, or in a carrier that turns.
//
//      c1 ---r1---P--r2-- c2        external: P between the axes
//      P --r1-- c1 --- c2           internal, body 2 the ring: P beyond the axis of the wheel within it
//
// Units and frames. Axes and points are of the world at the start; teeth are whole numbers. P divides the line from the one
// axis point to the other as the teeth, r1 : r2 = Teeth1 : Teeth2, so the points belong into the plane of the mesh.
//
// Phase. beta and gamma: the angles, about the axis, of the line c = c2 - c1 as body 1 and as body 2 see it, 0 at the start,
// rho its length across the axis, N2 negative for an internal mesh. What the teeth keep is
//   N1 beta + N2 gamma = 0 modulo 2 pi g,    g the greatest common divisor of the teeth,
// known from poses alone, however many turns were made: nothing is counted, nothing drifts. The arc that is off,
//   e = (N1 beta + N2 gamma) rho/(N1 + N2), has the rate  e' = t.(v2(P) - v1(P)),  P = c1 + c N1/(N1 + N2),  t = axis x c/rho
// while the axes are parallel and e = 0, whatever turns and moves, the line included; so it holds on moving carriers, too.
//
// Bevel wheels, on axes k1 and k2 from where they meet, O, to the wheels, at an angle of sine s: beta is the angle, about k1, of
// k2 as body 1 sees it, gamma that about k2 of k1 as body 2 does, P = O + L u, u along N2 k1 + N1 k2, L such that P is next to
// the wheels' centres, negative where body 2 is a ring. With t = k1 x k2/s and O1, O2 what of the bodies is at O,
//   e = t.(O2 - O1) + (N1 beta + N2 gamma) L s/|N2 k1 + N1 k2|,    e' = t.(v2(P) - v1(P))    where O1 = O2 and e = 0.
//
// Freedoms. One row of rank 1: along t at P. Its multiplier is the force between the teeth along their common tangent, on body
// 2; that across it, by which slanting flanks push wheels apart, is not modelled.
//
// Refused: an axis without direction, axes that coincide, or that neither meet nor are parallel, bevel wheels at or behind the
// place where they meet, an internal mesh with as many teeth on either wheel.
#include <cmath>
#include <numeric>

#include "plugin_sdk/joint_rows.h"
#include "plugin_sdk/math/rotation.h"
#include "plugin_sdk/math/transcendental.h"

namespace gravitas {
namespace {

constexpr double kMostTeeth = 1e6;

// Angle of a direction about a frame's first axis, from its second.
double angle_in(const Pose& frame, const Vector3& direction) {
  const Vector3 seen = frame.orientation.conjugate() * direction;
  return math::atan2(seen.z(), seen.y());
}

class Gear final : public ConstraintPlugin {
 public:
  static PluginDeclaration declaration() {
    return {
        .name = "Gear",
        .version = "1.0",
        .slot = Slot::kConstraint,
        .meaning = "Mesh of two gear wheels.",
        .types = {{"Gear",
                   "Two wheels, each in a bearing of its own, turn against each other as their teeth.",
                   {Property::vector("Axis", "1", "world")
                        .required()
                        .means("Direction of the axis of body 1 at the start, any length."),
                    Property::integer("Teeth1").at_least(1.0).at_most(kMostTeeth).required().means("Teeth of body 1."),
                    Property::integer("Teeth2").at_least(1.0).at_most(kMostTeeth).required().means("Teeth of body 2."),
                    Property::flag("Internal")
                        .defaults_to({0.0})
                        .means("True: the wheel with more teeth is a ring around the other, and both turn alike."),
                    Property::vector("BindAxisPoint1", "m", "world")
                        .means("Where the axis of body 1 passes through the plane of the mesh, at the start; its "
                               "centre of mass if absent, of the world the origin."),
                    Property::vector("BindAxisPoint2", "m", "world").means("The same of body 2."),
                    Property::vector("Axis2", "1", "world")
                        .means("Direction of the axis of body 2: of bevel wheels, where it meets that of body 1; "
                               "parallel to Axis if absent.")}}}};
  }
  explicit Gear(PropertyCursor) {}

  void bind(const stage::ConstraintBindRequest& request, const stage::ConstraintBindReply& reply, Host&) override {
    bind_each(request, reply,
              [](std::uint64_t type, PropertyCursor properties, const JointBodies& bodies, BoundWriter& out) {
                demand_type(type, "Gear");
                const Vector3 axis = unit_axis(properties.vector(), "Gear: Axis");
                const std::int64_t teeth1 = properties.integer(), teeth2 = properties.integer();
                const bool is_internal = properties.flag();
                const Vector3 point1 = given_or(properties.vector(), bodies.pose1.position);
                const Vector3 point2 = given_or(properties.vector(), bodies.pose2.position);
                const Vector3 axis2 = unit_axis(given_or(properties.vector(), axis), "Gear: Axis2");
                if (teeth1 < 1 || teeth2 < 1) throw Refusal("Gear: Teeth1 and Teeth2 must be 1 or more");
                if (is_internal && teeth1 == teeth2)
                  throw Refusal("Gear: an Internal mesh needs Teeth1 and Teeth2 that differ");
                const auto divisor = static_cast<double>(std::gcd(teeth1, teeth2));
                const double n1 = static_cast<double>(teeth1) / divisor;
                const double n2 = static_cast<double>(is_internal ? -teeth2 : teeth2) / divisor;
                const Mesh mesh = axis.cross(axis2).norm() < kParallel ? parallel(axis, point1, point2)
                                                                       : bevel(axis, point1, axis2, point2, n1, n2);
                write_frame(bodies.pose1, mesh.one, &out);
                write_frame(bodies.pose2, mesh.two, &out);
                out.number(n1);
                out.number(n2);
                out.number(mesh.length);
              });
  }

  void discrepancies(const stage::ConstraintDiscrepanciesRequest& request,
                     const stage::ConstraintDiscrepanciesReply& reply, Host&) override {
    describe_each(request, reply, [](std::uint64_t, PropertyCursor bound, const JointBodies& bodies, auto&& emit) {
      const Pose one = read_frame(&bound, bodies.pose1), two = read_frame(&bound, bodies.pose2);
      const double n1 = bound.number(), n2 = bound.number(), length = bound.number();
      const Vector3 apart = two.position - one.position;
      if (length != 0.0)
        emit_bevel(one, two, n1, n2, length, bodies, emit);
      else
        emit_row(axis_between(one, two).cross(apart), one.position + n1 / (n1 + n2) * apart, ahead(n1, n2), 0.0,
                 1.0 / (n1 + n2), n1 * angle_in(one, apart) + n2 * angle_in(two, apart), bodies, emit);
    });
  }

 private:
  static constexpr double kLeastOfWay = 1e-9;  // of the way between the points, across the axis
  static constexpr double kParallel = 1e-6;    // rad
  static constexpr double kMeet = 1e-6;        // of the way between the points

  // Frames of the bodies, their first axes those of the wheels, their second what the angles are counted from; and of bevel
  // wheels the way from where their axes meet to the mesh, along N2 k1 + N1 k2, else 0.
  struct Mesh {
    Pose one, two;
    double length = 0.0;
  };

  static Vector3 given_or(const Vector3& given, const Vector3& otherwise) { return given.hasNaN() ? otherwise : given; }

  static Mesh parallel(const Vector3& axis, const Vector3& point1, const Vector3& point2) {
    const Vector3 line = point2 - point1;
    if (!(axis.cross(line).norm() > kLeastOfWay * line.norm()))
      throw Refusal("Gear: the axes coincide; BindAxisPoint1 and BindAxisPoint2 must lie beside each other");
    return {cross_frame(point1, axis, line), cross_frame(point2, axis, line)};
  }

  static Mesh bevel(Vector3 axis1, const Vector3& point1, Vector3 axis2, const Vector3& point2, double n1, double n2) {
    const Vector3 across = axis1.cross(axis2), line = point2 - point1;
    const double square = across.squaredNorm();
    if (!(std::fabs(across.dot(line)) <= kMeet * std::sqrt(square) * line.norm()))
      throw Refusal("Gear: Axis and Axis2, through BindAxisPoint1 and BindAxisPoint2, neither meet nor are parallel");
    const Vector3 meet = point1 + line.cross(axis2).dot(across) / square * axis1;
    const Vector3 way1 = point1 - meet, way2 = point2 - meet;
    if (axis1.dot(way1) < 0.0) axis1 = -axis1;
    if (axis2.dot(way2) < 0.0) axis2 = -axis2;
    // seen from where the axes meet the wheels are on this side, those of a ring around body 1 on the other
    const double side = n1 + n2 < 0.0 ? -1.0 : 1.0;
    const Vector3 pitch = side * (n2 * axis1 + n1 * axis2).normalized();
    const double cosine1 = pitch.dot(axis1), cosine2 = pitch.dot(axis2);
    const double length = pitch.dot(way1 + way2) / (cosine1 * cosine1 + cosine2 * cosine2);
    if (!(length > kLeastOfWay * line.norm()))
      throw Refusal("Gear: BindAxisPoint1 and BindAxisPoint2 must lie away from where the axes meet, at the mesh");
    return {cross_frame(meet, axis1, axis2), cross_frame(meet, axis2, axis1), side * length};
  }

  template <class Emit>
  static void emit_bevel(const Pose& one, const Pose& two, double n1, double n2, double length,
                         const JointBodies& bodies, Emit&& emit) {
    const Vector3 axis1 = one.orientation * Vector3::UnitX(), axis2 = two.orientation * Vector3::UnitX();
    const Vector3 across = axis1.cross(axis2), line = n2 * axis1 + n1 * axis2;
    const double share = length / line.norm();
    emit_row(across, two.position + share * line, ahead(n1, n2), across.normalized().dot(two.position - one.position),
             share, n1 * angle_in(one, axis2) + n2 * angle_in(two, axis1), bodies, emit);
  }

  // Half of what body 2 closes of an error where the inertia of wheels goes by the fourth power of their teeth.
  static double ahead(double n1, double n2) { return 0.5 * n1 * n1 / (n1 * n1 + n2 * n2); }

  // A row along `across` at a point; the arc that is off is `apart` and, of the phase, `share` times the length of `across`.
  template <class Emit>
  static void emit_row(const Vector3& across, const Vector3& point, double ahead, double apart, double share,
                       double phase, const JointBodies& bodies, Emit&& emit) {
    const double length = across.norm();
    if (length == 0.0 || !std::isfinite(share)) return;  // no place for teeth
    const double arc = share * length;
    emit(meshing_row(across / length, point, ahead, apart + arc * phase, kWholeTurn * std::fabs(arc), bodies));
  }
};

}  // namespace
}  // namespace gravitas

GRAVITAS_PLUGIN(gravitas::Gear)
