#include "tests/paths.h"

#include "plugin_sdk/shell_word.h"

namespace gravitas {

std::string in_source(const std::string& path) { return GRAVITAS_SOURCE_DIR + path; }
std::string in_build(const std::string& path) { return GRAVITAS_BINARY_DIR + path; }

std::string in_shell(const std::string& path) { return shell_word(path); }

}  // namespace gravitas
