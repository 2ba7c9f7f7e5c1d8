// Limits of joints that open within an inner step of `Smooth`, and stops that are pressed again within it.
//
// Where a limit opens its force, which fell to zero, stays there: a kink, which costs a method its order. So an inner step ends just
// behind it. What the limit bears while it holds tells where: the secant of the last two trials that hold leads to it.
//
// Reactions go by what was closed where an inner step begins. What a stop let go of and comes back to it within the same inner
// step goes on into it, and would be put out of it at the end, against whatever presses there; and what presses while it flies off,
// near the stop, is held off, as if it still stood there. A stiff spring, or a chain that whips, would be given energy. So such an
// inner step ends in the flight, where the stop is open for the next one, which meets it in its turn (stops.cc).
#include <algorithm>
#include <cmath>
#include <cstddef>
#include <span>
#include <string>
#include <utility>
#include <vector>

#include "kernel/environment.h"
#include "kernel/simulators/location.h"

namespace gravitas::kernel {
namespace {

constexpr int kMostOpeningLooks = 40, kMostFlightLooks = 24, kMostHalvings = 10, kHalvedLooks = 4;
// Of the length, to which it is known where a limit opens (what that is off by counts with its square), where a flight begins.
constexpr double kOpeningShare = 1e-6, kFlightShare = 1.0 / 64;
constexpr double kNearEnd =
    0.75;  // of the length: an integrator that asks for nothing behind it does not see what opens there

// Where the first limit bears no more, at most `latest`, by the secant of what joints bore in trials of these two lengths.
double zero_of_limits(const StepData& data, std::span<const double> borne, double held, double tried, double latest) {
  double zero = latest;
  for (std::size_t i = 0; i < borne.size(); ++i) {
    const double bears = std::abs(data.held_force[i]), falls = (std::abs(borne[i]) - bears) / (tried - held);
    if (falls > 0.0 && may_open(data.discrepancies, i)) zero = std::min(zero, tried + bears / falls);
  }
  return zero;
}

}  // namespace

void Environment::note_what_joints_bear() {
  data_.held_force.assign(data_.discrepancy_force);
  const bool is_first = least_borne_.size() != data_.held_force.size();
  if (is_first) first_borne_.assign(data_.held_force.span().begin(), data_.held_force.span().end());
  if (is_first) least_borne_.resize(data_.held_force.size());
  for (std::size_t i = 0; i < least_borne_.size(); ++i) {
    const double borne = std::abs(data_.held_force[i]);
    least_borne_[i] = is_first ? borne : std::min(least_borne_[i], borne);
  }
}

// A trial that holds stops which it has left long ago may come to where no integrator can follow it: half of it is tried then.
Trusted<TrialState> Environment::integrate_shorter(double begin, double* length) {
  for (int halvings = 0;; ++halvings, *length *= 0.5) {
    begin_inner_step(begin, *length);
    try {
      return integrate(halvings < kMostHalvings);
    } catch (const StageFault& fault) {
      if (halvings == kMostHalvings || fault.kind != FaultKind::kRefusal || fault.slot != Slot::kIntegrator) throw;
    }
    if (refused_trials_.first++ == 0) refused_trials_.second = step_count_ + 1;
  }
}

std::string Environment::why_shortened(std::uint32_t times, std::uint32_t step) {
  return "from step " + std::to_string(step) + " on the integrator refused trials of whole steps (" +
         std::to_string(times) + " in all), which were made in shorter ones";
}

// The trial, which is in S*, or a shorter one that ends just behind where the first limit opens which bears at its beginning.
Trusted<TrialState> Environment::end_at_opening(Trusted<TrialState> trial, double begin, double* length) {
  const auto opens = [&] {
    for (std::size_t i = 0; i < least_borne_.size(); ++i)
      if (first_borne_[i] != 0.0 && least_borne_[i] == 0.0 && may_open(data_.discrepancies, i)) return true;
    return false;
  };
  if (!opens() || data_.derivative_time[0] - data_.time[0] < kNearEnd * *length) return trial;
  const double finest = kOpeningShare * *length;
  double holds = 0.0, known = 0.0, open = *length, zero = open, next = 0.5 * open;
  borne_ = first_borne_;
  for (int i = 1; i <= kMostOpeningLooks && open - known > finest; ++i) {
    double tried =
        i % kHalvedLooks == 0 ? 0.5 * (holds + open) : std::clamp(next, holds + 0.5 * finest, open - 0.5 * finest);
    trial = integrate_shorter(begin, &tried);
    if (opens()) {
      open = tried, next = 0.5 * (holds + open);
    } else {
      // from below, until zeros agree
      const double before = std::exchange(zero, zero_of_limits(data_, borne_, holds, tried, open));
      const double off = std::abs(zero - before);
      holds = tried, known = off <= finest ? std::max(holds, zero) : holds;
      next = off <= finest ? zero + 0.5 * finest : zero - 0.25 * off;
      borne_.assign(data_.held_force.span().begin(), data_.held_force.span().end());
    }
  }
  *length = open;
  return data_.time_step[0] == open ? trial : integrate_shorter(begin, length);
}

// Where stops are pressed again in S*: how long an inner step is that ends while they are open. In end_stops_ are the stops where it
// ends, before and after.
double Environment::length_of_flight(double begin, double length) {
  const auto has_let_go = [&](std::size_t k) { return k / 2 < least_borne_.size() && least_borne_[k / 2] == 0.0; };
  const auto is_pressed_again = [&](const std::vector<StopGap>& stops, std::size_t k) {
    return has_let_go(k) && stops[k].is_pressed_again(first_stops_[k], data_.held_force[k / 2] != 0.0);
  };
  const auto pressed_again = [&](const std::vector<StopGap>& stops) {
    std::vector<std::size_t> all;
    for (std::size_t k = 0; k < stops.size(); ++k)
      if (is_pressed_again(stops, k)) all.push_back(k);
    return all;
  };
  std::vector<std::size_t> again = pressed_again(end_stops_);
  if (again.empty()) return length;
  double closed = 0.0, open = 0.0, pressed = length;
  for (int i = 0; i < kMostFlightLooks && (open == 0.0 || open - closed > kFlightShare * length); ++i) {
    const double middle = 0.5 * (closed + (open > 0.0 ? open : pressed));
    begin_inner_step(begin, middle);
    constrain(integrate());
    find_stops(true, &trial_stops_);
    if (trial_stops_.size() != first_stops_.size()) return length;
    const bool flies =
        std::ranges::any_of(again, [&](std::size_t k) { return has_let_go(k) && trial_stops_[k].is_open(); });
    if (std::vector<std::size_t> now = pressed_again(trial_stops_); !now.empty()) {
      pressed = middle, open = 0.0;
      again = std::move(now);
    } else {
      (flies ? open : closed) = middle;
    }
  }
  const double end = open > 0.0 ? open : pressed;
  begin_inner_step(begin, end);
  constrain(integrate());
  find_stops(true, &end_stops_);
  return end;
}

}  // namespace gravitas::kernel
