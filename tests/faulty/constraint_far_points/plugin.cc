// A point of body 2 in a plane of body 1, told with the plane's origin, however far along it the point has gone.
#include "plugin_sdk/constraint.h"
#include "plugin_sdk/joint_rows.h"

namespace {

using namespace gravitas;

class FarPoints final : public ConstraintPlugin {
 public:
  static PluginDeclaration declaration() {
    return {.name = "FarPoints",
            .version = "1.0",
            .slot = Slot::kConstraint,
            .meaning = "Misbehaves on purpose.",
            .types = {{"Planar",
                       "A point in a plane.",
                       {Property::vector("Point", "m", "world").required().means("The point."),
                        Property::vector("Normal", "", "world").required().means("Across the plane.")}}}};
  }
  explicit FarPoints(PropertyCursor) {}

  void bind(const stage::ConstraintBindRequest& request, const stage::ConstraintBindReply& reply, Host&) override {
    bind_each(request, reply,
              [](std::uint64_t type, PropertyCursor properties, const JointBodies& bodies, BoundWriter& out) {
                if (type != type_id("Planar")) throw Refusal("a joint of another type");
                const Vector3 point = properties.vector(), normal = properties.vector();
                if (!(normal.norm() > 0.0) || !normal.allFinite()) throw Refusal("Normal has no direction");
                const Pose frame = frame_along(point, normal.stableNormalized());
                write_frame(bodies.pose1, frame, &out);
                write_frame(bodies.pose2, frame, &out);
              });
  }

  void discrepancies(const stage::ConstraintDiscrepanciesRequest& request,
                     const stage::ConstraintDiscrepanciesReply& reply, Host&) override {
    describe_each(request, reply, [](std::uint64_t, PropertyCursor bound, const JointBodies& bodies, auto&& emit) {
      const Pose plane = read_frame(&bound, bodies.pose1), point = read_frame(&bound, bodies.pose2);
      Discrepancy d;
      d.point1 = plane.position, d.point2 = point.position;
      d.axes = plane.orientation;
      d.modes = pack_modes(AxisMode::kLocked, AxisMode::kFree, AxisMode::kFree);
      emit(d);
    });
  }
};

}  // namespace

GRAVITAS_PLUGIN(FarPoints)
