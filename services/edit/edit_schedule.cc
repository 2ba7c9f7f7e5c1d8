#include "services/edit/edit_schedule.h"

#include <fmt/format.h>

#include <algorithm>
#include <stdexcept>
#include <string>

#include "kernel/plan.h"
#include "services/recorder/journal.h"
#include "services/run/fault_desk.h"
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
                            kernel::EnvironmentDescription description, Catalog* catalog) {
  for (std::size_t i = 0; i < to_come_.size(); ++i) {
    edit::v1::Edit edit = to_come_[i];
    const EditedScene edited(options, scene, description, catalog, &edit, nullptr);
    scene = edited.scene();
    description = edited.description();
    require_separate_files(options, scene, to_come_);
    try {
      kernel::EnvironmentDescription planned = description;
      left_out_.push_back(kernel::make_plan(&planned).left_out);
    } catch (const std::invalid_argument& problem) {
      throw BadInput(fmt::format("--edit before step {}: {}", edit.step(), problem.what()));
    }
  }
}

void EditSchedule::require_slots(const Orders& orders) const {
  for (std::size_t i = 0; i < left_out_.size(); ++i) {
    const std::uint32_t edit = to_come_[i].step();
    const auto is_between = [&](std::uint32_t step) {
      return step >= edit && (i + 1 == to_come_.size() || step < to_come_[i + 1].step());
    };
    const auto require = [&](Slot slot, const std::string& order) {
      const auto found = std::ranges::find(left_out_[i], slot_name(slot), &kernel::LeftOut::what);
      if (found != left_out_[i].end())
        throw BadInput(
            fmt::format("{}: after the edit before step {} the plan leaves the slot out: {}", order, edit, found->why));
    };
    for (const kernel::SwapOrder& one : orders.swaps)
      if (is_between(one.step))
        require(one.slot,
                fmt::format("swap {}={} at step {}", slot_name(one.slot), one.plugin.declaration.name, one.step));
    for (const kernel::SwapOrder& one : orders.comparisons)
      require(one.slot, fmt::format("--compare {}={}", slot_name(one.slot), one.plugin.declaration.name));
    for (const kernel::FaultInjection& one : orders.faults)
      if (is_between(one.step)) require(one.slot, "--fault " + fault_text(one));
  }
}

std::optional<edit::v1::Edit> EditSchedule::take_due(std::uint32_t step) {
  if (to_come_.empty() || to_come_.front().step() != step) return std::nullopt;
  std::optional<edit::v1::Edit> due = std::move(to_come_.front());
  to_come_.erase(to_come_.begin());
  return due;
}

}  // namespace gravitas
