// Integrator `SemiImplicitEuler` against the closed forms of its own recurrence.
#include <gtest/gtest.h>

#include <cmath>

#include "tests/workers/integrator/integrator_problem.h"

namespace gravitas::test {
namespace {

TEST(SemiImplicitEuler, DeclaresItsTheta) {
  const IntegratorProblem problem("integrator_semi_implicit_euler");
  EXPECT_EQ(problem.plugin.declaration().name, "SemiImplicitEuler");
  EXPECT_EQ(problem.plugin.declaration().slot, Slot::kIntegrator);
  EXPECT_EQ(problem.plugin.declaration().theta, 1.0);
}

// x_n = x_0 + n h v_0 + n (n + 1) / 2 h^2 a: ahead of the parabola by n h^2 a / 2.
TEST(SemiImplicitEuler, UnderAConstantForceRunsAheadOfTheParabola) {
  IntegratorProblem problem("integrator_semi_implicit_euler");
  problem.bodies = {FreeBody{.mass = 2.0, .wrench = {.force = Vector3(2, -4, 0)}}};
  problem.bodies[0].state.twist.linear = Vector3(0, 3, 1);
  const Vector3 v0(0, 3, 1), a(1, -2, 0);
  const double h = problem.time_step;
  for (int n = 1; n <= 50; ++n) {
    problem.step();
    const BodyState& state = problem.bodies[0].state;
    // fifty sums of numbers below fifty
    EXPECT_LT((state.twist.linear - (v0 + n * h * a)).norm(), 1e-13) << n;
    EXPECT_LT((state.pose.position - (n * h * v0 + 0.5 * n * (n + 1) * h * h * a)).norm(), 1e-12) << n;
  }
}

// One step with damping: v' = e^(-c h) (v + h a), x' = x + h v'.
TEST(SemiImplicitEuler, MovesWithTheNewVelocity) {
  IntegratorProblem problem("integrator_semi_implicit_euler");
  problem.bodies = {FreeBody{.mass = 2.0, .damping = 0.7, .wrench = {.force = Vector3(2, -4, 0)}}};
  problem.bodies[0].state.twist.linear = Vector3(0, 3, 1);
  problem.step();
  const BodyState& state = problem.bodies[0].state;
  EXPECT_LT((state.twist.linear - std::exp(-0.07) * Vector3(0.1, 2.8, 1)).norm(), 1e-15);
  EXPECT_EQ(state.pose.position, Vector3(0.1 * state.twist.linear));
}

// v^2 + w^2 x^2 - h w^2 x v is kept exactly, so the energy stays within h w / 2 of its value.
TEST(SemiImplicitEuler, KeepsTheShadowEnergyOfAnOscillator) {
  IntegratorProblem problem("integrator_semi_implicit_euler");
  make_oscillator(&problem, 2.0);
  const double h = problem.time_step;
  const auto energy = [&] {
    const BodyState& s = problem.bodies[0].state;
    return s.twist.linear.squaredNorm() + 4.0 * s.pose.position.squaredNorm();
  };
  const auto shadow = [&] {
    const BodyState& s = problem.bodies[0].state;
    return energy() - 4.0 * h * s.pose.position.x() * s.twist.linear.x();
  };
  const double before = shadow();
  for (int n = 0; n < 2000; ++n) {
    problem.step();
    // rounding of two thousand steps
    ASSERT_NEAR(shadow() / before, 1.0, 1e-12) << n;
    // |h w^2 x v| <= (h w / 2) (v^2 + w^2 x^2), h w = 0.2
    ASSERT_LE(energy(), before / 0.9 + 1e-12) << n;
    ASSERT_GE(energy(), before / 1.1 - 1e-12) << n;
  }
}

// About a principal axis alpha = tau / I: the angle runs ahead as the position does.
TEST(SemiImplicitEuler, UnderAConstantTorqueTurnsWithTheNewVelocity) {
  IntegratorProblem problem("integrator_semi_implicit_euler");
  problem.bodies = {FreeBody{.moments = {1, 2, 4}, .wrench = {.torque = Vector3(0, 0, 8)}}};
  for (int n = 1; n <= 10; ++n) {
    problem.step();
    EXPECT_NEAR(turned_about_z(problem.bodies[0].state), 0.5 * n * (n + 1) * 0.01 * 2.0, 1e-14);
    EXPECT_NEAR(problem.bodies[0].state.twist.angular.z(), 0.2 * n, 1e-14);
  }
}

}  // namespace
}  // namespace gravitas::test
