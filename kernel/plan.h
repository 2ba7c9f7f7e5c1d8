// The planner: which slots a scene needs, and why the others are left out. What is left out starts no process,
// has no columns and makes no call; the plan is exact, the trajectory's bits are those of the full pipeline.
#pragma once

#include <string>
#include <vector>

#include "kernel/description.h"

namespace gravitas::kernel {

struct LeftOut {
  std::string what;  // "solver", "force calls"
  std::string why;
};

// One host of a slot and the plugins it holds.
struct PlannedSlot {
  Slot slot;
  std::vector<std::string> plugins;
  Hosting hosting = Hosting::kSharedMemory;
  int process_id = 0;
  std::uint32_t standbys = 0;
  bool is_attached = false;          // started by hand; nothing has a deadline
  std::vector<std::string> sandbox;  // what keeps the process from harm, as it is enforced
};

struct Plan {
  std::vector<PlannedSlot> slots;
  std::vector<LeftOut> left_out;
};

// Removes from the description the plugins of slots that it does not need, and the energy of sleep where nothing can
// fall asleep, and says so.
Plan make_plan(EnvironmentDescription* description);

}  // namespace gravitas::kernel
