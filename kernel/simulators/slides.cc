// Ends of slides, for simulators that locate events: an inner step ends where surfaces stop sliding, rolling or spinning on
// each other, or turn back. Friction jumps there; a step across it is off by a share of what friction does in a step.
//
// The end is estimated from the solution of a trial (`Slide`: friction used, or speeds at both ends), trials are cut to the
// estimate until one ends there, and that one is committed as it is. Where friction does not change on the way one cut is
// enough, and with an integrator of order 2 the motion is exact: a box stops, a ball comes to roll, to rounding. Slides
// shorter than kShortestSlide of the step count as ended.
//
// What has stuck may have come to rest early in the trial, to be held against a load since, or sooner than dynamic friction
// could have stopped it: shorter trials then show it slide, which tells its end.
#include <algorithm>
#include <cmath>
#include <limits>

#include "kernel/environment.h"
#include "plugin_sdk/event_location.h"
#include "plugin_sdk/math/rotation.h"
#include "plugin_sdk/solver.h"

namespace gravitas::kernel {
namespace {

constexpr int kMostSlideTrials = 30;
constexpr double kShortestSlide = 1e-6;  // of the step
constexpr double kSteepest = 0.9;        // change of the estimate with the length of the trial, for the secant
constexpr double kOfGain = 4.0;          // of what forces do in the trial: faster arrivals are impacts
constexpr double kSlideShare = 1e-9;     // of the slide, and of the step: how closely its end is met

}  // namespace

std::optional<Trusted<Solution>> Environment::react_until_a_slide_ends(Trusted<TrialState> trial, double begin,
                                                                       double* length, bool has_found_contacts) {
  const double step = length_of_step(step_count_ + 1), shortest = kShortestSlide * step;
  const auto surface = [&](std::size_t contact, double side) {
    return Vector3(vector_at(data_.contact_point.span(), contact) +
                   0.5 * side * data_.contact_depth[contact] * vector_at(data_.contact_normal.span(), contact));
  };
  const auto motion = [&](std::uint32_t body) {
    return TrialMotion{
        {vector_at(front().position.span(), body), quaternion_at(front().orientation.span(), body)},
        {vector_at(data_.trial_position.span(), body), quaternion_at(data_.trial_orientation.span(), body)},
        {vector_at(start_linear_velocity().span(), body), vector_at(start_angular_velocity().span(), body)}};
  };
  const auto slip_before = [&](std::size_t contact) {
    const std::uint32_t* pair = &data_.contact_body[2 * contact];
    return start_slip(surface(contact, 1.0), surface(contact, -1.0), vector_at(data_.contact_normal.span(), contact),
                      motion(pair[0]), motion(pair[1]));
  };
  // velocity of b relative to a where body b's surface is, or a's
  const auto velocity = [&](std::size_t contact, const Column<double>& linear, const Column<double>& angular) {
    const auto at = [&](std::size_t end, double side) {
      const std::uint32_t body = data_.contact_body[2 * contact + end];
      const Vector3 arm = surface(contact, side) - vector_at(data_.trial_position.span(), body);
      return Vector3(vector_at(linear.span(), body) + vector_at(angular.span(), body).cross(arm));
    };
    return Vector3(at(1, -1.0) - at(0, 1.0));
  };
  const auto slip_after = [&](std::size_t contact) {
    return velocity(contact, data_.solved_linear_velocity, data_.solved_angular_velocity);
  };
  const auto turning = [&](std::size_t contact, const Column<double>& angular) {
    const std::uint32_t* pair = &data_.contact_body[2 * contact];
    return Vector3(vector_at(angular.span(), pair[1]) - vector_at(angular.span(), pair[0]));
  };
  // the end of the first slide, rolling or spinning of any two bodies; 0 where some stick that dynamic friction alone would
  // not have stopped then
  const auto first_end = [&](double trial_length) {
    double first = std::numeric_limits<double>::infinity();
    for (std::size_t i = 0; i < data_.contact_key.size();) {
      Slide slide, roll, spin;
      double gained = 0.0, arrival = 0.0;
      const std::size_t pair = i;
      for (; i < data_.contact_key.size() && data_.contact_pair[i] == data_.contact_pair[pair]; ++i) {
        const Vector3 normal = vector_at(data_.contact_normal.span(), i);
        const Vector3 impulse = vector_at(data_.contact_impulse.span(), i);
        const double* material = &data_.contact_material[kMaterialColumns * i];
        slide.add(normal, material[kDynamicFriction], slip_before(i), slip_after(i), impulse);
        arrival =
            std::max(arrival, std::fabs(normal.dot(velocity(i, start_linear_velocity(), start_angular_velocity()))));
        if (!(material[kRollingFriction] > 0.0 || material[kSpinningFriction] > 0.0)) continue;
        // as slides at the distance of the nearer centre of what can move
        double arm = std::numeric_limits<double>::infinity();
        for (const std::uint32_t body : data_.contact_body.span().subspan(2 * i, 2))
          if (model_.inverse_mass[body] > 0.0)
            arm = std::min(
                arm, (vector_at(data_.contact_point.span(), i) - vector_at(data_.trial_position.span(), body)).norm());
        if (!(arm > 0.0 && std::isfinite(arm))) continue;
        const Vector3 start = arm * turning(i, start_angular_velocity());
        const Vector3 after = arm * turning(i, data_.solved_angular_velocity);
        const Vector3 torque = vector_at(data_.contact_turning.span(), i) / arm,
                      across = orthonormal_basis(normal).first;
        const Vector3 pushed = normal.dot(impulse) * normal;
        roll.add(normal, material[kRollingFriction] / arm, start, after, pushed + torque);
        spin.add(normal, material[kSpinningFriction] / arm, normal.dot(start) * across, normal.dot(after) * across,
                 pushed + normal.dot(torque) * across);
      }
      for (std::size_t end = 0; end < 2; ++end) {
        const std::uint32_t body = data_.contact_body[2 * pair + end];
        gained = std::max(gained, (vector_at(data_.trial_linear_velocity.span(), body) -
                                   vector_at(start_linear_velocity().span(), body))
                                      .norm());
      }
      // an impact's friction stops a slide at once
      if (arrival > kOfGain * gained) continue;
      // What rolls along an arc seems to arrive with arms of the end, by v times the angle; and to slip, by v times half its square.
      const std::uint32_t* bodies = &data_.contact_body[2 * pair];
      const double speed =
          (vector_at(start_linear_velocity().span(), bodies[1]) - vector_at(start_linear_velocity().span(), bodies[0]))
              .norm();
      const double slip = slide.start_speed();
      const bool rolls = slip < speed && slip * speed <= arrival * arrival;
      for (const Slide& one : {rolls ? Slide() : slide, roll, spin}) {
        // what is slower has stopped
        if (!(one.start_speed() * trial_length > shortest * gained)) continue;
        const double end = one.end(trial_length);
        if (one.has_stuck() && !(end > shortest && end <= (1.0 + kSlideShare) * trial_length)) return 0.0;
        if (end > shortest) first = std::min(first, end);
      }
    }
    return first;
  };
  const double whole = *length;
  double clear = 0.0, stopped = whole, last_length = 0.0, last_end = 0.0;
  bool has_stuck = false;  // at `stopped`, for a reason that is not known yet
  for (int i = 0;; ++i) {
    std::optional<Trusted<Solution>> solution = react(trial, has_found_contacts);
    if (!solution) return std::nullopt;
    has_found_contacts = false;
    const double end = first_end(*length);
    const bool slides_on = end > *length;
    // of what slides on, the end is known, and may lie beyond a trial in which it stuck
    const bool is_part = slides_on && has_stuck && end >= stopped;
    const bool is_met = std::fabs(end - *length) <= kSlideShare * step;
    const bool is_end = is_met || (slides_on && (is_part || *length == whole));
    if (i == kMostSlideTrials || is_end || (end == 0.0 && *length <= 2.0 * shortest)) return solution;
    (slides_on ? clear : stopped) = *length;
    has_stuck = slides_on ? has_stuck : end == 0.0;
    // a little beyond the end, so that the trial has it; where the estimate moves with the trial, by the secant
    const double rate = slides_on && last_end > last_length ? (end - last_end) / (*length - last_length) : 0.0;
    const double met = std::fabs(rate) < kSteepest ? *length + (end - *length) / (1.0 - rate) : end;
    const double next = (1.0 + 0.1 * kSlideShare) * met;
    last_length = *length, last_end = end;
    *length = next > clear && next < stopped ? next : 0.5 * (clear + stopped);
    begin_inner_step(begin, *length);
    trial = integrate();
  }
}

}  // namespace gravitas::kernel
