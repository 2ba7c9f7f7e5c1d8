// Observed orders of the integrators on smooth problems of a free body, against the order of their theory, and the table
// of them (`--gtest_filter=Orders.Table`).
#include <gtest/gtest.h>

#include <cmath>
#include <cstdio>
#include <functional>
#include <string>
#include <vector>

#include "plugin_sdk/math/transcendental.h"
#include "tests/sanitized.h"
#include "tests/workers/integrator/integrator_problem.h"

namespace gravitas::test {
namespace {

struct Method {
  std::string library;
  std::vector<double> settings;
  double order;
  int steps;  // of the coarser ladder's end, so that the error is neither useless nor rounding
  std::string name() const {
    return library.substr(11) + (settings.empty() ? "" : "_" + std::to_string(static_cast<int>(settings[0])));
  }
};

std::vector<Method> methods() {
  return {{"integrator_euler", {}, 1, 512},
          {"integrator_semi_implicit_euler", {}, 1, 512},
          {"integrator_verlet", {}, 2, 128},
          {"integrator_basic_verlet", {}, 2, 128},
          {"integrator_implicit_midpoint", {}, 2, 128},
          {"integrator_rk4", {}, 4, 64},
          {"integrator_rkmk4", {}, 4, 64},
          {"integrator_symplectic_splitting", {2}, 2, 128},
          {"integrator_symplectic_splitting", {4}, 4, 32},
          {"integrator_symplectic_splitting", {6}, 6, 8},
          // one inner step each
          {"integrator_radau", {1}, 5, 16}};
}

// A smooth motion of one body over a second.
struct Motion {
  std::string name;
  FreeBody body;
  std::function<Wrench(double, const BodyState&)> wrench;
  bool depends_on_velocity = false;
};

std::vector<Motion> motions() {
  FreeBody body{.mass = 1.5, .moments = Vector3(1, 2, 4)};
  body.state = {{Vector3(0.5, -0.2, 0.1), exp_rotation(Vector3(0.3, 0.2, -0.4))},
                {Vector3(0.2, 1, -0.5), Vector3(0.6, 1.1, -0.7)}};
  FreeBody damped = body;
  damped.damping = 0.4;
  // a point of the body on a spring, turning it too
  const auto spring = [](double, const BodyState& s) {
    const Vector3 arm = s.pose.orientation * Vector3(0.2, 0.5, -0.3);
    const Vector3 force = -3.0 * (s.pose.position + arm);
    return Wrench{force, arm.cross(force)};
  };
  const auto well = [](double, const BodyState& s) {
    const Vector3& x = s.pose.position;
    return Wrench{-(1.0 + x.squaredNorm()) * x, s.pose.orientation * Vector3(0.3, 0, 0.1)};
  };
  const auto timed = [](double t, const BodyState&) {
    return Wrench{Vector3(math::cos(3 * t), math::sin(2 * t), t), Vector3(math::sin(t), 0.5, math::cos(2 * t))};
  };
  const auto drag = [spring](double t, const BodyState& s) {
    Wrench w = spring(t, s);
    w.force -= (0.3 + 0.2 * s.twist.linear.norm()) * s.twist.linear;
    w.torque -= 0.4 * s.twist.angular;
    return w;
  };
  return {{"spring at a point", body, spring},
          {"well and body torque", body, well},
          {"force of time", body, timed},
          {"damped body", damped, spring},
          {"drag", body, drag, true}};
}

BodyState state_after(const Method& method, const Motion& motion, int steps) {
  IntegratorProblem problem(method.library, method.settings);
  problem.wrench_is_constant = false;
  problem.bodies = {motion.body};
  problem.time_step = 1.0 / steps;
  problem.plugin.derivative = [&](const stage::IntegratorDerivativeRequest& q) {
    const BodyState state{{vector_at(q.position(), 0), quaternion_at(q.orientation(), 0)},
                          {vector_at(q.linear_velocity(), 0), vector_at(q.angular_velocity(), 0)}};
    const Wrench w = motion.wrench(q.time(), state);
    return std::vector<double>{w.force.x(), w.force.y(), w.force.z(), w.torque.x(), w.torque.y(), w.torque.z()};
  };
  for (int i = 0; i < steps; ++i) {
    problem.time = i * problem.time_step;
    problem.step();
  }
  return problem.bodies[0].state;
}

double distance(const BodyState& a, const BodyState& b) {
  const double turned = log_rotation(a.pose.orientation * b.pose.orientation.conjugate()).norm();
  return std::sqrt((a.pose.position - b.pose.position).squaredNorm() + turned * turned +
                   (a.twist.linear - b.twist.linear).squaredNorm() + (a.twist.angular - b.twist.angular).squaredNorm());
}

// Against the method of order 6 at a step where only rounding is left (for drag, where that one is of order 4, the
// group's Runge-Kutta method).
BodyState truth_of(const Motion& motion) {
  const Method exact{motion.depends_on_velocity ? "integrator_rkmk4" : "integrator_symplectic_splitting",
                     motion.depends_on_velocity ? std::vector<double>{} : std::vector<double>{6}, 6, 0};
  return state_after(exact, motion, motion.depends_on_velocity ? 3000 : 300);
}

// From two halvings of the step.
double observed_order(const Method& method, const Motion& motion, const BodyState& truth) {
  const double coarse = distance(state_after(method, motion, method.steps), truth);
  const double fine = distance(state_after(method, motion, 2 * method.steps), truth);
  return std::log2(coarse / fine);
}

TEST(Orders, AreThoseOfTheoryWithinATenth) {
  for (const Motion& motion : motions()) {
    std::printf("observed order, %s\n", motion.name.c_str());
    const BodyState truth = truth_of(motion);
    for (const Method& method : methods()) {
      const double order = observed_order(method, motion, truth);
      std::printf("  %-26s%8.3f\n", method.name().c_str(), order);
      if (motion.depends_on_velocity && method.order > 4.0) {
        // kicks of order 4, whose error may be the smaller one at these steps
        EXPECT_GT(order, 3.9) << method.name() << ", " << motion.name;
      } else {
        EXPECT_NEAR(order, method.order, 0.1) << method.name() << ", " << motion.name;
      }
    }
    if (harness::kSanitized) break;  // the others are the same code
  }
}

}  // namespace
}  // namespace gravitas::test
