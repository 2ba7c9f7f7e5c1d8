// Hosts that write down what they are asked: for `gravitas capture`.
#pragma once

#include <cstdint>
#include <memory>
#include <string>

#include "kernel/carrier/carrier.h"
#include "services/capsule/capsule.h"

namespace gravitas::capsule {

// Which calls are kept, and where. Belongs to the thread that makes the steps.
struct Tape {
  Slot slot = Slot::kSolver;
  std::uint32_t first_step = 1;
  std::uint32_t most_calls = ~0U;
  std::uint32_t step = 1;          // that is being made
  std::shared_ptr<Writer> writer;  // none: nothing is kept
  std::string problem;             // why there is none any more: a full disk ends the recording, not the run
};

// Makes hosts as kernel::start_host() does, which write their calls, and the answers, to the tape.
kernel::HostStarter recording(std::shared_ptr<Tape> tape);

}  // namespace gravitas::capsule
