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
  double deadline = 0.25;  // s, of a call
};

// The defences that can be switched off for the self-test. Throws BadInput for another name.
kernel::Defences without_defence(const std::string& name);
std::vector<std::string> defence_names();

// Never throws for what the run does: that is `forbidden` in the answer. The real tier looks for processes and mappings
// that are left over in this process, so one trial is made at a time.
v1::Trial run_trial(const TrialPlan& plan, const Scene& scene, const TrialOptions& options);

}  // namespace gravitas::campaign
