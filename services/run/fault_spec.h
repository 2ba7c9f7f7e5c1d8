// `--fault SLOT:KIND@step=N[,ARGUMENT=VALUE]...`: a fault that a worker is told to commit.
#pragma once

#include <string>

#include "kernel/fault.h"

namespace gravitas {

// Reads a specification: `solver:kill@step=100`, `solver:slow@step=5,factor=10,times=2`, or with the arguments beside
// the kind, `solver:slow,factor=10@step=5`. `step` is needed and at least 1, `times` is 1 where it is not given; the
// rest is the worker's order, checked as the worker will check it (plugin_sdk/host/fault_kinds.h). Throws BadInput,
// naming what was wrong and what is allowed.
kernel::FaultInjection parse_fault(const std::string& specification);

// The kinds with their meanings and arguments, for help: a line each, grouped.
std::string fault_help();

}  // namespace gravitas
