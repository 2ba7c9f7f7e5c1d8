// The truth about an environment between two steps: exactly what a checkpoint saves. There are two of them; a
// step reads the one and writes the other, and commit swaps them.
#pragma once

#include <cstdint>

#include "kernel/arena.h"
#include "kernel/description.h"

namespace gravitas::kernel {

struct State {
  State(Arena* arena, const EnvironmentDescription& description);
  // The initial state; after Arena::seal().
  void write(const EnvironmentDescription& description) const;

  // Bodies: pose of the centre of mass, velocities; world. Written by Stage::kCommit.
  Column<double> position, orientation;              // m; w, x, y, z
  Column<double> linear_velocity, angular_velocity;  // m/s, rad/s

  // 1 while a joint holds. Written by Stage::kCommit.
  Column<std::uint32_t> intact;

  // What the integrator cannot rebuild, and which bodies something else changed since. Written by Stage::kCommit.
  Column<double> plugin_state;
  Column<std::uint32_t> state_changed;

  // Memory of contacts, in their order (pair, feature): bodies, feature, key of the contact's life, multipliers.
  // Written by Stage::kCommit; matched with the next step's contacts.
  Column<std::uint32_t> contact_body;  // 2
  Column<std::uint32_t> contact_feature;
  Column<std::uint64_t> contact_key;
  Column<double> contact_impulse;     // 3, N s, world
  Column<double> contact_correction;  // kg m

  // Memory of joints: multipliers of each discrepancy, matched by joint and position in it.
  Column<std::uint32_t> discrepancy_constraint;
  Column<double> discrepancy_impulse;     // 3, N s, along the axes
  Column<double> discrepancy_correction;  // 3, kg m

  // Pairs of bodies that touch, ascending.
  Column<std::uint32_t> touching;  // 2
};

}  // namespace gravitas::kernel
