// The kernel's enumerations in words, as reports, events and messages have them.
#pragma once

#include <cstddef>
#include <string_view>

#include "kernel/fault.h"
#include "kernel/swap.h"

namespace gravitas {

// "death", "deadline", …
inline const char* fault_kind_name(kernel::FaultKind kind) {
  static constexpr const char* kNames[] = {"death",         "deadline",    "refusal",     "failure",      "bad_frame",
                                           "bad_structure", "bad_numbers", "bad_physics", "disagreement", "handshake"};
  return kNames[static_cast<std::size_t>(kind)];
}

// Of who comes or goes in a swap, as it is told, the plugin itself, without its library or hosting.
inline std::string_view plugin_of(std::string_view swapped) { return swapped.substr(0, swapped.find(" (")); }

// "preparing", "shadow", …
inline const char* swap_state_name(kernel::SwapState state) {
  static constexpr const char* kNames[] = {"preparing", "shadow", "probation", "committed", "rolled back", "refused"};
  return kNames[static_cast<std::size_t>(state)];
}

}  // namespace gravitas
