// One trial: a short run with faults, judged step by step against the quiet run.
#pragma once

#include <string>
#include <vector>

#include "gravitas/campaign/v1/campaign.pb.h"
#include "services/campaign/trial_plan.h"

namespace gravitas::campaign {

struct TrialOptions {
  Tier tier = Tier::kReal;
  kernel::Defences defences = {};
  bool confirms = true;    // another process is asked where no law of physics tells
  double deadline = 0.25;  // s, of a call
};

// Switches a defence off, for the self-test. Throws BadInput for a name that is none.
void leave_out_defence(const std::string& name, TrialOptions* options);

// Never throws for what the run does: that is `forbidden` in the answer. The real tier looks for processes and mappings
// that are left over in this process, so one trial is made at a time.
v1::Trial run_trial(const TrialPlan& plan, const Scene& scene, const TrialOptions& options);

}  // namespace gravitas::campaign
