// What a process does to itself, to its machine and to its parent when it is told to misbehave.
#pragma once

#include <cstddef>
#include <cstdint>
#include <string>

#include "plugin_sdk/host/fault_kinds.h"

namespace gravitas::host {

// Ends this process in the way of one of the kinds "process".
[[noreturn]] void end_process(InjectedFault how, int exit_code);

// Never return, but for kStop, which returns when the process is continued.
void hang(InjectedFault how);

// Takes memory, page by page, and keeps it. False if there was not as much.
bool leak(std::size_t bytes);

// Opens descriptors until there are no more, at most 65536, and keeps them. How many, and why no more.
std::string use_up_descriptors();

// Writes lines to standard output. How many bytes were taken.
std::string flood(std::size_t bytes);

// Tries what one of the kinds "sandbox" says and undoes it. What came of it: "fork: done", or the
// system's reason against it.
std::string try_forbidden(InjectedFault what);

}  // namespace gravitas::host
