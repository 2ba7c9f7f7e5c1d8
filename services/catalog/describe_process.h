// Asks `gravitas-worker --describe LIBRARY…` what plugin libraries hold, in a process of its own:
// loading a library runs its code, which may crash or hang.
#pragma once

#include <chrono>
#include <string>
#include <vector>

#include "gravitas/plugin/v1/description.pb.h"

namespace gravitas {

// Runs the worker once over all libraries and reads its answer, an entry per library in their
// order. Returns false with the reason if there is no such answer: the worker cannot be started,
// does not end within the timeout (it is killed then), ends with an error, or writes something
// else.
bool describe_libraries(const std::string& worker_path, const std::vector<std::string>& libraries,
                        std::chrono::milliseconds timeout, plugin::v1::Catalog* answer, std::string* problem);

}  // namespace gravitas
