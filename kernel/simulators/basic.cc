// Simulator `Basic`: the seed's retroactive pipeline (§ 3.13). Bodies first move as if they were free; where that
// went wrong (overlap, joint error, velocity into a contact) is then put right in one solve.
//
//   S_n -> integrate (asks for forces): S* -> bounds -> broad phase -> narrow phase at S*
//       -> constrain -> solve -> commit S_{n+1} -> events
#include "kernel/environment.h"

namespace gravitas::kernel {

void Environment::run_basic() {
  begin_step();
  const Trusted<TrialState> trial = integrate();
  if (!has_reactions()) {
    commit_trial(trial);
    return;
  }
  if (has_contacts()) {
    bound_bodies(trial);
    look_up_contacts(find_contacts(find_pairs()));
  }
  if (constraint_.is_running()) constrain(trial);
  commit_solution(solve());
}

}  // namespace gravitas::kernel
