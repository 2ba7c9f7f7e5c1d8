// Simulator `Smooth`: Basic's step for jointed bodies that touch nothing, with derivatives that know the joints.
//
//   S_n -> integrate: S*, asking for wrenches: forces -> discrepancies of the trial state -> reactions (solver)
//       -> constrain -> solve -> commit S_{n+1}
//
// The integrator gets the reactions among the wrenches and need not know of joints: it integrates the index-1 form of
// the equations and keeps its order. What that leaves of joint errors, in position and velocity, is of the size of the
// method's own error; the solve at the end projects it away along M^-1 J^T.
#include <algorithm>

#include "kernel/environment.h"

namespace gravitas::kernel {

// Why a plugin cannot serve this simulator; empty if it can.
std::string Environment::why_unfit(const PluginDeclaration& plugin) const {
  const bool can = std::ranges::find(plugin.capabilities, "reactions") != plugin.capabilities.end();
  if (!knows_reactions() || plugin.slot != Slot::kSolver || can) return {};
  return "the simulator Smooth needs a solver with the capability 'reactions' (Direct and Newton have it), and " +
         plugin.name + " has it not";
}

void Environment::ask_reactions() {
  ask_discrepancies(trial_columns_);
  for (const auto& [body, curve] : model_.curves) {
    const Twist change = curve.at(data_.derivative_time[0]).change;
    set_vector(data_.kinematic_acceleration.span(), 2 * body, change.linear);
    set_vector(data_.kinematic_acceleration.span(), 2 * body + 1, change.angular);
  }
  const DiscrepancyAnswer& joints = data_.discrepancies;
  const std::array<ColumnId, stage::SolverReactionsRequest::kColumnCount> request = {model_.flags.id(),
                                                                                     model_.inverse_mass.id(),
                                                                                     model_.inertia.id(),
                                                                                     model_.inverse_inertia.id(),
                                                                                     model_.damping.id(),
                                                                                     trial_columns_[1],
                                                                                     trial_columns_[2],
                                                                                     trial_columns_[3],
                                                                                     trial_columns_[4],
                                                                                     data_.wrench.id(),
                                                                                     data_.kinematic_acceleration.id(),
                                                                                     data_.discrepancy_body.id(),
                                                                                     joints.point1.id(),
                                                                                     joints.point2.id(),
                                                                                     joints.velocity.id(),
                                                                                     joints.correction.id(),
                                                                                     joints.axes.id(),
                                                                                     joints.mode.id(),
                                                                                     joints.lower.id(),
                                                                                     joints.upper.id(),
                                                                                     joints.compliance.id(),
                                                                                     joints.damping.id(),
                                                                                     joints.maximum_force.id()};
  const std::array<ColumnId, 3> reply = {data_.reaction.id(), data_.discrepancy_force.id(),
                                         data_.reaction_residual.id()};
  data_.discrepancy_force.resize(3 * joints.mode.size());
  ask(Stage::kSolve, &solver_, {stage::Method::kSolverReactions, 0, request, reply}, nullptr,
      [&](const auto& answer) { return validator_.reactions(answer); });
  std::ranges::transform(data_.wrench.span(), data_.reaction.span(), data_.wrench_with_reactions.data(), std::plus());
}

}  // namespace gravitas::kernel
