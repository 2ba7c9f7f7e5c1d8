// What joints and contacts did to their bodies in inner steps of a step, summed; and what such sums of attempts at a part of a
// step in 1, 2, 3, … inner steps (kernel/simulators/extrapolated.cc) tend to: T = sum of w_n T_n, with the weights of the
// states. Momentum is linear in both, so that masses gain with T what the extrapolated state has gained, to rounding.
//
// Who is connected is told from the finest attempt alone, to first order, where the sums of one of them are of different things
// (a contact of some attempts only, or whose feature changes on the way), or T leaves a bound that each attempt kept: a
// contact that pulls, friction beyond its cone, a drive beyond its bound. The sum of what acts on a body is then right, still.
#pragma once

#include <array>
#include <compare>
#include <cstdint>
#include <map>
#include <optional>
#include <span>
#include <vector>

#include "kernel/step_data.h"
#include "plugin_sdk/math/types.h"

namespace gravitas {

// Joints in the scene's order, then contacts by their bodies and feature.
struct ReactionKey {
  bool is_contact;
  std::array<std::uint32_t, 3> numbers;

  auto operator<=>(const ReactionKey&) const = default;
};

// In each inner step, and so in sums of them, |part| <= bound.
struct ReactionBound {
  Vector3 part = Vector3::Zero();
  double bound = 0.0;
};

struct ReactionSum {
  Vector3 point = Vector3::Zero();                   // of the last inner step, world, m
  Vector3 impulse = Vector3::Zero();                 // on the second body, N s
  Vector3 turn = Vector3::Zero();                    // about the point, N m s
  std::optional<Vector3> drive_impulse, drive_turn;  // of a drive that pushes, or turns
  std::vector<ReactionBound> bounds;
  std::uint32_t inner_steps = 0;          // in which it acted
  std::array<std::uint32_t, 2> bodies{};  // kNone: the world
};

using ReactionSums = std::map<ReactionKey, ReactionSum>;

// With what acted in the inner step that has been made. Bounds are those of attempts, which are to keep them.
void add_reactions(const kernel::StepData& data, bool acts_in_derivatives, bool has_bounds, ReactionSums* sums);

// `sums` have the finest attempt, the last, among others: puts what the attempts tend to in its place.
void extrapolate_reactions(std::span<const ReactionSums> attempts, std::span<const double> weights,
                           std::span<const std::uint32_t> body_flags, ReactionSums* sums);

}  // namespace gravitas
