// Finds what holds by the joints of the state that it is asked about, whatever they tell of the start.
#include <algorithm>
#include <array>

#include "plugin_sdk/solver/end_of_step.h"
#include "plugin_sdk/solver/reactions.h"

namespace {

using namespace gravitas;

class ForgetsStart final : public SolverPlugin {
 public:
  static PluginDeclaration declaration() {
    return {.name = "ForgetsStart",
            .version = "1.0",
            .slot = Slot::kSolver,
            .meaning = "Misbehaves on purpose.",
            .capabilities = {"reactions"}};
  }
  explicit ForgetsStart(PropertyCursor) {}

  void solve(const stage::SolverSolveRequest& request, const stage::SolverSolveReply& reply, Host& host) override {
    solve_end_of_step(request, {}, reply, host);
  }

  void reactions(const stage::SolverReactionsRequest& request, const stage::SolverReactionsReply& reply,
                 Host&) override {
    using Request = stage::SolverReactionsRequest;
    std::array<gravitas_column, Request::kColumnCount> columns;
    std::copy_n(request.plain(), columns.size(), columns.begin());
    for (std::size_t i = Request::kStartPoint1; i <= Request::kStartAcceleration; ++i) columns[i].count = 0;
    solve_reactions(Request(columns.data()), reply);
  }
};

}  // namespace

GRAVITAS_PLUGIN(ForgetsStart)
