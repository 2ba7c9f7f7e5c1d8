// Force `MyName`: a wind that takes bodies along, f = c (u - v) (the equations: my_name.h).
//
// A plugin is a class derived from the base of its slot. It declares itself once (name, types, properties), receives a
// request as columns, and fills the columns of the reply. The answer depends on the request and the settings alone: the
// same request gives the same bytes, so keep nothing between calls but caches that can be made again.
#include <cstddef>
#include <cstdint>

#include "my_name.h"
#include "plugin_sdk/force.h"
#include "plugin_sdk/force_jacobians.h"

namespace {

using namespace gravitas;

class MyNamePlugin final : public ForcePlugin {
 public:
  // What a scene may write. Parsing, checking, defaults, `gravitas describe` and the documentation come from here, so a
  // property has its unit, its bounds and a sentence. More kinds of properties: plugin_sdk/property.h.
  static PluginDeclaration declaration() {
    return {.name = "MyName",
            .version = "1.0",
            .slot = Slot::kForce,
            .meaning = "A wind that takes bodies along.",
            // promises that wrenches' slopes are answered, too, which implicit integrators ask for
            .capabilities = {"jacobians"},
            .types = {
                {"MyName",
                 "Force at the centre of mass, linear in its velocity relative to a wind.",
                 {Property::number("Coefficient", "N*s/m").at_least(0.0).required().means("Force per relative speed."),
                  Property::vector("Wind", "m/s", "world").defaults_to({0, 0, 0}).means("Velocity of the wind.")}}}};
  }

  // Settings of the plugin itself (PluginDeclaration::properties) would be read here; this one has none.
  explicit MyNamePlugin(PropertyCursor) {}

  // The question of the slot. An application is a force that acts on a body: one row of the request, one of the reply,
  // in the same order (schemas/gravitas/stage/v1/force.proto). The loop checks indices, and refuses answers that are not
  // finite. For a request that is impossible throw Refusal with the reason; it is shown at the force in the scene.
  void wrenches(const stage::ForceWrenchesRequest& request, const stage::ForceWrenchesReply& reply, Host&) override {
    for_each_application(request, reply, [&](std::uint64_t, PropertyCursor properties, std::uint32_t body) {
      // values come in the order of declaration
      const double coefficient = properties.number();
      const Vector3 wind = properties.vector();
      const Vector3 velocity = vector_at(request.linear_velocity(), body);
      // no kConstantWrench: this wrench changes with the state. No kHasPotential: it has none
      return ApplicationAnswer{.wrench = {.force = plain::wind_force(coefficient, wind, velocity)}};
    });
  }

  // How each wrench changes with the state (dx, r, dv, dw) of a body: six rows, twelve columns (wrench_jacobian.h).
  // OwnStateForce of force_jacobians.h as the base instead would take differences of wrenches().
  void jacobians(const stage::ForceWrenchesRequest& request, const stage::ForceJacobiansReply& reply, Host&) override {
    for (std::size_t row = 0; row < request.application().size() / 2; ++row) {
      Application one = application_at(request, row);
      JacobianBlock block = JacobianBlock::Zero();
      block.block<3, 3>(0, 6) = plain::wind_force_slope(one.properties.number());
      push_block(reply, one.body, one.body, block);
    }
  }
};

}  // namespace

GRAVITAS_PLUGIN(MyNamePlugin)
