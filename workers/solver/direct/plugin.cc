// The Direct solver: joints exactly, contacts by iteration.
//
// Where the rows are taken: plugin_sdk/solver/end_of_step.h. Joints are eliminated by a sparse L D L^T that bears
// dependent rows (plugin_sdk/solver/profile_ldlt.h); contacts, limits and drives feel each other through what is left
// and are solved by projected Gauss-Seidel sweeps, each contact exactly (plugin_sdk/solver/cone_problem.h,
// kGaussSeidel), or, with ContactSolver = "Newton", as Newton does. As long as nothing slides it takes Newton's steps in
// any case, and where sweeps do not converge: stacks stand at any ratio of mass, and what Newton solves is solved.
//
// Order: S_{n+1} is of first order in h (with the simulator Smooth, that of the integrator); joints are closed to
// rounding at every mass ratio. Sweeps converge linearly, the slower the more contacts carry one another: in piles that
// slide most are for nothing. `stop_reason` and `residual` say when steps, too, ran out. Other limits: those of Newton.
#include "plugin_sdk/solver/end_of_step.h"
#include "plugin_sdk/solver/reactions.h"

namespace gravitas {
namespace {

class Direct final : public SolverPlugin {
 public:
  static PluginDeclaration declaration() {
    PluginDeclaration declaration;
    declaration.name = "Direct";
    declaration.version = "1.0.0";
    declaration.slot = kSlot;
    declaration.meaning = "Joints exactly, by a sparse factorisation at the end of the step; contacts by iteration.";
    declaration.capabilities = {"reactions", "reaction_jacobians"};
    declaration.properties = {Property::choice("ContactSolver", {"GaussSeidel", "Newton"})
                                  .defaults_to({0.0})
                                  .live()
                                  .means("How contacts, limits and drives are solved once the joints are eliminated."),
                              Property::integer("Iterations")
                                  .at_least(1.0)
                                  .at_most(100000.0)
                                  .defaults_to({1000.0})
                                  .live()
                                  .means("Largest number of sweeps (Newton: steps) of one solution; fewer where it "
                                         "converges. Where sweeps do not, up to 500 steps follow. Above 900 rows of "
                                         "contacts ten times as many sweeps alone.")};
    return declaration;
  }

  explicit Direct(PropertyCursor settings) {
    settings_.method = settings.choice() == 0 ? ConeMethod::kGaussSeidel : ConeMethod::kNewton;
    const std::int64_t iterations = settings.integer();
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

GRAVITAS_PLUGIN(Direct)

}  // namespace gravitas
