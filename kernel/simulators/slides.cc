// Ends of slides, for simulators that locate events: an inner step ends where surfaces stop sliding on each other, or turn
// back. Coulomb's friction jumps there; a step across it is off by a share of what friction does in a step.
//
// The end is estimated from the solution of a trial (`Slide`: friction used, or speeds at both ends), trials are cut to the
// estimate until one ends there, and that one is committed as it is. Where friction does not change on the way one cut is
// enough, and with an integrator of order 2 the motion is exact: a box stops, a ball comes to roll, to rounding. Slides
// shorter than kShortestSlide of the step count as ended.
#include <algorithm>
#include <limits>

#include "kernel/environment.h"
#include "plugin_sdk/event_location.h"
#include "plugin_sdk/solver.h"

namespace gravitas::kernel {
namespace {

constexpr int kMostSlideTrials = 30;
constexpr double kShortestSlide = 1e-6;  // of the step
constexpr double kSlideShare = 1e-9;     // of the slide: how closely its end is met

}  // namespace

std::optional<Trusted<Solution>> Environment::react_until_a_slide_ends(Trusted<TrialState> trial, double begin,
                                                                       double* length, bool has_found_contacts) {
  const double shortest = kShortestSlide * length_of_step(step_count_ + 1);
  // velocity of b relative to a where body b's surface is, or a's
  const auto slip = [&](std::size_t contact, const Column<double>& linear, const Column<double>& angular) {
    const auto at = [&](std::size_t end, double side) {
      const std::uint32_t body = data_.contact_body[2 * contact + end];
      const Vector3 surface =
          vector_at(data_.contact_point.span(), contact) +
          0.5 * side * data_.contact_depth[contact] * vector_at(data_.contact_normal.span(), contact);
      const Vector3 arm = surface - vector_at(data_.trial_position.span(), body);
      return Vector3(vector_at(linear.span(), body) + vector_at(angular.span(), body).cross(arm));
    };
    return Vector3(at(1, -1.0) - at(0, 1.0));
  };
  // the end of the first slide of any two bodies
  const auto first_end = [&](double trial_length) {
    double first = std::numeric_limits<double>::infinity();
    for (std::size_t i = 0; i < data_.contact_key.size();) {
      Slide slide;
      double gained = 0.0;
      const std::size_t pair = i;
      for (; i < data_.contact_key.size() && data_.contact_pair[i] == data_.contact_pair[pair]; ++i) {
        const Vector3 start = slip(i, start_linear_velocity(), start_angular_velocity());
        slide.add(vector_at(data_.contact_normal.span(), i),
                  data_.contact_material[kMaterialColumns * i + kDynamicFriction], start,
                  slip(i, data_.solved_linear_velocity, data_.solved_angular_velocity),
                  vector_at(data_.contact_impulse.span(), i));
      }
      for (std::size_t end = 0; end < 2; ++end) {
        const std::uint32_t body = data_.contact_body[2 * pair + end];
        gained = std::max(gained, (vector_at(data_.trial_linear_velocity.span(), body) -
                                   vector_at(start_linear_velocity().span(), body))
                                      .norm());
      }
      // what is slower has stopped
      const double end = slide.end(trial_length);
      if (slide.start_speed() * trial_length > shortest * gained && end > shortest) first = std::min(first, end);
    }
    return first;
  };
  const double whole = *length;
  double clear = 0.0, stopped = whole;
  for (int i = 0;; ++i) {
    std::optional<Trusted<Solution>> solution = react(trial, has_found_contacts);
    if (!solution) return std::nullopt;
    has_found_contacts = false;
    const double end = first_end(*length);
    const bool slides_on = end > *length;
    if (i == kMostSlideTrials || (slides_on ? *length == whole : end >= (1.0 - kSlideShare) * *length)) return solution;
    (slides_on ? clear : stopped) = *length;
    // a little beyond the end, so that the trial has it
    const double next = (1.0 + 0.1 * kSlideShare) * end;
    *length = next > clear && next < stopped ? next : 0.5 * (clear + stopped);
    begin_inner_step(begin, *length);
    trial = integrate();
  }
}

}  // namespace gravitas::kernel
