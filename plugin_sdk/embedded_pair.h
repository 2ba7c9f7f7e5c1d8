// For authors of integrators: explicit Runge-Kutta pairs in the group chart (motion_stages.h) with error control.
//
// A step is made of inner steps of its own choice, the last of which ends on the step's boundary. The pair tells the
// error E of an inner step; it is accepted where E <= Accuracy, and the next one is
//
//   0.9 h E^-kExponent E_before^kMemory       (E over Accuracy)
//
// long, by between 0.2 and 5 times. So Accuracy bounds the error of an inner step, not that of the end, which gathers
// them. The length that the last one would have had is kept in plugin_state for the step to come; without, the first one
// is guessed from the first two derivatives (Hairer, Norsett, Wanner, Solving ODEs I, II.4). The answer's error_estimate is
// the largest E / Accuracy of the step. Refused, with the body's number: what no inner step can follow.
//
// A pair is a type with
//   kStages             stages, the last one at the end of the inner step: the next one's first
//   kErrorStages        those that its error needs; the others wait until the step is accepted
//   kNodes, kWeights    c_i, and a_ij by rows
//   kOrder, kExponent, kMemory
//   error(stages, h)    E of the inner step
#pragma once

#include <algorithm>
#include <cmath>
#include <span>
#include <vector>

#include "plugin_sdk/error_control.h"
#include "plugin_sdk/math/transcendental.h"
#include "plugin_sdk/motion_stages.h"

namespace gravitas {

// Of e = h sum_i d_i k_i, d the weights:
//   max over bodies of |e_x| / (1 m), |e_r| / (1 rad), |e_v| / max(1 m/s, |v|), |e_w| / max(1 rad/s, |w|),
// infinite where one is not finite.
inline double largest_error(const MotionStages<GroupChart>& stages, std::span<const double> weights, double h) {
  double largest = 0.0;
  for (std::size_t i = 0; i < stages.size(); ++i) {
    if (!stages.is_movable(i)) continue;
    const auto error = stages.weighted(i, weights, h);
    const Twist& twist = stages.start(i).twist;
    for (const double e :
         {error.velocity.norm(), error.turn.norm(), error.linear.norm() / std::max(1.0, twist.linear.norm()),
          error.angular.norm() / std::max(1.0, twist.angular.norm())})
      largest = e <= largest ? largest : e;
    if (!std::isfinite(largest)) return HUGE_VAL;
  }
  return largest;
}

template <typename Pair>
class EmbeddedPair : public IntegratorPlugin {
 public:
  explicit EmbeddedPair(PropertyCursor settings) : accuracy_(settings.number()) {}

  void integrate(const stage::IntegratorIntegrateRequest& request, const stage::IntegratorIntegrateReply& reply,
                 Host& host) override {
    Derivatives derivatives(request, host, &room_);
    stages_.begin(request, &derivatives, Pair::kStages);
    const double whole = request.time_step();
    host.mark_progress();
    if (!evaluate(0, 1, whole)) throw Refusal("the state is not finite");
    double inner = remembered_inner_step(request.plugin_state(), whole);
    if (inner == 0.0) inner = first_inner_step(whole);
    double done = 0.0, before = 1.0, worst = 0.0;
    while (done < whole) {
      require_inner_step(inner, whole);
      const double h = next_inner_step(inner, whole - done);
      const double error = evaluate(1, Pair::kErrorStages, h) ? Pair::error(stages_, h) / accuracy_ : HUGE_VAL;
      if (error <= 1.0 && evaluate(Pair::kErrorStages, Pair::kStages, h)) {
        worst = std::max(worst, error);
        stages_.advance(Pair::kStages - 1, h);
        done = h == whole - done ? whole : done + h;
        const double longer = factor(error, before);
        // a step cut short at a boundary says little of long ones
        inner = longer < kFastest ? longer * h : std::max(inner, longer * h);
        before = std::max(error, 1e-4);
      } else {
        inner = h * (error > 1.0 && std::isfinite(error) ? std::min(1.0, factor(error, 1.0)) : 0.1);
      }
      host.mark_progress();
    }
    for_each_body(request, reply, [&](std::size_t i, const BodyState&) { return stages_.start(i); });
    reply.plugin_state().push(inner);
    reply.error_estimate().set(worst);
  }

 private:
  static constexpr double kSafety = 0.9, kSlowest = 0.2, kFastest = 5.0;

  // False where a state is not finite.
  bool evaluate(std::size_t from, std::size_t to, double h) {
    for (std::size_t stage = from; stage < to; ++stage)
      if (!stages_.evaluate(stage, Pair::kWeights[stage], Pair::kNodes, h)) return false;
    return true;
  }

  // So long that states change by some hundredths of 1 m, 1 rad and their speeds at the most, and that derivatives changing
  // as they do at first leave an error far below Accuracy.
  double first_inner_step(double whole) {
    constexpr double kSmall = 0.01, kLonger = 100.0;
    constexpr double kFirst[] = {1.0}, kChange[] = {-1.0, 1.0}, kEuler[] = {0.0, 1.0};
    const double rate = largest_error(stages_, kFirst, 1.0);
    if (rate == 0.0) return whole;
    const double trial = std::min(whole, kSmall / rate);
    if (!stages_.evaluate(1, kFirst, kEuler, trial)) return trial;
    const double fastest = std::max(rate, largest_error(stages_, kChange, 1.0) / trial);
    const double exact = math::pow(kSmall * accuracy_ / fastest, 1.0 / (Pair::kOrder + 1));
    return std::min({whole, kLonger * trial, exact});
  }

  // By how much the next step is longer.
  static double factor(double error, double before) {
    if (error == 0.0) return kFastest;
    const double wanted = kSafety * math::pow(error, -Pair::kExponent) * math::pow(before, Pair::kMemory);
    return std::clamp(wanted, kSlowest, kFastest);
  }

  double accuracy_;
  MotionStages<GroupChart> stages_;  // scratch
  std::vector<double> room_;         // scratch
};

}  // namespace gravitas
