// Integrator `Verlet` (§ 2.4.2, 2.43): velocity Verlet, order 2. Without damping,
//
//   x' = x + h v + h^2/2 a         q' = exp(h w + h^2/2 alpha) q
//   v' = v + h/2 (a + a')          w' = w + h/2 (alpha + alpha')
//
// where a', alpha' are those at (t + h, x', q') and the predicted velocities v + h a, w + h alpha: on them forces that
// depend on velocity, and the gyroscopic term, are evaluated. With damping c and s = (1 - e^(-c h)) / c,
//
//   x' = x + s v + h^2/2 a,   v' = e^(-c h) v + h/2 (e^(-c h) a + a'),
//
// and likewise in rotation: order 2, a free body slows by e^(-c h). The seed takes v by Euler's step "for want of jerk":
// that is of first order, and multiplies the energy of an oscillator by 2e4 in 200 s at h w = 0.1.
// Two derivatives a step. For forces of position alone symplectic and symmetric: the energy of an oscillator stays
// within (h w)^2 / 4 of its value up to h w = 2 and grows without bound beyond. Known failure: the gyroscopic term is
// explicit, so the energy of a fast free rotor of unequal moments drifts, by order h^3 per unit of time.
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
      const double moved = damped_time(request.damping()[i], h);
      return BodyState{displaced(s.pose, moved * s.twist.linear + 0.5 * h * h * first.linear,
                                 moved * s.twist.angular + 0.5 * h * h * first.angular),
                       accelerated(s.twist, first, request.damping()[i], h)};
    };
    const auto completed = [&](std::size_t i, const BodyState& s, const Acceleration& first, const BodyState& trial,
                               const Acceleration& second) {
      const double kept = damping_factor(request.damping()[i], h);
      return BodyState{trial.pose,
                       {kept * (s.twist.linear + 0.5 * h * first.linear) + 0.5 * h * second.linear,
                        kept * (s.twist.angular + 0.5 * h * first.angular) + 0.5 * h * second.angular}};
    };

    if (derivatives.are_constant()) {
      for_each_body(request, reply, [&](std::size_t i, const BodyState& s) {
        const Acceleration first = derivatives.acceleration(i, s, before);
        const BodyState trial = predicted(i, s, first);
        return completed(i, s, first, trial, derivatives.acceleration(i, trial, before));
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
      first_[i] = derivatives.acceleration(i, s, before);
      trial_.set(i, predicted(i, s, first_[i]));
    }
    const std::span<const double> after = derivatives.wrenches(request.time() + h, trial_);
    for_each_body(request, reply, [&](std::size_t i, const BodyState& s) {
      const BodyState trial = trial_.at(i);
      return completed(i, s, first_[i], trial, derivatives.acceleration(i, trial, after));
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
