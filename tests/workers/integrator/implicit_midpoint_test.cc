// ImplicitMidpoint: that it finds the solution of its equations.
#include <gtest/gtest.h>

#include <cmath>

#include "tests/workers/integrator/integrator_problem.h"

namespace gravitas::test {
namespace {

// u = v_0 - h c/(2 m) u^2 is the speed in the middle of a step under quadratic drag: from it or from rest, Newton's method
// would leap, and a step with the matrix of one far away gains little.
TEST(ImplicitMidpoint, SolvesForStrongQuadraticDrag) {
  for (double c = 1e-2; c < 2e10; c *= 10.0) {
    IntegratorProblem problem("integrator_implicit_midpoint");
    problem.wrench_is_constant = false;
    problem.time_step = 1.0 / 60.0;
    problem.bodies = {FreeBody{.mass = 1.0}};
    const Vector3 along = Vector3(3, -2, 1);
    problem.bodies[0].state.twist.linear = along;
    problem.plugin.derivative = [=](const stage::IntegratorDerivativeRequest& q) {
      const Vector3 v = vector_at(q.linear_velocity(), 0), force = -c * v.norm() * v;
      return std::vector<double>{force.x(), force.y(), force.z(), 0, 0, 0};
    };
    for (int step = 0; step < 30; ++step) {
      const BodyState before = problem.bodies[0].state;
      problem.step();
      const double a = 0.5 * problem.time_step * c, v = before.twist.linear.norm();
      const double middle = 2.0 * v / (1.0 + std::sqrt(1.0 + 4.0 * a * v));
      const Vector3 moved = problem.bodies[0].state.pose.position - before.pose.position;
      EXPECT_LT((moved - problem.time_step * middle * before.twist.linear.normalized()).norm(),
                1e-12 * problem.time_step * v)
          << c << ' ' << step;
    }
  }
}

// A bearing at rest at the origin, between weights that balance; an arm that turns about it on a stiff rod. What the weights
// leave is rounding of the arm's direction, and no less than the bearing's speed.
TEST(ImplicitMidpoint, TakesRoundingOfANeighboursStateForRounding) {
  constexpr double kWeight = 10.0, kStiffness = 1e6, kLength = 0.3;
  for (const double turned : {0.0, 0.3, 1.0, 2.0}) {
    IntegratorProblem problem("integrator_implicit_midpoint");
    problem.wrench_is_constant = false;
    problem.time_step = 1.0 / 60.0;
    problem.bodies = {FreeBody{.mass = 1.0}, FreeBody{.mass = 2.0}};
    BodyState& arm = problem.bodies[1].state;
    arm.pose.position = kLength * Vector3(std::cos(turned), std::sin(turned), 0);
    arm.twist.linear = 3.0 * Vector3(-std::sin(turned), std::cos(turned), 0);
    problem.plugin.derivative = [=](const stage::IntegratorDerivativeRequest& q) {
      const Vector3 apart = vector_at(q.position(), 1) - vector_at(q.position(), 0), along = apart.normalized();
      const Vector3 side(-along.y(), along.x(), along.z()), down(0, -kWeight, 0);
      const Vector3 bearing = down - down.dot(along) * along - down.dot(side) * side;
      const Vector3 rod = -kStiffness * (apart.norm() - kLength) * along;
      return std::vector<double>{bearing.x(), bearing.y(), bearing.z(), 0, 0, 0, rod.x(), rod.y(), rod.z(), 0, 0, 0};
    };
    problem.steps(60);
    EXPECT_LT(problem.bodies[0].state.pose.position.norm(), 1e-14);
  }
}

}  // namespace
}  // namespace gravitas::test
