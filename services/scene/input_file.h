// Files that a scene is made of.
#pragma once

#include <cstdint>
#include <string>

namespace gravitas::scene {

// Who writes a pipe is waited for: not for a file that a scene names, which others can name to a server.
enum class InputKind : std::uint8_t { kAny, kOrdinary };

// The whole contents of an ordinary file, and of a pipe or a terminal where those are allowed. False, and in *why the
// reason, where it cannot be read, is a folder or a device, or is larger than 4 GiB.
bool read_input_file(const std::string& path, std::string* text, std::string* why, InputKind allowed = InputKind::kAny);

}  // namespace gravitas::scene
