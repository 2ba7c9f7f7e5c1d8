// A push that refuses, where a scene says how long it lasts, to be asked with another.
#include <cmath>

#include "plugin_sdk/force.h"

namespace {

using namespace gravitas;

class OneAtATime final : public ForcePlugin {
 public:
  static PluginDeclaration declaration() {
    return {.name = "OneAtATime",
            .version = "1.0",
            .slot = Slot::kForce,
            .meaning = "Misbehaves on purpose.",
            .types = {{"Push",
                       "Pushes the body.",
                       {Property::vector("Strength", "N", "world").required().means("The force."),
                        Property::number("Time", "s").above(0.0).means("How long it lasts.")}}}};
  }
  explicit OneAtATime(PropertyCursor) {}

  void wrenches(const stage::ForceWrenchesRequest& request, const stage::ForceWrenchesReply& reply, Host&) override {
    const auto applications = request.application();
    bool are_several = false;
    for (std::size_t i = 0; i < applications.size(); i += 2) are_several |= applications[i] != applications[0];
    for_each_application(request, reply, [&](std::uint64_t, PropertyCursor properties, std::uint32_t) {
      const Vector3 strength = properties.vector();
      if (!std::isnan(properties.number()) && are_several) throw Refusal("more than one push");
      return ApplicationAnswer{.wrench = {.force = strength}};
    });
  }
};

}  // namespace

GRAVITAS_PLUGIN(OneAtATime)
