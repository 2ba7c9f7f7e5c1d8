#include "plugin_sdk/event_location.h"

#include <algorithm>
#include <cmath>

namespace gravitas {

NextStop stop_before(const Encounter& encounter, double length, double target_gap, double shortest_flight) {
  const double acceleration = (encounter.end_speed - encounter.start_speed) / length;
  if (encounter.fraction <= 0.0) {
    if (encounter.start_speed <= 0.0 || encounter.end_speed >= 0.0) return {length};
    const double top = encounter.start_speed / -acceleration;
    return {2.0 * top <= shortest_flight ? length : std::min(length, top)};
  }
  const double time = encounter.fraction * length;
  if (encounter.gap > target_gap) return {time};
  const double closing = -(encounter.start_speed + acceleration * time);
  const double bend = 0.5 * std::fabs(acceleration) * time;
  if (bend * (length - time) <= 0.5 * target_gap) {
    // grazing, the last part of the way is not worth a step of its own
    return {closing * (length - time) <= 2.0 * target_gap ? length : time + 2.0 * target_gap / closing};
  }
  if (length > 2.5 * time) return {2.0 * time, true};
  return {time * (closing > bend ? std::max(0.5, 1.0 - 2.0 * bend * (length - time) / (closing * time)) : 0.5)};
}

}  // namespace gravitas
