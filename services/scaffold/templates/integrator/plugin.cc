// Integrator `MyName`: drift, kick, drift (position Verlet, Strang's splitting), order 2. With h the time step:
//
//   x_m = x + h/2 v        q_m, w_m = (q, w) after h/2 of exact free turning
//   v'  = v + h f_m/m      w*  = w_m + h I_m^-1 tau_m         f_m, tau_m at t + h/2, x_m, q_m
//   x'  = x_m + h/2 v'     q', w' = (q_m, w*) after another h/2
//
// with damping as in my_name.h. One derivative a step. Symplectic for forces of position and attitude alone: an oscillator
// moves as cos(n phi), cos(phi) = 1 - (h w)^2/2, for h w < 2, and grows without bound beyond. Known failure: forces of the
// velocity are taken at the one the step began with, so of them it is of order 1.
//
// A plugin is a class derived from the base of its slot. It declares itself once, receives a request as columns, and fills
// the columns of the reply. The answer depends on the request and the settings alone: the same request gives the same
// bytes, so keep nothing between calls but caches that can be made again.
#include <cstddef>
#include <span>
#include <vector>

#include "my_name.h"
#include "plugin_sdk/integrator.h"

namespace {

using namespace gravitas;

class MyNamePlugin final : public IntegratorPlugin {
 public:
  static PluginDeclaration declaration() {
    return {
        .name = "MyName",
        .version = "1.0",
        .slot = Slot::kIntegrator,
        .meaning = "Drift, kick, drift: order 2, one derivative a step.",
        .capabilities = {"order=2"},
        // share of an impulse's effect on the velocity that moves the pose within the step: 1/2 for order 2 and more
        .theta = 0.5};
  }

  // Settings, PluginDeclaration::properties, would be read here; this one has none.
  explicit MyNamePlugin(PropertyCursor) {}

  // The question of the slot: from S_n to the trial state S*, without joints and contacts, which the solver puts right
  // (schemas/gravitas/stage/v1/integrator.proto). Bodies that are not movable are for for_each_body().
  void integrate(const stage::IntegratorIntegrateRequest& request, const stage::IntegratorIntegrateReply& reply,
                 Host& host) override {
    const double h = request.time_step();
    Derivatives derivatives(request, host, &room_);
    trial_.resize(derivatives.size());
    for (std::size_t body = 0; body < derivatives.size(); ++body) {
      BodyState middle = derivatives.start(body);
      if ((request.flags()[body] & kMovable) != 0)
        middle = drifted(derivatives, body, middle, half_of(request, body));
      else if ((request.flags()[body] & kKinematic) != 0)
        middle.pose = displaced(middle.pose, 0.5 * h * middle.twist.linear, 0.5 * h * middle.twist.angular);
      trial_.set(body, middle);
    }
    // forces are asked for in the state between: unless they are the same in all
    const std::span<const double> wrenches = derivatives.are_constant()
                                                 ? derivatives.wrenches_at_start()
                                                 : derivatives.wrenches(request.time() + 0.5 * h, trial_);
    for_each_body(request, reply, [&](std::size_t body, const BodyState& start) {
      BodyState middle = trial_.at(body);
      const Acceleration kick = derivatives.kick(body, middle.pose.orientation, wrenches);
      middle.twist.linear += h * kick.linear;
      middle.twist.angular += h * kick.angular;
      const plain::HalfDrift half = half_of(request, body);
      BodyState end = drifted(derivatives, body, middle, half);
      // in one sum, which has a free body's way to rounding
      const Vector3 way = half.way * (start.twist.linear + middle.twist.linear);
      end.pose.position = displaced(start.pose, way, Vector3::Zero()).position;
      return end;
    });
  }

 private:
  static plain::HalfDrift half_of(const stage::IntegratorIntegrateRequest& request, std::size_t body) {
    return plain::half_drift(request.damping()[body], request.time_step());
  }

  static BodyState drifted(const Derivatives& derivatives, std::size_t body, const BodyState& state,
                           const plain::HalfDrift& half) {
    const Pose moved = displaced(state.pose, half.way * state.twist.linear, Vector3::Zero());
    const Turning turned = derivatives.turned_freely(body, {state.pose.orientation, state.twist.angular}, half.way);
    return {{moved.position, turned.orientation},
            {half.kept * state.twist.linear, half.kept * turned.angular_velocity}};
  }

  std::vector<double> room_;  // scratch, so that a step allocates nothing
  TrialColumns trial_;        // scratch
};

}  // namespace

GRAVITAS_PLUGIN(MyNamePlugin)
