// Reads a number more than its type declares, so that every question is refused.
#include "plugin_sdk/force.h"

namespace {

using namespace gravitas;

class ReadsTooMuch final : public ForcePlugin {
 public:
  static PluginDeclaration declaration() {
    return {.name = "ReadsTooMuch",
            .version = "1.0",
            .slot = Slot::kForce,
            .meaning = "Misbehaves on purpose.",
            .types = {{"Shove", "Pushes.", {Property::vector("Push", "N", "world").required().means("The force.")}}}};
  }
  explicit ReadsTooMuch(PropertyCursor) {}

  void wrenches(const stage::ForceWrenchesRequest& request, const stage::ForceWrenchesReply& reply, Host&) override {
    for_each_application(request, reply, [&](std::uint64_t, PropertyCursor properties, std::uint32_t) {
      const Vector3 push = properties.vector();
      return ApplicationAnswer{.wrench = {.force = properties.number() * push, .torque = Vector3::Zero()}};
    });
  }
};

}  // namespace

GRAVITAS_PLUGIN(ReadsTooMuch)
