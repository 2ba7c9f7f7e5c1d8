// What a trial that is over must not leave in this process.
#pragma once

#include <cstddef>
#include <string>
#include <vector>

namespace gravitas::campaign {

// Child processes of this process.
std::vector<int> child_processes();

// Worker processes, segments that are mapped and their descriptors; empty if there is nothing.
std::vector<std::string> find_leftovers();

std::size_t open_descriptors();

}  // namespace gravitas::campaign
