// Integrator `RKMK4`: the Runge-Kutta-Munthe-Kaas method of order 4 on the group of rotations. The attitude of a step
// is exp(r) q_0, and the classical Runge-Kutta method (see RK4) advances (x, r, v, w) with
//
//   r^. = dexp_r^-1 w = w - r x w / 2 + (1 - (|r|/2) cot(|r|/2)) / |r|^2  r x (r x w),     r = 0 at the start,
//   w^. = alpha = I_w^-1 (tau - w x I_w w).
//
// Every stage is a rotation, nothing is renormalised but rounding, and turning about a fixed axis is exact at any
// speed. Source: Munthe-Kaas, "High order Runge-Kutta methods on manifolds", Appl. Numer. Math. 29 (1999). Four
// derivatives a step. Stability: in x and v that of RK4 (h w < 2.83). Damping as in motion_stages.h. Known failure: the
// axis of a body that tumbles by more than about a radian a step is wrong, and energy is lost or won slowly (order 4);
// see SymplecticSplitting for free rotors.
#include "plugin_sdk/motion_stages.h"

namespace gravitas {
namespace {

class RKMK4 final : public IntegratorPlugin {
 public:
  static PluginDeclaration declaration() {
    return {.name = "RKMK4",
            .version = "1.0",
            .slot = Slot::kIntegrator,
            .meaning = "Runge-Kutta-Munthe-Kaas method on the rotation group, order 4, four derivatives a step.",
            .capabilities = {"order=4"},
            .theta = 0.5};
  }
  explicit RKMK4(PropertyCursor) {}

  void integrate(const stage::IntegratorIntegrateRequest& request, const stage::IntegratorIntegrateReply& reply,
                 Host& host) override {
    integrate_rk4(request, reply, host, &stages_, &room_);
  }

 private:
  MotionStages<GroupChart> stages_;  // scratch
  std::vector<double> room_;         // scratch
};

}  // namespace
}  // namespace gravitas

GRAVITAS_PLUGIN(gravitas::RKMK4)
