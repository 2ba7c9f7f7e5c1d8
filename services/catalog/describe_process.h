// Asks `gravitas-worker --describe LIBRARY…` what plugin libraries hold, and `COMMAND --describe` what a command
// serves, in a process of its own: their code may crash or hang.
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

// The same for a shell command that starts a worker of one plugin.
bool describe_command(const std::string& command, std::chrono::milliseconds timeout, plugin::v1::Catalog* answer,
                      std::string* problem);

}  // namespace gravitas
