// For authors of integrators: the bodies of an Integrator.Integrate call, and derivatives of a trial state.
#pragma once

#include <array>
#include <vector>

#include "plugin_sdk/body.h"
#include "plugin_sdk/derivative_question.h"
#include "plugin_sdk/dynamics.h"
#include "plugin_sdk/math/free_rotor.h"
#include "plugin_sdk/math/transcendental.h"
#include "plugin_sdk/plugin.h"
#include "plugin_sdk/wrench_jacobian.h"

namespace gravitas {

struct BodyState {
  Pose pose;    // of the centre of mass
  Twist twist;  // world
};

// States of all bodies in the layout of the columns.
struct TrialColumns {
  std::vector<double> position, orientation, linear_velocity, angular_velocity;

  void resize(std::size_t bodies);
  BodyState at(std::size_t body) const;
  void set(std::size_t body, const BodyState& state);
};

struct Acceleration {
  Vector3 linear;   // m/s^2, world
  Vector3 angular;  // rad/s^2, world; with the gyroscopic term
};

// Accelerations of free bodies. It asks the host for wrenches unless the request says that they are constant.
class Derivatives {
 public:
  // `room` is kept by the plugin from call to call, so that a step allocates nothing.
  Derivatives(const stage::IntegratorIntegrateRequest& request, Host& host, std::vector<double>* room);

  // True if the wrenches are the same in any state at any time of the step.
  bool are_constant() const { return request_.wrench_is_constant() != 0; }

  // Wrenches of all bodies (six numbers each) in the initial state of the step, or in a trial state. Throws Refusal,
  // naming the body, for a trial state that is not finite, and for wrenches that are not.
  std::span<const double> wrenches_at_start();
  std::span<const double> wrenches(double time, const TrialColumns& trial);
  // The same, and how they change with the states of the bodies.
  std::span<const double> wrenches(double time, const TrialColumns& trial, WrenchJacobian* jacobian);

  // Those of the forces alone: without what joints do, which simulator Smooth adds.
  std::span<const double> forces(double time, const TrialColumns& trial);

  // For methods that keep to the joints within a step: how joints have to push in the state that wrenches() was last asked
  // for, along J^T there, six numbers a body.
  //   place_impulses     W, kg m, with J M^-1 W = -(joints' errors in the trial state): W/s, added to the momenta there,
  //                      moves the bodies in a time s to where joints want them, to first order in s
  //   velocity_impulses  W, N s, with J M^-1 W = -(J v of the trial state - what joints want)
  // Empty where joints hold by other than locks alone (limits, drives, friction, springs), or there are none. Throws as
  // wrenches().
  std::span<const double> place_impulses(double time, const TrialColumns& trial);
  std::span<const double> velocity_impulses(double time, const TrialColumns& trial);

  // Acceleration of one body in a state, under its part of `wrenches`.
  Acceleration acceleration(std::size_t body, const BodyState& state, std::span<const double> wrenches) const;

  // That without the gyroscopic term, f/m and I_w^-1 tau, for methods that leave that term to the two below.
  Acceleration kick(std::size_t body, const Quaternion& orientation, std::span<const double> wrenches) const {
    const Vector3 linear = request_.inverse_mass()[body] * vector_at(wrenches, 2 * body);
    const Vector3 torque = vector_at(wrenches, 2 * body + 1);
    return {linear, torque.isZero(0.0) ? Vector3::Zero() : angular_kick(body, orientation, torque)};
  }
  // Attitude and angular velocity of one body after `time` (s) in which nothing turns it: exp(t w) q where its moments are
  // equal or some are infinite, else the exact free rotor (free_rotor.h).
  Turning turned_freely(std::size_t body, const Turning& start, double time) const {
    return start.angular_velocity.isZero(0.0) ? start : turned(body, start, time);
  }
  // The angular velocity at another attitude that has the same angular momentum.
  Vector3 carried(std::size_t body, const Vector3& angular_velocity, const Quaternion& from,
                  const Quaternion& to) const;

  BodyState start(std::size_t body) const;
  std::size_t size() const { return request_.flags().size(); }

