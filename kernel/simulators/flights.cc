// Stops that are pressed again within an inner step of `Smooth`, and trials that the integrator refuses.
//
// Reactions go by what was closed where an inner step begins. What a stop let go of and comes back to it within the same inner
// step goes on into it, and would be put out of it at the end, against whatever presses there; and what presses while it flies off,
// near the stop, is held off, as if it still stood there. A stiff spring, or a chain that whips, would be given energy. So such an
// inner step ends in the flight, where the stop is open for the next one, which meets it in its turn (stops.cc).
#include <algorithm>
#include <cstddef>
#include <string>
#include <utility>
#include <vector>

#include "kernel/environment.h"
#include "kernel/simulators/location.h"

namespace gravitas::kernel {
namespace {

constexpr int kMostFlightLooks = 24, kMostHalvings = 10;
constexpr double kFlightShare = 1.0 / 64;  // of the length, to which it is known where a flight begins

}  // namespace

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
