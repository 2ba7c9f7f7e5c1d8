#include "services/campaign/table.h"

#include <fmt/format.h>

#include <algorithm>

#include "plugin_sdk/counted.h"

namespace gravitas::campaign {
namespace {

constexpr std::size_t kShownFailures = 20;

v1::Quantiles quantiles(std::vector<double> values) {
  v1::Quantiles result;
  if (values.empty()) return result;
  std::ranges::sort(values);
  result.set_count(values.size());
  result.set_median(values[values.size() / 2]);
  result.set_p99(values[values.size() * 99 / 100]);
  result.set_max(values.back());
  return result;
}

void count(const v1::Fault& fault, v1::Row* row) {
  row->set_injected(row->injected() + 1);
  const std::string& outcome = fault.outcome();
  if (outcome == "M") return row->set_masked(row->masked() + 1);
  if (outcome == "B") return row->set_recovered(row->recovered() + 1);
  if (outcome == "F") return row->set_fallback(row->fallback() + 1);
  if (outcome == "Q") return row->set_paused(row->paused() + 1);
  if (outcome == "needs re-run") return row->set_needs_rerun(row->needs_rerun() + 1);
  if (outcome == "not caught") return row->set_not_caught(row->not_caught() + 1);
  row->set_forbidden(row->forbidden() + 1);
}

std::string quantile_line(const char* what, const v1::Quantiles& one) {
  return fmt::format("{:<34} {:>8}   median {:>9.1f} us   p99 {:>9.1f} us   max {:>9.1f} us\n", what, one.count(),
                     one.median(), one.p99(), one.max());
}

}  // namespace

void Tally::add(const v1::Trial& trial, const std::string& command) {
  ++trials_;
  unprovoked_ += static_cast<std::uint64_t>(trial.unprovoked_size());
  for (const std::string& one : trial.unprovoked())
    if (unexplained_.size() < kShownFailures) unexplained_.push_back(fmt::format("{}: {}", command, one));
  for (const v1::Fault& fault : trial.faults()) {
    ++injected_;
    manifested_ += fault.outcome() != "M";
    const bool is_escaped = fault.outcome() == "not caught";
    wrong_values_ += is_escaped || (fault.group() == "values" && fault.outcome() == "B");
    not_caught_ += is_escaped;
    if (is_escaped && failures_.size() < kShownFailures)
      failures_.push_back(fmt::format("{}: {} in slot {} was not noticed", command, fault.order(), fault.slot()));
    v1::Row& row = rows_[fault.group()];
    row.set_group(fault.group());
    count(fault, &row);
  }
  standby_.insert(standby_.end(), trial.standby_us().begin(), trial.standby_us().end());
  cold_start_.insert(cold_start_.end(), trial.cold_start_us().begin(), trial.cold_start_us().end());
  swap_pause_.insert(swap_pause_.end(), trial.swap_pause_us().begin(), trial.swap_pause_us().end());
  if (trial.forbidden().empty()) return;
  ++forbidden_;
  if (failures_.size() < kShownFailures) failures_.push_back(fmt::format("{}: {}", command, trial.forbidden(0)));
}

v1::Table Tally::table() const {
  v1::Table table;
  table.set_injected(injected_);
  table.set_manifested(manifested_);
  table.set_trials(trials_);
  table.set_forbidden(forbidden_);
  table.set_unprovoked(unprovoked_);
  if (manifested_ > 0)
    table.set_forbidden_bound(std::min(
        1.0, (forbidden_ > 0 ? 3.0 * static_cast<double>(forbidden_) + 1.0 : 3.0) / static_cast<double>(manifested_)));
  table.set_wrong_values(wrong_values_);
  table.set_not_caught(not_caught_);
  for (const auto& [group, row] : rows_) *table.add_rows() = row;
  *table.mutable_standby() = quantiles(standby_);
  *table.mutable_cold_start() = quantiles(cold_start_);
  *table.mutable_swap_pause() = quantiles(swap_pause_);
  for (const std::string& failure : failures_) table.add_failures(failure);
  for (const std::string& one : unexplained_) table.add_unexplained(one);
  return table;
}

bool is_passed(const v1::Table& table) {
  const double most = kMayEscape * static_cast<double>(table.wrong_values());
  return table.forbidden() == 0 && static_cast<double>(table.not_caught()) <= most;
}

std::string table_text(const v1::Table& table) {
  std::string text =
      fmt::format("{:<10} {:>9} {:>9} {:>10} {:>9} {:>7} {:>13} {:>11} {:>10}\n", "group", "injected", "M masked",
                  "B bit same", "F fallbk", "Q pause", "needs re-run", "not caught", "forbidden");
  for (const v1::Row& row : table.rows())
    text += fmt::format("{:<10} {:>9} {:>9} {:>10} {:>9} {:>7} {:>13} {:>11} {:>10}\n", row.group(), row.injected(),
                        row.masked(), row.recovered(), row.fallback(), row.paused(), row.needs_rerun(),
                        row.not_caught(), row.forbidden());
  text += fmt::format("\n{} injected, {} manifested, in {} ({} tier, seed {}) and {:.1f} s\n",
                      counted(table.injected(), "fault"), table.manifested(), counted(table.trials(), "trial"),
                      table.tier(), table.seed(), table.seconds());
  text += table.forbidden() == 0
              ? fmt::format("nothing forbidden happened: with 95 % confidence at most {:.2g} of faults\n",
                            table.forbidden_bound())
              : counted(table.forbidden(), "trial") + " with something forbidden\n";
  if (table.wrong_values() > 0)
    text += fmt::format("{} of {} wrong values were not noticed without an ordered re-run ({:.3g} %; {:g} % may be)\n",
                        table.not_caught(), table.wrong_values(),
                        100.0 * static_cast<double>(table.not_caught()) / static_cast<double>(table.wrong_values()),
                        100.0 * kMayEscape);
  if (table.unprovoked() > 0)
    text += fmt::format("{} besides, which no fault explains{}\n", counted(table.unprovoked(), "failed call"),
                        table.tier() == "real" ? " (a busy machine's deadlines)" : "");
  for (const std::string& one : table.unexplained()) text += "  " + one + "\n";
  if (table.logged() > 0 && table.tier() != "real")
    text += fmt::format(
        "trials.jsonl holds {} of {} trials: those in which something was neither masked nor recovered bit for bit\n",
        table.logged(), table.trials());
  if (table.tier() == "real") {
    text += quantile_line("noticed -> answered by a standby", table.standby());
    text += quantile_line("noticed -> answered, after a start", table.cold_start());
    text += quantile_line("swap: pause of the simulation", table.swap_pause());
  }
  for (const std::string& failure : table.failures()) text += failure + "\n";
  return text;
}

}  // namespace gravitas::campaign
