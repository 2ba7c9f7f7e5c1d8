// What the report of a run takes from its environment.
#pragma once

#include <span>
#include <string>

#include "gravitas/edit/v1/edit.pb.h"
#include "gravitas/recorder/v1/checkpoint.pb.h"
#include "gravitas/report/v1/report.pb.h"
#include "kernel/environment.h"
#include "plugin_sdk/slots.h"
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
// With those of before: what a checkpoint keeps of them.
void write_swaps(const kernel::Environment& environment, std::span<const recorder::v1::Decision> taken_over,
                 const report::v1::Report& before, recorder::v1::Tally* tally);
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

// True of one that was made and not taken back.
template <typename Message>
bool is_in_place(const Message& swap) {
  return swap.outcome() == swap_state_name(kernel::SwapState::kProbation) ||
         swap.outcome() == swap_state_name(kernel::SwapState::kCommitted);
}

// How a swap stands now, in the last of these messages that is of it; false if none is.
template <typename Messages>
bool renew_swap(const kernel::SwapRecord& record, Messages* messages, int count) {
  for (int i = count; i-- > 0;) {
    auto& one = (*messages)[i];
    if (!is_in_place(one) || one.slot() != slot_name(record.slot) || one.step() != record.step ||
        plugin_of(one.to()) != plugin_of(record.to))
      continue;
    // of a step that was broken off it is made again
    if (record.state == kernel::SwapState::kPreparing || record.state == kernel::SwapState::kShadow) return true;
    one.set_outcome(swap_state_name(record.state));
    one.set_reason(record.reason);
    return true;
  }
  return false;
}

}  // namespace gravitas
