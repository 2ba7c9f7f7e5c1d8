#include "services/survey/frame_file.h"

#include <algorithm>
#include <utility>

#include "services/recorder/json.h"
#include "services/survey/picture.h"

namespace gravitas::survey {

FrameFile::FrameFile(const std::string& path, Surveyor* surveyor, std::vector<Kind> kinds, double interval)
    : file_("instrumentation", path),
      instrumentation_(surveyor),
      kinds_(std::move(kinds)),
      sampling_(interval),
      title_(surveyor->description().id) {}

void FrameFile::offer(const kernel::Environment& environment, bool last) {
  const bool is_due = sampling_.is_due(environment, last);
  if (!is_picture()) {
    if (!is_due) return;
    const Frame frame = instrumentation_->frame(environment, kinds_);
    note_missing(frame);
    file_.write(to_json(frame, JsonForm::kLine));
    return;
  }
  // on the way the lines of trajectories alone
  const auto trajectory = std::ranges::find(kinds_, instrumentation::v1::KIND_TRAJECTORY);
  if (is_due && trajectory != kinds_.end())
    picture_.MergeFrom(instrumentation_->frame(environment, {instrumentation::v1::KIND_TRAJECTORY}));
  if (!last || drawn_step_ == environment.step_count()) return;
  drawn_step_ = environment.step_count();
  std::vector<Kind> others = kinds_;
  std::erase(others, instrumentation::v1::KIND_TRAJECTORY);
  const Frame frame = instrumentation_->frame(environment, others);
  note_missing(frame);
  picture_.MergeFrom(frame);
}

void FrameFile::note_missing(const Frame& frame) {
  for (const std::string& reason : frame.missing())
    if (std::ranges::find(missing_, reason) == missing_.end()) missing_.push_back(reason);
}

void FrameFile::close() {
  if (file_.is_open() && is_picture()) file_.write(picture(picture_, title_));
  file_.close();
}

}  // namespace gravitas::survey
