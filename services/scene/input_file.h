// Files that a scene is made of.
#pragma once

#include <string>

namespace gravitas::scene {

// The whole contents of an ordinary file, a pipe or a terminal. False, and in *why the reason, where it cannot be read, is
// a folder or a device, or is larger than 4 GiB.
bool read_input_file(const std::string& path, std::string* text, std::string* why);

}  // namespace gravitas::scene
