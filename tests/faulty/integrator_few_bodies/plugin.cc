// Semi-implicit Euler that leaves out the wrenches of all bodies from row 40 on.
#include "plugin_sdk/integrator.h"

namespace {

using namespace gravitas;

class FewBodies final : public IntegratorPlugin {
 public:
  static PluginDeclaration declaration() {
    return {.name = "FewBodies",
            .version = "1.0",
            .slot = Slot::kIntegrator,
            .meaning = "Misbehaves on purpose.",
            .theta = 1.0};
  }
  explicit FewBodies(PropertyCursor) {}

  void integrate(const stage::IntegratorIntegrateRequest& request, const stage::IntegratorIntegrateReply& reply,
                 Host& host) override {
    const double h = request.time_step();
    std::vector<double> room;
    Derivatives derivatives(request, host, &room);
    const std::span<const double> first = derivatives.wrenches_at_start();
    std::vector<double> wrenches(first.begin(), first.end());
    for (std::size_t i = 6 * 40; i < wrenches.size(); ++i) wrenches[i] = 0.0;
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

GRAVITAS_PLUGIN(FewBodies)
