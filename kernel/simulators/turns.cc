// Bodies that turn far while they touch, for simulators that locate events: such a pair has no time of impact, and what it
// meets next of each other is found at S* alone, where a rod that topples may lie in or behind the thin plate it stood on. An
// inner step that makes two bodies overlap by more than half of the thinner one's half thickness, and turns them so far, is
// halved until it does not.
#include <limits>

#include "kernel/environment.h"
#include "plugin_sdk/local_bound.h"

namespace gravitas::kernel {
namespace {

constexpr double kOfThickness = 0.5;    // of the least half extent
constexpr double kShortestTurn = 1e-3;  // of the step: turns that would take shorter ones are the solver's

// What overlaps by no more than this is pushed out on the side where it came in, m.
double harmless_depth(const LocalBound& one, const LocalBound& two) {
  double least = std::numeric_limits<double>::infinity();
  for (const LocalBound* bound : {&one, &two})
    if (bound->least_half_extent > 0.0) least = std::min(least, kOfThickness * bound->least_half_extent);
  return least;
}

// From one end of the smaller body to the other, m.
double longest_arm(const LocalBound& one, const LocalBound& two) {
  if (!(one.reach > 0.0) || !(two.reach > 0.0)) return 2.0 * std::max(one.reach, two.reach);
  return 2.0 * std::min(one.reach, two.reach);
}

}  // namespace

double Environment::shorten_turns(Trusted<TrialState>* trial, double begin, double length, bool* has_found_contacts) {
  const auto spin = [&](std::uint32_t body) { return Vector3(vector_at(data_.trial_angular_velocity.span(), body)); };
  const double least = kOfThickness * margin_ / kMarginOfHalfExtent;
  bool may_turn_far = false;
  for (std::uint32_t i = 0; i < model_.body_count; ++i)
    may_turn_far = may_turn_far || 2.0 * model_.bound[i].reach * spin(i).norm() * length > least;
  const double shortest = kShortestTurn * length_of_step(step_count_ + 1);
  if (!may_turn_far || length <= shortest) return length;

  const auto is_too_deep = [&] {
    if (!*has_found_contacts) look_up_contacts(find_contacts(bound_and_pair(*trial)));
    *has_found_contacts = true;
    for (std::size_t i = 0; i < data_.contact_key.size(); ++i) {
      const std::uint32_t one = data_.contact_body[2 * i], two = data_.contact_body[2 * i + 1];
      const LocalBound &first = model_.bound[one], &second = model_.bound[two];
      const double harmless = harmless_depth(first, second);
      if (!(data_.contact_depth[i] > harmless)) continue;
      if ((spin(two) - spin(one)).norm() * longest_arm(first, second) * length > harmless) return true;
    }
    return false;
  };
  const auto is_too_deep_at = [&](double end) {
    begin_inner_step(begin, end);
    *trial = integrate();
    *has_found_contacts = false;
    return is_too_deep();
  };
  if (!is_too_deep()) return length;
  // what overlaps from the beginning has not turned there
  if (is_too_deep_at(shortest)) {
    is_too_deep_at(length);
    return length;
  }
  double end = 0.5 * length;
  while (is_too_deep_at(end) && end > shortest) end *= 0.5;
  return end;
}

}  // namespace gravitas::kernel
