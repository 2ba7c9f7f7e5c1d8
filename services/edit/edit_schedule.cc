#include "services/edit/edit_schedule.h"

#include <fmt/format.h>

#include <algorithm>

#include "services/recorder/journal.h"
#include "services/run/file_names.h"

namespace gravitas {

void EditSchedule::leave_out_past(std::uint32_t step, const std::vector<edit::v1::Edit>& journal) {
  // one may have been made before a step that was not
  const std::uint32_t done = made_.empty() ? step : std::max(step, made_.back().step());
  for (const edit::v1::Edit& one : to_come_)
    if (one.step() <= done &&
        !std::ranges::any_of(made_, [&](const edit::v1::Edit& made) { return is_same_edit(made, one); }))
      throw BadInput(
          fmt::format("--edit before step {}: the run that the checkpoint of step {} belongs to was not edited so; "
                      "allowed: what it was edited by, and later edits",
                      one.step(), step));
  std::erase_if(to_come_, [&](const edit::v1::Edit& one) { return one.step() <= done; });
  const std::vector<edit::v1::Edit> ordered = to_come_;
  for (const edit::v1::Edit& one : journal)
    if (std::ranges::find(ordered, one.step(), &edit::v1::Edit::step) == ordered.end()) to_come_.push_back(one);
  std::ranges::stable_sort(to_come_, {}, &edit::v1::Edit::step);
}

void EditSchedule::rehearse(const RunOptions& options, scene::v1::Scene scene,
                            kernel::EnvironmentDescription description, Catalog* catalog) const {
  for (edit::v1::Edit edit : to_come_) {
    const EditedScene edited(options, scene, description, catalog, &edit, nullptr);
    scene = edited.scene();
    description = edited.description();
    require_separate_files(options, scene, to_come_);
  }
}

std::optional<edit::v1::Edit> EditSchedule::take_due(std::uint32_t step) {
  if (to_come_.empty() || to_come_.front().step() != step) return std::nullopt;
  std::optional<edit::v1::Edit> due = std::move(to_come_.front());
  to_come_.erase(to_come_.begin());
  return due;
}

}  // namespace gravitas