 private:
  Vector3 angular_kick(std::size_t body, const Quaternion& orientation, const Vector3& torque) const;
  Turning turned(std::size_t body, const Turning& start, double time) const;
  bool has_gyroscopic_term(std::size_t body) const;
  void require_finite(std::span<const double> column, std::size_t components, const char* what) const;
  void require_finite(const TrialColumns& trial) const;
  std::span<const double> ask(DerivativeQuestion question, double time,
                              const std::array<std::span<const double>, 4>& state, WrenchJacobian* jacobian = nullptr);
  std::span<const double> ask_impulses(DerivativeQuestion question, double time, const TrialColumns& trial);

  const stage::IntegratorIntegrateRequest& request_;
  Host& host_;
  std::vector<double>& answer_;
};

// Calls move(body, state) for every movable body and writes the state it returns as S*; kinematic bodies go on
// with their velocities (exactly, x + h v and exp(h w) q), immovable ones stay as they are, bit for bit. Throws Refusal
// where a state comes out that is not finite.
template <typename Move>
void for_each_body(const stage::IntegratorIntegrateRequest& request, const stage::IntegratorIntegrateReply& reply,
                   Move&& move);

// Factor by which damping slows a body in time h: exp(-c h) for any c >= 0, never a change of sign.
inline double damping_factor(double damping, double time_step) {
  return damping == 0.0 ? 1.0 : math::exp(-damping * time_step);
}

// Velocities after `time_step` of constant acceleration, slowed by damping: e^(-c h) (v + h a), e^(-c h) (w + h alpha).
inline Twist accelerated(const Twist& twist, const Acceleration& acceleration, double damping, double time_step) {
  const double slowed = damping_factor(damping, time_step);
  return {slowed * (twist.linear + time_step * acceleration.linear),
          slowed * (twist.angular + time_step * acceleration.angular)};
}

// The time (s) in which an undamped body goes as far as a damped one in h: (1 - exp(-c h)) / c.
inline double damped_time(double damping, double time_step) {
  return damping == 0.0 ? time_step : -math::expm1(-damping * time_step) / damping;
}

// The distance (s^2) per acceleration that a damped body goes from rest in h: (h - (1 - exp(-c h)) / c) / c, h^2/2 without
// damping.
double damped_distance(double damping, double time_step);

// What a body moves and turns by, and its velocities, after h of constant accelerations a, alpha and damping, exactly.
struct DampedMotion {
  Vector3 moved = Vector3::Zero();   // m
  Vector3 turned = Vector3::Zero();  // rad, where it keeps its axis
  Twist twist;
};
DampedMotion damped_motion(const Twist& start, const Acceleration& acceleration, double damping, double time_step);

namespace detail {
inline BodyState state_at(const stage::IntegratorIntegrateRequest& request, std::size_t body) {
  return {{vector_at(request.position(), body), quaternion_at(request.orientation(), body)},
          {vector_at(request.linear_velocity(), body), vector_at(request.angular_velocity(), body)}};
}

// Where S* is written to.
struct StateColumns {
  std::span<double> position, orientation, linear_velocity, angular_velocity;

  // Has it room for all bodies? If not, the counts of the reply tell the host how much it takes.
  bool resize(const stage::IntegratorIntegrateReply& reply, std::size_t bodies);
  void set(std::size_t body, const BodyState& state) const {
    set_vector(position, body, state.pose.position);
    set_quaternion(orientation, body, state.pose.orientation);
    set_vector(linear_velocity, body, state.twist.linear);
    set_vector(angular_velocity, body, state.twist.angular);
  }
  // Throws Refusal, naming the first body, for a state that is not finite.
  void require_finite() const;
};

BodyState keep_moving(const BodyState& state, double time_step);
}  // namespace detail

template <typename Move>
void for_each_body(const stage::IntegratorIntegrateRequest& request, const stage::IntegratorIntegrateReply& reply,
                   Move&& move) {
  detail::StateColumns columns;
  if (!columns.resize(reply, request.flags().size())) return;
  for (std::size_t body = 0; body < request.flags().size(); ++body) {
    BodyState state = detail::state_at(request, body);
    if ((request.flags()[body] & kMovable) != 0) {
      state = move(body, state);
    } else if ((request.flags()[body] & kKinematic) != 0) {
      state = detail::keep_moving(state, request.time_step());
    }
    columns.set(body, state);
  }
  columns.require_finite();
  reply.error_estimate().set(0.0);
}

}  // namespace gravitas
