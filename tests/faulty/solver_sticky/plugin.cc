// Pulls touching bodies together: every contact gets an impulse of -1 N s along its normal.
#include "plugin_sdk/plugin.h"

#include "plugin_sdk/body.h"
#include "tests/faulty/faulty_solver.h"

namespace {

using namespace gravitas;

class StickySolver final : public SolverPlugin {
 public:
  static PluginDeclaration declaration() {
    return {.name = "Sticky", .version = "1.0", .slot = Slot::kSolver, .meaning = "Misbehaves on purpose."};
  }
  explicit StickySolver(PropertyCursor) {}

  void solve(const stage::SolverSolveRequest& request, const stage::SolverSolveReply& reply, Host&) override {
    refuse_bad_input(request);
    const auto copy = [](std::span<const double> from, const stage::ReplyColumn<double>& to) {
      for (const double number : from) to.push(number);
    };
    copy(request.trial_linear_velocity(), reply.linear_velocity());
    copy(request.trial_angular_velocity(), reply.angular_velocity());
    for (std::size_t i = 0; i < 6 * request.flags().size(); ++i) reply.pose_change().push(0.0);
    for (std::size_t i = 0; i < 3 * request.mode().size(); ++i) {
      reply.discrepancy_impulse().push(0.0);
      reply.discrepancy_correction().push(0.0);
    }
    copy(request.contact_normal(), reply.contact_direction());
    for (std::size_t i = 0; i < request.contact_depth().size(); ++i) {
      const Vector3 impulse = -vector_at(request.contact_normal(), i);
      reply.contact_impulse().push(impulse.x(), impulse.y(), impulse.z());
      reply.contact_turning().push(0, 0, 0);
      reply.contact_correction().push(0.0);
    }
    reply.iterations().set(1);
    reply.residual().set(0.0);
    reply.stop_reason().set(0);
  }
};

}  // namespace

GRAVITAS_PLUGIN(StickySolver)
