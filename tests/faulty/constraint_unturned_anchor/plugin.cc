// Keeps the anchor of a joint in the world's axes: it does not turn with its body.
#include "plugin_sdk/constraint.h"

namespace {

using namespace gravitas;

class UnturnedAnchor final : public ConstraintPlugin {
 public:
  static PluginDeclaration declaration() {
    return {.name = "UnturnedAnchor",
            .version = "1.0",
            .slot = Slot::kConstraint,
            .meaning = "Misbehaves on purpose.",
            .types = {{"Spherical",
                       "A ball joint.",
                       {Property::vector("BindPoint", "m", "world").required().means("The shared point.")}}}};
  }
  explicit UnturnedAnchor(PropertyCursor) {}

  void bind(const stage::ConstraintBindRequest& request, const stage::ConstraintBindReply& reply, Host&) override {
    bind_each(request, reply,
              [](std::uint64_t type, PropertyCursor properties, const JointBodies& bodies, BoundWriter& out) {
                if (type != type_id("Spherical")) throw Refusal("a joint of another type");
                const Vector3 point = properties.vector();
                out.vector(point - bodies.pose1.position);
                out.vector(point - bodies.pose2.position);
              });
  }

  void discrepancies(const stage::ConstraintDiscrepanciesRequest& request,
                     const stage::ConstraintDiscrepanciesReply& reply, Host&) override {
    describe_each(request, reply, [](std::uint64_t, PropertyCursor bound, const JointBodies& bodies, auto&& emit) {
      Discrepancy d;
      d.point1 = bodies.pose1.position + bound.vector();
      d.point2 = bodies.pose2.position + bound.vector();
      emit(d);
    });
  }
};

}  // namespace

GRAVITAS_PLUGIN(UnturnedAnchor)
