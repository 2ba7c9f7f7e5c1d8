// A ball joint that exchanges its two points: its error grows as fast as it should, but the other way.
#include "plugin_sdk/constraint.h"

namespace {

using namespace gravitas;

class SwappedPoints final : public ConstraintPlugin {
 public:
  static PluginDeclaration declaration() {
    return {.name = "SwappedPoints",
            .version = "1.0",
            .slot = Slot::kConstraint,
            .meaning = "Misbehaves on purpose.",
            .types = {{"Spherical",
                       "A ball joint.",
                       {Property::vector("BindPoint", "m", "world").required().means("The shared point.")}}}};
  }
  explicit SwappedPoints(PropertyCursor) {}

  void bind(const stage::ConstraintBindRequest& request, const stage::ConstraintBindReply& reply, Host&) override {
    bind_each(request, reply,
              [](std::uint64_t type, PropertyCursor properties, const JointBodies& bodies, BoundWriter& out) {
                if (type != type_id("Spherical")) throw Refusal("a joint of another type");
                const Vector3 point = properties.vector();
                out.vector(inverse_transform_point(bodies.pose1, point));
                out.vector(inverse_transform_point(bodies.pose2, point));
              });
  }

  void discrepancies(const stage::ConstraintDiscrepanciesRequest& request,
                     const stage::ConstraintDiscrepanciesReply& reply, Host&) override {
    describe_each(request, reply, [](std::uint64_t, PropertyCursor bound, const JointBodies& bodies, auto&& emit) {
      Discrepancy d;
      d.point2 = transform_point(bodies.pose1, bound.vector());
      d.point1 = transform_point(bodies.pose2, bound.vector());
      emit(d);
    });
  }
};

}  // namespace

GRAVITAS_PLUGIN(SwappedPoints)
