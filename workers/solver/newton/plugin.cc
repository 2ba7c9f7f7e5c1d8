// The Newton solver: joints and contacts together, at the end of the step, to rounding, at any mass ratio.
//
// Where the rows are taken: plugin_sdk/solver/end_of_step.h. How they are solved: semi-smooth Newton on Coulomb's cone after
// the joints have been eliminated by a sparse L D L^T, plugin_sdk/solver/cone_problem.h (kNewton), with the equations and
// their source; where its steps do not settle, from guesses along the central path (cone_path.h).
//
// Order: S_{n+1} is of first order in h (with the simulator Smooth, that of the integrator); what holds at its end holds to
// Tolerance. Stability: rigid rows at every h and mass ratio, springs and dampers of joints at every stiffness (implicit
// Euler; with Smooth they are the integrator's). Cost: cubic in the rows of contacts, limits and drives of an island (dense;
// beyond 900 of them accelerated projected sweeps, ten for each of `Iterations`, whose convergence is linear), linear in a
// chain's joints.
// Known failures: Coulomb friction with large coefficients at long arms (Painlevé) may have no solution or several; then
// `stop_reason` and `residual` say so. Random heaps that slide and turn under up to 10,000 times their mass are all solved
// (1600 of 1600; 1599 of 1600 with rolling and spinning friction), under a million times 395 of 400; walls of some 50 bricks
// that fall apart are left at 1e-6 to 1e-8 m/s. Irregular reach cones are closed to the third order of what turns round them in
// the step, all else to rounding.
#include "plugin_sdk/solver/end_of_step.h"
#include "plugin_sdk/solver/reactions.h"

namespace gravitas {
namespace {

class Newton final : public SolverPlugin {
 public:
  static PluginDeclaration declaration() {
    PluginDeclaration declaration;
    declaration.name = "Newton";
    declaration.version = "1.0.0";
    declaration.slot = kSlot;
    declaration.meaning =
        "Joints and contacts at the end of the step by semi-smooth Newton on the friction cone: accurate at any mass "
        "ratio.";
    declaration.capabilities = {"reactions", "reaction_jacobians"};
    declaration.properties = {
        Property::number("Tolerance", "1")
            .at_least(1e-15)
            .at_most(1e-2)
            .defaults_to({ConeSettings{}.tolerance})
            .live()
            .means("Largest violation of a law, as a share of the largest velocity that meets; one step more is taken "
                   "when it is reached."),
        Property::integer("Iterations")
            .at_least(1.0)
            .at_most(100000.0)
            .defaults_to({static_cast<double>(ConeSettings{}.iterations)})
            .live()
            .means("Largest number of steps of one solution; fewer where it converges. Of more than 368 rows of "
                   "contacts fewer, by "
                   "the cube of their number, down to a fifth.")};
    return declaration;
  }

  explicit Newton(PropertyCursor settings) {
    settings_.method = ConeMethod::kNewton;
    settings_.tolerance = settings.number();
    const std::int64_t iterations = settings.integer();
    if (!(settings_.tolerance >= 1e-15 && settings_.tolerance <= 1e-2))
      throw Refusal("Tolerance is outside 1e-15 ... 1e-2");
    if (iterations < 1 || iterations > 100000) throw Refusal("Iterations is outside 1 ... 100000");
    settings_.iterations = static_cast<std::uint32_t>(iterations);
  }

  void solve(const stage::SolverSolveRequest& request, const stage::SolverSolveReply& reply, Host& host) override {
    solve_end_of_step(request, settings_, reply, host);
  }

  void reactions(const stage::SolverReactionsRequest& request, const stage::SolverReactionsReply& reply,
                 Host&) override {
    solve_reactions(request, reply);
  }

  void reaction_jacobians(const stage::SolverReactionsRequest& request,
                          const stage::SolverReactionJacobiansReply& reply, Host&) override {
    differentiate_reactions(request, reply);
  }

 private:
  ConeSettings settings_;
};

}  // namespace

GRAVITAS_PLUGIN(Newton)

}  // namespace gravitas
