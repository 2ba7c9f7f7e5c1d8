// Integrator for benchmarks: semi-implicit Euler with the mean of four derivatives, all asked at the initial state,
// so that a step has the traffic of a method of four stages and the arithmetic of one.
#include "plugin_sdk/integrator.h"

namespace gravitas {
namespace {

class FourDerivatives final : public IntegratorPlugin {
 public:
  static PluginDeclaration declaration() {
    return {.name = "FourDerivatives",
            .version = "1.0",
            .slot = Slot::kIntegrator,
            .meaning = "Asks for four derivatives a step.",
            .theta = 1.0};
  }
  explicit FourDerivatives(PropertyCursor) {}

  void integrate(const stage::IntegratorIntegrateRequest& request, const stage::IntegratorIntegrateReply& reply,
                 Host& host) override {
    const double h = request.time_step();
    Derivatives derivatives(request, host, &room_);
    mean_.assign(6 * derivatives.size(), 0.0);
    for (int i = 0; i < 4; ++i) {
      const std::span<const double> wrenches = derivatives.wrenches_at_start();
      for (std::size_t k = 0; k < mean_.size(); ++k) mean_[k] += 0.25 * wrenches[k];
    }
    for_each_body(request, reply, [&](std::size_t body, const BodyState& s) {
      const Twist next = accelerated(s.twist, derivatives.acceleration(body, s, mean_), request.damping()[body], h);
      return BodyState{displaced(s.pose, h * next.linear, h * next.angular), next};
    });
  }

 private:
  std::vector<double> room_, mean_;  // scratch
};

}  // namespace
}  // namespace gravitas

GRAVITAS_PLUGIN(gravitas::FourDerivatives)
