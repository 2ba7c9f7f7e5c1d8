#include "services/run/summary.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <cstdint>

#include "plugin_sdk/counted.h"
#include "services/run/report.h"

namespace gravitas {
namespace {

// Bodies and joints that are named one by one.
constexpr std::size_t kMostNamed = 4;

std::string story(const report::v1::Report& report, const std::vector<EventLog::Meeting>& meetings) {
  std::string text;
  for (std::size_t i = 0; i < meetings.size() && i < kMostNamed; ++i) {
    text += fmt::format("{}{} met {} at {:.3f} s ({:.2f} m/s)", i == 0 ? "" : ", ", meetings[i].body, meetings[i].with,
                        meetings[i].time, meetings[i].speed);
  }
  if (meetings.size() > kMostNamed) text += fmt::format(" and {} more", meetings.size() - kMostNamed);
  const auto tell_drives = [&](const auto& drives, const char* moves, const char* unit) {
    for (int i = 0; i < drives.size() && i < static_cast<int>(kMostNamed); ++i)
      text += fmt::format("{}{} {} at {:.6g} {} (set: {:.6g})", text.empty() ? "" : "; ", drives[i].constraint(), moves,
                          drives[i].speed(), unit, drives[i].target());
  };
  tell_drives(report.drives(), "turns", "rad/s");
  tell_drives(report.sliding_drives(), "slides", "m/s");
  if (report.events().break_() > 0)
    text += fmt::format("{}{} broke", text.empty() ? "" : "; ", counted(report.events().break_(), "joint"));
  return text;
}

std::string hosts(const report::v1::Plan& plan) {
  std::uint32_t processes = 0;
  std::string names;
  for (const report::v1::PlannedSlot& slot : plan.slots()) {
    names += fmt::format("{}{}={}", names.empty() ? "" : ", ", slot.slot(), slot.plugin());
    processes = std::max(processes, slot.process());
  }
  return processes == 0 ? fmt::format("in this process: {}", names)
                        : fmt::format("{}: {}", counted(processes, "worker process", "worker processes"), names);
}

// Faults that were survived, swaps and edits; of faults and edits a line each for the first ones.
std::string exchanges(const report::v1::Report& report) {
  std::string text;
  int survived = 0;
  const auto is_lost = [](const report::v1::FaultRecord& fault) { return fault.recovered_by().starts_with("none"); };
  // what was ordered for a step before
  const auto is_late = [](const report::v1::FaultRecord& fault) {
    return !fault.ordered().empty() &&
           (fault.ordered() + ",").find(fmt::format("@step={},", fault.step())) == std::string::npos;
  };
  // in a step that was given up
  const auto is_open = [&](const report::v1::FaultRecord& fault) {
    return report.outcome() == "interrupted" && fault.step() > report.steps() && fault.recovery_us() == 0.0;
  };
  // what a plugin says itself, and not what was done to its worker
  const auto words = [&](const report::v1::FaultRecord& fault) {
    const std::string order = is_late(fault) ? fault.ordered() : fault.ordered().empty() ? fault.text() : "";
    return order.empty() ? order : " (" + order + ")";
  };
  for (const report::v1::FaultRecord& fault : report.faults()) {
    if (is_open(fault)) {
      text += fmt::format("  interrupted: step {}, {} {}: {}{}; nobody had answered instead\n", fault.step(),
                          fault.slot(), fault.plugin(), fault.kind(), words(fault));
      continue;
    }
    // nor what came before another in a step that ended the run
    if (std::ranges::any_of(report.faults(), [&](const report::v1::FaultRecord& other) {
          return is_lost(other) && other.step() == fault.step() && other.slot() == fault.slot();
        }))
      continue;
    if (++survived <= static_cast<int>(kMostNamed))
      text += fmt::format("  survived: step {}, {} {}: {}{}; {} took over in {:.3g} ms\n", fault.step(), fault.slot(),
                          fault.plugin(), fault.kind(), words(fault), fault.recovered_by(), 1e-3 * fault.recovery_us());
  }
  if (survived > static_cast<int>(kMostNamed))
    text += fmt::format("  survived: {}\n", counted(survived - static_cast<int>(kMostNamed), "more fault"));
  for (const report::v1::FaultRecord& fault : report.faults())
    if (const std::string names = fallback_of(fault.recovered_by()); !names.empty())
      text += fmt::format("  another plugin from step {} on: {}, {} instead of {}\n", fault.step(), fault.slot(), names,
                          fault.plugin());
  for (const report::v1::SwapRecord& swap : report.swaps())
    text += fmt::format("  swap before step {}: {} {} -> {}, {}{}\n", swap.step(), swap.slot(), swap.from(), swap.to(),
                        swap.outcome(), swap.reason().empty() ? "" : ": " + swap.reason());
  const int edits = std::min(report.edits_size(), static_cast<int>(kMostNamed));
  for (int i = 0; i < edits; ++i) text += fmt::format("  {}\n", edit_line(report.edits(i)));
  if (report.edits_size() > edits) text += fmt::format("  {}\n", counted(report.edits_size() - edits, "more edit"));
  for (const report::v1::SwapRecord& one : report.comparisons())
    text += fmt::format("  compared{}: {} {} with {}: {}{}\n",
                        one.step() > 1 ? fmt::format(" from step {} on", one.step()) : "", one.slot(), one.from(),
                        one.to(), comparison_text(one.shadow(), one.from(), one.to()),
                        one.reason().empty() ? "" : "; it ended: " + one.reason());
  return text;
}

}  // namespace

std::string summarize(const report::v1::Report& report, const std::vector<EventLog::Meeting>& meetings) {
  std::string text = fmt::format("{}: {:.6g} s in {}, {}, {:.3f} s of wall time (median {:.1f} us a step)\n",
                                 report.scene(), report.simulated_seconds(), counted(report.steps(), "step"),
                                 counted(report.bodies(), "body", "bodies"), report.wall_seconds(),
                                 report.microseconds_per_step().median());
  const std::string happened = story(report, meetings);
  if (!happened.empty()) text += "  " + happened + "\n";
  const auto energy = [](double number) {
    return std::isnan(number) ? "not known" : std::isinf(number) ? "not finite" : fmt::format("{:.6g}", number);
  };
  text += fmt::format("  energy {} -> {} J, contacts up to {:.2g} m deep, joint error <= {:.2g} m\n",
                      energy(report.energy().initial()), energy(report.energy().final()), report.max_penetration(),
                      report.max_joint_error());
  text += exchanges(report);
  text += fmt::format("  {}\n  chain hash {}\n", hosts(report.plan()), report.chain_hash());
  return text;
}

}  // namespace gravitas
