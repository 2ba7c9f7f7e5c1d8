// Where `Bisection` ends an inner step (§ 1.4): trials are halved until one ends just after a contact closes. It sees contacts at
// S* alone: what passes through within a trial is missed. Pairs that touch and do not fly up are the solver's.
//
// What closes on the way has a gap where the trial begins. The contact's own points tell it, carried back there along its normal;
// but where the normal turns on the way, as that of two balls that graze each other, they may tell of none though the pair was
// apart. So where a contact of a pair that did not touch has none, the pair is looked for at the beginning itself.
//
// Of pairs that touch, those are looked for there, too, that the trial moves far or that fly up and come back within it: it ends before
// one presses the other through, and at the top of such a flight (event_location.h), which closes after that as any does.
#include <algorithm>
#include <cmath>
#include <limits>
#include <span>
#include <vector>

#include "kernel/environment.h"
#include "kernel/simulators/location.h"
#include "plugin_sdk/event_location.h"

namespace gravitas::kernel {
namespace {

constexpr double kLead = 0.9999;  // of the way to an impact is one step, the rest another

}  // namespace

double Environment::bisect(const Trusted<TrialState>& trial, double begin, double length, bool* is_near) {
  const double nothing = kTargetShare * margin_;
  const auto start_speed = [&](std::size_t contact) {
    return vector_at(data_.contact_normal.span(), contact)
        .dot(contact_velocity(data_, contact, data_.trial_position, start_linear_velocity(), start_angular_velocity()));
  };
  const auto find_contacts_at = [&](const Trusted<TrialState>& at) {
    look_up_contacts(find_contacts(bound_and_pair(at)));
  };
  const auto try_step = [&](double end) {
    begin_inner_step(begin, end);
    return integrate();
  };
  const auto contact_pair = [&](std::size_t contact) { return data_.contact_body.span().subspan(2 * contact, 2); };
  // pairs that overlap at the beginning, once one of them is asked for
  std::vector<std::uint32_t> overlapping, doubtful;
  bool knows_overlapping = false, comes_back = false;
  const auto closes = [&](const Trusted<TrialState>& at) {
    find_contacts_at(at);
    doubtful.clear();
    bool was_apart = false;
    std::span<const std::uint32_t> touching = front().touching.span();
    for (std::size_t i = 0; i < data_.contact_key.size(); ++i) {
      const bool touches = starts_with(contact_pair(i), &touching);
      // what rolls or slides on is the solver's, what flies up is not
      const bool goes_on = touches && start_speed(i) * data_.time_step[0] <= nothing;
      if (goes_on || data_.contact_depth[i] <= nothing) continue;
      const bool was_open = gap_at(i, front()) > nothing;
      was_apart = was_apart || was_open;
      comes_back = comes_back || touches;
      if (!touches && !was_open) doubtful.insert(doubtful.end(), contact_pair(i).begin(), contact_pair(i).end());
    }
    if (was_apart || doubtful.empty()) return was_apart;
    if (!knows_overlapping) {
      find_contacts_at(try_step(kFinest * length));
      for (std::size_t i = 0; i < data_.contact_key.size(); ++i)
        if (data_.contact_depth[i] > nothing)
          overlapping.insert(overlapping.end(), contact_pair(i).begin(), contact_pair(i).end());
      knows_overlapping = true;
    }
    std::span<const std::uint32_t> known = overlapping;
    for (std::size_t k = 0; k < doubtful.size(); k += 2)
      if (!starts_with(std::span(doubtful).subspan(k, 2), &known)) return true;
    return false;
  };
  // between bodies that are both bounded: others have no other side
  const auto thickness = [&](std::span<const std::uint32_t> pair) {
    const LocalBound &one = model_.bound[pair[0]], &two = model_.bound[pair[1]];
    return one.reach > 0.0 && two.reach > 0.0 ? harmless_depth(one, two) : std::numeric_limits<double>::infinity();
  };
  const auto moves_far = [&](std::span<const std::uint32_t> pair) {
    const auto way = [&](std::uint32_t body) {
      return Vector3(vector_at(data_.trial_position.span(), body) - vector_at(front().position.span(), body));
    };
    return (way(pair[1]) - way(pair[0])).norm() > thickness(pair);
  };
  const auto may_pass = [&] {
    const std::span<const std::uint32_t> touching = front().touching.span();
    for (std::size_t k = 0; k < touching.size(); k += 2)
      if (moves_far(touching.subspan(k, 2))) return true;
    return is_anew_ && inner_ == 0;
  };
  // for the contacts where the trial begins, of each pair the one that parts slowest
  const auto longest_trial = [&] {
    find_contacts_at(try_step(kFinest * length));
    try_step(length);
    double longest = length;
    for (std::size_t i = 0; i < data_.contact_key.size();) {
      const std::span<const std::uint32_t> pair = contact_pair(i);
      Encounter met;
      met.start_speed = std::numeric_limits<double>::infinity();
      for (; i < data_.contact_key.size() && std::ranges::equal(contact_pair(i), pair); ++i) {
        const auto speed = [&](const Column<double>& linear, const Column<double>& angular) {
          return vector_at(data_.contact_normal.span(), i)
              .dot(contact_velocity(data_, i, front().position, linear, angular));
        };
        const double start = speed(start_linear_velocity(), start_angular_velocity());
        if (data_.contact_depth[i] < -nothing || !(start < met.start_speed)) continue;
        met = {0.0, -data_.contact_depth[i], start, speed(data_.trial_linear_velocity, data_.trial_angular_velocity)};
      }
      if (!std::isfinite(met.start_speed)) continue;
      met.is_touching = true, met.left_gap = met.gap, met.most_pressed = thickness(pair);
      longest = std::min(longest,
                         stop_before(met, length, nothing, kShortestFlight * length_of_step(step_count_ + 1)).length);
    }
    return std::max(longest, kFinest * length);
  };
  // asked of the whole trial: closes() may make shorter ones
  const bool presses = may_pass();
  bool has_closed = closes(trial);
  if (comes_back || presses) {
    length = longest_trial();
    has_closed = closes(try_step(length));
  }
  if (!has_closed) {
    *is_near = false;
    return length;
  }
  double clear = 0.0, closed = length;
  while (closed - clear > kFinest * length) {
    const double middle = 0.5 * (clear + closed);
    (closes(try_step(middle)) ? closed : clear) = middle;
  }
  const double stop = *is_near || clear == 0.0 ? closed : kLead * clear;
  *is_near = !*is_near && stop < length;
  return stop;
}

}  // namespace gravitas::kernel
