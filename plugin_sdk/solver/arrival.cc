// Arrival speeds: one square root and the rules that make a resting contact rest.
#include "plugin_sdk/solver/arrival.h"

#include <algorithm>
#include <cmath>

namespace gravitas {

double arrival_speed(double start_velocity, double trial_velocity, double way, double time_step) {
  if (!(trial_velocity < 0.0)) return 0.0;
  const double gained = trial_velocity - start_velocity;  // a h
  const double square = start_velocity * start_velocity - 2.0 * (gained / time_step) * std::max(0.0, way);
  const double speed = std::sqrt(std::max(0.0, square));
  return speed < 2.0 * std::fabs(gained) ? 0.0 : speed;
}

double gap_before(double gap, const ConstraintDirection& direction, const SolverBody& body1, const SolverBody& body2) {
  return gap - direction.along(body1.way, body2.way);
}

}  // namespace gravitas
