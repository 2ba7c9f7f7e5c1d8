// Integrator `SemiImplicitEuler` (symplectic Euler): first order, position with the new velocity. With h the time
// step and forces at t_n:
//
//   v' = e^(-c h) (v + h f/m)          w* = e^(-c h) (w + h I_w^-1 tau)
//   x' = x + h v'                      q', w' = (q, w*) after h of exact free turning (free_rotor.h)
//
// A kick, then a drift: symplectic for forces that depend on position and attitude alone. The energy of an oscillator stays
// within about h w / 2 of its value for h w < 2 and grows without bound beyond; a body that nothing turns keeps its energy and
// momentum to rounding, and has its true attitude, at any spin and step. (The gyroscopic term taken explicitly multiplies the
// energy of a disc by 15 in 5 s at 10 rad/s and 1/60 s.) Without torque it is exp(h w) q where the moments are equal.
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
      const Quaternion& q = s.pose.orientation;
      const Twist next = accelerated(s.twist, derivatives.kick(body, q, wrenches), request.damping()[body], h);
      const Turning turned = derivatives.turned_freely(body, {q, next.angular}, h);
      const Pose moved = displaced(s.pose, h * next.linear, Vector3::Zero());
      return BodyState{{moved.position, turned.orientation}, {next.linear, turned.angular_velocity}};
    });
  }

 private:
  std::vector<double> room_;  // scratch
};

}  // namespace
}  // namespace gravitas

GRAVITAS_PLUGIN(gravitas::SemiImplicitEuler)
