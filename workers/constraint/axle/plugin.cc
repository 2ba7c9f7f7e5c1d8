// Constraint `Axle`: a wheel (body 2) on a vehicle (body 1). It rolls about an axis of its own, steers about one of the
// vehicle, and may be sprung along the latter.
//
//        | s  steering axis, fixed in body 1; the spring acts along it
//      --o--- r  rolling axis, fixed in body 2; the angle between s and r stays that of the start
//
// Freedoms. The wheel's centre: three rows, or with a suspension the two across s (held where the wheel is) and a soft one
// along s, which takes no freedom. The angle between s and r changes at the rate w.n, n = s x r/|s x r|: one row about n.
// Four rows of rank 4, left are the turns about s and r; with a suspension rank 3 and a spring.
#include <cmath>

#include "plugin_sdk/joint_rows.h"

namespace gravitas {
namespace {

class Axle final : public ConstraintPlugin {
 public:
  static PluginDeclaration declaration() {
    return {
        .name = "Axle",
        .version = "1.0",
        .slot = Slot::kConstraint,
        .meaning = "Wheel that rolls, steers and is sprung.",
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
                  .means("Spring along the steering axis; rigid if absent."),
              Property::number("SuspensionDamping", "N*s/m").at_least(0.0).means("Its damping; none if absent.")}}}};
  }
  explicit Axle(PropertyCursor) {}

  void bind(const stage::ConstraintBindRequest& request, const stage::ConstraintBindReply& reply, Host&) override {
    bind_each(request, reply,
              [](std::uint64_t type, PropertyCursor properties, const JointBodies& bodies, BoundWriter& out) {
                demand_type(type, "Axle");
                const Vector3 point = properties.vector();
                const Vector3 steering = unit_axis(properties.vector(), "Axle: SteeringAxis");
                const Vector3 rolling = unit_axis(properties.vector(), "Axle: RollingAxis");
                const double stiffness = properties.number(), damping = properties.number();
                if (steering.cross(rolling).norm() < 1e-6)
                  throw Refusal("Axle: RollingAxis is parallel to SteeringAxis");
                if (std::isnan(stiffness) && !std::isnan(damping))
                  throw Refusal("Axle: SuspensionDamping is given without SuspensionStiffness");
                if (stiffness <= 0.0) throw Refusal("Axle: SuspensionStiffness is not positive");
                write_frame(bodies.pose1, frame_along(point, steering), &out);
                write_frame(bodies.pose2, frame_along(point, rolling), &out);
                out.number(swing_between(steering, rolling).angle);
                out.number(std::isnan(stiffness) ? 0.0 : 1.0 / stiffness);
                out.number(std::isnan(damping) ? 0.0 : damping);
              });
  }

  void discrepancies(const stage::ConstraintDiscrepanciesRequest& request,
                     const stage::ConstraintDiscrepanciesReply& reply, Host&) override {
    describe_each(request, reply, [](std::uint64_t, PropertyCursor bound, const JointBodies& bodies, auto&& emit) {
      const Pose one = read_frame(&bound, bodies.pose1), two = read_frame(&bound, bodies.pose2);
      const double angle = bound.number(), compliance = bound.number(), damping = bound.number();
      const Vector3 steering = one.orientation * Vector3::UnitX(), rolling = two.orientation * Vector3::UnitX();
      const bool is_sprung = compliance > 0.0;
      emit(held_point(one, two.position, {!is_sprung, true, true}));
      emit(swing_row(steering, rolling, angle));
      if (!is_sprung) return;
      Discrepancy spring = row_along(steering, one.position, two.position, AxisMode::kLocked);
      spring.compliance.x() = compliance;
      spring.damping.x() = damping;
      emit(spring);
    });
  }
};

}  // namespace
}  // namespace gravitas

GRAVITAS_PLUGIN(gravitas::Axle)
