// `gravitas-worker --describe`: loads libraries where a crash hurts nobody and says what they are.
#pragma once

#include <string>
#include <vector>

#include "gravitas/plugin/v1/description.pb.h"

namespace gravitas::host {

// An entry per library, in order. Libraries are loaded in a child process; one that crashes it, or that has not
// finished loading after `seconds`, gets an entry that says so, and the others are still described.
plugin::v1::Catalog describe_libraries(const std::vector<std::string>& libraries, double seconds);

}  // namespace gravitas::host
