// Hosts that tell of the calls that a run makes for itself.
#pragma once

#include <functional>

#include "kernel/environment.h"

namespace gravitas {

// Hosts of `starter` that say `on_call` before each call; not before those whose answers are only compared, nor before what
// these ask for in turn. That must live as long as they do, and is asked in the thread that steps.
kernel::HostStarter counting(kernel::HostStarter starter, std::function<void()> on_call);

}  // namespace gravitas
