// Integrator `Euler` (§ 2.4.1, 2.42): explicit, first order. With h the time step and everything on the right at t_n:
//
//   x' = x + h v          q' = exp(h w) q
//   v' = e^(-c h) (v + h f/m)          w' = e^(-c h) (w + h alpha),   alpha = I_w^-1 (tau - w x I_w w)
//
// The attitude turns by the exponential: the seed's sum q + h q' (2.39-2.41) turns by 2 atan(h w / 2), seven per
// cent short at h w = 1. Stability: unstable for every undamped oscillator (energy times 1 + (h w)^2 per step);
// with damping c for h < 2 c / (c^2 + w^2) or so. Known failure: energy of springs grows, 4e8-fold in 200 s at
// h w = 0.1. theta = 0: the pose of a step does not see that step's impulses.
#include "plugin_sdk/integrator.h"

namespace gravitas {
namespace {

class Euler final : public IntegratorPlugin {
 public:
  static PluginDeclaration declaration() {
    return {.name = "Euler",
            .version = "1.0",
            .slot = Slot::kIntegrator,
            .meaning = "Explicit Euler, order 1: position with the old velocity.",
            .theta = 0.0};
  }
  explicit Euler(PropertyCursor) {}

  void integrate(const stage::IntegratorIntegrateRequest& request, const stage::IntegratorIntegrateReply& reply,
                 Host& host) override {
    const double h = request.time_step();
    Derivatives derivatives(request, host, &room_);
    const std::span<const double> wrenches = derivatives.wrenches_at_start();
    for_each_body(request, reply, [&](std::size_t body, const BodyState& s) {
      return BodyState{displaced(s.pose, h * s.twist.linear, h * s.twist.angular),
                       accelerated(s.twist, derivatives.acceleration(body, s, wrenches), request.damping()[body], h)};
    });
  }

 private:
  std::vector<double> room_;  // scratch
};

}  // namespace
}  // namespace gravitas

GRAVITAS_PLUGIN(gravitas::Euler)
