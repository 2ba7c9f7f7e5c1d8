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
// the largest E / Accuracy of the step. Refused: what no inner step can follow.
//
// With dense output (dense_step.h) the last inner step goes on past the boundary where nothing but the plugin changed the
// bodies in the step before, and serves the steps within it: each is Simpson's rule with the derivatives of its start, and
// of the states that the inner step says for its middle and end. These must ask for the inner step's accelerations, to
//
//   H |a - a_dense| <= kKept Accuracy  (per max(1 m/s, |v|); angular likewise),
//
// or it is dropped and the step made of inner steps that end with it (a live change of a force).
//
// A pair is a type with
//   kStages             stages, the last one at the end of the inner step: the next one's first
//   kErrorStages        those that its error needs; the others wait until the step is accepted
//   kNodes, kWeights    c_i, and a_ij by rows
//   kOrder, kExponent, kMemory
//   error(stages, h)    E of the inner step
//   kDense              d_j of its dense output; none: it has no such
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <span>
#include <vector>

#include "plugin_sdk/dense_step.h"
#include "plugin_sdk/error_control.h"
#include "plugin_sdk/math/transcendental.h"
#include "plugin_sdk/motion_stages.h"

namespace gravitas {

// Of e, a change of a body's state:
//   max over bodies of |e_x| / (1 m), |e_r| / (1 rad), |e_v| / max(1 m/s, |v|), |e_w| / max(1 rad/s, |w|),
// infinite where one is not finite.
template <typename ChangeOf>
double largest_change(const MotionStages<GroupChart>& stages, ChangeOf&& change_of) {
  double largest = 0.0;
  for (std::size_t i = 0; i < stages.size(); ++i) {
    if (!stages.is_movable(i)) continue;
    const auto change = change_of(i);
    const Twist& twist = stages.start(i).twist;
    for (const double e :
         {change.velocity.norm(), change.turn.norm(), change.linear.norm() / std::max(1.0, twist.linear.norm()),
          change.angular.norm() / std::max(1.0, twist.angular.norm())})
      largest = e <= largest ? largest : e;
    if (!std::isfinite(largest)) return HUGE_VAL;
  }
  return largest;
}

// Of e = h sum_i d_i k_i, d the weights.
inline double largest_rate(const MotionStages<GroupChart>& stages, std::span<const double> weights, double h) {
  return largest_change(stages, [&](std::size_t i) { return stages.weighted(i, weights, h); });
}

// Of what the end changes by with the weights: with damping, e^(-d (1 - c_i) h) of what accelerations differ by.
inline double largest_error(const MotionStages<GroupChart>& stages, std::span<const double> weights,
                            std::span<const double> nodes, double h) {
  return largest_change(stages, [&](std::size_t i) { return stages.difference(i, weights, nodes, h); });
}

template <typename Pair>
class EmbeddedPair : public IntegratorPlugin {
 public:
  static constexpr bool kHasDense = requires { Pair::kDense; };

  // With a flag behind Accuracy where the pair has dense output: is it used?
  explicit EmbeddedPair(PropertyCursor settings)
      : accuracy_(settings.number()), is_dense_(kHasDense && settings.flag()) {}

