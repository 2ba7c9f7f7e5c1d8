// The Sequential solver as a plugin: its declaration and settings. What it computes stands in
// sequential.h.
#include "plugin_sdk/plugin.h"

#include "workers/solver/sequential/sequential_islands.h"

namespace gravitas {
namespace {

constexpr double kLargestFactor = 1.95;

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
    declaration.properties = {
        Property::integer("Iterations")
            .at_least(1.0)
            .at_most(100000.0)
            .defaults_to({static_cast<double>(SequentialSettings{}.iterations)})
            .live()
            .means("Largest number of sweeps of one relaxation; fewer where it converges, of joints without contacts "
                   "ten times as many."),
        Property::number("CorrectionFactor", "1")
            .at_least(0.0)
            .at_most(1.0)
            .defaults_to({SequentialSettings{}.correction_factor})
            .live()
            .means("Share of the joint error and overlap of the step before that a step removes; "
                   "what one step adds is always removed whole."),
        Property::choice("Order", {"Given", "DeepestFirst", "Simultaneous"})
            .defaults_to({static_cast<double>(SequentialSettings{}.order)})
            .live()
            .means("How a sweep goes: joints, then contacts, by their bodies; the largest error "
                   "first, kept up to date (what few sweeps leave does not go by how bodies are "
                   "numbered); or all from the velocities that the sweep began with "
                   "(what is symmetric stays so in every sweep, but for contacts of one pair, which go in "
                   "turn where they slide; takes several times as many)."),
        Property::number("RelaxationFactor", "1")
            .above(0.0)
            .at_most(kLargestFactor)
            .defaults_to({SequentialSettings{}.relaxation_factor})
            .live()
            .means("How far locks and contacts go, of the way to where they are right: below 1 "
                   "careful, 1.5 to 1.9 fewer sweeps for stacks and chains; sliding contacts "
                   "may not converge above 1."),
        Property::choice("ShockPropagation", {"Never", "Stacks", "Always"})
            .defaults_to({static_cast<double>(SequentialSettings{}.shock_propagation)})
            .live()
            .means("Starts contacts layer by layer from what is immovable: of stacks (each body "
                   "rests on one other, no joints) that is the solution at any height and ratio "
                   "of mass; Always: of all that rests, where it is closer than the step "
                   "before."),
        Property::flag("NesterovAcceleration")
            .defaults_to({SequentialSettings{}.nesterov_acceleration ? 1.0 : 0.0})
            .live()
            .means("Sweeps go on from where they are going: of n bodies in a row some n of them in "
                   "place of n^2. Where RelaxationFactor is 1.")};
    return declaration;
  }

  explicit Sequential(PropertyCursor settings) : solver_(settings_from(settings)) {}

  void solve(const stage::SolverSolveRequest& request, const stage::SolverSolveReply& reply, Host& host) override {
    solver_.solve(request, reply, host);
  }

 private:
  static SequentialSettings settings_from(PropertyCursor settings) {
    const std::int64_t iterations = settings.integer();
    const double correction_factor = settings.number();
    if (iterations < 1 || iterations > 100000) throw Refusal("Iterations is outside 1 ... 100000");
    if (!(correction_factor >= 0.0 && correction_factor <= 1.0)) throw Refusal("CorrectionFactor is outside 0 ... 1");
    const std::uint32_t order = settings.choice();
    const double relaxation_factor = settings.number();
    const std::uint32_t shock_propagation = settings.choice();
    const bool nesterov_acceleration = settings.flag();
    if (order > 2) throw Refusal("Order is none of Given, DeepestFirst, Simultaneous");
    if (shock_propagation > 2) throw Refusal("ShockPropagation is none of Never, Stacks, Always");
    if (!(relaxation_factor > 0.0 && relaxation_factor <= kLargestFactor))
      throw Refusal("RelaxationFactor is outside 0 ... 1.95");
    return {static_cast<std::uint32_t>(iterations),
            correction_factor,
            static_cast<RelaxationOrder>(order),
            relaxation_factor,
            static_cast<ShockPropagation>(shock_propagation),
            nesterov_acceleration};
  }

  SequentialIslands solver_;
};

}  // namespace

GRAVITAS_PLUGIN(Sequential)

}  // namespace gravitas
