// Leaves the gyroscopic term out: the angular momentum of a free rotor of unequal moments drifts.
#include "plugin_sdk/integrator.h"

namespace {

using namespace gravitas;

class DriftingIntegrator final : public IntegratorPlugin {
 public:
  static PluginDeclaration declaration() {
    return {.name = "Drifting",
            .version = "1.0",
            .slot = Slot::kIntegrator,
            .meaning = "Misbehaves on purpose.",
            .theta = 1.0};
  }
  explicit DriftingIntegrator(PropertyCursor) {}

  void integrate(const stage::IntegratorIntegrateRequest& request, const stage::IntegratorIntegrateReply& reply,
                 Host& host) override {
    const double h = request.time_step();
    std::vector<double> room;
    Derivatives derivatives(request, host, &room);
    const std::span<const double> wrenches = derivatives.wrenches_at_start();
    for_each_body(request, reply, [&](std::size_t body, const BodyState& s) {
      // as if it did not turn
      const BodyState still{s.pose, {s.twist.linear, Vector3::Zero()}};
      const Acceleration a = derivatives.acceleration(body, still, wrenches);
      const double slowed = damping_factor(request.damping()[body], h);
      const Twist next{slowed * (s.twist.linear + h * a.linear), slowed * (s.twist.angular + h * a.angular)};
      return BodyState{displaced(s.pose, h * next.linear, h * next.angular), next};
    });
  }
};

}  // namespace

GRAVITAS_PLUGIN(DriftingIntegrator)
