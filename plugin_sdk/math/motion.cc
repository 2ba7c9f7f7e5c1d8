#include "plugin_sdk/math/motion.h"

#include <cmath>
#include <numbers>

#include "plugin_sdk/math/rotation.h"

namespace gravitas {

Pose moved(const Pose& start, const Motion& motion, double fraction) {
  return {start.position + fraction * motion.displacement, rotate_by(start.orientation, fraction * motion.rotation)};
}

Motion motion_between(const Pose& start, const Pose& end, const Vector3& expected_rotation) {
  constexpr double kTurn = 2.0 * std::numbers::pi;
  // a shorter arc has no axis
  constexpr double kNoArc = 1e-9;
  const Vector3 displacement = end.position - start.position;
  const Vector3 arc = log_rotation(end.orientation * start.orientation.conjugate());
  const double angle = std::sqrt(arc.squaredNorm()), expected = std::sqrt(expected_rotation.squaredNorm());
  if (angle < kNoArc) {
    if (!(expected > 0.0)) return {displacement, arc};
    const double turns = std::round(expected / kTurn);
    return {displacement, arc + (turns * kTurn / expected) * expected_rotation};
  }
  const double along = arc.dot(expected_rotation) / angle;
  const double turns = std::round((along - angle) / kTurn);
  return {displacement, (1.0 + turns * kTurn / angle) * arc};
}

}  // namespace gravitas
