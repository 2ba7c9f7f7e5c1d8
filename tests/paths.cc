#include "tests/paths.h"

namespace gravitas {

std::string in_source(const std::string& path) { return GRAVITAS_SOURCE_DIR + path; }
std::string in_build(const std::string& path) { return GRAVITAS_BINARY_DIR + path; }

std::string in_shell(const std::string& path) {
  const std::string plain = "abcdefghijklmnopqrstuvwxyzABCDEFGHIJKLMNOPQRSTUVWXYZ0123456789-_./,:=+@%";
  if (path.find_first_not_of(plain) == std::string::npos) return path;
  std::string word = "'";
  for (const char c : path) word += c == '\'' ? std::string("'\\''") : std::string(1, c);
  return word + "'";
}

}  // namespace gravitas
