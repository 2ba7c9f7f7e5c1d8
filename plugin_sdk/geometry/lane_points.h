// Points laid out for vector registers: the one farthest along a direction, four at a time.
#pragma once

#include <cstdint>
#include <vector>

#include "plugin_sdk/math/types.h"

namespace gravitas {

class LanePoints {
 public:
  // At least one point must be added before any is asked for.
  void add(const Vector3& point);
  // The row of the point farthest along d (of any length), the first of those that are equally far.
  std::uint32_t farthest(const Vector3& d) const;

 private:
  std::uint32_t count_ = 0;
  // x of four points, y of four, z of four, and so on; the places that are left repeat an earlier point
  std::vector<double> coordinates_;
};

}  // namespace gravitas
