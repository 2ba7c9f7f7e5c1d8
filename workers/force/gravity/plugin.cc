// Force `Gravity` (§ 4.2): f = m g at the centre of mass, potential U = -m g.x (zero at the origin).
#include "plugin_sdk/plugin.h"

#include "plugin_sdk/body.h"
#include "plugin_sdk/force.h"

namespace gravitas {
namespace {

class Gravity final : public ForcePlugin {
 public:
  static PluginDeclaration declaration() {
    return {.name = "Gravity",
            .version = "1.0",
            .slot = Slot::kForce,
            .meaning = "Uniform field of gravity.",
            .capabilities = {"potential"},
            .types = {
                {"Gravity",
                 "Pulls every body with its mass times the acceleration.",
                 {Property::vector("Acceleration", "m/s^2", "world").required().means("Acceleration of free fall.")}}}};
  }
  explicit Gravity(PropertyCursor) {}

  void wrenches(const stage::ForceWrenchesRequest& request, const stage::ForceWrenchesReply& reply, Host&) override {
    for_each_application(request, reply, [&](std::uint64_t, PropertyCursor parameters, std::uint32_t body) {
      const Vector3 force = request.mass()[body] * parameters.vector();
      return ApplicationAnswer{.wrench = {.force = force},
                               .potential = -force.dot(vector_at(request.position(), body)),
                               .flags = kConstantWrench | kHasPotential};
    });
  }
};

}  // namespace
}  // namespace gravitas

GRAVITAS_PLUGIN(gravitas::Gravity)
