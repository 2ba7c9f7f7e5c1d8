// The Sequential solver as a plugin: its declaration and settings. What it computes stands in
// sequential.h.
#include "plugin_sdk/plugin.h"

#include "workers/solver/sequential/sequential.h"

namespace gravitas {
namespace {

class Sequential final : public SolverPlugin {
 public:
  static PluginDeclaration declaration() {
    PluginDeclaration declaration;
    declaration.name = "Sequential";
    declaration.version = "1.0.0";
    declaration.slot = kSlot;
    declaration.meaning =
        "Joints and contacts by relaxation: every row is solved in turn, with accumulated, clamped "
        "multipliers, until nothing moves any more.";
    declaration.properties = {Property::integer("Iterations")
                                  .at_least(1.0)
                                  .at_most(100000.0)
                                  .defaults_to({static_cast<double>(SequentialSettings{}.iterations)})
                                  .live()
                                  .means("Largest number of sweeps of one relaxation; fewer where it converges."),
                              Property::number("CorrectionFactor", "1")
                                  .at_least(0.0)
                                  .at_most(1.0)
                                  .defaults_to({SequentialSettings{}.correction_factor})
                                  .live()
                                  .means("Share of the joint error and overlap of the step before that a step removes; "
                                         "what one step adds is always removed whole.")};
    return declaration;
  }

  explicit Sequential(PropertyCursor settings) : solver_(settings_from(settings)) {}

  void solve(const stage::SolverSolveRequest& request, const stage::SolverSolveReply& reply, Host&) override {
    solver_.solve(request, reply);
  }

 private:
  static SequentialSettings settings_from(PropertyCursor settings) {
    const std::int64_t iterations = settings.integer();
    const double correction_factor = settings.number();
    if (iterations < 1 || iterations > 100000) throw Refusal("Iterations is outside 1 ... 100000");
    if (!(correction_factor >= 0.0 && correction_factor <= 1.0)) throw Refusal("CorrectionFactor is outside 0 ... 1");
    return {static_cast<std::uint32_t>(iterations), correction_factor};
  }

  SequentialSolver solver_;
};

}  // namespace

GRAVITAS_PLUGIN(Sequential)

}  // namespace gravitas
