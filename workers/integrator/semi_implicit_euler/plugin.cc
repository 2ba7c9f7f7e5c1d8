// Integrator `SemiImplicitEuler` (symplectic Euler): first order, position with the new velocity. With h the time
// step and forces at t_n:
//
//   v' = e^(-c h) (v + h f/m)          w' = e^(-c h) (w + h alpha),   alpha = I_w^-1 (tau - w x I_w w)
//   x' = x + h v'         q' = exp(h w') q
//
// Symplectic for forces that depend on position alone: the energy of an oscillator stays within about h w / 2 of
// its value for h w < 2 and grows without bound beyond. Known failure: the gyroscopic term is taken explicitly,
// so a fast free rotor with unequal moments gains energy, of order (h w)^2 per turn.
// theta = 1: an impulse of this step moves the pose by h times the velocity it gives.
#include "plugin_sdk/integrator.h"

namespace gravitas {
namespace {

class SemiImplicitEuler final : public IntegratorPlugin {
 public:
  static PluginDeclaration declaration() {
    return {.name = "SemiImplicitEuler",
            .version = "1.0",
            .slot = Slot::kIntegrator,
            .meaning = "Symplectic Euler, order 1: position with the new velocity.",
            .theta = 1.0};
  }
  explicit SemiImplicitEuler(PropertyCursor) {}

  void integrate(const stage::IntegratorIntegrateRequest& request, const stage::IntegratorIntegrateReply& reply,
                 Host& host) override {
    const double h = request.time_step();
    Derivatives derivatives(request, host, &room_);
    const std::span<const double> wrenches = derivatives.wrenches_at_start();
    for_each_body(request, reply, [&](std::size_t body, const BodyState& s) {
      const Twist next = accelerated(s.twist, derivatives.acceleration(body, s, wrenches), request.damping()[body], h);
      return BodyState{displaced(s.pose, h * next.linear, h * next.angular), next};
    });
  }

 private:
  std::vector<double> room_;  // scratch
};

}  // namespace
}  // namespace gravitas

GRAVITAS_PLUGIN(gravitas::SemiImplicitEuler)
