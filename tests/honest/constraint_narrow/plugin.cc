// Holds a point, and refuses states in which it is open by more than a scene may allow.
#include <cmath>

#include "plugin_sdk/constraint.h"
#include "plugin_sdk/joint_rows.h"

namespace gravitas {
namespace {

constexpr double kAnyGap = 1e9;  // m

class Narrow final : public ConstraintPlugin {
 public:
  static PluginDeclaration declaration() {
    return {.name = "Narrow",
            .version = "1.0",
            .slot = Slot::kConstraint,
            .meaning = "Holds points that are not too far apart.",
            .types = {{"Narrow",
                       "A shared point.",
                       {Property::vector("Point", "m", "world").required().means("The point."),
                        Property::number("Gap", "m").above(0.0).at_most(0.001).means("Beyond it nothing is known.")}}}};
  }
  explicit Narrow(PropertyCursor) {}

  void bind(const stage::ConstraintBindRequest& request, const stage::ConstraintBindReply& reply, Host&) override {
    bind_each(request, reply,
              [](std::uint64_t type, PropertyCursor properties, const JointBodies& bodies, BoundWriter& out) {
                if (type != type_id("Narrow")) throw Refusal("a joint of another type");
                const Vector3 point = properties.vector();
                if (!point.allFinite()) throw Refusal("Point is not finite");
                write_frame(bodies.pose1, frame_along(point, Vector3::UnitX()), &out);
                write_frame(bodies.pose2, frame_along(point, Vector3::UnitX()), &out);
                const double gap = properties.number();
                out.number(std::isnan(gap) ? kAnyGap : gap);
              });
  }

  void discrepancies(const stage::ConstraintDiscrepanciesRequest& request,
                     const stage::ConstraintDiscrepanciesReply& reply, Host&) override {
    describe_each(request, reply, [](std::uint64_t, PropertyCursor bound, const JointBodies& bodies, auto&& emit) {
      const Pose one = read_frame(&bound, bodies.pose1), other = read_frame(&bound, bodies.pose2);
      if ((other.position - one.position).norm() > bound.number()) throw Refusal("it is open by more than Gap");
      Discrepancy d;
      d.point1 = one.position, d.point2 = other.position;
      emit(d);
    });
  }
};

}  // namespace
}  // namespace gravitas

GRAVITAS_PLUGIN(gravitas::Narrow)
