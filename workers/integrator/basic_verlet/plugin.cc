// Integrator `BasicVerlet` (§ 2.4.2, 2.44): position Verlet, order 2. With d = x_n - x_{n-1} the last displacement and
// r the last rotation vector, q_n = exp(r) q_{n-1},
//
//   x_{n+1} = x_n + d + h^2 a_n             q_{n+1} = exp(r + h^2 alpha_n) q_n
//   v_{n+1} = (x_{n+1} - x_n)/h + h/2 a_{n+1}      w_{n+1} = r_{n+1}/h + h/2 alpha_{n+1}
//
// The seed prints h^2/2 a, with which a body falls at g/2, and takes v as (x_{n+1} - x_{n-1}) / 2h, which is v_n. Where
// its sum of quaternions has the form of x, the rotation vectors here are that of the group: turning about a fixed axis
// under a constant torque is exact at any angle. With damping c, s = (1 - e^(-c h))/c, E = e^(-c h):
//
//   d_{n+1} = E d_n + h s a_n,   v_{n+1} = (E d_{n+1} + (s^2 - E (h - s)/c) a_{n+1}) / s      (exact for constant a).
//
// History: plugin_state holds h and, per body, E d and E r. It is rebuilt from the state (2.43 with -h) where there is
// none, where h is another, and for a body that was changed from outside: E d_n = s v_n - (s - E h)/c a_n.
// a_{n+1} is taken at the predicted velocities d/h + h/2 a_n. Two derivatives a step. For forces of position alone the
// path is that of velocity Verlet: symplectic, stable up to h w = 2. Known failures: as for Verlet; and no more than
// half a turn a step.
#include "plugin_sdk/integrator.h"

namespace gravitas {
namespace {

constexpr std::size_t kNumbersPerBody = 6;

// Coefficients of a step with damping; see the head.
struct Damped {
  double kept;     // E
  double reached;  // s
  double back;     // (s - E h) / c
  double forward;  // s - E (h - s) / (c s): share of a in the next velocity

  Damped(double c, double h) : kept(damping_factor(c, h)), reached(damped_time(c, h)) {
    // closed forms cancel where c h is small; their series end within rounding there
    const double z = c * h;
    if (z < 1e-2) {
      back = h * h * (0.5 - z * (1.0 / 3.0 - z * (1.0 / 8.0 - z * (1.0 / 30.0 - z * (1.0 / 144.0 - z / 840.0)))));
      const double ahead =
          h * h * (0.5 - z * (1.0 / 6.0 - z * (1.0 / 24.0 - z * (1.0 / 120.0 - z * (1.0 / 720.0 - z / 5040.0)))));
      forward = reached - kept * ahead / reached;
    } else {
      back = (reached - kept * h) / c;
      forward = reached - kept * (h - reached) / (c * reached);
    }
  }
};

class BasicVerlet final : public IntegratorPlugin {
 public:
  static PluginDeclaration declaration() {
    return {.name = "BasicVerlet",
            .version = "1.0",
            .slot = Slot::kIntegrator,
            .meaning = "Position Verlet with the last displacement as history, order 2, two derivatives a step.",
            .capabilities = {"order=2", "plugin_state"},
            .theta = 0.5};
  }
  explicit BasicVerlet(PropertyCursor) {}

  void integrate(const stage::IntegratorIntegrateRequest& request, const stage::IntegratorIntegrateReply& reply,
                 Host& host) override {
    const double h = request.time_step();
    Derivatives derivatives(request, host, &room_);
    const std::size_t bodies = derivatives.size();
    const std::span<const double> history = request.plugin_state();
    const bool has_history = history.size() == 1 + kNumbersPerBody * bodies && history[0] == h;
    moved_.resize(bodies), trial_.resize(bodies);

    const std::span<const double> before = derivatives.wrenches_at_start();
    for (std::size_t i = 0; i < bodies; ++i) {
      const BodyState s = derivatives.start(i);
      if ((request.flags()[i] & kMovable) == 0) {
        trial_.set(i, (request.flags()[i] & kKinematic) != 0 ? detail::keep_moving(s, h) : s);
        continue;
      }
      const Acceleration a = derivatives.acceleration(i, s, before);
      const Damped damped(request.damping()[i], h);
      Moved last;  // E d, E r
      if (has_history && request.state_changed()[i] == 0) {
        last = {vector_at(history.subspan(1), 2 * i), vector_at(history.subspan(1), 2 * i + 1)};
      } else {
        last = {damped.reached * s.twist.linear - damped.back * a.linear,
                damped.reached * s.twist.angular - damped.back * a.angular};
      }
      const double push = h * damped.reached;
      moved_[i] = {last.linear + push * a.linear, last.angular + push * a.angular};
      trial_.set(i, {displaced(s.pose, moved_[i].linear, moved_[i].angular), velocity(moved_[i], damped, a)});
    }

    const std::span<const double> after = derivatives.wrenches(request.time() + h, trial_);
    reply.plugin_state().push(h);
    for_each_body(request, reply, [&](std::size_t i, const BodyState&) {
      const BodyState predicted = trial_.at(i);
      const Damped damped(request.damping()[i], h);
      return BodyState{predicted.pose, velocity(moved_[i], damped, derivatives.acceleration(i, predicted, after))};
    });
    for (std::size_t i = 0; i < bodies; ++i) {
      const bool movable = (request.flags()[i] & kMovable) != 0;
      const double kept = movable ? damping_factor(request.damping()[i], h) : 0.0;
      const Vector3 linear = movable ? Vector3(kept * moved_[i].linear) : Vector3::Zero();
      const Vector3 angular = movable ? Vector3(kept * moved_[i].angular) : Vector3::Zero();
      reply.plugin_state().push(linear.x(), linear.y(), linear.z());
      reply.plugin_state().push(angular.x(), angular.y(), angular.z());
    }
  }

 private:
  struct Moved {
    Vector3 linear, angular;  // displacement, rotation vector
  };

  static Twist velocity(const Moved& moved, const Damped& damped, const Acceleration& a) {
    const double share = damped.kept / damped.reached;
    return {share * moved.linear + damped.forward * a.linear, share * moved.angular + damped.forward * a.angular};
  }

  std::vector<double> room_;  // scratch
  std::vector<Moved> moved_;  // scratch
  TrialColumns trial_;        // scratch
};

}  // namespace
}  // namespace gravitas

GRAVITAS_PLUGIN(gravitas::BasicVerlet)
