// Exchanging a plugin, its settings or its hosting while the simulation runs:
//
//   prepare (a host starts beside the run) -> shadow (asked too, compared, not used) -> cut over at a step boundary
//   -> probation (the old host stays warm) -> committed, or rolled back by itself
//
// The run waits for the preparation and, in the steps of the shadow, for the answers that are compared (ten times the
// longest call so far, or 100 ms, at most: then it goes on without a shadow). A plugin that fails in preparation or
// shadow never touches the run.
#pragma once

#include <cstdint>
#include <memory>
#include <optional>
#include <string>

#include "kernel/description.h"
#include "kernel/shadow.h"
#include "kernel/spare.h"

namespace gravitas::kernel {

struct SwapOrder {
  Slot slot = Slot::kSolver;
  PluginChoice plugin;             // in a list slot it takes the place of the plugin whose types it declares
  std::optional<Hosting> hosting;  // as before if absent
  std::uint32_t step = 0;          // cut over before this step is made; a step of the past: before the next
  bool has_taken_over = false;     // in a run before: no probation, none to go back to, no fallback on itself
};

enum class SwapState : std::uint32_t { kPreparing, kShadow, kProbation, kCommitted, kRolledBack, kRefused };

struct SwapRecord {
  Slot slot;
  std::uint32_t step;    // first step that the new host makes
  std::string from, to;  // plugins, with library and hosting where these change
  bool only_compared = false;
  // Of a comparison: the step from which on `from` answers; 0: since it began. Of others before there is another record.
  std::uint32_t since = 0;
  SwapState state = SwapState::kPreparing;
  std::string reason;     // why it was refused or rolled back
  double pause_us = 0.0;  // the cut-over alone
  double wait_us = 0.0;   // for the preparation
  Comparison shadow;
};

// Steps before the cut-over in which the new host is asked, too.
inline constexpr std::uint32_t kShadowSteps = 8;

// A swap on its way to the cut-over.
struct PendingSwap {
  SwapOrder order;
  std::size_t record;          // of the slot's records
  std::size_t host;            // of the slot's hosts
  std::uint32_t target;        // of the slot's plugins
  SlotDescription next;        // what the host will be
  std::uint32_t revision = 0;  // of the host, which `next` goes by
  std::unique_ptr<Spare> spare;
  std::unique_ptr<Carrier> candidate;  // prepared
  Shadow shadow;
  bool only_compare = false;  // it stays in shadow
  bool may_shadow = true;
  bool is_in_shadow = false;
};

}  // namespace gravitas::kernel
