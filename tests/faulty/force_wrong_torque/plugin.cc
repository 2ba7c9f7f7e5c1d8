// A force at a point whose torque is force x arm instead of arm x force.
#include "plugin_sdk/force.h"

namespace {

using namespace gravitas;

class WrongTorque final : public ForcePlugin {
 public:
  static PluginDeclaration declaration() {
    return {
        .name = "WrongTorque",
        .version = "1.0",
        .slot = Slot::kForce,
        .meaning = "Misbehaves on purpose.",
        .types = {
            {"Basic",
             "A force at a point.",
             {Property::vector("Force", "N", "world").required().means("The force."),
              Property::vector("ApplicationPoint", "m", "geometry").defaults_to({0, 0, 0}).means("Where it acts.")}}}};
  }
  explicit WrongTorque(PropertyCursor) {}

  void wrenches(const stage::ForceWrenchesRequest& request, const stage::ForceWrenchesReply& reply, Host&) override {
    for_each_application(request, reply, [&](std::uint64_t, PropertyCursor properties, std::uint32_t body) {
      const Vector3 force = properties.vector();
      const Pose geometry{vector_at(request.geometry_position(), body),
                          quaternion_at(request.geometry_orientation(), body)};
      const Vector3 arm = quaternion_at(request.orientation(), body) * transform_point(geometry, properties.vector());
      return ApplicationAnswer{.wrench = {.force = force, .torque = force.cross(arm)}};
    });
  }
};

}  // namespace

GRAVITAS_PLUGIN(WrongTorque)
