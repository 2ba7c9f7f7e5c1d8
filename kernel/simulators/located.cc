// Simulators `Bisection` and `Continuous`: inner steps end at impacts, so that nothing passes through another, and each is
// solved where it happens. Both look at trials from the same state and commit the one that ends there; the steps before
// it are cut so that the last is short against the flight (the solver takes slow arrivals for rest).
//
//   Continuous   asks the collision slot for times of impact on the way from S_n to S*; event_location.h says where to
//                stop. Pairs that touch at the start are the solver's: what they run into next is found at S* (turns.cc).
//   Bisection    (§ 1.4) halves trials until one ends just after a contact closes (halving.cc).
//
// Both also end inner steps where surfaces stop sliding on each other (slides.cc), up to some number in a step. A Zeno
// sequence ends where flights are shorter than kShortestFlight of the step, or after kMostInnerSteps (of Bisection, with some 45
// trials each, kMostBisections): the rest is Basic's.
#include <algorithm>

#include "kernel/environment.h"
#include "kernel/simulators/location.h"
#include "plugin_sdk/discrepancy.h"
#include "plugin_sdk/event_location.h"

namespace gravitas::kernel {
namespace {

constexpr int kMostInnerSteps = 10'000, kMostBisections = 200, kMostTrials = 200;
constexpr std::size_t kMostSlides = 8, kMostSlidesOfPair = 4;    // whose ends are met in a step
constexpr double kSlopOfArm = 2e-9, kSlopOfCoordinates = 4e-15;  // twice the gaps that solvers take for none

}  // namespace

void Environment::locate_events(double begin, double length) {
  const bool bisects = description_.simulator == Simulator::kBisection;
  double done = 0.0;
  bool is_near = false;
  std::size_t slides = 0;
  for (int inner = 0; done < length && !must_restart_; ++inner) {
    const double left = length - done;
    double stop = left, lead = left;
    bool has_found_contacts = false;
    begin_inner_step(begin + done, left);
    Trusted<TrialState> trial = integrate();
    if (inner < (bisects ? kMostBisections : kMostInnerSteps)) {
      stop = bisects ? bisect(trial, begin + done, left, &is_near) : first_impact(trial, begin + done, left).length;
      lead = stop;
      has_found_contacts = bisects && stop == data_.time_step[0];
      if (stop != data_.time_step[0]) {
        begin_inner_step(begin + done, stop);
        trial = integrate();
      }
      stop = shorten_turns(&trial, begin + done, stop, &has_found_contacts);
    }
    const double before = stop;
    const std::optional<Trusted<Solution>> solution =
        slides < kMostSlides + kMostSlidesOfPair * (front().touching.size() / 2)
            ? react_until_a_slide_ends(trial, begin + done, &stop, has_found_contacts)
            : react(trial, has_found_contacts);
    if (!write_what_joints_bear(trial, solution)) return;
    slides += stop < before ? 1 : 0;
    // what was cut on the way ends far from the impact
    is_near = is_near && stop == lead;
    end_inner_step();
    done = stop == left ? length : done + stop;
  }
}

NextStop Environment::first_impact(const Trusted<TrialState>& trial, double begin, double length) {
  data_.target_gap[0] = kTargetShare * margin_;
  const double shortest_flight = kShortestFlight * length_of_step(step_count_ + 1);
  double left = length;
  for (int i = 0;; ++i) {
    bound_motions(i == 0 ? trial : integrate(), left);
    find_impacts(find_pairs());
    NextStop next{left, false};
    bool looks_again = false;  // a pair that asks for it may meet before another makes the step end
    std::span<const std::uint32_t> touching = front().touching.span();
    for (std::size_t k = 0; k < data_.impact_pair.size(); ++k) {
      const auto pair = data_.pair.span().subspan(2 * data_.impact_pair[k], 2);
      Encounter met = encounter(k);
      // the solver has them, whatever gap it left
      if (starts_with(pair, &touching)) {
        met.left_gap = met.gap - 0.5 * (met.start_speed + met.end_speed) * met.fraction * left;
        met.fraction = met.gap = 0.0, met.is_touching = true;
      }
      if (met.fraction <= 0.0) {
        met.turning_speed = turning_speed(pair);
        const LocalBound &one = model_.bound[pair[0]], &two = model_.bound[pair[1]];
        met.harmless_depth = harmless_depth(one, two);
        // what is unbounded has no other side
        if (one.reach > 0.0 && two.reach > 0.0) met.most_pressed = met.harmless_depth;
        if (met.turning_speed * left > met.harmless_depth)
          met.bounce_speed = !met.is_touching ? met.start_speed : inner_ > 0 ? bounce_speed(pair) : 0.0;
      }
      const NextStop stop = stop_before(met, left, data_.target_gap[0], shortest_flight);
      looks_again = looks_again || stop.is_trial;
      if (stop.length < next.length) next = stop;
    }
    if (!looks_again || i == kMostTrials) return {std::max(next.length, kFinest * length), false, next.meets};
    left = next.length;
    begin_inner_step(begin, left);
  }
}

double Environment::bounce_speed(std::span<const std::uint32_t> pair) const {
  double fastest = 0.0;
  for (std::size_t i = 0; i < data_.contact_key.size(); ++i) {
    if (!std::ranges::equal(data_.contact_body.span().subspan(2 * i, 2), pair)) continue;
    if (vector_at(data_.contact_impulse.span(), i).isZero(0.0)) continue;
    const Vector3 parting =
        contact_velocity(data_, i, front().position, front().linear_velocity, front().angular_velocity);
    fastest = std::max(fastest, vector_at(data_.contact_normal.span(), i).dot(parting));
  }
  return fastest;
}

Encounter Environment::encounter(std::size_t impact) const {
  const double fraction = data_.impact_fraction[impact];
  const auto centre_of = [&](std::uint32_t body) {
    return Vector3(vector_at(front().position.span(), body) + fraction * vector_at(data_.displacement.span(), body));
  };
  const auto velocity = [&](std::uint32_t body, const Column<double>& linear, const Column<double>& angular) {
    const Vector3 arm = vector_at(data_.impact_point.span(), impact) - centre_of(body);
    return Vector3(vector_at(linear.span(), body) + vector_at(angular.span(), body).cross(arm));
  };
  const auto speed = [&](const Column<double>& linear, const Column<double>& angular) {
    const std::uint32_t* pair = &data_.pair[2 * data_.impact_pair[impact]];
    return vector_at(data_.impact_normal.span(), impact)
        .dot(velocity(pair[1], linear, angular) - velocity(pair[0], linear, angular));
  };
  const Vector3 point = vector_at(data_.impact_point.span(), impact);
  double arm = 0.0;
  for (const std::uint32_t body : data_.pair.span().subspan(2 * data_.impact_pair[impact], 2))
    if (model_.inverse_mass[body] > 0.0) arm = std::max(arm, (point - centre_of(body)).norm());
  const double slop = kSlopOfArm * arm + kSlopOfCoordinates * point.cwiseAbs().maxCoeff();
  return {fraction, -data_.impact_depth[impact], speed(start_linear_velocity(), start_angular_velocity()),
          speed(data_.trial_linear_velocity, data_.trial_angular_velocity), slop};
}

}  // namespace gravitas::kernel
