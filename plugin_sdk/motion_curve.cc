#include "plugin_sdk/motion_curve.h"

#include <algorithm>
#include <cmath>

#include "plugin_sdk/body.h"
#include "plugin_sdk/checks.h"
#include "plugin_sdk/math/hermite.h"
#include "plugin_sdk/math/rotation.h"

namespace gravitas {
namespace {

constexpr std::size_t kColumns = MotionTable::kColumns;

}  // namespace

std::string MotionCurve::find_problem(const MotionTable& table) {
  const std::span<const double> rows = table.rows;
  if (rows.empty() || rows.size() % kColumns != 0) return "it has no rows of time, position and orientation";
  if (!table.surface.allFinite()) return "the velocity of its surface is not finite";
  for (std::size_t row = 0; row < rows.size() / kColumns; ++row) {
    const std::span<const double> numbers = rows.subspan(row * kColumns, kColumns);
    const std::string which = "row " + std::to_string(row);
    if (first_not_finite(numbers) != kNoRow) return which + " has a number that is not finite";
    if (row > 0 && !(numbers[0] > rows[(row - 1) * kColumns])) return "the time of " + which + " does not ascend";
    if (first_not_unit(numbers.subspan(4, 4), 4) != kNoRow) return "the orientation of " + which + " is not unit";
  }
  return {};
}

MotionCurve::MotionCurve(const MotionTable& table, const Pose& frame_in_body)
    : rows_(table.rows.size() / kColumns), surface_(table.surface), frame_in_body_(frame_in_body) {
  const std::span<const double> numbers = table.rows;
  for (std::size_t i = 0; i < rows_.size(); ++i) {
    rows_[i].time = numbers[i * kColumns];
    rows_[i].pose.position = vector_at(numbers.subspan(i * kColumns + 1, 3), 0);
    rows_[i].pose.orientation = quaternion_at(numbers.subspan(i * kColumns + 4, 4), 0);
  }
  std::vector<double> lengths;
  std::vector<Vector3> moves, turns;
  for (std::size_t i = 0; i + 1 < rows_.size(); ++i) {
    const Row &from = rows_[i], &to = rows_[i + 1];
    lengths.push_back(to.time - from.time);
    moves.emplace_back((to.pose.position - from.pose.position) / lengths[i]);
    turns.emplace_back(log_rotation(shorter_arc(to.pose.orientation * from.pose.orientation.conjugate())) / lengths[i]);
  }
  const Vector3 none = Vector3::Zero();
  const std::vector<Vector3> velocities = hermite_rates(moves, lengths, none),
                             angular = hermite_rates(turns, lengths, none);
  for (std::size_t i = 0; i < rows_.size(); ++i) rows_[i].twist = {velocities[i], angular[i]};
  for (std::size_t i = 0; i + 1 < rows_.size(); ++i) {
    const Vector3 first = lengths[i] / 3.0 * angular[i], last = lengths[i] / 3.0 * angular[i + 1];
    const Quaternion turn = exp_rotation(lengths[i] * turns[i]);
    rows_[i].turns = {first, log_rotation(exp_rotation(-last) * turn * exp_rotation(-first)), last};
  }
}

MotionCurve::State MotionCurve::frame_at(double time) const {
  const auto next = std::ranges::upper_bound(rows_, time, {}, &Row::time);
  const bool is_outside = next == rows_.begin() || next == rows_.end();
  if (is_outside) {
    const Row& end = next == rows_.begin() ? rows_.front() : rows_.back();
    const double beyond = time - end.time;
    return {displaced(end.pose, beyond * end.twist.linear, beyond * end.twist.angular), end.twist, {}};
  }
  const Row &from = *(next - 1), &to = *next;
  const double h = to.time - from.time, s = (time - from.time) / h, r = 1.0 - s;
  State state;

  const HermitePoint<Vector3> way =
      hermite_point(from.pose.position, from.twist.linear, to.pose.position, to.twist.linear, h, s);
  state.pose.position = way.value, state.twist.linear = way.rate, state.change.linear = way.change;

  // factors from the right: q = e3 e2 e1 q0, each turning what those before it did
  const std::array<double, 3> b = {1.0 - r * r * r, s * s * (3.0 - 2.0 * s), s * s * s};
  const std::array<double, 3> rate = {3.0 * r * r / h, 6.0 * s * r / h, 3.0 * s * s / h};
  const std::array<double, 3> bend = {-6.0 * r / (h * h), 6.0 * (r - s) / (h * h), 6.0 * s / (h * h)};
  state.pose.orientation = from.pose.orientation;
  for (std::size_t k = 0; k < 3; ++k) {
    const Vector3& c = from.turns[k];
    const Quaternion e = exp_rotation(b[k] * c);
    state.pose.orientation = e * state.pose.orientation;
    const Vector3 own = rate[k] * c, carried = e * state.twist.angular;
    state.change.angular = bend[k] * c + own.cross(carried) + e * state.change.angular;
    state.twist.angular = own + carried;
  }
  state.pose.orientation = normalized(state.pose.orientation);
  return state;
}

MotionCurve::State MotionCurve::at(double time) const {
  State state = frame_at(time);
  const Pose body = inverse(frame_in_body_);
  const Vector3 arm = state.pose.orientation * body.position, surface = state.pose.orientation * surface_;
  const Vector3 &w = state.twist.angular, &a = state.change.angular;
  state.pose.position += arm;
  state.pose.orientation = state.pose.orientation * body.orientation;
  state.twist.linear += w.cross(arm);
  state.change.linear += a.cross(arm) + w.cross(w.cross(arm));
  if (surface_.isZero(0.0)) return state;
  state.twist.linear += surface;
  state.change.linear += w.cross(surface);
  return state;
}

}  // namespace gravitas
