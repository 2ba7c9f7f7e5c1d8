// A stop along an axis of body 1 whose way is counted the wrong way round: it pushes on what has gone beyond it.
#include "plugin_sdk/constraint.h"
#include "plugin_sdk/joint_rows.h"

namespace {

using namespace gravitas;

class BackwardStop final : public ConstraintPlugin {
 public:
  static PluginDeclaration declaration() {
    return {.name = "BackwardStop",
            .version = "1.0",
            .slot = Slot::kConstraint,
            .meaning = "Misbehaves on purpose.",
            .types = {{"Stop",
                       "A point that goes 1 m along an axis, at most.",
                       {Property::vector("Point", "m", "world").required().means("The point."),
                        Property::vector("Axis", "", "world").required().means("Along which it may go.")}}}};
  }
  explicit BackwardStop(PropertyCursor) {}

  void bind(const stage::ConstraintBindRequest& request, const stage::ConstraintBindReply& reply, Host&) override {
    bind_each(request, reply,
              [](std::uint64_t type, PropertyCursor properties, const JointBodies& bodies, BoundWriter& out) {
                demand_type(type, "Stop");
                const Vector3 point = properties.vector();
                const Pose frame = frame_along(point, unit_axis(properties.vector(), "Axis"));
                write_frame(bodies.pose1, frame, &out);
                write_frame(bodies.pose2, frame, &out);
              });
  }

  void discrepancies(const stage::ConstraintDiscrepanciesRequest& request,
                     const stage::ConstraintDiscrepanciesReply& reply, Host&) override {
    describe_each(request, reply, [](std::uint64_t, PropertyCursor bound, const JointBodies& bodies, auto&& emit) {
      const Pose guide = read_frame(&bound, bodies.pose1), point = read_frame(&bound, bodies.pose2);
      Discrepancy d;
      d.point1 = point.position, d.point2 = guide.position;
      d.axes = guide.orientation;
      d.modes = pack_modes(AxisMode::kLimited, AxisMode::kFree, AxisMode::kFree);
      d.lower.x() = -kUnlimited, d.upper.x() = 1.0;
      emit(d);
    });
  }
};

}  // namespace

GRAVITAS_PLUGIN(BackwardStop)
