// Ids in files of comma-separated values.
#pragma once

#include <string>

namespace gravitas {

// Ids are written as they are unless CSV would misread them.
inline std::string csv_quoted(const std::string& id) {
  if (id.find_first_of(",\"\n\r") == std::string::npos) return id;
  std::string out = "\"";
  for (const char c : id) out += c == '"' ? std::string("\"\"") : std::string(1, c);
  return out + "\"";
}

}  // namespace gravitas
