// All slots, in the order in which they are shown, and a slot by its name.
#pragma once

#include <array>
#include <optional>
#include <string_view>

#include "plugin_sdk/plugin.h"

namespace gravitas {

inline constexpr std::array<Slot, 6> kSlots = {Slot::kSpace, Slot::kCollision, Slot::kConstraint,
                                               Slot::kForce, Slot::kSolver,    Slot::kIntegrator};

inline std::optional<Slot> find_slot(std::string_view name) {
  for (const Slot slot : kSlots)
    if (name == slot_name(slot)) return slot;
  return std::nullopt;
}

}  // namespace gravitas
