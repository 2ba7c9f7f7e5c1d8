// Fails whenever a body is in the upper half of the world, in every process again.
#include <stdexcept>

#include "plugin_sdk/force.h"

namespace {

using namespace gravitas;

class PoisonedForce final : public ForcePlugin {
 public:
  static PluginDeclaration declaration() {
    return {.name = "PoisonedForce",
            .version = "1.0",
            .slot = Slot::kForce,
            .meaning = "Misbehaves on purpose.",
            .types = {{"Push",
                       "Pushes the body's centre of mass.",
                       {Property::vector("Push", "N", "world").required().means("The force.")}}}};
  }
  explicit PoisonedForce(PropertyCursor) {}

  void wrenches(const stage::ForceWrenchesRequest& request, const stage::ForceWrenchesReply& reply, Host&) override {
    for_each_application(request, reply, [&](std::uint64_t, PropertyCursor properties, std::uint32_t body) {
      if (request.position()[3 * body + 1] > 0.0) throw std::runtime_error("it never was so high");
      return ApplicationAnswer{.wrench = {.force = properties.vector()}};
    });
  }
};

}  // namespace

GRAVITAS_PLUGIN(PoisonedForce)
