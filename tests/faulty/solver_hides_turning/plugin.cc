// Solves rolling and spinning friction, and tells nobody what they turn.
#include "plugin_sdk/plugin.h"

#include <algorithm>

#include "plugin_sdk/solver/end_of_step.h"

namespace {

using namespace gravitas;

class HidesTurning final : public SolverPlugin {
 public:
  static PluginDeclaration declaration() {
    return {.name = "HidesTurning", .version = "1.0", .slot = Slot::kSolver, .meaning = "Misbehaves on purpose."};
  }
  explicit HidesTurning(PropertyCursor) {}

  void solve(const stage::SolverSolveRequest& request, const stage::SolverSolveReply& reply, Host& host) override {
    solve_end_of_step(request, ConeSettings{}, reply, host);
    std::ranges::fill(reply.contact_turning().resize(3 * request.contact_key().size()), 0.0);
  }
};

}  // namespace

GRAVITAS_PLUGIN(HidesTurning)
