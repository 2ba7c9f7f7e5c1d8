#include "tests/paths.h"

namespace gravitas {

std::string in_source(const std::string& path) { return GRAVITAS_SOURCE_DIR + path; }
std::string in_build(const std::string& path) { return GRAVITAS_BINARY_DIR + path; }

}  // namespace gravitas
