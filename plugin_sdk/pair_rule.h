// The one rule by which every space decides whether two bodies are a pair, so that all spaces agree.
#pragma once

#include <cstdint>
#include <span>
#include <vector>

#include "plugin_sdk/body.h"
#include "schemas/stage_frames.h"

namespace gravitas {

// What a body brings to the question whom it may touch.
struct TouchRights {
  std::uint32_t flags = 0;  // BodyFlag bits
  std::uint64_t group = 0, mask = 0;
  bool operator==(const TouchRights&) const = default;
};

// Both have shapes, one of them can be pushed, and their filters allow it.
constexpr bool may_touch(const TouchRights& a, const TouchRights& b) {
  return (a.flags & b.flags & kHasShape) != 0 && ((a.flags | b.flags) & kMovable) != 0 && (a.group & b.mask) != 0 &&
         (b.group & a.mask) != 0;
}

// True if any two of the bodies may touch. Cost: n log n, and quadratic in how many differ.
bool can_any_touch(std::vector<TouchRights> bodies);

// True if a structure may rely on the bounds of a body: lower <= upper, and so far from the largest number that extents
// can be multiplied. The rest (unbounded, upside down, not a number) is for the rules alone: such a body is tested
// against all.
inline bool has_regular_bounds(std::span<const double> lower, std::span<const double> upper, std::uint32_t body) {
  constexpr double kFarthest = 1e100;  // m
  for (std::size_t k = 3 * std::size_t{body}; k < 3 * std::size_t{body} + 3; ++k)
    if (!(lower[k] <= upper[k] && lower[k] >= -kFarthest && upper[k] <= kFarthest)) return false;
  return true;
}

// True if bodies a and b both have shapes, one of them can be pushed, their filters allow it, and their closed
// bounds overlap.
class PairRule {
 public:
  explicit PairRule(const stage::SpacePairsRequest& request)
      : lower_(request.lower()),
        upper_(request.upper()),
        flags_(request.flags()),
        group_(request.filter_group()),
        mask_(request.filter_mask()) {}

  bool may_touch(std::uint32_t a, std::uint32_t b) const {
    return gravitas::may_touch({flags_[a], group_[a], mask_[a]}, {flags_[b], group_[b], mask_[b]});
  }

  bool bounds_overlap(std::uint32_t a, std::uint32_t b) const {
    for (std::size_t k = 0; k < 3; ++k)
      if (!(lower_[3 * a + k] <= upper_[3 * b + k] && lower_[3 * b + k] <= upper_[3 * a + k])) return false;
    return true;
  }

  bool operator()(std::uint32_t a, std::uint32_t b) const { return may_touch(a, b) && bounds_overlap(a, b); }

  std::uint32_t bodies() const { return static_cast<std::uint32_t>(flags_.size()); }
  bool has_shape(std::uint32_t body) const { return (flags_[body] & kHasShape) != 0; }

  bool is_regular(std::uint32_t body) const { return has_regular_bounds(lower_, upper_, body); }

 private:
  std::span<const double> lower_, upper_;
  std::span<const std::uint32_t> flags_;
  std::span<const std::uint64_t> group_, mask_;
};

}  // namespace gravitas
