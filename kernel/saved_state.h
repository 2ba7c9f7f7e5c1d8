// A committed state on its way out of an environment and back: plain columns by name, and what identifies them. How
// they are kept is the business of a recorder; the kernel says what there is, and checks what comes back.
#pragma once

#include <cstdint>
#include <span>
#include <string_view>
#include <variant>
#include <vector>

#include "plugin_sdk/plugin.h"
#include "plugin_sdk/trajectory_hash.h"

namespace gravitas::kernel {

// Largest overlap (m) and joint error (m; rad count as m) of the state that the last step committed, of who was awake.
struct CommitFigures {
  double penetration = 0.0;
  double joint_error = 0.0;
};

// What the ladder of a slot (slot_host.h) knows of the failures of a plugin's host.
struct Budget {
  std::uint32_t failures = 0, failures_in_a_row = 0;
  std::uint64_t good_answers = 0;  // since the last failure
};

struct SavedBudget {
  Slot slot;
  std::uint32_t target;  // of the slot's plugins
  Budget budget;
};

struct SavedColumn {
  std::string_view name;  // as in kernel/state.h
  std::variant<std::span<const double>, std::span<const std::uint32_t>, std::span<const std::uint64_t>> numbers;
};

struct SavedState {
  std::uint32_t step = 0;    // number of the state, counted from t = 0
  double step_length = 0.0;  // s, of the step that led to it; 0 for the initial state
  bool is_anew = false;      // of the scene, or made by an edit: no step
  Hash state_hash, chain_hash;
  CommitFigures figures;
  std::vector<std::uint32_t> wake_orders;  // bodies that are awake with the next step
  std::vector<SavedColumn> columns;        // all of State::visit_columns(), in its order
  std::vector<SavedBudget> budgets = {};   // those with failures
};

}  // namespace gravitas::kernel
