// Simulator `Smooth`: Basic's step for jointed bodies that touch nothing, with derivatives that know the joints.
//
//   S_n -> integrate: S*, asking for wrenches: forces -> discrepancies of the trial state -> reactions (solver)
//       -> constrain -> solve -> commit S_{n+1}
//
// The integrator gets the reactions among the wrenches and need not know of joints: it integrates the index-1 form of
// the equations and keeps its order. What that leaves of joint errors, in position and velocity, is of the size of the
// method's own error; the solve at the end projects it away along M^-1 J^T. Springs of joints are among the reactions, so
// that their stiffness bounds the step of an explicit method; the solve is told to leave them alone (kForcesApplied).
#include <algorithm>

#include "kernel/environment.h"

namespace gravitas::kernel {

void Environment::ask_reactions() {
  ask_discrepancies(data_.derivative_time, data_.derivative_position, data_.derivative_orientation,
                    data_.derivative_linear_velocity, data_.derivative_angular_velocity);
  for (const auto& [body, curve] : model_.curves) {
    const Twist change = curve.at(data_.derivative_time[0]).change;
    set_vector(data_.kinematic_acceleration.span(), 2 * body, change.linear);
    set_vector(data_.kinematic_acceleration.span(), 2 * body + 1, change.angular);
  }
  const auto request = reaction_request();
  const auto reply = ids(data_.reaction, data_.discrepancy_force, data_.reaction_residual);
  data_.discrepancy_force.resize(3 * data_.discrepancies.mode.size());
  ask(Stage::kSolve, &solver_, {stage::Method::kSolverReactions, 0, request, reply}, nullptr,
      [&](const auto& answer) { return validator_.reactions(answer); });
  std::ranges::transform(data_.wrench.span(), data_.reaction.span(), data_.wrench_with_reactions.data(), std::plus());
}

}  // namespace gravitas::kernel
