// A fault that a worker is ordered to commit, to test who calls it.
#pragma once

#include <cstdint>
#include <string>

#include "plugin_sdk/plugin.h"

namespace gravitas::kernel {

struct FaultInjection {
  Slot slot = Slot::kSolver;
  std::string order;        // "slow,factor=10": kinds and arguments are those of plugin_sdk/host/fault_kinds.h
  std::uint32_t step = 1;   // that is being made when it happens
  std::uint32_t times = 1;  // attempts at the first call of that step which are hit
};

}  // namespace gravitas::kernel
