#include "services/survey/joint_file.h"

#include <fmt/format.h>

#include <algorithm>
#include <utility>

#include "services/recorder/csv.h"

namespace gravitas::survey {

std::string joint_row(double time, const std::string& joint, const std::string& coordinate, double value, double rate) {
  // + 0.0 turns -0 into 0
  return fmt::format("{:.17g},{},{},{:.17g},{:.17g}\n", time, csv_quoted(joint), coordinate, value + 0.0, rate + 0.0);
}

JointFile::JointFile(const std::string& path, Surveyor* surveyor, double interval)
    : file_("joints", path), surveyor_(surveyor), sampling_(interval) {}

void JointFile::begin() {
  if (!std::exchange(has_begun_, true)) file_.write(kJointHead);
}

void JointFile::offer(const kernel::Environment& environment, bool last) {
  if (!sampling_.is_due(environment, last)) return;
  begin();
  std::vector<std::string> missing;
  for (const JointCoordinate& one : surveyor_->coordinates(environment, &missing))
    file_.write(joint_row(environment.time(), surveyor_->description().constraints[one.joint].id, one.name, one.value,
                          one.rate));
  for (std::string& reason : missing)
    if (std::ranges::find(missing_, reason) == missing_.end()) missing_.push_back(std::move(reason));
}

}  // namespace gravitas::survey
