// A wind that grows from call to call, which shows only where a scene says that there is one.
#include "plugin_sdk/force.h"

namespace {

using namespace gravitas;

class Gusts final : public ForcePlugin {
 public:
  static PluginDeclaration declaration() {
    return {.name = "Gusts",
            .version = "1.0",
            .slot = Slot::kForce,
            .meaning = "Misbehaves on purpose.",
            .types = {{"Gust",
                       "Takes the body along.",
                       {Property::number("Coefficient", "N*s/m").at_least(0.0).required().means("The share."),
                        Property::vector("Wind", "m/s", "world").defaults_to({0, 0, 0}).means("Its velocity.")}}}};
  }
  explicit Gusts(PropertyCursor) {}

  void wrenches(const stage::ForceWrenchesRequest& request, const stage::ForceWrenchesReply& reply, Host&) override {
    ++calls_;
    for_each_application(request, reply, [&](std::uint64_t, PropertyCursor properties, std::uint32_t body) {
      const double coefficient = properties.number();
      const Vector3 wind = calls_ * properties.vector();
      return ApplicationAnswer{.wrench = {.force = coefficient * (wind - vector_at(request.linear_velocity(), body))}};
    });
  }

 private:
  int calls_ = 0;
};

}  // namespace

GRAVITAS_PLUGIN(Gusts)
