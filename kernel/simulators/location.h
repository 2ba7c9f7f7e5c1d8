// What the searches for impacts and jumps share (located.cc, halving.cc, jumps.cc, breakaways.cc, limits.cc), who keeps the pairs that
// touch (gaps.cc), and which limits may open (openings.cc, smooth.cc).
#pragma once

#include <algorithm>
#include <cstdint>
#include <span>

#include "kernel/step_data.h"
#include "plugin_sdk/local_bound.h"

namespace gravitas::kernel {

inline constexpr double kTargetShare = 1e-8;     // of the margin: gap at which a pair has met, overlap that is none
inline constexpr double kFinest = 1e-13;         // of the step: its shortest part
inline constexpr double kShortestFlight = 1e-6;  // of the step
inline constexpr std::size_t kExtrapolated = 13,
                             kExtrapolatedTwist = 7;  // numbers of a body; where its velocities begin

// Is the pair the next one of these (two ids each)? Both ascend from question to question, so that those before it are dropped.
inline bool starts_with(std::span<const std::uint32_t> pair, std::span<const std::uint32_t>* pairs) {
  while (!pairs->empty() && std::ranges::lexicographical_compare(pairs->first(2), pair)) *pairs = pairs->subspan(2);
  return !pairs->empty() && std::ranges::equal(pairs->first(2), pair);
}

// Velocity (m/s) of body 2 of a contact relative to body 1 at its point, seen with the places of `position`.
inline Vector3 contact_velocity(const StepData& data, std::size_t contact, const Column<double>& position,
                                const Column<double>& linear, const Column<double>& angular) {
  const auto velocity = [&](std::uint32_t body) {
    const Vector3 arm = vector_at(data.contact_point.span(), contact) - vector_at(position.span(), body);
    return Vector3(vector_at(linear.span(), body) + vector_at(angular.span(), body).cross(arm));
  };
  return velocity(data.contact_body[2 * contact + 1]) - velocity(data.contact_body[2 * contact]);
}

// Is this axis (three a row) of a joint a limit that leaves it room?
inline bool may_open(const DiscrepancyAnswer& joints, std::size_t i) {
  const AxisMode mode = axis_mode(joints.mode[i / 3], static_cast<int>(i % 3));
  return mode == AxisMode::kUnilateral || (mode == AxisMode::kLimited && joints.lower[i] < joints.upper[i]);
}

// turns.cc: what two bodies overlap by no more than this is pushed out on the side where it came in, m.
double harmless_depth(const LocalBound& one, const LocalBound& two);

}  // namespace gravitas::kernel
