// A constant push that is half as strong from call 20 of its process on.
#include "plugin_sdk/force.h"

namespace {

using namespace gravitas;

class Tires final : public ForcePlugin {
 public:
  static PluginDeclaration declaration() {
    return {.name = "Tires",
            .version = "1.0",
            .slot = Slot::kForce,
            .meaning = "Misbehaves on purpose.",
            .types = {{"Push",
                       "Pushes the body's centre of mass.",
                       {Property::vector("Push", "N", "world").required().means("The force.")}}}};
  }
  explicit Tires(PropertyCursor) {}

  void wrenches(const stage::ForceWrenchesRequest& request, const stage::ForceWrenchesReply& reply, Host&) override {
    const double share = ++calls_ < 20 ? 1.0 : 0.5;
    for_each_application(request, reply, [&](std::uint64_t, PropertyCursor properties, std::uint32_t) {
      return ApplicationAnswer{.wrench = {.force = share * properties.vector()}, .flags = kConstantWrench};
    });
  }

 private:
  int calls_ = 0;
};

}  // namespace

GRAVITAS_PLUGIN(Tires)
