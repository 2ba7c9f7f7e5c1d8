#include "services/survey/survey_files.h"

#include <fmt/format.h>

#include "plugin_sdk/slots.h"

namespace gravitas::survey {

SurveyFiles::SurveyFiles(const kernel::EnvironmentDescription& description, const kernel::HostStarter& starter)
    : starter_(starter) {
  surveyor_.emplace(description, starter_);
}

void SurveyFiles::open(const std::string& instrumentation, const std::vector<Kind>& kinds, const std::string& joints,
                       double interval) {
  if (!instrumentation.empty()) frames_.emplace(instrumentation, &*surveyor_, kinds, interval);
  if (!joints.empty()) joints_.emplace(joints, &*surveyor_, interval);
}

void SurveyFiles::begin_again(const kernel::EnvironmentDescription& description) {
  note_faults(&past_);
  surveyor_.emplace(description, starter_);
  for_each([&](auto& file) { file.begin_again(&*surveyor_); });
}

void SurveyFiles::note_faults(std::vector<std::string>* warnings) {
  const char* const what = !joints_ ? "instrumentation" : !frames_ ? "joints" : "instrumentation and joints";
  for (const Slot slot : kSlots)
    for (const kernel::FaultRecord& failed : surveyor_->slot(slot).faults())
      warnings->push_back(
          fmt::format("{}: slot {}, plugin {}: {}; {}", what, slot_name(slot), failed.fault.plugin, failed.fault.text(),
                      failed.recovered_by.empty() ? "nobody else answered" : "asked again: " + failed.recovered_by));
}

std::vector<std::string> SurveyFiles::warnings() {
  std::vector<std::string> warnings = past_;
  if (frames_)
    for (const std::string& reason : frames_->missing()) warnings.push_back("instrumentation lacks " + reason);
  if (joints_)
    for (const std::string& reason : joints_->missing()) warnings.push_back("joints lacks " + reason);
  note_faults(&warnings);
  return warnings;
}

}  // namespace gravitas::survey
