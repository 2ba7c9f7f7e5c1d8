// The one rule by which every space decides whether a ray meets the bounds of a body, so that all spaces agree, and
// what a space does that has no structure for rays.
#pragma once

#include <cstdint>
#include <span>

#include "plugin_sdk/body.h"
#include "plugin_sdk/plugin.h"

namespace gravitas {

// Slabs (T. Kay, J. Kajiya, "Ray tracing complex scenes", 1986), with the end of the stay inside moved out by what
// rounding can do (T. Ize, "Robust BVH ray traversal", 2013): a ray that meets the bounds is never missed, and one that
// meets them meets all boxes around them, so a tree may go by meets(), too.
class RayRule {
 public:
  // Throws Refusal if a ray is not finite, has a negative length or a direction that is no unit vector.
  explicit RayRule(const stage::SpaceRaysRequest& request);

  // The body has a shape, and the ray meets its closed bounds.
  bool operator()(std::uint32_t ray, std::uint32_t body) const {
    return has_shape(body) && meets(ray, &lower_[3 * std::size_t{body}], &upper_[3 * std::size_t{body}]);
  }
  // Three coordinates each. False where one is no number.
  bool meets(std::uint32_t ray, const double* lower, const double* upper) const;

  std::uint32_t rays() const { return static_cast<std::uint32_t>(length_.size()); }
  std::uint32_t bodies() const { return static_cast<std::uint32_t>(flags_.size()); }
  bool has_shape(std::uint32_t body) const { return (flags_[body] & kHasShape) != 0; }

 private:
  std::span<const double> lower_, upper_, origin_, direction_, length_;
  std::span<const std::uint32_t> flags_;
};

// The answer by testing every ray against every body: O(rays * bodies).
void test_rays_against_all(const stage::SpaceRaysRequest& request, const stage::SpaceRaysReply& reply, Host& host);

}  // namespace gravitas
