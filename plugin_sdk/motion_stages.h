// For authors of integrators: the stages of an explicit Runge-Kutta step of free bodies.
//
// In a step from (x0, q0, v0, w0) at t0 over h, with nodes c_1 = 0, none above 1, and weights a_ij, stage i is at
//
//   x_i = x0 + h sum_j a_ij v_j    v_i = v0 + h sum_j a_ij a_j      (w_i likewise, with alpha_j)
//   q_i = chart(q0, h sum_j a_ij r_j)
//
// r is the rate of the attitude's coordinates in a chart (below), a and alpha are the accelerations of the stage's
// state, without damping. With damping d the method is applied to what deviates from the motion under the accelerations of
// the start, which is known (damped_motion: x_c, v_c, r_c, w_c at times after the start), with d as an integrating factor
// (Lawson 1967):
//
//   x_i = x0 + x_c(c_i h) + h sum_j a_ij (v_j - v_c(c_j h))        (attitudes likewise, with r_j and the rate of w_c)
//   v_i = v_c(c_i h) + h sum_j a_ij e^(-d (c_i - c_j) h) (a_j - a_1)
//
// So free bodies slow by e^(-d h) and come as far as that takes them, and bodies under constant accelerations come to the
// speed where damping balances them, exactly at any step; the method keeps its order. What changes within a step with
// d h >> 1 is met as without damping, by the order.
#pragma once

#include <span>
#include <vector>

#include "plugin_sdk/integrator.h"
#include "plugin_sdk/math/rotation.h"

namespace gravitas {

// Attitudes by rotation vectors from q0 (Munthe-Kaas 1999): every stage is a rotation.
struct GroupChart {
  using Coordinates = Vector3;
  static Coordinates zero() { return Vector3::Zero(); }
  static Quaternion at(const Quaternion& q0, const Coordinates& r) { return rotate_by(q0, r); }
  static Coordinates coordinates(const Quaternion& q0, const Quaternion& q) { return log_rotation(q * q0.conjugate()); }
  static Coordinates rate(const Quaternion&, const Coordinates& r, const Vector3& w) {
    return rotation_vector_rate(r, w);
  }
};

// Attitudes as four numbers with q' = (0, w) q / 2, renormalised where they are used.
struct QuaternionChart {
  using Coordinates = Eigen::Vector4d;  // (x, y, z, w), as Eigen keeps a quaternion
  static Coordinates zero() { return Coordinates::Zero(); }
  static Quaternion at(const Quaternion& q0, const Coordinates& change) {
    return change.isZero(0.0) ? q0 : normalized(Quaternion(Coordinates(q0.coeffs() + change)));
  }
  static Coordinates rate(const Quaternion& q0, const Coordinates& change, const Vector3& w) {
    const Quaternion q(Coordinates(q0.coeffs() + change));
    return 0.5 * (Quaternion(0.0, w.x(), w.y(), w.z()) * q).coeffs();
  }
};

template <typename Chart>
class MotionStages {
 public:
  struct Rate {
    Vector3 velocity, linear, angular;
    typename Chart::Coordinates turn;
  };

  // Starts at the request's state. `derivatives` must live as long as the steps from here.
  void begin(const stage::IntegratorIntegrateRequest& request, Derivatives* derivatives, std::size_t stages) {
    request_ = &request;
    derivatives_ = derivatives;
    time_ = request.time();
    const std::size_t bodies = derivatives->size();
    start_.resize(bodies), rates_.resize(stages * bodies), deviations_.resize(stages * bodies), trial_.resize(bodies);
    for (std::size_t i = 0; i < bodies; ++i) start_[i] = derivatives->start(i);
  }

  // Evaluates stage `stage` at node c[stage] with the row a of weights of the earlier ones. False, having asked nothing,
  // where its state is not finite.
  bool evaluate(std::size_t stage, std::span<const double> a, std::span<const double> c, double h) {
    return evaluate_at(
        stage, c[stage] * h, [&](std::size_t i) { return combined(i, a.first(stage), c, c[stage], h); },
        [&](std::size_t i, const BodyState&) { return turned(i, a.first(stage), c[stage], h); });
  }

