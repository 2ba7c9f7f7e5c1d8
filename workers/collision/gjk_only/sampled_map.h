// A convex solid of which nothing is known but its support points: its features are found by asking in directions all
// round the one that matters.
#pragma once

#include "plugin_sdk/geometry/support_map.h"

namespace gravitas::gjk_only {

class SampledMap final : public SupportMap {
 public:
  // `map` must outlive this.
  explicit SampledMap(const SupportMap& map);
  Vector3 support(const Vector3& d) const override { return map_.support(d); }
  // The support points of eight directions `sine` round n, in their order, equal neighbours being one. A feature is a
  // face where they span an area.
  void contour(const Vector3& n, double sine, Contour* out) const override;

 private:
  const SupportMap& map_;
};

}  // namespace gravitas::gjk_only
