// Says that it knows the reactions of joints, and answers that there are none.
#include "plugin_sdk/plugin.h"

#include "plugin_sdk/body.h"
#include "plugin_sdk/checks.h"
#include "plugin_sdk/solver.h"
#include "tests/faulty/faulty_solver.h"

namespace {

using namespace gravitas;

class IdleReactions final : public SolverPlugin {
 public:
  static PluginDeclaration declaration() {
    return {.name = "IdleReactions",
            .version = "1.0",
            .slot = Slot::kSolver,
            .meaning = "Misbehaves on purpose.",
            .capabilities = {"owns_motion", "reactions"}};
  }
  explicit IdleReactions(PropertyCursor) {}

  void solve(const stage::SolverSolveRequest& request, const stage::SolverSolveReply& reply, Host&) override {
    refuse_bad_input(request);
    for (std::size_t i = 0; i < request.flags().size(); ++i) {
      for (std::size_t k = 3 * i; k < 3 * i + 3; ++k) {
        reply.linear_velocity().push(request.trial_linear_velocity()[k]);
        reply.angular_velocity().push(request.trial_angular_velocity()[k]);
      }
      reply.pose_change().push(0, 0, 0, 0, 0, 0);
    }
    for (std::size_t i = 0; i < request.mode().size(); ++i) {
      reply.discrepancy_impulse().push(0, 0, 0);
      reply.discrepancy_correction().push(0, 0, 0);
    }
    for (std::size_t i = 0; i < request.contact_depth().size(); ++i) {
      reply.contact_impulse().push(0, 0, 0);
      reply.contact_turning().push(0, 0, 0);
      for (std::size_t k = 3 * i; k < 3 * i + 3; ++k) reply.contact_direction().push(request.contact_normal()[k]);
      reply.contact_correction().push(0.0);
    }
    reply.iterations().set(0);
    reply.residual().set(0.0);
    reply.stop_reason().set(static_cast<std::uint32_t>(StopReason::kNothingToDo));
  }

  void reactions(const stage::SolverReactionsRequest& request, const stage::SolverReactionsReply& reply,
                 Host&) override {
    for (const std::span<const double> column :
         {request.position(), request.angular_velocity(), request.wrench(), request.point1()})
      if (first_not_finite(column) != kNoRow) throw Refusal("a number is not finite");
    const std::size_t bodies = request.flags().size();
    for (const std::uint32_t body : request.discrepancy_body())
      if (body >= bodies && body != kNone) throw Refusal("a joint names a body that does not exist");
    for (std::size_t i = 0; i < bodies; ++i) reply.reaction().push(0, 0, 0, 0, 0, 0);
    for (std::size_t i = 0; i < request.mode().size(); ++i) reply.discrepancy_force().push(0, 0, 0);
    reply.residual().set(0.0);
  }
};

}  // namespace

GRAVITAS_PLUGIN(IdleReactions)
