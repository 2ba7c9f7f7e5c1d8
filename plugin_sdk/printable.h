// Text of unknown origin, such as a plugin's or the name of a file, as messages, logs and terminals take it.
#pragma once

#include <string>
#include <string_view>

namespace gravitas {

// The same text with a '?' for every byte that is neither UTF-8 nor printable; tabs and ends of lines stay.
std::string printable(std::string_view text);

}  // namespace gravitas
