// Dies whenever a movable body is in the upper half of the world, in every process again.
#include <csignal>

#include "plugin_sdk/integrator.h"

namespace {

using namespace gravitas;

class Poisoned final : public IntegratorPlugin {
 public:
  static PluginDeclaration declaration() {
    return {.name = "Poisoned",
            .version = "1.0",
            .slot = Slot::kIntegrator,
            .meaning = "Misbehaves on purpose.",
            .theta = 1.0};
  }
  explicit Poisoned(PropertyCursor) {}

  void integrate(const stage::IntegratorIntegrateRequest& request, const stage::IntegratorIntegrateReply& reply,
                 Host&) override {
    for_each_body(request, reply, [&](std::size_t, BodyState state) {
      if (state.pose.position.y() > 0.0) raise(SIGKILL);
      state.pose.position += request.time_step() * state.twist.linear;
      return state;
    });
  }
};

}  // namespace

GRAVITAS_PLUGIN(Poisoned)
