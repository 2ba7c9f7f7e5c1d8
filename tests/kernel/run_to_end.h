// What the tests of whole runs share.
#pragma once

#include <gtest/gtest.h>

#include <string>
#include <vector>

#include "kernel/environment.h"
#include "plugin_sdk/slots.h"

namespace gravitas {

inline void step(kernel::Environment* world) {
  ASSERT_EQ(world->step(), kernel::StepOutcome::kCommitted) << world->fault()->fault.text();
}

inline void run_to_end(kernel::Environment* world) {
  while (world->step_count() < world->total_steps()) ASSERT_NO_FATAL_FAILURE(step(world));
}

// But those of slow calls, which a busy machine makes of any.
inline std::vector<std::string> warnings_but_of_slow_calls(kernel::Environment* world) {
  std::vector<std::string> all = world->warnings();
  std::erase_if(all, [](const std::string& one) { return one.find(": it was slow ") != std::string::npos; });
  return all;
}

}  // namespace gravitas
