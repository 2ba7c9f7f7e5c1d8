// Answers with far more numbers than it is asked with, and has bounds so large that a number more is the same number.
#include "plugin_sdk/integrator.h"

namespace gravitas {
namespace {

constexpr std::size_t kKept = 100'000;
constexpr double kFar = 1e17;  // beyond 2^53

class Roomy final : public IntegratorPlugin {
 public:
  static PluginDeclaration declaration() {
    return {.name = "Roomy",
            .version = "1.0",
            .slot = Slot::kIntegrator,
            .meaning = "Semi-implicit Euler that keeps much.",
            .capabilities = {"plugin_state"},
            .properties = {Property::number("Reach", "m")
                               .at_least(kFar)
                               .at_most(4.0 * kFar)
                               .defaults_to({2.0 * kFar})
                               .means("Nothing."),
                           Property::integer("Count").at_least(kFar).defaults_to({kFar}).means("Nothing.")},
            .theta = 1.0};
  }
  explicit Roomy(PropertyCursor) {}

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
    for (std::size_t i = 0; i < kKept; ++i) reply.plugin_state().push(h);
  }

 private:
  std::vector<double> room_;  // scratch
};

}  // namespace
}  // namespace gravitas

GRAVITAS_PLUGIN(gravitas::Roomy)
