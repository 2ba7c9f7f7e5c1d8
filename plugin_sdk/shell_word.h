// A word as a shell reads it back.
#pragma once

#include <string>

namespace gravitas {

inline std::string shell_word(const std::string& word) {
  std::string text = "'";
  for (const char c : word) text += c == '\'' ? std::string("'\\''") : std::string(1, c);
  return text + "'";
}

}  // namespace gravitas
