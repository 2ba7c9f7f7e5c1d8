// Hosts that write down what they are asked: for `gravitas capture`.
#pragma once

#include <atomic>
#include <memory>

#include "kernel/carrier/carrier.h"
#include "services/capsule/capsule.h"

namespace gravitas::capsule {

// Which calls are kept.
struct Selection {
  Slot slot = Slot::kSolver;
  std::uint32_t first_step = 1;
  std::uint32_t most_calls = ~0U;
};

// Makes hosts as kernel::start_host() does; those of the slot write their calls, and the answers, to `writer`, with the
// number of the step that `step` says is being made. What cannot be written ends the run with std::system_error.
kernel::HostStarter recording(const Selection& selection, std::shared_ptr<Writer> writer,
                              std::shared_ptr<const std::atomic<std::uint32_t>> step);

}  // namespace gravitas::capsule
