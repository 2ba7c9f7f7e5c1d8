// A number with the word for what it counts, in messages: "1 body", "2 bodies".
#pragma once

#include <concepts>
#include <string>
#include <string_view>

namespace gravitas {

// `many` where it is not `one` with an s.
template <std::integral Number>
std::string counted(Number number, std::string_view one, std::string_view many = {}) {
  std::string text = std::to_string(number) + ' ';
  if (number == 1 || many.empty()) text += one;
  if (number != 1) text += many.empty() ? "s" : many;
  return text;
}

}  // namespace gravitas
