// Constraint `Revolute` (§ 2.7.5.3, 2.84): a hinge. Two points of an axis, fixed in both bodies, stay the same two points.
//
//      body 1  ----x--a-->--x----  body 2      x: anchors half a metre to either side of the middle of
//                 p1   m    p2                    BindAxisPoint1 and BindAxisPoint2
//
// Freedoms. Each anchor locks three axes: six rows. Anchored at m, body 2 may turn only (three freedoms left of six); the
// second anchor holds the two turns across the axis and, once more, the translation along it: rank 5, one row redundant,
// one freedom left, the turn about a. (2.84 puts the arm of body 1 on both bodies; each has its own.)
// With limits one row more about a, active only at a limit: rank 6 there. The angle is that of body 2 relative to body 1,
// right-handed about point 1 -> point 2, zero at the start, known within one turn: two limits may span less than that.
#include "plugin_sdk/joint_rows.h"
#include "plugin_sdk/math/rotation.h"

namespace gravitas {
namespace {

constexpr double kTwoPi = 6.283185307179586;

class Revolute final : public ConstraintPlugin {
 public:
  static PluginDeclaration declaration() {
    return {
        .name = "Revolute",
        .version = "1.0",
        .slot = Slot::kConstraint,
        .meaning = "Hinge.",
        .types = {{"Revolute",
                   "Two bodies share an axis about which they turn, freely or within limits.",
                   {Property::vector("BindAxisPoint1", "m", "world")
                        .required()
                        .means("First point of the axis, at the start."),
                    Property::vector("BindAxisPoint2", "m", "world").required().means("Second point of the axis."),
                    Property::number("LowerLimit", "rad")
                        .at_most(0.0)
                        .means("Smallest angle of body 2 relative to body 1, right-handed about point 1 -> point 2, "
                               "0 at the start; none if absent."),
                    Property::number("UpperLimit", "rad")
                        .at_least(0.0)
                        .means("Largest angle; none if absent. Less than a full turn above LowerLimit.")}}}};
  }
  explicit Revolute(PropertyCursor) {}

  void bind(const stage::ConstraintBindRequest& request, const stage::ConstraintBindReply& reply, Host&) override {
    bind_each(
        request, reply, [](std::uint64_t type, PropertyCursor properties, const JointBodies& bodies, BoundWriter& out) {
          demand_type(type, "Revolute");
          const Vector3 point1 = properties.vector(), point2 = properties.vector();
          const double lower = properties.number(), upper = properties.number();
          const JointLimits limits = JointLimits::of(lower, upper, "Revolute: LowerLimit", "Revolute: UpperLimit");
          if (!limits.is_none() && limits.upper - limits.lower >= kTwoPi && limits.lower > -kUnlimited &&
              limits.upper < kUnlimited)
            throw Refusal("Revolute: UpperLimit lies a full turn or more above LowerLimit, which limits nothing");
          if (point1 == point2) throw Refusal("Revolute: BindAxisPoint1 and BindAxisPoint2 are the same point");
          const Pose frame = frame_along(0.5 * (point1 + point2),
                                         unit_axis(point2 - point1, "Revolute: BindAxisPoint1, BindAxisPoint2"));
          write_frame(bodies.pose1, frame, &out);
          write_frame(bodies.pose2, frame, &out);
          out.number(limits.lower);
          out.number(limits.upper);
        });
  }

  void discrepancies(const stage::ConstraintDiscrepanciesRequest& request,
                     const stage::ConstraintDiscrepanciesReply& reply, Host&) override {
    describe_each(request, reply, [](std::uint64_t, PropertyCursor bound, const JointBodies& bodies, auto&& emit) {
      const Pose one = read_frame(&bound, bodies.pose1), two = read_frame(&bound, bodies.pose2);
      for (const double way : {-0.5, 0.5}) {
        Discrepancy anchor;
        anchor.point1 = transform_point(one, way * Vector3::UnitX());
        anchor.point2 = transform_point(two, way * Vector3::UnitX());
        emit(anchor);
      }
      JointLimits limits;
      limits.lower = bound.number();
      limits.upper = bound.number();
      if (limits.is_none()) return;
      const Vector3 axis = (one.orientation * Vector3::UnitX() + two.orientation * Vector3::UnitX()).normalized();
      Discrepancy limit =
          row_about(axis, limits.turn(twist_between(one.orientation, two.orientation)), AxisMode::kLimited);
      limit.lower.x() = limits.lower;
      limit.upper.x() = limits.upper;
      emit(limit);
    });
  }
};

}  // namespace
}  // namespace gravitas

GRAVITAS_PLUGIN(gravitas::Revolute)
