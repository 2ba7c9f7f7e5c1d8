// Integrator `RK4` (§ 2.4.3, 2.45): the classical Runge-Kutta method on (x, q, v, w) together, order 4.
//
//   k_1 = f(t, y)   k_2 = f(t + h/2, y + h/2 k_1)   k_3 = f(t + h/2, y + h/2 k_2)   k_4 = f(t + h, y + h k_3)
//   y' = y + h/6 (k_1 + 2 k_2 + 2 k_3 + k_4),     q^. = (0, w) q / 2,  alpha = I_w^-1 (tau - w x I_w w)
//
// The seed's 2.46, which takes the forces of time alone, is of first order as soon as one depends on the state. The
// attitude is renormalised once a step, an error of order 5, and damping is exact for free bodies (motion_stages.h).
// Four derivatives a step. Stability: an undamped oscillator loses energy, (h w)^6 / 72 of it a step, up to
// h w = 2.83; a decay at rate c is stable up to h c = 2.79. Known failure: rotations of more than some 0.5 rad a step
// are far off, since quaternions do not add (see RKMK4); stiff springs blow up.
#include "plugin_sdk/motion_stages.h"

namespace gravitas {
namespace {

class RK4 final : public IntegratorPlugin {
 public:
  static PluginDeclaration declaration() {
    return {.name = "RK4",
            .version = "1.0",
            .slot = Slot::kIntegrator,
            .meaning = "Classical Runge-Kutta method, order 4, four derivatives a step.",
            .capabilities = {"order=4"},
            .theta = 0.5};
  }
  explicit RK4(PropertyCursor) {}

  void integrate(const stage::IntegratorIntegrateRequest& request, const stage::IntegratorIntegrateReply& reply,
                 Host& host) override {
    integrate_rk4(request, reply, host, &stages_, &room_);
  }

 private:
  MotionStages<QuaternionChart> stages_;  // scratch
  std::vector<double> room_;              // scratch
};

}  // namespace
}  // namespace gravitas

GRAVITAS_PLUGIN(gravitas::RK4)
