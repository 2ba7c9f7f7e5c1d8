// Hosts whose calls end where somebody interrupts a run in the middle of a step. The step is given up: what was committed
// stays.
#pragma once

#include <functional>

#include "kernel/environment.h"

namespace gravitas {

// Instead of a call's answer.
struct StepInterrupted {};

// Hosts of `starter` that throw StepInterrupted instead of making a call, also one that an open Integrate call waits for,
// when `interrupted` says so. That must live as long as they do, and is asked in the thread that steps.
kernel::HostStarter interruptible(kernel::HostStarter starter, std::function<bool()> interrupted);

}  // namespace gravitas
