// Which row of its request a refusal is about: "joint 3: Axis is missing". The loops of constraint.h and force.h put
// that before whatever is refused in them; whoever runs a scene is told the Id and the place of that joint or force instead.
#pragma once

#include <cstddef>
#include <stdexcept>
#include <string>

#include "plugin_sdk/plugin.h"

namespace gravitas {

inline constexpr const char* kJointRow = "joint ";              // row of constraint_type
inline constexpr const char* kApplicationRow = "application ";  // row of application

// Calls body(). Refusals, and cursors that are read beyond their end, are thrown again as Refusal "KIND ROW: reason".
template <typename Body>
void name_refused_row(const char* kind, std::size_t row, Body&& body) {
  const auto text = [&](const std::exception& refused) { return kind + std::to_string(row) + ": " + refused.what(); };
  try {
    body();
  } catch (const Refusal& refused) {
    throw Refusal(text(refused));
  } catch (const std::out_of_range& refused) {
    throw Refusal(text(refused));
  }
}

}  // namespace gravitas
