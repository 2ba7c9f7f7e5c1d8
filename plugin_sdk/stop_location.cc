#include "plugin_sdk/stop_location.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <optional>

#include "plugin_sdk/math/hermite.h"
#include "plugin_sdk/math/rotation.h"
#include "plugin_sdk/solver/joint_laws.h"

namespace gravitas {
namespace {

constexpr double kSlop = 1e-8;      // of the arm, m, or rad: what reactions take for none
constexpr double kRounding = 1e-6;  // of coordinates, which a gap is told from as from an arm
constexpr double kBend = 2.0;       // by so much more than the straight way back a gap may have been less
constexpr int kLooks = 16;          // at the cubic, which turns twice at most
constexpr int kHalvings = 60;

}  // namespace

bool StopGap::may_have_closed(double time) const {
  return exists() && (gap < 0.0 || (rate > 0.0 && gap < kBend * rate * time));
}

bool StopGap::asks_the_same(const StopGap& there) const {
  return std::fabs(asked - there.asked) <= kSlop * std::fabs(asked);
}

bool StopGap::is_pressed_again(const StopGap& from, bool bears) const {
  return from.exists() && !gives_way && !is_drive && !from.is_open() &&
         (gap < -slop || (bears && gap > slop && rate > still));
}

std::array<StopGap, kStopsOfRow> stop_gaps(const Discrepancy& discrepancy, const StopBody& body1,
                                           const StopBody& body2) {
  std::array<StopGap, kStopsOfRow> stops;
  const Matrix3 axes = to_rotation_matrix(discrepancy.axes);
  const Vector3 error = discrepancy.point2 - discrepancy.point1;
  const Vector3 middle = 0.5 * (discrepancy.point1 + discrepancy.point2);
  double slop = kSlop, reach = 1.0;
  if (!discrepancy.is_angular()) {
    double arm = 0.0;
    for (const StopBody* body : {&body1, &body2})
      if (body->is_pushed) arm = std::max(arm, (middle - body->centre).norm());
    slop = kSlop * arm;
    reach = arm + kRounding * middle.cwiseAbs().maxCoeff();
  }
  for (int axis = 0; axis < 3; ++axis) {
    const AxisMode mode = axis_mode(discrepancy.modes, axis);
    const double bound = discrepancy.maximum_force[axis];
    const bool slips = is_drive(mode) && bound > 0.0 && bound < kUnlimited && !acts_as_force(discrepancy, axis) &&
                       discrepancy.acceleration.isZero(0.0);
    if (!slips && mode != AxisMode::kLimited && mode != AxisMode::kUnilateral) continue;
    const bool gives_way = discrepancy.compliance[axis] > 0.0;
    if (gives_way && discrepancy.damping[axis] == 0.0) continue;  // pushes with nothing at first
    // gives way as to all that takes no time
    if (!slips && !gives_way && bound < kUnlimited) continue;
    const double length = error.norm();
    const bool is_radial = discrepancy.is_radial() && axis == 0 && length > 0.0;
    const Vector3 along = is_radial ? Vector3(error / length) : Vector3(axes.col(axis));
    JointAxisState state = joint_axis_state(discrepancy, axis, along, error);
    state.mode = mode;  // that it acts in the derivatives makes no axis free here
    const JacobianRow row = jacobian_row(discrepancy, along, body1.centre, body2.centre);
    const Twist &one = body1.velocity, &two = body2.velocity;
    const double rate = row.velocity(one.linear, one.angular, two.linear, two.angular) - state.desired_velocity;
    const double speeds = std::fabs(row.linear1.dot(one.linear)) + std::fabs(row.angular1.dot(one.angular)) +
                          std::fabs(row.linear2.dot(two.linear)) + std::fabs(row.angular2.dot(two.angular));
    for (const double sign : {1.0, -1.0}) {
      StopGap& here = stops[2 * static_cast<std::size_t>(axis) + (sign < 0.0 ? 1 : 0)];
      if (slips) {
        here = {sign * rate, 0.0, still_rate(speeds), 1.0, 0.0, false, true, state.desired_velocity};
        continue;
      }
      const std::optional<JointStop> stop = gives_way ? soft_stop_of(state, sign) : stop_of(state, sign);
      if (!stop) continue;
      here = {sign * (state.error_at_start - stop->limit), sign * rate, slop, reach, still_rate(speeds), gives_way};
    }
  }
  return stops;
}

double closing_time(const StopGap& from, const StopGap& to, double length) {
  const auto gap_at = [&](double share) {
    if (to.is_drive) return from.gap + share * (to.gap - from.gap);
    return hermite_point(from.gap, from.rate, to.gap, to.rate, length, share).value;
  };
  double open = 0.0, closed = -1.0, lowest = 0.0;
  for (int look = 1; look <= kLooks; ++look) {
    const double share = static_cast<double>(look) / kLooks, gap = gap_at(share);
    lowest = std::min(lowest, gap);
    if (gap < 0.0 && closed < 0.0) closed = share;
    if (closed < 0.0) open = share;
  }
  if (closed < 0.0 || !(lowest < -to.slop)) return std::numeric_limits<double>::infinity();
  for (int halving = 0; halving < kHalvings; ++halving) {
    const double middle = 0.5 * (open + closed);
    (gap_at(middle) < 0.0 ? closed : open) = middle;
  }
  return closed * length;
}

}  // namespace gravitas
