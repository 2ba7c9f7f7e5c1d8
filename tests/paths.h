// Where the sources and the build of the tests are. Their names are compiled into one file alone, so that the compiler's
// cache serves all others to trees in other folders.
#pragma once

#include <string>

namespace gravitas {

// in_source("/deploy/scenes"), in_build("/lib/gravitas")
std::string in_source(const std::string& path = "");
std::string in_build(const std::string& path = "");
// As a shell reads it back, with its blanks.
std::string in_shell(const std::string& path);

}  // namespace gravitas
