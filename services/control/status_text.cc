#include "services/control/status_text.h"

#include <fmt/format.h>

#include <algorithm>

#include "services/run/report.h"

namespace gravitas::control {
namespace {

namespace api = control_api::v1;

// Swaps, edits and faults that a page shows.
constexpr int kMostListed = 5;

std::string duration_text(double microseconds) {
  return microseconds < 1000.0 ? fmt::format("{:.1f} us", microseconds) : fmt::format("{:.1f} ms", 1e-3 * microseconds);
}

std::string plan_table(const api::Plan& plan) {
  std::string text = fmt::format("{:<21} {:<20} {:<8} {:<8} {}\n", "slot", "plugin", "hosting", "pid", "settings");
  for (const api::PlannedSlot& slot : plan.slots()) {
    std::string settings;
    for (const api::Setting& one : slot.settings())
      settings += fmt::format("{}{}={}", settings.empty() ? "" : " ", one.name(), one.value());
    text +=
        fmt::format("{:<21} {:<20} {:<8} {:<8} {}\n", slot.slot(), slot.plugin(), slot.hosting(), slot.pid(), settings);
  }
  for (const report::v1::LeftOut& out : plan.left_out())
    text += fmt::format("{:<21} left out: {}\n", out.what(), out.why());
  return text;
}

// Of a comparison: a line for each quantity in which answers differed.
std::string differences(const api::ServedSwap& swap) {
  std::string text;
  if (!swap.compares()) return text;
  for (const report::v1::Disagreement& one : swap.shadow().disagreements())
    text += fmt::format("      {}\n", disagreement_text(one));
  return text;
}

}  // namespace

std::string status_line(const api::Status& status) {
  const bool is_running = status.state() == "running";
  return fmt::format("step {} of {}, t = {:.6g} of {:.6g} s, {}{}", status.step(), status.total_steps(), status.time(),
                     status.time_step() * status.total_steps(), status.state(),
                     is_running ? fmt::format(", {:.0f} steps/s", status.steps_per_second()) : "");
}

std::string swap_line(const api::ServedSwap& swap) {
  if (swap.compares()) {
    const std::string state = !swap.reason().empty()       ? "ended"
                              : swap.outcome() == "shadow" ? "comparing"
                                                           : swap.outcome();
    const bool any = swap.shadow().calls() > 0;
    return fmt::format("{}: {} {} beside {}, from step {} on: {}{}", state, swap.slot(), swap.to(), swap.from(),
                       swap.step(),
                       any ? comparison_text(swap.shadow(), swap.from(), swap.to()) : "nobody was asked yet",
                       swap.reason().empty() ? "" : "; " + swap.reason());
  }
  std::string text =
      fmt::format("{}: {} {} -> {}, before step {}", swap.outcome(), swap.slot(), swap.from(), swap.to(), swap.step());
  if (swap.pause_us() > 0.0)
    text += fmt::format("; pause {}, wait {}", duration_text(swap.pause_us()), duration_text(swap.wait_us()));
  return text + (swap.reason().empty() ? "" : "; " + swap.reason());
}

std::string waiting_line(const api::Status& status) {
  return fmt::format("step {} has taken {:.1f} s so far", status.step() + 1, status.waited());
}

std::string status_page(const api::Status& status) {
  const std::string speed = status.speed() == 0.0 ? "as fast as possible" : fmt::format("speed {:g}", status.speed());
  std::string text = fmt::format("{}, {}\n  {}\n", status.scene(), speed, status_line(status));
  if (status.waited() > 0.0) text += fmt::format("  {}; below is what was known before\n", waiting_line(status));
  if (!status.fault().empty()) text += fmt::format("  fault: {}\n", status.fault());
  if (!status.checkpoint().empty())
    text += fmt::format("  checkpoint: {}; {}\n", status.checkpoint(),
                        status.resume_command().empty() ? "a listener decided, so nobody goes on from it"
                                                        : "to go on: " + status.resume_command());
  text += fmt::format("  state hash {}\n  chain hash {}\n", status.state_hash(), status.chain_hash());
  text += plan_table(status.plan());
  const auto heading = [&](const char* what, std::uint32_t count) {
    if (count > 0) text += fmt::format("{}: {}{}\n", what, count, count > kMostListed ? ", the last ones" : "");
  };
  heading("swaps", status.swap_count());
  for (int i = std::max(0, status.swaps_size() - kMostListed); i < status.swaps_size(); ++i)
    text +=
        fmt::format("  {} {}\n{}", status.swaps(i).number(), swap_line(status.swaps(i)), differences(status.swaps(i)));
  heading("edits", status.edit_count());
  for (int i = std::max(0, status.edits_size() - kMostListed); i < status.edits_size(); ++i) {
    text += fmt::format("  {}", edit_line(status.edits(i)));
    for (int k = 0; k < status.edits(i).texts_size(); ++k)
      text += fmt::format("{}{}", k == 0 ? ": " : ", ", status.edits(i).texts(k));
    text += '\n';
  }
  heading("faults", status.fault_count());
  for (int i = std::max(0, status.faults_size() - kMostListed); i < status.faults_size(); ++i) {
    const report::v1::FaultRecord& fault = status.faults(i);
    text += fmt::format("  step {}, {} {}: {}{}; {}, {}\n", fault.step(), fault.slot(), fault.plugin(), fault.kind(),
                        fault.text().empty() ? "" : " (" + fault.text() + ")", fault.recovered_by(),
                        duration_text(fault.recovery_us()));
  }
  if (status.warning_count() > 0)
    text += fmt::format("warnings: {}, the last: {}\n", status.warning_count(), status.last_warning());
  return text;
}

}  // namespace gravitas::control
