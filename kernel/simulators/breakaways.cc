// Where static friction gives way on the way of a part of an extrapolated step (extrapolated.cc): what rests begins to slide, roll or
// spin, and friction falls to the dynamic one. In the last quarter of the part attempts in one and in two inner steps both miss it,
// since each inner step weighs what acts in all of it, and agree on a rest that is over.
//
// One inner step more tells: what rests where the part ends, and does not then, may have begun before. It is as long as the others:
// of what is redundant, a solver goes on with the solution that it has, and may find another for a step of another length.
//
// Where it gives way in the last inner step of each of the attempts that count, these end with a slip in proportion to that step, which
// is extrapolated to none: what slides where the finest of them ends, and rests where they are extrapolated to, has given way, too.
#include <algorithm>
#include <cmath>
#include <utility>

#include "kernel/environment.h"
#include "kernel/simulators/location.h"
#include "plugin_sdk/event_location.h"
#include "plugin_sdk/solver.h"

namespace gravitas::kernel {
namespace {

constexpr double kLoaded = 0.1;                         // share of the largest friction that a contact bears, at least
constexpr double kAtRest = 0.01;                        // of the accuracy, m/s or rad/s: slower is at rest
constexpr double kOfAccuracy = 1e-3, kNothing = 1e-12;  // m, m/s or rad/s: changes that count for none
constexpr double kStill = 1e-15;                        // of the trial velocity

}  // namespace

// Whether what rests where the attempts are extrapolated to does not at the end of the one in front(), or gains more than the accuracy
// from there in a time as long as the part.
bool Environment::breaks_away(double end, double length, std::uint32_t pieces) {
  const double accuracy = description_.accuracy;
  const auto pressed = [&](std::size_t i) {
    return vector_at(data_.contact_normal.span(), i).dot(vector_at(data_.contact_impulse.span(), i));
  };
  const auto coefficient = [&](std::size_t i, MaterialColumn column) {
    return data_.contact_material[kMaterialColumns * i + column];
  };
  // never below the dynamic one
  const auto static_friction = [&](std::size_t i) {
    return std::max(coefficient(i, kStaticFriction), coefficient(i, kDynamicFriction));
  };
  const auto may_turn = [&](std::size_t i) {
    return coefficient(i, kRollingFriction) > 0.0 || coefficient(i, kSpinningFriction) > 0.0;
  };
  const auto gives_way = [&](std::size_t i) { return pressed(i) > 0.0 && (static_friction(i) > 0.0 || may_turn(i)); };
  // how fast its bodies slide on each other, and turn
  const auto slip_and_turn = [&](std::size_t i, const auto& twist_of) {
    const Vector3 normal = vector_at(data_.contact_normal.span(), i);
    const auto at_contact = [&](std::uint32_t body) {
      const Twist twist = twist_of(body);
      const Vector3 arm = vector_at(data_.contact_point.span(), i) - vector_at(data_.trial_position.span(), body);
      return Twist{twist.linear + twist.angular.cross(arm), twist.angular};
    };
    const Twist one = at_contact(data_.contact_body[2 * i]), two = at_contact(data_.contact_body[2 * i + 1]);
    const Vector3 apart = two.linear - one.linear;
    return std::pair((apart - normal.dot(apart) * normal).norm(),
                     may_turn(i) ? (two.angular - one.angular).norm() : 0.0);
  };
  const auto solved = [&](std::uint32_t body) {
    return Twist{vector_at(data_.solved_linear_velocity.span(), body),
                 vector_at(data_.solved_angular_velocity.span(), body)};
  };
  const auto extrapolated = [&](std::uint32_t body) {
    const double* twist = &extrapolation_.best()[kExtrapolated * body + kExtrapolatedTwist];
    return Twist{{twist[0], twist[1], twist[2]}, {twist[3], twist[4], twist[5]}};
  };
  const auto only_seems_to_rest = [&](double best, double last) { return best <= accuracy && last - best > accuracy; };
  for (std::size_t i = 0; i < data_.contact_key.size(); ++i) {
    if (!gives_way(i)) continue;
    const auto best = slip_and_turn(i, extrapolated), at_end = slip_and_turn(i, solved);
    if (only_seems_to_rest(best.first, at_end.first) || only_seems_to_rest(best.second, at_end.second)) return true;
  }
  bool any_bears = false;
  for (std::size_t i = 0; i < data_.contact_key.size() && !any_bears; ++i) {
    const Vector3 impulse = vector_at(data_.contact_impulse.span(), i);
    const Vector3 across = impulse - pressed(i) * vector_at(data_.contact_normal.span(), i);
    any_bears = across.norm() > kLoaded * static_friction(i) * pressed(i) ||
                !vector_at(data_.contact_turning.span(), i).isZero(0.0);
  }
  if (!any_bears) return false;
  begin_inner_step(end, length / pieces);
  if (!make_next_state() || must_restart_) return true;
  find_changes(&trial_changes_);
  if (lets_go()) return false;
  for (std::size_t i = 0; i < data_.contact_key.size(); ++i) {
    // what has given way bears next to nothing where dynamic friction is small
    if (!gives_way(i)) continue;
    const std::uint32_t* pair = &data_.contact_body[2 * i];
    const Vector3 point = vector_at(data_.contact_point.span(), i), normal = vector_at(data_.contact_normal.span(), i);
    const auto motion = [&](std::uint32_t body) {
      return TrialMotion{
          pose_of(front().position, front().orientation, body),
          pose_of(data_.trial_position, data_.trial_orientation, body),
          {vector_at(start_linear_velocity().span(), body), vector_at(start_angular_velocity().span(), body)}};
    };
    const auto begins = [&](double before, double then) {
      return before <= kAtRest * accuracy && (then - before) * pieces > accuracy;
    };
    const auto then = slip_and_turn(i, solved);
    const Vector3 turning =
        vector_at(start_angular_velocity().span(), pair[1]) - vector_at(start_angular_velocity().span(), pair[0]);
    if (begins(start_slip(point, point, normal, motion(pair[0]), motion(pair[1])).norm(), then.first) ||
        (may_turn(i) && begins(turning.norm(), then.second)))
      return true;
  }
  return false;
}

// Of bodies that it moves. Other numbers stay: a difference of rounding alone would double from part to part. What reactions leave
// of a velocity within rounding is none: what rests rests. Returns the weights of the attempts.
std::span<const double> Environment::take_extrapolated() {
  const State& end = back();
  const double nothing = std::min(kOfAccuracy * description_.accuracy, kNothing);
  for (std::uint32_t i = 0; i < model_.body_count; ++i) {
    if (!is_awake(i)) continue;
    const double* best = &extrapolation_.best()[kExtrapolated * i];
    set_quaternion(end.orientation.span(), i, Quaternion(best[0], best[1], best[2], best[3]).normalized());
    const auto set = [&](const Column<double>& column, const Column<double>& trial, std::size_t at) {
      for (std::size_t k = 3ULL * i; k < 3ULL * i + 3; ++k, ++at) {
        if (std::fabs(best[at] - column[k]) > nothing) column[k] = best[at] + 0.0;
        if (std::fabs(column[k]) <= kStill * std::fabs(trial[k])) column[k] = 0.0;
      }
    };
    set(end.position, data_.trial_position, 4);
    set(end.linear_velocity, data_.trial_linear_velocity, 7);
    set(end.angular_velocity, data_.trial_angular_velocity, 10);
    end.state_changed[i] = 1;
  }
  figures_ = {};
  complete_state();
  return extrapolation_.weights();
}

}  // namespace gravitas::kernel
