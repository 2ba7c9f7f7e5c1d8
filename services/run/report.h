// What the report of a run takes from its environment.
#pragma once

#include <span>
#include <string>
#include <string_view>

#include "gravitas/edit/v1/edit.pb.h"
#include "gravitas/recorder/v1/checkpoint.pb.h"
#include "gravitas/report/v1/report.pb.h"
#include "kernel/environment.h"
#include "plugin_sdk/slots.h"
#include "services/recorder/event_log.h"
#include "services/run/figures.h"
#include "services/run/kernel_names.h"

namespace gravitas {

// The plan as the report shows it, with what plugins need not do (omissions.h); process ids are those of the workers.
report::v1::Plan plan_message(const kernel::Environment& environment,
                              const kernel::EnvironmentDescription& description);

// Each adds its part.
void write_stages(const kernel::Environment& environment, report::v1::Report* report);
// With a warning where another plugin answers since.
void write_faults(const kernel::Environment& environment, report::v1::Report* report);
// Those that the report has, and that were made again where a run goes on or after an edit, are renewed: how they stand. None is
// what was `taken_over`, in the step that a decision tells (resumption.h).
void write_swaps(const kernel::Environment& environment, std::span<const recorder::v1::Decision> taken_over,
                 report::v1::Report* report);
// What a checkpoint keeps of the report. `before`: with the swaps of environments before this one.
recorder::v1::Tally tally_of(const kernel::Environment& environment, std::span<const recorder::v1::Decision> taken_over,
                             const report::v1::Report& before, const Figures& figures, const EventLog& events);
void write_comparison(const Comparison& from, const kernel::Environment& environment, report::v1::Comparison* to);
void note_edit(const edit::v1::Edit& edit, report::v1::Report* report);

// "edit before step 31: 2 changes".
std::string edit_line(const report::v1::EditRecord& edit);

// Without the body.
void write_disagreement(const Disagreement& from, report::v1::Disagreement* to);

// "3 of 100 answers differ; Sequential 12.3 us, Newton 45.6 us a call".
std::string comparison_text(const report::v1::Comparison& comparison, const std::string& from, const std::string& to);

// "Solver.Solve linear_velocity: 0.00123 m/s apart at most, 4.5e-06 of the largest (row 7, Ball)".
std::string disagreement_text(const report::v1::Disagreement& disagreement);

// Who took over, of a fault that was recovered by a fallback; else empty.
std::string fallback_of(const std::string& recovered_by);

// Why nobody could make a step: "step 20: slot solver, plugin …". `is_poisoned`: the request is to blame, else the slot has
// used up what it may fail.
std::string pause_text(const kernel::EnvironmentDescription& description, const kernel::FaultRecord& record,
                       bool is_poisoned);

// Warnings that are alike become the first of them, with their count: "… (275 times)".
void fold_warnings(report::v1::Report* report);

// The outcome of a swap that was made and not taken back.
inline bool is_in_place(std::string_view outcome) {
  return outcome == swap_state_name(kernel::SwapState::kProbation) ||
         outcome == swap_state_name(kernel::SwapState::kCommitted);
}

// How a swap stands now, in the last of the first `count` messages that is of it, rather one that is in place; false if none
// is. One that was refused or taken back stays so, and one that begins again, in a step that was broken off, as it was.
template <typename Messages>
bool renew_swap(const kernel::SwapRecord& record, Messages* messages, int count) {
  typename Messages::value_type* found = nullptr;
  for (int i = count; i-- > 0 && (found == nullptr || !is_in_place(found->outcome()));) {
    auto& one = (*messages)[i];
    const bool is_it = one.slot() == slot_name(record.slot) && one.step() == record.step &&
                       plugin_of(one.to()) == plugin_of(record.to);
    if (is_it && (found == nullptr || is_in_place(one.outcome()))) found = &one;
  }
  if (found == nullptr) return false;
  const std::string_view outcome = swap_state_name(record.state);
  const bool begins = record.state == kernel::SwapState::kPreparing || record.state == kernel::SwapState::kShadow;
  if (begins || !is_in_place(found->outcome()) || found->outcome() == outcome) return true;
  found->set_outcome(std::string(outcome));
  found->set_reason(record.reason);
  return true;
}

}  // namespace gravitas
