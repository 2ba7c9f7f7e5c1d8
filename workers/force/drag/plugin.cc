// Force `Drag`: resistance of a medium at rest at the centre of mass,
//
//   f = -(c_1 + c_2 |v|) v
//
// The velocity of a body under it alone: v_0 e^(-c_1 t/m) (c_2 = 0) or v_0 / (1 + c_2 |v_0| t/m) (c_1 = 0). Stiff where
// (c_1 + 2 c_2 |v|) h / m is large: an explicit integrator then overshoots.
#include "plugin_sdk/plugin.h"

#include "plugin_sdk/body.h"
#include "plugin_sdk/force.h"
#include "plugin_sdk/force_jacobians.h"

namespace gravitas {
namespace {

class Drag final : public OwnStateForce {
 public:
  static PluginDeclaration declaration() {
    return {
        .name = "Drag",
        .version = "1.0",
        .slot = Slot::kForce,
        .meaning = "Resistance of a medium at rest, linear and quadratic in the speed.",
        .capabilities = {"jacobians"},
        .types = {{"Drag",
                   "Resists the velocity of the centre of mass.",
                   {Property::number("LinearCoefficient", "N*s/m").at_least(0.0).required().means("Force per speed."),
                    Property::number("QuadraticCoefficient", "N*s^2/m^2")
                        .at_least(0.0)
                        .defaults_to({0})
                        .means("Force per squared speed.")}}}};
  }
  explicit Drag(PropertyCursor) {}

  void wrenches(const stage::ForceWrenchesRequest& request, const stage::ForceWrenchesReply& reply, Host&) override {
    for_each_application(request, reply, [&](std::uint64_t, PropertyCursor cursor, std::uint32_t body) {
      const double linear = cursor.number(), quadratic = cursor.number();
      const Vector3 v = vector_at(request.linear_velocity(), body);
      return ApplicationAnswer{.wrench = {.force = -(linear + quadratic * v.norm()) * v}};
    });
  }
};

}  // namespace
}  // namespace gravitas

GRAVITAS_PLUGIN(gravitas::Drag)
