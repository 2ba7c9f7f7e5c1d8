// `--fault SLOT:KIND@step=N[,ARGUMENT=VALUE]...`: a fault that a worker is told to commit.
#pragma once

#include <span>
#include <string>

#include "kernel/fault.h"
#include "kernel/swap.h"

namespace gravitas {

// Reads a specification: `solver:kill@step=100`, `solver:slow@step=5,factor=10,times=2`, or with the arguments beside
// the kind, `solver:slow,factor=10@step=5`. `step` is needed and at least 1, `times` is 1 where it is not given; the
// rest is the worker's order, checked as the worker will check it (plugin_sdk/host/fault_kinds.h), its column against the
// slot's replies. Throws BadInput, naming what was wrong and what is allowed.
kernel::FaultInjection parse_fault(const std::string& text);

// That of `ctl inject`, likewise: without a `step`, it is 0.
kernel::FaultInjection parse_inject(const std::string& text);

// Throws BadInput if swaps will have the fault's slot hosted in the kernel's own process when it comes.
void require_worker(const kernel::FaultInjection& fault, std::span<const kernel::SwapOrder> swaps);

// The kinds with their meanings and arguments, for help: a line each, grouped.
std::string fault_help();

}  // namespace gravitas
