// Where the clipping of two patches x and y delivers its contacts. The clipping is written for x
// and y; the sink knows which of them is shape a.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>

#include "plugin_sdk/geometry/contact_candidates.h"
#include "plugin_sdk/math/types.h"
#include "workers/collision/standard/features.h"
#include "workers/collision/standard/patches.h"
#include "workers/collision/standard/polygon_clip.h"

namespace gravitas::collision {

class PatchSink {
 public:
  // `normal`: unit, from a to b; `tolerance` (m): how far outside a boundary still counts as
  // inside.
  PatchSink(const Vector3& normal, double tolerance, ContactCandidates* out)
      : normal_(normal), tolerance_(tolerance), out_(out) {}

  double tolerance() const { return tolerance_; }

  // x is a until the first call, then b, then a again.
  void swap_roles() { x_is_a_ = !x_is_a_; }

  // `p` moved along the normal into the plane.
  Vector3 projected(const Vector3& p, const Plane& plane) const {
    return p + normal_ * (plane.height_along(normal_, p) - normal_.dot(p));
  }

  // A contact on the line through `place` along the normal, between the coordinates of the two
  // surfaces along it (m).
  void add_heights(const Vector3& place, double height_x, double height_y, FeatureCode code_x, FeatureCode code_y,
                   std::uint32_t repeat = 0) {
    const double middle = 0.5 * (height_x + height_y);
    const double depth = x_is_a_ ? height_x - height_y : height_y - height_x;
    const std::uint32_t feature =
        x_is_a_ ? contact_feature(code_x, code_y, repeat) : contact_feature(code_y, code_x, repeat);
    out_->add({place + normal_ * (middle - normal_.dot(place)), normal_, depth, feature});
  }

  // The same between two planes.
  void add(const Vector3& place, const Plane& x, const Plane& y, FeatureCode code_x, FeatureCode code_y,
           std::uint32_t repeat = 0) {
    add_heights(place, x.height_along(normal_, place), y.height_along(normal_, place), code_x, code_y, repeat);
  }

  // Both ends of the part of line y that lies over patch x.
  void add_clipped_line(const Line& y, const Interval& inside, const Plane& x, FeatureCode code_x) {
    if (inside.empty()) return;
    const std::array<double, 2> at = {inside.from, inside.to};
    for (std::size_t i = 0; i < 2; ++i) {
      const Vector3 place = y.ends[0] + at[i] * (y.ends[1] - y.ends[0]);
      add_heights(place, x.height_along(normal_, place), normal_.dot(place), code_x, y.end_codes[i]);
    }
  }

  // The four points that represent a rim lying in one of the planes x and y.
  RimPoints rim_points(const Rim& rim, const Plane& x, const Plane& y) const {
    return spread_rim_points(rim, [&](const Vector3& direction) {
      const Vector3 place = rim.centre + rim.radius * direction;
      const double gain = x.height_along(normal_, place) - y.height_along(normal_, place);
      return x_is_a_ ? gain : -gain;
    });
  }

 private:
  Vector3 normal_;
  double tolerance_;
  ContactCandidates* out_;
  bool x_is_a_ = true;
};

}  // namespace gravitas::collision
