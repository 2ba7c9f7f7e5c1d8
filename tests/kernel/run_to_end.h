// What the tests of whole runs share.
#pragma once

#include <gtest/gtest.h>

#include "kernel/environment.h"
#include "plugin_sdk/slots.h"

namespace gravitas {

inline void step(kernel::Environment* world) {
  ASSERT_EQ(world->step(), kernel::StepOutcome::kCommitted) << world->fault()->fault.text();
}

inline void run_to_end(kernel::Environment* world) {
  while (world->step_count() < world->total_steps()) ASSERT_NO_FATAL_FAILURE(step(world));
}

}  // namespace gravitas
