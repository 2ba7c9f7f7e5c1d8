// Integrator `Euler` against the closed forms of its own recurrence.
#include <gtest/gtest.h>

#include <cmath>

#include "tests/workers/integrator/integrator_problem.h"

namespace gravitas::test {
namespace {

TEST(Euler, DeclaresItsTheta) {
  const IntegratorProblem problem("integrator_euler");
  EXPECT_EQ(problem.plugin.declaration().name, "Euler");
  EXPECT_EQ(problem.plugin.declaration().slot, Slot::kIntegrator);
  EXPECT_EQ(problem.plugin.declaration().theta, 0.0);
}

// x_n = x_0 + n h v_0 + n (n - 1) / 2 h^2 a: behind the parabola by n h^2 a / 2.
TEST(Euler, UnderAConstantForceLagsBehindTheParabola) {
  IntegratorProblem problem("integrator_euler");
  problem.bodies = {FreeBody{.mass = 2.0, .wrench = {.force = Vector3(2, -4, 0)}}};
  problem.bodies[0].state.twist.linear = Vector3(0, 3, 1);
  const Vector3 v0(0, 3, 1), a(1, -2, 0);
  const double h = problem.time_step;
  for (int n = 1; n <= 50; ++n) {
    problem.step();
    const BodyState& state = problem.bodies[0].state;
    // fifty sums of numbers below fifty
    EXPECT_LT((state.twist.linear - (v0 + n * h * a)).norm(), 1e-13) << n;
    EXPECT_LT((state.pose.position - (n * h * v0 + 0.5 * n * (n - 1) * h * h * a)).norm(), 1e-12) << n;
  }
}

// One step with damping: x' = x + h v, v' = e^(-c h) (v + h a).
TEST(Euler, MovesWithTheOldVelocity) {
  IntegratorProblem problem("integrator_euler");
  problem.bodies = {FreeBody{.mass = 2.0, .damping = 0.7, .wrench = {.force = Vector3(2, -4, 0)}}};
  problem.bodies[0].state.twist.linear = Vector3(0, 3, 1);
  problem.step();
  const BodyState& state = problem.bodies[0].state;
  EXPECT_EQ(state.pose.position, Vector3(0.1 * Vector3(0, 3, 1)));
  EXPECT_LT((state.twist.linear - std::exp(-0.07) * Vector3(0.1, 2.8, 1)).norm(), 1e-15);
}

// The energy of an oscillator grows by 1 + (h w)^2 in every step: x'^2 + v'^2 = (1 + h^2 w^2) ...
TEST(Euler, FeedsAnOscillatorByItsKnownFactor) {
  IntegratorProblem problem("integrator_euler");
  make_oscillator(&problem, 2.0);
  const auto energy = [&] {
    const BodyState& state = problem.bodies[0].state;
    return 0.5 * (4.0 * state.pose.position.squaredNorm() + state.twist.linear.squaredNorm());
  };
  double expected = energy();
  for (int n = 0; n < 100; ++n) {
    problem.step();
    expected *= 1.04;
    ASSERT_NEAR(energy() / expected, 1.0, 1e-13) << n;
  }
}

// About a principal axis alpha = tau / I: the angle lags as the position does.
TEST(Euler, UnderAConstantTorqueTurnsWithTheOldVelocity) {
  IntegratorProblem problem("integrator_euler");
  problem.bodies = {FreeBody{.moments = {1, 2, 4}, .wrench = {.torque = Vector3(0, 0, 8)}}};
  for (int n = 1; n <= 10; ++n) {
    problem.step();
    EXPECT_NEAR(turned_about_z(problem.bodies[0].state), 0.5 * n * (n - 1) * 0.01 * 2.0, 1e-14);
    EXPECT_NEAR(problem.bodies[0].state.twist.angular.z(), 0.2 * n, 1e-14);
  }
}

}  // namespace
}  // namespace gravitas::test