  // Evaluates stage `stage` at states that come from elsewhere, `elapsed` after the start.
  template <typename StateOf>
  bool evaluate_at(std::size_t stage, double elapsed, StateOf&& state_of) {
    return evaluate_at(stage, elapsed, state_of, [&](std::size_t i, const BodyState& state) {
      return Chart::coordinates(start_[i].pose.orientation, state.pose.orientation);
    });
  }

  // State of a movable body at node `end` with the weights of the first stages.
  BodyState combined(std::size_t body, std::span<const double> weights, std::span<const double> c, double end,
                     double h) const {
    const BodyState& s = start_[body];
    if (weights.empty()) return s;
    const double damping = damping_of(body);
    Vector3 moved = Vector3::Zero();
    Twist twist = s.twist;
    if (damping != 0.0) {
      const DampedMotion known = known_motion(body, end * h);
      moved = known.moved, twist = known.twist;
    }
    Vector3 linear = Vector3::Zero(), angular = Vector3::Zero();
    for (std::size_t j = 0; j < weights.size(); ++j) {
      if (weights[j] == 0.0) continue;
      const Rate& r = deviation(j, body);
      moved += h * weights[j] * r.velocity;
      // where nodes go back the factor grows beyond all numbers: nothing stays nothing
      if (r.linear.isZero(0.0) && r.angular.isZero(0.0)) continue;
      const double slowed = h * weights[j] * damping_factor(damping, (end - c[j]) * h);
      linear += slowed * r.linear;
      angular += slowed * r.angular;
    }
    BodyState state;
    state.pose.position = moved.isZero(0.0) ? s.pose.position : Vector3(s.pose.position + moved);
    state.pose.orientation = Chart::at(s.pose.orientation, turned(body, weights, end, h));
    state.twist = {twist.linear + linear, twist.angular + angular};
    return state;
  }

  // The sum of a body's rates with weights.
  Rate weighted(std::size_t body, std::span<const double> weights, double h) const {
    Rate sum{Vector3::Zero(), Vector3::Zero(), Vector3::Zero(), Chart::zero()};
    for (std::size_t j = 0; j < weights.size(); ++j) add(h * weights[j], h * weights[j], rate(j, body), &sum);
    return sum;
  }

  // By how much a body's state at the end, node 1, would change with its weights, for error estimates.
  Rate difference(std::size_t body, std::span<const double> weights, std::span<const double> c, double h) const {
    Rate sum{Vector3::Zero(), Vector3::Zero(), Vector3::Zero(), Chart::zero()};
    for (std::size_t j = 0; j < weights.size(); ++j) {
      const double slowed = h * weights[j] * damping_factor(damping_of(body), (1.0 - c[j]) * h);
      add(h * weights[j], slowed, deviation(j, body), &sum);
    }
    return sum;
  }

  // Goes on from the end of a step whose last stage, `last`, was evaluated there: it becomes the first stage.
  void advance(std::size_t last, double h) {
    time_ += h;
    for (std::size_t i = 0; i < start_.size(); ++i) {
      start_[i] = trial_.at(i);
      if (!is_movable(i)) continue;
      Rate& first = rates_[i];
      first = rate(last, i);
      first.turn = Chart::rate(start_[i].pose.orientation, Chart::zero(), start_[i].twist.angular);
      deviations_[i] = deviation_of(0, i, 0.0);
    }
  }

  const BodyState& start(std::size_t body) const { return start_[body]; }
  const Rate& rate(std::size_t stage, std::size_t body) const { return rates_[stage * start_.size() + body]; }
  // The same, without damping, and with it what the rates deviate from those of the known motion by.
  const Rate& deviation(std::size_t stage, std::size_t body) const { return deviations_[stage * start_.size() + body]; }
  bool is_movable(std::size_t body) const { return (request_->flags()[body] & kMovable) != 0; }
  std::size_t size() const { return start_.size(); }

