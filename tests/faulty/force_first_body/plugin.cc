// A wind that takes all bodies along as if they were as fast as the first.
#include "plugin_sdk/force.h"

namespace {

using namespace gravitas;

class FirstBody final : public ForcePlugin {
 public:
  static PluginDeclaration declaration() {
    return {.name = "FirstBody",
            .version = "1.0",
            .slot = Slot::kForce,
            .meaning = "Misbehaves on purpose.",
            .types = {{"Breeze",
                       "Force per relative speed.",
                       {Property::number("Coefficient", "N*s/m").at_least(0.0).required().means("The share.")}}}};
  }
  explicit FirstBody(PropertyCursor) {}

  void wrenches(const stage::ForceWrenchesRequest& request, const stage::ForceWrenchesReply& reply, Host&) override {
    for_each_application(request, reply, [&](std::uint64_t, PropertyCursor properties, std::uint32_t) {
      const double coefficient = properties.number();
      return ApplicationAnswer{.wrench = {.force = -coefficient * vector_at(request.linear_velocity(), 0)}};
    });
  }
};

}  // namespace

GRAVITAS_PLUGIN(FirstBody)
