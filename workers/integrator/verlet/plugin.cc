// Integrator `Verlet` (§ 2.4.2, 2.43): velocity Verlet, order 2. With h the time step and no damping,
//
//   x' = x + h v + h^2/2 a             v' = v + h/2 (a + a')
//   w* = w + h/2 I_w^-1 tau            q' = q after h of exact free turning with w* (free_rotor.h)
//   L' = L + h/2 (tau + tau')          w' = I_w'^-1 L',      L = I_w w
//
// where a', tau' are those at (t + h, x', q') and the predicted velocities v + h a, I_w'^-1 (L + h tau), on which forces that
// depend on velocity are evaluated. With damping c and s = (1 - e^(-c h)) / c,
//
//   x' = x + s v + h^2/2 a,   v' = e^(-c h) v + h/2 (e^(-c h) a + a'),
//
// and likewise L', and w* = (s w + h^2/2 I_w^-1 tau) / h: order 2, a free body slows by e^(-c h). The seed takes v by Euler's
// step "for want of jerk": that is of first order, and multiplies the energy of an oscillator by 2e4 in 200 s at h w = 0.1.
// Two derivatives a step. For forces of position and attitude alone symplectic and symmetric: the energy of an oscillator stays
// within (h w)^2 / 4 of its value up to h w = 2 and grows without bound beyond. A body that nothing turns keeps its energy and
// momentum to rounding, and has its true attitude, at any spin and step.
#include "plugin_sdk/integrator.h"
#include "plugin_sdk/math/transcendental.h"

namespace gravitas {
namespace {

class Verlet final : public IntegratorPlugin {
 public:
  static PluginDeclaration declaration() {
    return {.name = "Verlet",
            .version = "1.0",
            .slot = Slot::kIntegrator,
            .meaning = "Velocity Verlet, order 2, two derivatives a step.",
            .capabilities = {"order=2"},
            .theta = 0.5};
  }
  explicit Verlet(PropertyCursor) {}

  void integrate(const stage::IntegratorIntegrateRequest& request, const stage::IntegratorIntegrateReply& reply,
                 Host& host) override {
    const double h = request.time_step();
    Derivatives derivatives(request, host, &room_);
    const std::size_t bodies = derivatives.size();
    const std::span<const double> before = derivatives.wrenches_at_start();

    // where a body goes, and its velocities as far as the first derivative knows
    const auto predicted = [&](std::size_t i, const BodyState& s, const Acceleration& first) {
      const double moved = damped_time(request.damping()[i], h), kept = damping_factor(request.damping()[i], h);
      const Quaternion& q = s.pose.orientation;
      const Pose shifted = displaced(s.pose, moved * s.twist.linear + 0.5 * h * h * first.linear, Vector3::Zero());
      const Vector3 mean = moved / h * s.twist.angular + 0.5 * h * first.angular;
      const Turning turned = derivatives.turned_freely(i, {q, mean}, h);
      // what nothing turns has its velocity from there
      const Vector3 spin =
          first.angular.isZero(0.0)
              ? Vector3(kept * (h / moved) * turned.angular_velocity)
              : derivatives.carried(i, kept * (s.twist.angular + h * first.angular), q, turned.orientation);
      return BodyState{{shifted.position, turned.orientation}, {kept * (s.twist.linear + h * first.linear), spin}};
    };
    const auto completed = [&](std::size_t i, const BodyState& s, const Acceleration& first, const BodyState& trial,
                               const Acceleration& second) {
      const double kept = damping_factor(request.damping()[i], h);
      Vector3 spin = trial.twist.angular;
      if (!first.angular.isZero(0.0)) {
        const Vector3 half = kept * (s.twist.angular + 0.5 * h * first.angular);
        spin = derivatives.carried(i, half, s.pose.orientation, trial.pose.orientation);
      }
      return BodyState{trial.pose,
                       {kept * (s.twist.linear + 0.5 * h * first.linear) + 0.5 * h * second.linear,
                        spin + 0.5 * h * second.angular}};
    };

    if (derivatives.are_constant()) {
      for_each_body(request, reply, [&](std::size_t i, const BodyState& s) {
        const Acceleration first = derivatives.kick(i, s.pose.orientation, before);
        const BodyState trial = predicted(i, s, first);
        return completed(i, s, first, trial, derivatives.kick(i, trial.pose.orientation, before));
      });
      return;
    }
    first_.resize(bodies), trial_.resize(bodies);
    for (std::size_t i = 0; i < bodies; ++i) {
      const BodyState s = derivatives.start(i);
      if ((request.flags()[i] & kMovable) == 0) {
        trial_.set(i, (request.flags()[i] & kKinematic) != 0 ? detail::keep_moving(s, h) : s);
        continue;
      }
      first_[i] = derivatives.kick(i, s.pose.orientation, before);
      trial_.set(i, predicted(i, s, first_[i]));
    }
    const std::span<const double> after = derivatives.wrenches(request.time() + h, trial_);
    for_each_body(request, reply, [&](std::size_t i, const BodyState& s) {
      const BodyState trial = trial_.at(i);
      return completed(i, s, first_[i], trial, derivatives.kick(i, trial.pose.orientation, after));
    });
  }

 private:
  std::vector<double> room_;         // scratch
  std::vector<Acceleration> first_;  // scratch
  TrialColumns trial_;               // scratch
};

}  // namespace
}  // namespace gravitas

GRAVITAS_PLUGIN(gravitas::Verlet)
