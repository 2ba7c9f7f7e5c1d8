// Semi-implicit Euler that says it is explicit: what impulses add to velocities moves poses by h, not by 0.
#include "plugin_sdk/integrator.h"

namespace {

using namespace gravitas;

class WrongTheta final : public IntegratorPlugin {
 public:
  static PluginDeclaration declaration() {
    return {.name = "WrongTheta",
            .version = "1.0",
            .slot = Slot::kIntegrator,
            .meaning = "Misbehaves on purpose.",
            .theta = 0.0};
  }
  explicit WrongTheta(PropertyCursor) {}

  void integrate(const stage::IntegratorIntegrateRequest& request, const stage::IntegratorIntegrateReply& reply,
                 Host& host) override {
    const double h = request.time_step();
    std::vector<double> room;
    Derivatives derivatives(request, host, &room);
    const std::span<const double> wrenches = derivatives.wrenches_at_start();
    for_each_body(request, reply, [&](std::size_t body, const BodyState& s) {
      const Quaternion& q = s.pose.orientation;
      const Twist next = accelerated(s.twist, derivatives.kick(body, q, wrenches), request.damping()[body], h);
      const Turning turned = derivatives.turned_freely(body, {q, next.angular}, h);
      const Pose moved = displaced(s.pose, h * next.linear, Vector3::Zero());
      return BodyState{{moved.position, turned.orientation}, {next.linear, turned.angular_velocity}};
    });
  }
};

}  // namespace

GRAVITAS_PLUGIN(WrongTheta)
