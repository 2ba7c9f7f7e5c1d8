#include "plugin_sdk/event_location.h"

#include <algorithm>
#include <cmath>
#include <limits>

namespace gravitas {
namespace {

// Of the gap that is not told from touching: overlap at which a pair that no contact was found for counts as pressed.
constexpr double kMostUnseen = 1e4;

}  // namespace

NextStop stop_before(const Encounter& encounter, double length, double target_gap, double shortest_flight) {
  const double acceleration = (encounter.end_speed - encounter.start_speed) / length;
  const double time = encounter.fraction * length;
  // what detectors and solvers do not tell from touching
  const double near = std::max(encounter.slop, target_gap);
  const bool comes_back = encounter.start_speed > 0.0 && encounter.end_speed < 0.0;
  const double top = comes_back ? encounter.start_speed / -acceleration : 0.0;
  if (comes_back && top >= time) {
    const bool rests = 2.0 * top <= shortest_flight || 0.5 * encounter.start_speed * top <= target_gap;
    return {rests ? length : std::min(length, top)};
  }
  if (encounter.fraction <= 0.0) {
    const double closing = -encounter.start_speed;
    if (encounter.is_touching || encounter.gap < -kMostUnseen * near || closing <= 0.0) return {length};
    return {std::min(length, (std::fabs(encounter.gap) + 2.0 * target_gap) / closing)};
  }
  const double closing = -(encounter.start_speed + acceleration * time);
  const double bend = 0.5 * std::fabs(acceleration) * time;
  if (bend * (length - time) <= 0.5 * target_gap) {
    if (encounter.gap > target_gap) return {time};
    const double lead = 2.0 * near / closing;
    if (time > std::max(shortest_flight, 2.0 * lead)) return {time - lead};
    // grazing, the last part of the way is not worth a step of its own
    return {closing * (length - time) <= 2.0 * target_gap ? length : time + 2.0 * target_gap / closing};
  }
  if (length > 2.5 * time) return {2.0 * time, true};
  return {time * (closing > bend ? std::max(0.5, 1.0 - 2.0 * bend * (length - time) / (closing * time)) : 0.5)};
}

void Slide::add(const Vector3& normal, double friction, const Vector3& start_velocity, const Vector3& end_velocity,
                const Vector3& impulse) {
  const double weight = friction * normal.dot(impulse);
  const Vector3 slip = start_velocity - normal.dot(start_velocity) * normal;
  const double speed = slip.norm();
  if (!(weight > 0.0 && speed > 0.0)) return;
  weight_ += weight;
  start_ += weight * speed;
  end_ += weight * slip.dot(end_velocity) / speed;
  used_ -= slip.dot(impulse);
}

bool Slide::has_stuck() const {
  constexpr double kStuck = 1e-9;  // of the speed at the start
  return std::fabs(end_) <= kStuck * start_;
}

double Slide::end(double length) const {
  if (has_stuck()) return length * used_ / start_;
  return end_ < start_ ? length * start_ / (start_ - end_) : std::numeric_limits<double>::infinity();
}

}  // namespace gravitas
