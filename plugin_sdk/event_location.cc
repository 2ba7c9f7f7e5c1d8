#include "plugin_sdk/event_location.h"

#include <algorithm>
#include <cmath>
#include <limits>

namespace gravitas {
namespace {

// Of the gap that is not told from touching: overlap at which a pair that no contact was found for counts as pressed.
constexpr double kMostUnseen = 1e4;

// Of the slip with the arms that the trial ends with: what is slower in one of the ways a contact may have moved, sticks.
constexpr double kSticks = 0.1;

// Of the gap at which detectors and solvers take a pair for closed: surely apart.
constexpr double kApart = 20.0;

// How long a pair that bounced off is to fly until it is surely apart; 0 where it need not, or may meet elsewhere before.
double leaving_time(const Encounter& encounter, double length, double near) {
  const double speed = std::min(encounter.start_speed, encounter.bounce_speed);
  if (!(speed > 0.0 && encounter.turning_speed * length > encounter.harmless_depth)) return 0.0;
  const double time = 2.0 * (std::fabs(encounter.gap) + kApart * near) / speed;
  return time < length && encounter.turning_speed * time <= encounter.harmless_depth ? time : 0.0;
}

// When a pair meets that the straight motion lets meet at a time: later, if it is drawn together.
double accelerated_time(const Encounter& encounter, double acceleration, double time) {
  if (!(acceleration < 0.0)) return time;
  const double way = -0.5 * (encounter.start_speed + encounter.end_speed) * time, speed = encounter.start_speed;
  const double root = std::sqrt(speed * speed - 2.0 * acceleration * way);
  return std::max(time, speed <= 0.0 ? 2.0 * way / (root - speed) : (speed + root) / -acceleration);
}

// How long a trial is that presses a pair that starts closed together by no more than it may.
double pressed_time(const Encounter& encounter, double acceleration, double length, double shortest_flight) {
  constexpr double kShortest = 1e3;  // shortest flights
  const double speed = encounter.start_speed, most = encounter.most_pressed;
  if (!(-0.5 * (speed + encounter.end_speed) * length > most)) return length;
  const double root = std::sqrt(speed * speed - 2.0 * acceleration * most);
  const double time = speed <= 0.0 ? 2.0 * most / (root - speed) : (speed + root) / -acceleration;
  return std::min(length, std::max(time, kShortest * shortest_flight));
}

}  // namespace

NextStop stop_before(const Encounter& encounter, double length, double target_gap, double shortest_flight) {
  const double acceleration = (encounter.end_speed - encounter.start_speed) / length;
  const double time = encounter.fraction * length;
  // what detectors and solvers do not tell from touching
  const double near = std::max(encounter.slop, target_gap);
  const double pressed =
      encounter.fraction <= 0.0 ? pressed_time(encounter, acceleration, length, shortest_flight) : length;
  const bool comes_back = encounter.start_speed > 0.0 && encounter.end_speed < 0.0;
  const double top = comes_back ? encounter.start_speed / -acceleration : 0.0;
  if (encounter.fraction <= 0.0 && (!comes_back || 2.0 * top > shortest_flight))
    if (const double leaves = leaving_time(encounter, length, near); leaves > 0.0) return {std::min(leaves, pressed)};
  if (comes_back && top >= time) {
    const bool rests =
        2.0 * top <= shortest_flight || 0.5 * encounter.start_speed * top <= std::max(target_gap, encounter.left_gap);
    if (rests) return {pressed};
    // what turns may come back before
    return {std::min(length, top), encounter.fraction > 0.0};
  }
  if (encounter.fraction <= 0.0) {
    const double closing = -encounter.start_speed;
    if (encounter.is_touching || encounter.gap < -kMostUnseen * near || closing <= 0.0) return {pressed};
    return {std::min(length, (std::fabs(encounter.gap) + 2.0 * target_gap) / closing), false, true};
  }
  const double closing = -(encounter.start_speed + acceleration * time);
  const double bend = 0.5 * std::fabs(acceleration) * time;
  if (bend * (length - time) <= 0.5 * target_gap) {
    if (encounter.gap > target_gap) return {time};
    const double lead = 2.0 * near / closing;
    if (time > std::max(shortest_flight, 2.0 * lead)) return {time - lead};
    // grazing, the last part of the way is not worth a step of its own
    return {closing * (length - time) <= 2.0 * target_gap ? length : time + 2.0 * target_gap / closing, false, true};
  }
  if (const double met = accelerated_time(encounter, acceleration, time); length > 2.5 * met) return {2.0 * met, true};
  return {time * (closing > bend ? std::max(0.5, 1.0 - 2.0 * bend * (length - time) / (closing * time)) : 0.5)};
}

Vector3 start_slip(const Vector3& point1, const Vector3& point2, const Vector3& normal, const TrialMotion& one,
                   const TrialMotion& two) {
  const Quaternion turn1 = one.end.orientation * one.start.orientation.conjugate();
  const Quaternion turn2 = two.end.orientation * two.start.orientation.conjugate();
  const Quaternion turn =
      Quaternion::FromTwoVectors(two.start.position - one.start.position, two.end.position - one.end.position);
  const Vector3 arm1 = point1 - one.end.position, arm2 = point2 - two.end.position;
  const auto across = [&](const Vector3& relative) { return Vector3(relative - normal.dot(relative) * normal); };
  // with the point where it was when the trial began, and how directions turn with the normal
  const auto slip = [&](const Vector3& point, const Quaternion& directions) {
    const Vector3 velocity1 = one.velocity.linear + one.velocity.angular.cross(point - one.start.position);
    const Vector3 velocity2 = two.velocity.linear + two.velocity.angular.cross(point - two.start.position);
    return across(directions * (velocity2 - velocity1));
  };
  const auto from_one = [&](const Quaternion& way) { return Vector3(one.start.position + way.conjugate() * arm1); };
  const auto from_two = [&](const Quaternion& way) { return Vector3(two.start.position + way.conjugate() * arm2); };
  Vector3 slowest = slip(from_one(turn1), turn2);
  for (const Vector3& other : {slip(from_two(turn2), turn1), slip(from_one(turn2), turn2), slip(from_two(turn1), turn1),
                               slip(from_one(turn), turn)})
    if (other.squaredNorm() < slowest.squaredNorm()) slowest = other;
  const Vector3 with_arms_of_end = across(two.velocity.linear + two.velocity.angular.cross(arm2) - one.velocity.linear -
                                          one.velocity.angular.cross(arm1));
  return slowest.norm() < kSticks * with_arms_of_end.norm() ? slowest : with_arms_of_end;
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