  void integrate(const stage::IntegratorIntegrateRequest& request, const stage::IntegratorIntegrateReply& reply,
                 Host& host) override {
    Derivatives derivatives(request, host, &room_);
    stages_.begin(request, &derivatives, Pair::kStages);
    const double whole = request.time_step();
    double inner = remembered_inner_step(request.plugin_state(), whole);
    bool may_pass = is_dense_ && inner > 0.0 && has_gone_on(request);
    host.mark_progress();
    if (!evaluate(0, 1, whole)) throw Refusal("the state is not finite");
    if (may_pass && dense_.load(request, kOwn) && dense_.left() >= whole && goes_along(request, whole))
      return answer_along(request, reply, {inner, request.plugin_state()[1]}, whole);

    if (inner == 0.0) inner = first_inner_step(whole);
    double done = 0.0, before = 1.0, worst = 0.0;
    while (done < whole) {
      require_inner_step(inner, whole);
      const double left = whole - done;
      const double h = may_pass ? passing_inner_step(request, inner, left) : next_inner_step(inner, left);
      const double error = evaluate(1, Pair::kErrorStages, h) ? Pair::error(stages_, h) / accuracy_ : HUGE_VAL;
      if (error <= 1.0 && evaluate(Pair::kErrorStages, Pair::kStages, h)) {
        const double longer = factor(error, before);
        // a step cut short at a boundary says little of long ones
        inner = longer < kFastest ? longer * h : std::max(inner, longer * h);
        before = std::max(error, 1e-4);
        if (h > left) {
          make_dense(request, h);
          if (goes_along(request, left)) {
            answer_along(request, reply, {inner, error}, left);
            return reply.error_estimate().set(std::max(worst, error));
          }
          may_pass = false;
          continue;
        }
        worst = std::max(worst, error);
        stages_.advance(Pair::kStages - 1, h);
        done = h == left ? whole : done + h;
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
  static constexpr double kKept = 5.0;  // free bodies, oscillators: up to 2
  static constexpr std::array<double, 3> kSimpsonNodes = {0.0, 0.5, 1.0}, kSimpsonWeights = {1.0 / 6, 4.0 / 6, 1.0 / 6};
  // Numbers in front of a dense step in plugin_state: the next inner step's length, and the error estimate of this one.
  static constexpr std::size_t kOwn = 2;

  // Did nothing else change a body since the last answer?
  static bool has_gone_on(const stage::IntegratorIntegrateRequest& request) {
    return std::ranges::none_of(request.state_changed(), [](std::uint32_t changed) { return changed != 0; });
  }

  // Half of what the error at its end allows, since states within it are worse; within what damping lets a dense step be long
  // (dense_step.h).
  static double passing_inner_step(const stage::IntegratorIntegrateRequest& request, double inner, double left) {
    if (inner < 2.0 * left) return next_inner_step(inner, left);
    if (request.damping().empty()) return 0.5 * inner;
    const double most = std::ranges::max(request.damping()), half = 0.5 * inner;
    return most * half <= 1.0 ? half : std::min(half, std::max(left, 1.0 / most));
  }

  void make_dense(const stage::IntegratorIntegrateRequest& request, double h) {
    if constexpr (kHasDense)
      dense_.assign(request, stages_, Pair::kWeights[Pair::kStages - 1], Pair::kDense, Pair::kNodes, h);
  }

  // Evaluates the stages of Simpson's rule over h along the dense step, of which the first is there. False where forces and
  // masses do not ask for its accelerations (any more).
  bool goes_along(const stage::IntegratorIntegrateRequest& request, double h) {
    for (std::size_t stage = 0; stage < kSimpsonNodes.size(); ++stage) {
      const double ahead = kSimpsonNodes[stage] * h;
      const auto state = [&](std::size_t i) { return dense_.at(i, request.damping()[i], ahead); };
      if (stage > 0 && !stages_.evaluate_at(stage, ahead, state)) return false;
      for (std::size_t i = 0; i < stages_.size(); ++i) {
        if (!stages_.is_movable(i)) continue;
        const auto& rate = stages_.rate(stage, i);
        const Acceleration said = dense_.acceleration(i, request.damping()[i], ahead);
        const Twist twist = state(i).twist;
        const double off = std::max((rate.linear - said.linear).norm() / std::max(1.0, twist.linear.norm()),
                                    (rate.angular - said.angular).norm() / std::max(1.0, twist.angular.norm()));
        if (!(dense_.length() * off <= kKept * accuracy_)) return false;
      }
    }
    return true;
  }

  // Answers the end of Simpson's rule over h, and keeps the dense step.
  void answer_along(const stage::IntegratorIntegrateRequest& request, const stage::IntegratorIntegrateReply& reply,
                    std::array<double, kOwn> own, double h) {
    for_each_body(request, reply, [&](std::size_t i, const BodyState&) {
      return stages_.combined(i, kSimpsonWeights, kSimpsonNodes, 1.0, h);
    });
    dense_.go_on(h);
    const std::span<double> room = reply.plugin_state().resize(kOwn + DenseStep::size(stages_.size()));
    if (!room.empty()) {
      std::ranges::copy(own, room.begin());
      dense_.save(request.time() + request.time_step(), room.subspan(kOwn));
    }
    reply.error_estimate().set(own[1]);
  }

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
    const double rate = largest_rate(stages_, kFirst, 1.0);
    if (rate == 0.0) return whole;
    const double trial = std::min(whole, kSmall / rate);
    if (!stages_.evaluate(1, kFirst, kEuler, trial)) return trial;
    const double fastest = std::max(rate, largest_rate(stages_, kChange, 1.0) / trial);
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
  bool is_dense_;
  MotionStages<GroupChart> stages_;  // scratch
  DenseStep dense_;                  // scratch
  std::vector<double> room_;         // scratch
};

}  // namespace gravitas
