// The truth about an environment between two steps: exactly what a checkpoint saves. There are two to four
// of them (environment.h); a step reads one and writes another, and commit swaps them.
#pragma once

#include <cstdint>

#include "kernel/arena.h"
#include "kernel/description.h"
#include "kernel/model.h"
#include "plugin_sdk/trajectory_hash.h"

namespace gravitas::kernel {

// What the rows of a column of the state stand for: columns of one kind have the same number of rows.
enum class StateRows : std::uint32_t { kBody, kJoint, kPluginState, kContact, kDiscrepancy, kTouching, kRest, kWrench };

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

  // Steps that a body has been at rest, or kAsleep, and the wrench under which it is. Written by Stage::kCommit; empty
  // where nothing can fall asleep, the wrench also where wrenches are constant.
  Column<std::uint32_t> rested;
  Column<double> rest_wrench;  // 6, N and N m, world

  // visit(name, what a row is, numbers per row, column) for every column, always in this order.
  template <typename Visit>
  void visit_columns(Visit&& visit) const {
    visit("position", StateRows::kBody, 3U, position);
    visit("orientation", StateRows::kBody, 4U, orientation);
    visit("linear_velocity", StateRows::kBody, 3U, linear_velocity);
    visit("angular_velocity", StateRows::kBody, 3U, angular_velocity);
    visit("intact", StateRows::kJoint, 1U, intact);
    visit("plugin_state", StateRows::kPluginState, 1U, plugin_state);
    visit("state_changed", StateRows::kBody, 1U, state_changed);
    visit("contact_body", StateRows::kContact, 2U, contact_body);
    visit("contact_feature", StateRows::kContact, 1U, contact_feature);
    visit("contact_key", StateRows::kContact, 1U, contact_key);
    visit("contact_impulse", StateRows::kContact, 3U, contact_impulse);
    visit("contact_correction", StateRows::kContact, 1U, contact_correction);
    visit("discrepancy_constraint", StateRows::kDiscrepancy, 1U, discrepancy_constraint);
    visit("discrepancy_impulse", StateRows::kDiscrepancy, 3U, discrepancy_impulse);
    visit("discrepancy_correction", StateRows::kDiscrepancy, 3U, discrepancy_correction);
    visit("touching", StateRows::kTouching, 2U, touching);
    visit("rested", StateRows::kRest, 1U, rested);
    visit("rest_wrench", StateRows::kWrench, 6U, rest_wrench);
  }
};

inline Hash state_hash(const State& s) {
  return gravitas::state_hash(
      {s.position.span(), s.orientation.span(), s.linear_velocity.span(), s.angular_velocity.span()});
}

inline BodiesAtRest bodies_at_rest(const Model& model, const State& state) {
  return {model.flags.span(),           model.mass.span(),
          model.inertia.span(),         state.orientation.span(),
          state.linear_velocity.span(), state.angular_velocity.span()};
}

}  // namespace gravitas::kernel
