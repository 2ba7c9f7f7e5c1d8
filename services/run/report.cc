#include "services/run/report.h"

#include <fmt/format.h>

#include <algorithm>
#include <iterator>
#include <map>
#include <string_view>
#include <utility>
#include <vector>

#include "kernel/slot_host.h"
#include "plugin_sdk/counted.h"
#include "plugin_sdk/host/fault_kinds.h"
#include "services/run/kernel_names.h"
#include "services/run/omissions.h"
#include "services/scene/refusal.h"

namespace gravitas {
namespace {

// A worker that cannot change its reply as it was ordered to says that it failed.
bool was_injected(const kernel::FaultRecord& record) {
  const auto kind = std::ranges::find(host::fault_kinds(), record.injected, &host::FaultInfo::name);
  if (kind == host::fault_kinds().end()) return false;
  return record.fault.kind != kernel::FaultKind::kFailure || (kind->group != "values" && kind->group != "wire");
}

// Other plugins make other trajectories: whoever reads one should know.
std::string exchange_warning(const kernel::FaultRecord& record) {
  const std::string begin =
      fmt::format("from step {} on slot {} is answered by ", record.step, slot_name(record.fault.slot));
  const std::string end = fmt::format(", since {} failed: {} ({})", record.fault.plugin, record.fault.text(),
                                      was_injected(record) ? record.injected : fault_kind_name(record.fault.kind));
  if (const std::string names = fallback_of(record.recovered_by); !names.empty())
    return fmt::format("{}the fallback {} instead of {}{}: the trajectory is not that of {}", begin, names,
                       record.fault.plugin, end, record.fault.plugin);
  if (record.recovered_by == "previous build") return begin + "the plugin from before its last swap" + end;
  if (record.recovered_by == "rollback")
    return begin + "the plugin from before its last swap, which is rolled back" + end;
  return {};
}

bool is_to_come(const report::v1::SwapRecord& swap) {
  return swap.outcome() == swap_state_name(kernel::SwapState::kPreparing) ||
         swap.outcome() == swap_state_name(kernel::SwapState::kShadow);
}

}  // namespace

void write_stages(const kernel::Environment& environment, report::v1::Report* report) {
  for (std::uint32_t i = 0; i < static_cast<std::uint32_t>(kernel::Stage::kCount); ++i) {
    const auto stage = static_cast<kernel::Stage>(i);
    const DurationHistogram& time = environment.stage_time(stage);
    if (time.count() == 0) continue;
    report::v1::StageTiming* timing = report->add_stages();
    timing->set_stage(kernel::stage_name(stage));
    timing->set_calls(static_cast<std::uint32_t>(time.count()));
    timing->set_median_us(time.quantile_us(0.5));
    timing->set_p99_us(time.quantile_us(0.99));
    timing->set_transport_median_us(environment.transport_time(stage).quantile_us(0.5));
    timing->set_validation_median_us(environment.validation_time(stage).quantile_us(0.5));
  }
  const DurationHistogram& steps = environment.step_time();
  report::v1::Durations* durations = report->mutable_microseconds_per_step();
  durations->set_mean(steps.mean_us());
  durations->set_median(steps.quantile_us(0.5));
  durations->set_p99(steps.quantile_us(0.99));
  durations->set_max(steps.max_us());
}

void write_faults(const kernel::Environment& environment, report::v1::Report* report) {
  for (const kernel::FaultRecord& record : environment.faults()) {
    report::v1::FaultRecord* fault = report->add_faults();
    fault->set_step(record.step);
    fault->set_slot(slot_name(record.fault.slot));
    fault->set_kind(was_injected(record) ? record.injected : fault_kind_name(record.fault.kind));
    if (!record.injected.empty() && !was_injected(record))
      report->add_warnings(fmt::format("fault {} of step {} in slot {} was not injected: {}", record.injected,
                                       record.step, slot_name(record.fault.slot), record.fault.text()));
    fault->set_detected_by(record.fault.detected_by);
    fault->set_recovered_by(record.recovered_by.empty() ? "none: paused" : record.recovered_by);
    fault->set_recovery_us(record.recovery_us);
    if (std::string warning = exchange_warning(record); !warning.empty()) report->add_warnings(std::move(warning));
    fault->set_plugin(record.fault.plugin);
    fault->set_text(record.fault.text());
  }
}

void note_edit(const edit::v1::Edit& edit, report::v1::Report* report) {
  report::v1::EditRecord* record = report->add_edits();
  record->set_step(edit.step());
  record->set_changes(static_cast<std::uint32_t>(edit.changes_size()));
  for (const edit::v1::Change& change : edit.changes())
    record->add_texts(change.has_add()      ? "add " + change.add().name()
                      : change.has_remove() ? "remove " + change.remove()
                                            : "set " + change.set());
}

std::string fallback_of(const std::string& recovered_by) {
  constexpr std::string_view kMark = "fallback ";
  return recovered_by.starts_with(kMark) ? recovered_by.substr(kMark.size()) : "";
}

std::string pause_text(const kernel::EnvironmentDescription& description, const kernel::FaultRecord& record,
                       bool is_poisoned) {
  const Slot slot = record.fault.slot;
  std::string text =
      fmt::format("step {}: slot {}, plugin {}: {} ({})", record.step, slot_name(slot), record.fault.plugin,
                  scene::refusal_text(description, record.fault), fault_kind_name(record.fault.kind));
  // a request that is to blame is said to be kept, and so is one that hung, by which the slot has used up the rest
  if (is_poisoned && record.fault.kind != kernel::FaultKind::kDeadline) return text;
  return text + fmt::format(
                    "; nobody else is asked, since slot {} has used up its Failures = {} (failed calls and starts, "
                    "each with fewer than {} good answers after the one before)",
                    slot_name(slot), description.slot(slot).failures, kernel::SlotHost::kGoodAnswers);
}

std::string edit_line(const report::v1::EditRecord& edit) {
  return fmt::format("edit before step {}: {}", edit.step(), counted(edit.changes(), "change"));
}

void write_disagreement(const Disagreement& from, report::v1::Disagreement* to) {
  to->set_quantity(fmt::format("{} {}", stage::method_info(from.method).name, from.column->name));
  to->set_largest(from.largest);
  to->set_relative(from.relative);
  to->set_row(from.largest_row);
  to->set_unit(from.column->unit);
  to->set_rows(from.rows);
  to->set_other_counts(from.other_counts);
}

void write_comparison(const Comparison& from, const kernel::Environment& environment, report::v1::Comparison* to) {
  to->set_calls(from.calls);
  to->set_differing_calls(from.differing_calls);
  to->set_refused_calls(from.refused_calls);
  to->set_first_refusal(from.first_refusal);
  const std::uint64_t answered = from.calls - from.refused_calls;
  const double per_call = answered == 0 ? 0.0 : 1e-3 / static_cast<double>(answered);
  to->set_from_us(per_call * static_cast<double>(from.first_ns));
  to->set_to_us(per_call * static_cast<double>(from.second_ns));
  for (const Disagreement& one : from.disagreements) {
    report::v1::Disagreement* disagreement = to->add_disagreements();
    write_disagreement(one, disagreement);
    if (std::string_view(one.column->rows) == "body" && one.largest_row < environment.model().body_count)
      disagreement->set_body(environment.model().body_id[one.largest_row]);
  }
}

std::string comparison_text(const report::v1::Comparison& comparison, const std::string& from, const std::string& to) {
  if (comparison.calls() == 0) return "no answer was compared";
  const std::string refused = comparison.refused_calls() == 0
                                  ? ""
                                  : fmt::format(" (in {} {})", comparison.refused_calls(), comparison.first_refusal());
  return fmt::format("{} of {} answers differ{}; {} {:.3g} us, {} {:.3g} us a call", comparison.differing_calls(),
                     comparison.calls(), refused, from, comparison.from_us(), to, comparison.to_us());
}

std::string disagreement_text(const report::v1::Disagreement& disagreement) {
  const auto& one = disagreement;
  const std::string row = fmt::format("row {}{}", one.row(), one.body().empty() ? "" : ", " + one.body());
  std::string apart;
  if (one.relative() > 0.0)
    apart = fmt::format("{:.3g}{} apart at most, {:.3g} of the largest ({})", one.largest(),
                        one.unit() == "1" ? "" : " " + one.unit(), one.relative(), row);
  else if (one.rows() > 0)
    apart = fmt::format("{} ({})", counted(one.rows(), "row differs", "rows differ"), row);
  if (one.other_counts() > 0)
    apart += fmt::format("{}{} another number of rows", apart.empty() ? "" : "; ", counted(one.other_counts(), "time"));
  return one.quantity() + ": " + apart;
}

void write_swaps(const kernel::Environment& environment, std::span<const recorder::v1::Decision> taken_over,
                 report::v1::Report* report) {
  const int known = report->swaps_size();
  for (const kernel::SwapRecord& one : environment.swaps()) {
    const auto is_it = [&](const recorder::v1::Decision& decision) {
      return decision.step() == one.step && decision.slot() == slot_name(one.slot) &&
             decision.plugin() == plugin_of(one.to);
    };
    const bool is_told = is_in_place(swap_state_name(one.state)) && std::ranges::any_of(taken_over, is_it);
    if (!one.only_compared && (is_told || renew_swap(one, report->mutable_swaps(), known))) continue;
    report::v1::SwapRecord* swap = one.only_compared ? report->add_comparisons() : report->add_swaps();
    swap->set_step(std::max(one.step, one.since));
    swap->set_slot(slot_name(one.slot));
    swap->set_from(one.from);
    swap->set_to(one.to);
    swap->set_pause_us(one.pause_us);
    swap->set_wait_us(one.wait_us);
    swap->set_outcome(swap_state_name(one.state));
    swap->set_reason(one.reason);
    write_comparison(one.shadow, environment, swap->mutable_shadow());
  }
  std::ranges::stable_sort(*report->mutable_comparisons(), {}, &report::v1::SwapRecord::step);
}

recorder::v1::Tally tally_of(const kernel::Environment& environment, std::span<const recorder::v1::Decision> taken_over,
                             const report::v1::Report& before, const Figures& figures, const EventLog& events) {
  recorder::v1::Tally tally;
  figures.write(&tally);
  events.write(&tally);
  report::v1::Report all;
  *all.mutable_swaps() = before.swaps();
  write_swaps(environment, taken_over, &all);
  for (report::v1::SwapRecord& swap : *all.mutable_swaps()) {
    // those of later steps are ordered again
    const bool is_refused = swap.outcome() == swap_state_name(kernel::SwapState::kRefused);
    if (swap.step() <= environment.step_count() + (is_refused ? 0 : 1) && !is_to_come(swap))
      *tally.add_swaps() = std::move(swap);
  }
  return tally;
}

report::v1::Plan plan_message(const kernel::Environment& environment,
                              const kernel::EnvironmentDescription& description) {
  report::v1::Plan message;
  std::vector<int> processes;
  for (const kernel::PlannedSlot& planned : environment.plan().slots) {
    std::uint32_t number = 0;
    if (planned.hosting != kernel::Hosting::kDirect) {
      auto process = std::ranges::find(processes, planned.process_id);
      if (process == processes.end()) process = processes.insert(process, planned.process_id);
      number = static_cast<std::uint32_t>(process - processes.begin()) + 1;
    }
    for (const std::string& plugin : planned.plugins) {
      report::v1::PlannedSlot* slot = message.add_slots();
      slot->set_slot(slot_name(planned.slot));
      slot->set_plugin(plugin);
      slot->set_hosting(kernel::hosting_name(planned.hosting));
      slot->set_pid(planned.process_id);
      slot->set_process(number);
      slot->set_standby(planned.standbys);
      slot->set_attached(planned.is_attached);
      for (const std::string& one : planned.sandbox) slot->add_sandbox(one);
    }
  }
  std::vector<kernel::LeftOut> left_out = environment.plan().left_out;
  std::ranges::move(omissions(environment, description), std::back_inserter(left_out));
  for (const kernel::LeftOut& one : left_out) {
    report::v1::LeftOut* out = message.add_left_out();
    out->set_what(one.what);
    out->set_why(one.why);
  }
  return message;
}

void fold_warnings(report::v1::Report* report) {
  std::map<std::string, int> times;
  for (const std::string& warning : report->warnings()) ++times[warning];
  report::v1::Report folded;
  for (const std::string& warning : report->warnings())
    if (const int all = std::exchange(times[warning], 0); all > 0)
      folded.add_warnings(all > 1 ? fmt::format("{} ({} times)", warning, all) : warning);
  report->mutable_warnings()->Swap(folded.mutable_warnings());
}

}  // namespace gravitas
