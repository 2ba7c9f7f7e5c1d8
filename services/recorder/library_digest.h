// Which build of a plugin answered: a digest of its library. Name and version stay when somebody builds it anew.
#pragma once

#include <cstdint>
#include <string>

namespace gravitas {

// Of the file's bytes as they are now; 0 if they cannot be read, and for no path.
std::uint64_t library_digest(const std::string& path);

}  // namespace gravitas
