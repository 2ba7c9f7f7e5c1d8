// A run to its end, which nobody interrupts and nobody looks at.
#pragma once

#include "services/run/session.h"

namespace gravitas::harness {

inline RunResult run_quietly(const RunOptions& options) {
  return run(
      options, [] { return false; }, [](const Progress&) {});
}

}  // namespace gravitas::harness
