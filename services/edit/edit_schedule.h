// The edits of a run: those made, and those to come.
#pragma once

#include <cstdint>
#include <optional>
#include <span>
#include <vector>

#include "services/edit/edited_scene.h"

namespace gravitas {

class EditSchedule {
 public:
  // Of the command line, ascending.
  void plan(std::vector<edit::v1::Edit> edits) { to_come_ = std::move(edits); }
  // A run begins after that step, in the scene of the edits made: what is planned up to there is past, and what a journal
  // knows of later ones is planned, where the command line has none for that step. Throws BadInput for what is planned up to
  // there and was not made.
  void leave_out_past(std::uint32_t step, const std::vector<edit::v1::Edit>& journal);
  // Throws BadInput if one of those to come cannot be, as far as that can be said before. The catalogue learns their libraries.
  void rehearse(const RunOptions& options, scene::v1::Scene scene, kernel::EnvironmentDescription description,
                Catalog* catalog);
  // What is ordered of slots.
  struct Orders {
    std::span<const kernel::SwapOrder> swaps, comparisons;
    std::span<const kernel::FaultInjection> faults;
  };
  // Throws BadInput if one that was rehearsed leaves out a slot of which something is ordered for a step after it.
  void require_slots(const Orders& orders) const;

  // The next edit before that step, which is to come no more.
  std::optional<edit::v1::Edit> take_due(std::uint32_t step);
  void note(const edit::v1::Edit& edit) { made_.push_back(edit); }

  const std::vector<edit::v1::Edit>& made() const { return made_; }
  const std::vector<edit::v1::Edit>& to_come() const { return to_come_; }

 private:
  std::vector<edit::v1::Edit> made_, to_come_;          // ascending
  std::vector<std::vector<kernel::LeftOut>> left_out_;  // of the plan after each to come, as rehearsed
};

}  // namespace gravitas
