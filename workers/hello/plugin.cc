// The smallest plugin there is, and the tutorial: a force type `Hello` that pushes every body it is applied to
// with the same force.
//
// A plugin is a class derived from the base of its slot. It declares itself once (name, types, properties),
// receives a request as columns, and fills the columns of the reply. It keeps nothing between calls.
#include "plugin_sdk/force.h"

namespace {

using namespace gravitas;

class Hello final : public ForcePlugin {
 public:
  // What the plugin is. The properties are those that a scene may write in CustomProperties; parsing, checking,
  // `gravitas describe` and the documentation come from here.
  static PluginDeclaration declaration() {
    return {.name = "Hello",
            .version = "1.0",
            .slot = Slot::kForce,
            .meaning = "The smallest plugin: a constant push.",
            .types = {{"Hello",
                       "Pushes the body's centre of mass.",
                       {Property::vector("Push", "N", "world").required().means("The force.")}}}};
  }

  // Settings of the plugin itself would be read here; this one has none.
  explicit Hello(PropertyCursor) {}

  // The question of the slot: schemas/gravitas/stage/v1/force.proto says what the columns are.
  void wrenches(const stage::ForceWrenchesRequest& request, const stage::ForceWrenchesReply& reply, Host&) override {
    for_each_application(request, reply, [](std::uint64_t, PropertyCursor properties, std::uint32_t) {
      return ApplicationAnswer{.wrench = {.force = properties.vector()}, .flags = kConstantWrench};
    });
  }
};

}  // namespace

GRAVITAS_PLUGIN(Hello)
