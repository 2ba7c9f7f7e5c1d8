// What a campaign counts: outcomes by group of kinds, and how long recoveries took.
#pragma once

#include <cstdint>
#include <map>
#include <string>
#include <vector>

#include "gravitas/campaign/v1/campaign.pb.h"

namespace gravitas::campaign {

class Tally {
 public:
  // `command` shows the trial again.
  void add(const v1::Trial& trial, const std::string& command);

  std::uint64_t injected() const { return injected_; }
  // Trials with something forbidden.
  std::uint64_t forbidden() const { return forbidden_; }
  // Recovery times, us.
  const std::vector<double>& standby() const { return standby_; }
  const std::vector<double>& cold_start() const { return cold_start_; }

  v1::Table table() const;

 private:
  std::uint64_t injected_ = 0, manifested_ = 0, trials_ = 0, forbidden_ = 0, unprovoked_ = 0;
  std::uint64_t wrong_values_ = 0, not_caught_ = 0;
  std::map<std::string, v1::Row> rows_;
  std::vector<double> standby_, cold_start_, swap_pause_;
  std::vector<std::string> failures_, unexplained_;
};

// Share of wrong values, above every tolerance, that may stay unnoticed where no re-run looks for them.
inline constexpr double kMayEscape = 1e-3;

// Nothing forbidden happened, and no more escaped than may.
bool is_passed(const v1::Table& table);

// For a person.
std::string table_text(const v1::Table& table);

}  // namespace gravitas::campaign