 private:
  static bool is_finite(const BodyState& s) {
    return s.pose.position.allFinite() && s.pose.orientation.coeffs().allFinite() && s.twist.linear.allFinite() &&
           s.twist.angular.allFinite();
  }
  BodyState carried(std::size_t body, double elapsed) const {
    const bool moves = (request_->flags()[body] & kKinematic) != 0;
    return moves ? detail::keep_moving(start_[body], elapsed) : start_[body];
  }
  template <typename StateOf, typename TurnOf>
  bool evaluate_at(std::size_t stage, double elapsed, StateOf&& state_of, TurnOf&& turn_of) {
    bool finite = true;
    for (std::size_t i = 0; i < start_.size(); ++i) {
      const BodyState state = is_movable(i) ? state_of(i) : carried(i, elapsed);
      finite = finite && is_finite(state);
      trial_.set(i, state);
    }
    if (!finite) return false;
    const std::span<const double> wrenches = derivatives_->wrenches(time_ + elapsed, trial_);
    for (std::size_t i = 0; i < start_.size(); ++i) {
      if (!is_movable(i)) continue;
      const BodyState state = trial_.at(i);
      const Acceleration acceleration = derivatives_->acceleration(i, state, wrenches);
      rates_[stage * start_.size() + i] = {
          state.twist.linear, acceleration.linear, acceleration.angular,
          Chart::rate(start_[i].pose.orientation, turn_of(i, state), state.twist.angular)};
      deviations_[stage * start_.size() + i] = deviation_of(stage, i, elapsed);
    }
    return true;
  }
  typename Chart::Coordinates turned(std::size_t body, std::span<const double> weights, double end, double h) const {
    typename Chart::Coordinates sum = Chart::zero();
    if (damping_of(body) != 0.0 && !weights.empty()) sum = rate_of(body, known_motion(body, end * h).turned);
    for (std::size_t j = 0; j < weights.size(); ++j)
      if (weights[j] != 0.0) sum += h * weights[j] * deviation(j, body).turn;
    return sum;
  }
  Rate deviation_of(std::size_t stage, std::size_t body, double elapsed) const {
    Rate off = rate(stage, body);
    if (damping_of(body) == 0.0) return off;
    if (stage == 0) return {Vector3::Zero(), Vector3::Zero(), Vector3::Zero(), Chart::zero()};
    const Twist known = known_motion(body, elapsed).twist;
    off.velocity -= known.linear, off.turn -= rate_of(body, known.angular);
    off.linear -= rate(0, body).linear, off.angular -= rate(0, body).angular;
    return off;
  }
  DampedMotion known_motion(std::size_t body, double elapsed) const {
    const Rate& first = rate(0, body);
    return damped_motion(start_[body].twist, {first.linear, first.angular}, damping_of(body), elapsed);
  }
  typename Chart::Coordinates rate_of(std::size_t body, const Vector3& angular_velocity) const {
    return Chart::rate(start_[body].pose.orientation, Chart::zero(), angular_velocity);
  }
  static void add(double poses, double velocities, const Rate& rate, Rate* sum) {
    sum->velocity += poses * rate.velocity, sum->turn += poses * rate.turn;
    sum->linear += velocities * rate.linear, sum->angular += velocities * rate.angular;
  }
  double damping_of(std::size_t body) const { return request_->damping()[body]; }

  const stage::IntegratorIntegrateRequest* request_ = nullptr;
  Derivatives* derivatives_ = nullptr;
  double time_ = 0.0;
  std::vector<BodyState> start_;
  std::vector<Rate> rates_, deviations_;
  TrialColumns trial_;
};

// One step of the classical Runge-Kutta method in a chart: nodes 0, 1/2, 1/2, 1, weights 1/6, 1/3, 1/3, 1/6.
template <typename Chart>
void integrate_rk4(const stage::IntegratorIntegrateRequest& request, const stage::IntegratorIntegrateReply& reply,
                   Host& host, MotionStages<Chart>* stages, std::vector<double>* room) {
  static constexpr double kNodes[] = {0.0, 0.5, 0.5, 1.0};
  static constexpr double kWeights[4][3] = {{0, 0, 0}, {0.5, 0, 0}, {0, 0.5, 0}, {0, 0, 1}};
  static constexpr double kEnd[] = {1.0 / 6.0, 1.0 / 3.0, 1.0 / 3.0, 1.0 / 6.0};
  Derivatives derivatives(request, host, room);
  const double h = request.time_step();
  stages->begin(request, &derivatives, 4);
  for (std::size_t i = 0; i < 4; ++i)
    if (!stages->evaluate(i, kWeights[i], kNodes, h)) throw Refusal("a stage comes to a state that is not finite");
  for_each_body(request, reply,
                [&](std::size_t body, const BodyState&) { return stages->combined(body, kEnd, kNodes, 1.0, h); });
}

}  // namespace gravitas
