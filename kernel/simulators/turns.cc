// Bodies that turn far while they touch, for simulators that locate events: such a pair has no time of impact, and what it
// meets next of each other is found at S* alone, where a rod that topples may lie in or behind the thin plate it stood on. An
// inner step that turns two bodies by more than half of the thinner one's half thickness, and makes them overlap by so much or
// meet no more where they did (a die that a corner of it struck may be behind the wall), is halved until it does not. What
// bounced off with a spin leaves first, and has a time of impact then (event_location.h).
#include <algorithm>
#include <limits>

#include "kernel/environment.h"
#include "kernel/simulators/location.h"
#include "plugin_sdk/discrepancy.h"
#include "plugin_sdk/local_bound.h"

namespace gravitas::kernel {
namespace {

constexpr double kOfThickness = 0.5;    // of half of it
constexpr double kShortestTurn = 1e-3;  // of the step: turns that would take shorter ones are the solver's

// From one end of the smaller body to the other, m.
double longest_arm(const LocalBound& one, const LocalBound& two) {
  if (!(one.reach > 0.0) || !(two.reach > 0.0)) return 2.0 * std::max(one.reach, two.reach);
  return 2.0 * std::min(one.reach, two.reach);
}

}  // namespace

// What overlaps by no more than this is pushed out on the side where it came in, m.
double harmless_depth(const LocalBound& one, const LocalBound& two) {
  double least = std::numeric_limits<double>::infinity();
  for (const LocalBound* bound : {&one, &two})
    if (bound->half_thickness > 0.0) least = std::min(least, kOfThickness * bound->half_thickness);
  return least;
}

double Environment::turning_speed(std::span<const std::uint32_t> pair) const {
  const auto spin = [&](std::uint32_t body) { return Vector3(vector_at(data_.trial_angular_velocity.span(), body)); };
  return (spin(pair[1]) - spin(pair[0])).norm() * longest_arm(model_.bound[pair[0]], model_.bound[pair[1]]);
}

double Environment::shorten_turns(Trusted<TrialState>* trial, double begin, double length, bool* has_found_contacts) {
  const auto spin = [&](std::uint32_t body) { return Vector3(vector_at(data_.trial_angular_velocity.span(), body)); };
  double least = std::numeric_limits<double>::infinity();
  for (const LocalBound& bound : model_.bound) least = std::min(least, harmless_depth(bound, bound));
  bool may_turn_far = false;
  for (std::uint32_t i = 0; i < model_.body_count; ++i)
    may_turn_far = may_turn_far || 2.0 * model_.bound[i].reach * spin(i).norm() * length > least;
  if (!may_turn_far) return length;
  // in which what touches turns by half of what is harmless
  double shortest = kShortestTurn * length_of_step(step_count_ + 1);
  for (std::size_t i = 0; i < front().touching.size(); i += 2) {
    const auto pair = front().touching.span().subspan(i, 2);
    shortest =
        std::min(shortest, 0.5 * harmless_depth(model_.bound[pair[0]], model_.bound[pair[1]]) / turning_speed(pair));
  }
  if (length <= shortest) return length;

  const auto harmless = [&](std::span<const std::uint32_t> pair) {
    return harmless_depth(model_.bound[pair[0]], model_.bound[pair[1]]);
  };
  const auto turns_far = [&](std::span<const std::uint32_t> pair, double time) {
    return turning_speed(pair) * time > harmless(pair);
  };
  const auto overlaps = [&] {
    if (!*has_found_contacts) look_up_contacts(find_contacts(bound_and_pair(*trial)));
    *has_found_contacts = true;
    for (std::size_t i = 0; i < data_.contact_key.size(); ++i) {
      const auto pair = data_.contact_body.span().subspan(2 * i, 2);
      if (data_.contact_depth[i] > harmless(pair) && turns_far(pair, length)) return true;
    }
    return false;
  };
  // the centre of one comes to the side of the contact's plane that it is pushed to from the other
  const auto changes_sides = [&](std::size_t i) {
    const Vector3 normal = vector_at(data_.contact_normal.span(), i), point = vector_at(data_.contact_point.span(), i);
    for (std::size_t side = 0; side < 2; ++side) {
      const std::uint32_t body = data_.contact_body[2 * i + side], other = data_.contact_body[2 * i + 1 - side];
      const Vector3 outward = side == 1 ? normal : Vector3(-normal);
      const Vector3 before = carried(point, pose_of(data_.trial_position, data_.trial_orientation, other),
                                     pose_of(front().position, front().orientation, other));
      if (model_.inverse_mass[body] > 0.0 && outward.dot(vector_at(front().position.span(), body) - before) < 0.0 &&
          outward.dot(vector_at(data_.trial_position.span(), body) - point) > 0.0)
        return true;
    }
    return false;
  };
  const auto may_be_behind = [&] {
    const double now = data_.time_step[0];
    std::span<const std::uint32_t> touching = front().touching.span();
    // those before `next` are met no more
    const auto has_lost_one = [&](std::span<const std::uint32_t> next) {
      for (; !touching.empty() && (next.empty() || std::ranges::lexicographical_compare(touching.first(2), next));
           touching = touching.subspan(2))
        if (turns_far(touching, now)) return true;
      if (!touching.empty() && std::ranges::equal(touching.first(2), next)) touching = touching.subspan(2);
      return false;
    };
    for (std::size_t i = 0; i < data_.contact_key.size(); ++i) {
      const auto pair = data_.contact_body.span().subspan(2 * i, 2);
      if ((turns_far(pair, now) && changes_sides(i)) || has_lost_one(pair)) return true;
    }
    return has_lost_one({});
  };
  const auto try_step = [&](double end) {
    begin_inner_step(begin, end);
    *trial = integrate();
    *has_found_contacts = false;
    return end;
  };
  double end = length;
  while (end > shortest && (overlaps() || may_be_behind())) {
    if (end == length) {
      // what overlaps from the beginning has not turned there
      try_step(kFinest * length);
      if (overlaps()) return try_step(length);
      try_step(shortest);
      if (overlaps() || may_be_behind()) return shortest;
    }
    end = try_step(std::max(shortest, 0.5 * end));
  }
  return end;
}

}  // namespace gravitas::kernel
