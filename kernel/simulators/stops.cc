// Where `Smooth` meets stops of joints (plugin_sdk/stop_location.h): a rope comes taut, a hinge meets its limit, a drive comes to
// its velocity. The reaction jumps there, and reactions know of stops that were closed where an inner step begins alone
// (reaction_holdings.cc), so that trials pass them. An inner step ends just before, the next just behind, short enough that what
// acts in it is nothing; its solve is the impact. So motion keeps the integrator's order between stops, and what bounces, its energy.
//
// An inner step also ends where a limit opens or a drive begins to slip (openings.cc), and before a stop is pressed again (flights.cc).
// Flights from one stop back to it that are shorter than kShortestHop of the step are none: the stop is at rest (the solver has nothing
// arrive that left it in the same inner step). After kMostMeetings the rest of the step is Basic's.
#include <algorithm>
#include <cmath>
#include <cstddef>
#include <utility>

#include "kernel/environment.h"
#include "plugin_sdk/stop_location.h"

namespace gravitas::kernel {
namespace {

constexpr int kManyInnerSteps = 10, kMostMeetings = 1000, kMostLooks = 100;
constexpr double kReach = 4.0;  // of the inner step before: how long a trial is after many, or a refusal
constexpr double kCrossing = 1e-9, kShortestHop = 1e-6;  // of the step: an inner step that passes a stop; a flight
constexpr double kLeadGap = 1e-8;                        // of its reach: gap at which a step ends before a stop
constexpr int kHalved = 4;                               // every so many trials, whatever the cubics say

}  // namespace

void Environment::meet_stops(double begin, double length) {
  double done = 0.0, crossing = 0.0, reach = length;
  for (int inner = 0; done < length && !must_restart_; ++inner) {
    const double left = length - done;
    const double asked = std::min(crossing > 0.0 ? crossing : inner < kMostMeetings ? reach : left, left);
    double stop = asked;
    Trusted<TrialState> trial = integrate_shorter(begin + done, &stop);
    bool lets_go = false;
    const bool is_short = stop < asked || reach < length || inner >= kManyInnerSteps;
    if (crossing == 0.0 && inner < kMostMeetings) {
      lets_go = end_where_joints_let_go(begin + done, &stop, &trial);
      stop = next_stop(trial, begin + done, stop, &crossing);
      if (is_short) reach = kReach * stop;
    } else {
      crossing = 0.0;
    }
    if (stop != data_.time_step[0]) {
      begin_inner_step(begin + done, stop);
      trial = integrate();
    }
    if (!write_what_joints_bear(trial, lets_go ? react_holding_limits(trial) : react(trial))) return;
    end_inner_step();
    done = stop == left ? length : done + stop;
  }
}

// Of all rows in the state that they were told for: S*, or where the inner step begins.
void Environment::find_stops(bool of_trial, std::vector<StopGap>* stops) const {
  stops->clear();
  const auto body = [&](std::uint32_t i) {
    if (i == kNone) return StopBody{};
    const bool is_pushed = model_.inverse_mass[i] > 0.0;
    if (of_trial)
      return StopBody{
          vector_at(data_.trial_position.span(), i),
          {vector_at(data_.trial_linear_velocity.span(), i), vector_at(data_.trial_angular_velocity.span(), i)},
          is_pushed};
    return StopBody{vector_at(front().position.span(), i),
                    {vector_at(start_linear_velocity().span(), i), vector_at(start_angular_velocity().span(), i)},
                    is_pushed};
  };
  const DiscrepancyColumns rows = (of_trial ? data_.discrepancies : data_.start_joints).columns();
  for (std::size_t i = 0; i < rows.size(); ++i)
    for (const StopGap& stop :
         stop_gaps(rows.at(i), body(data_.discrepancy_body[2 * i]), body(data_.discrepancy_body[2 * i + 1])))
      stops->push_back(stop);
}

// How long the next inner step is, of at most `length`, for which S* is in place; where it ends before a stop, how long the one
// after it is, which passes that.
double Environment::next_stop(const Trusted<TrialState>& trial, double begin, double length, double* crossing) {
  // those of the last derivative have the same rows
  find_stops(true, &end_stops_);
  if (std::ranges::none_of(end_stops_, &StopGap::exists)) return length;
  constrain(trial);
  find_stops(true, &end_stops_);
  if (std::ranges::none_of(end_stops_, [&](const StopGap& stop) { return stop.may_have_closed(length); }))
    return length;
  if (!ask_start_joints()) return length;
  find_stops(false, &start_stops_);
  if (start_stops_.size() != end_stops_.size()) return length;
  first_stops_ = start_stops_;
  for (std::size_t k = 0; k < first_stops_.size(); ++k)
    if (first_stops_[k].is_drive && !first_stops_[k].asks_the_same(end_stops_[k])) first_stops_[k] = {};
  const double step = length_of_step(step_count_ + 1), finest = kCrossing * step;
  // a drive that would go far beyond its velocity is left out of the derivatives
  const auto leaves_drives_out = [&] {
    for (std::size_t k = 0; k < first_stops_.size() && k / 2 < least_borne_.size(); ++k)
      if (first_stops_[k].is_drive && first_stops_[k].is_open() && least_borne_[k / 2] == 0.0) return true;
    return false;
  };
  while (length > finest && leaves_drives_out()) {
    length *= 0.5;
    begin_inner_step(begin, length);
    constrain(integrate());
    find_stops(true, &end_stops_);
  }
  length = length_of_flight(begin, length);
  // gaps count from where an open stop is: what leaves one that it is beyond by rounding has not closed it
  const auto count = [&](std::vector<StopGap>* stops) {
    for (std::size_t k = 0; k < stops->size(); ++k)
      (*stops)[k].gap = first_stops_[k].is_open() ? (*stops)[k].gap - std::min(first_stops_[k].gap, 0.0) : kUnlimited;
  };
  count(&start_stops_), count(&end_stops_);
  const auto is_beyond = [](const StopGap& stop) { return stop.exists() && stop.gap < -stop.slop; };
  double open = 0.0, closed = length;
  bool has_closed = std::ranges::any_of(end_stops_, is_beyond), has_left = false;
  for (int i = 1; i <= kMostLooks && !(has_closed && closed - open <= finest); ++i) {
    double time = kUnlimited;
    for (std::size_t k = 0; k < start_stops_.size(); ++k) {
      if (!start_stops_[k].exists()) continue;
      const double closes = open + closing_time(start_stops_[k], end_stops_[k], closed - open);
      if (closes < time) time = closes, has_left = !(first_stops_[k].gap > first_stops_[k].slop);
    }
    if (!has_closed && !(time < closed)) return length;
    // a little before it, then a little after
    double trial_length = time - 0.5 * finest;
    if (trial_length <= open + 0.25 * finest) trial_length = time + 0.5 * finest;
    if (i % kHalved == 0 || !(trial_length < closed)) trial_length = 0.5 * (open + closed);
    begin_inner_step(begin, trial_length);
    constrain(integrate());
    find_stops(true, &trial_stops_);
    if (trial_stops_.size() != start_stops_.size()) return length;
    count(&trial_stops_);
    // nearer by, all that is beyond counts
    for (StopGap& stop : trial_stops_) stop.slop = 0.0;
    const bool closes = std::ranges::any_of(trial_stops_, is_beyond);
    has_closed = has_closed || closes;
    (closes ? closed : open) = trial_length;
    std::swap(closes ? end_stops_ : start_stops_, trial_stops_);
  }
  if (!has_closed) return length;
  if (has_left && closed <= kShortestHop * step) return std::min(2.0 * closed, length);
  // no solver sees it closed yet where the step before it ends
  double lead = 0.0;
  for (const StopGap& stop : end_stops_)
    if (stop.exists() && stop.gap < 0.0 && stop.rate < 0.0) lead = std::max(lead, -kLeadGap * stop.reach / stop.rate);
  if (open <= lead) return closed;
  *crossing = closed - open + lead;
  return open - lead;
}

}  // namespace gravitas::kernel
