// Simulator `Basic`: the seed's retroactive pipeline (§ 3.13). Bodies first move as if they were free; where that
// went wrong (overlap, joint error, velocity into a contact) is then put right in one solve.
//
//   S_n -> integrate (asks for forces): S* -> bounds -> broad phase -> narrow phase at S*
//       -> constrain -> solve -> commit S_{n+1} -> events
//
// A committed step is made of one or more inner steps: `Substeps` equal ones, and whatever a simulator makes of each.
#include "kernel/environment.h"

namespace gravitas::kernel {

void Environment::make_inner_steps() {
  if (!does_anything_move()) return;
  const double length = length_of_step(step_count_ + 1) / description_.substeps;
  for (std::uint32_t i = 0; i < description_.substeps && !must_restart_; ++i) {
    if (locates_events()) {
      locate_events(i * length, length);
    } else {
      begin_inner_step(i * length, length);
      const auto trial = integrate();
      if (has_reactions()) {
        if (const auto solution = react(trial)) commit_solution(*solution);
      } else {
        commit_trial(trial);
      }
    }
  }
}

std::optional<Trusted<Solution>> Environment::react(const Trusted<TrialState>& trial, bool has_found_contacts) {
  if (has_contacts() && !has_found_contacts) look_up_contacts(find_contacts(bound_and_pair(trial)));
  if (sleepers_ > 0 && wakes_sleepers()) return std::nullopt;
  if (constraint_.is_running()) constrain(trial);
  return solve();
}

}  // namespace gravitas::kernel
