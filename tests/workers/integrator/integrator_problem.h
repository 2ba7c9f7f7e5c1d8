// Free bodies and an integrator that moves them, for the tests of integrators.
#pragma once

#include <gtest/gtest.h>

#include <cmath>
#include <cstdint>
#include <functional>
#include <string>
#include <vector>

#include "plugin_sdk/body.h"
#include "plugin_sdk/dynamics.h"
#include "plugin_sdk/integrator.h"
#include "plugin_sdk/math/rotation.h"
#include "tests/workers/plugin_fixture.h"

namespace gravitas::test {

struct FreeBody {
  double mass = 2.0;
  Vector3 moments = Vector3(1, 2, 4);  // principal, kg m^2
  double damping = 0.0;                // 1/s
  BodyState state = {};
  Wrench wrench = {};  // constant
  std::uint32_t flags = kMovable;
};

class IntegratorProblem {
 public:
  explicit IntegratorProblem(const std::string& library, const std::vector<double>& settings = {})
      : plugin(library, settings) {}

  double time = 0.0;
  double time_step = 0.1;
  bool wrench_is_constant = true;
  std::vector<FreeBody> bodies;
  std::vector<double> plugin_state;    // as answered last
  std::vector<std::uint32_t> changed;  // of the next step; empty: nothing was
  double error_estimate = 0.0;         // of the last step
  PluginUnderTest plugin;

  MessageColumns request() const {
    MessageColumns columns = PluginUnderTest::request_of(stage::Method::kIntegratorIntegrate);
    columns.f64("time") = {time};
    columns.f64("time_step") = {time_step};
    columns.u32("wrench_is_constant") = {wrench_is_constant ? 1U : 0U};
    const auto append = [&](const char* column, const Vector3& v) {
      std::vector<double>& numbers = columns.f64(column);
      numbers.insert(numbers.end(), {v.x(), v.y(), v.z()});
    };
    for (const FreeBody& body : bodies) {
      const bool movable = (body.flags & kMovable) != 0;
      columns.u32("flags").push_back(body.flags);
      columns.f64("inverse_mass").push_back(movable ? 1.0 / body.mass : 0.0);
      append("inertia", body.moments);
      append("inverse_inertia", movable ? Vector3(body.moments.cwiseInverse()) : Vector3::Zero());
      columns.f64("damping").push_back(body.damping);
      append("wrench", body.wrench.force);
      append("wrench", body.wrench.torque);
      append("position", body.state.pose.position);
      const Quaternion& q = body.state.pose.orientation;
      std::vector<double>& orientation = columns.f64("orientation");
      orientation.insert(orientation.end(), {q.w(), q.x(), q.y(), q.z()});
      append("linear_velocity", body.state.twist.linear);
      append("angular_velocity", body.state.twist.angular);
      columns.u32("state_changed").push_back(0);
    }
    if (!changed.empty()) columns.u32("state_changed") = changed;
    columns.f64("plugin_state") = plugin_state;
    return columns;
  }

  // S* becomes the state.
  void step() {
    const MessageColumns reply = plugin.ask(stage::Method::kIntegratorIntegrate, request());
    for (std::size_t i = 0; i < bodies.size(); ++i) {
      bodies[i].state = {{vector_at(reply.f64("position"), i), quaternion_at(reply.f64("orientation"), i)},
                         {vector_at(reply.f64("linear_velocity"), i), vector_at(reply.f64("angular_velocity"), i)}};
    }
    plugin_state = reply.f64("plugin_state");
    error_estimate = reply.f64("error_estimate").at(0);
    changed.clear();
    time += time_step;
  }
  void steps(int count) {
    for (int i = 0; i < count; ++i) step();
  }
};

// Angle (rad) of an attitude that is turned about the world's z axis alone.
inline double turned_about_z(const BodyState& state) {
  const Vector3 turned = log_rotation(state.pose.orientation);
  EXPECT_LT(std::hypot(turned.x(), turned.y()), 1e-14);
  return turned.z();
}

// A mass of 1 kg on a spring of `frequency` (rad/s) along x, let go at x = 1 m.
inline void make_oscillator(IntegratorProblem* problem, double frequency) {
  problem->wrench_is_constant = false;
  problem->bodies = {FreeBody{.mass = 1.0}};
  problem->bodies[0].state.pose.position = Vector3(1, 0, 0);
  problem->plugin.derivative = [=](const stage::IntegratorDerivativeRequest& question) {
    return std::vector<double>{-frequency * frequency * question.position()[0], 0, 0, 0, 0, 0};
  };
}

// Distance in phase space from the oscillator's true state after a time of one second.
inline double oscillator_error(const std::string& library, int steps) {
  IntegratorProblem problem(library);
  make_oscillator(&problem, 1.0);
  problem.time_step = 1.0 / steps;
  problem.steps(steps);
  const BodyState& state = problem.bodies[0].state;
  return std::hypot(state.pose.position.x() - std::cos(1.0), state.twist.linear.x() + std::sin(1.0));
}

}  // namespace gravitas::test
