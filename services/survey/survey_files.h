// The files of a run for which its plugins are asked beside it: debug geometry (frame_file.h) and coordinates of joints
// (joint_file.h). Both ask the same hosts.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "services/survey/frame_file.h"
#include "services/survey/joint_file.h"
#include "services/survey/surveyor.h"

namespace gravitas::survey {

class SurveyFiles {
 public:
  // As for Surveyor. No file yet.
  SurveyFiles(const kernel::EnvironmentDescription& description, const kernel::HostStarter& starter);

  // No file where a name is empty; `interval` as in Sampling. Throws std::system_error if one cannot be made.
  void open(const std::string& instrumentation, const std::vector<Kind>& kinds, const std::string& joints,
            double interval);

  // Calls use(file) for each that is open.
  void for_each(auto use) {
    if (frames_) use(*frames_);
    if (joints_) use(*joints_);
  }

  void offer(const kernel::Environment& environment, bool last) {
    for_each([&](auto& file) { file.offer(environment, last); });
  }

  // A plugin was exchanged in the run.
  void follow(const kernel::Decision& decision) { surveyor_->follow(decision); }
  // The scene was edited.
  void begin_again(const kernel::EnvironmentDescription& description);

  // What failed beside the run, and what the files lack, for people.
  std::vector<std::string> warnings();

 private:
  void note_faults(std::vector<std::string>* warnings);

  const kernel::HostStarter starter_;
  std::optional<Surveyor> surveyor_;
  std::optional<FrameFile> frames_;
  std::optional<JointFile> joints_;
  std::vector<std::string> past_;  // warnings of the scene before an edit
};

}  // namespace gravitas::survey
