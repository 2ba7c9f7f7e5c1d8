// What Linux lets this process have, told before workers are started: gRPC hangs or aborts where it gets less.
#pragma once

#include "kernel/description.h"

namespace gravitas {

// Throws std::runtime_error if the description needs workers and they cannot be started, as far as that can be seen from
// here.
void require_workers(const kernel::EnvironmentDescription& description);

}  // namespace gravitas
