// DormandPrince54's dense output: inner steps longer than the steps asked for.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <functional>

#include "tests/workers/integrator/integrator_problem.h"

namespace gravitas::test {
namespace {

constexpr const char* kDense = "integrator_dormand_prince54";

struct Course {
  double error = 0.0;  // the largest
  int derivatives = 0;
};

// Of `steps` steps; `error` tells that of a state at a time.
Course follow(IntegratorProblem* problem, int steps, const std::function<double(const BodyState&, double)>& error) {
  Course course;
  for (int i = 0; i < steps; ++i) {
    problem->step();
    course.derivatives += problem->plugin.derivatives_asked;
    course.error = std::max(course.error, error(problem->bodies[0].state, problem->time));
  }
  return course;
}

Course oscillate(double accuracy, bool is_dense, int steps, double time_step) {
  IntegratorProblem problem(kDense, {accuracy, is_dense ? 1.0 : 0.0});
  make_oscillator(&problem, 1.0);
  problem.time_step = time_step;
  return follow(&problem, steps, [](const BodyState& state, double t) {
    return std::hypot(state.pose.position.x() - std::cos(t), state.twist.linear.x() + std::sin(t));
  });
}

TEST(DenseOutput, IsAsAccurateAsItsInnerSteps) {
  for (const double accuracy : {1e-4, 1e-6, 1e-8, 1e-10}) {
    SCOPED_TRACE(accuracy);
    const Course dense = oscillate(accuracy, true, 4000, 2.5e-3);
    // some tens of inner steps: states within them are no worse than their ends may be (half of the length that those allow)
    EXPECT_LT(dense.error, 0.05 * accuracy);
    // not by short inner steps
    EXPECT_GT(dense.error, 0.01 * accuracy);
  }
}

TEST(DenseOutput, TakesThreeDerivativesAStep) {
  const Course dense = oscillate(1e-6, true, 1000, 1e-3), cut = oscillate(1e-6, false, 1000, 1e-3);
  EXPECT_EQ(cut.derivatives, 7 * 1000 + 1);  // the one to guess a length from
  EXPECT_LT(dense.derivatives, 3.1 * 1000);
  EXPECT_GE(dense.derivatives, 3 * 990);
}

// Steps of all lengths, some within an inner step, some of several.
TEST(DenseOutput, ServesStepsOfAnyLength) {
  IntegratorProblem problem(kDense, {1e-8, 1.0});
  make_oscillator(&problem, 1.0);
  double worst = 0.0;
  for (int i = 0; i < 400; ++i) {
    problem.time_step = 1e-4 * std::pow(10.0, i * i % 41 / 10.0);
    problem.step();
    const BodyState& state = problem.bodies[0].state;
    worst = std::max(worst, std::hypot(state.pose.position.x() - std::cos(problem.time),
                                       state.twist.linear.x() + std::sin(problem.time)));
  }
  EXPECT_GT(problem.time, 40.0);
  EXPECT_LT(worst, 1e-8 * 10.0 * problem.time);
}

TEST(DenseOutput, TurnsAndSlowsBodies) {
  // about its axis of symmetry, slowed by 2/s: by (1 - e^-2t)/2 times its first speed
  IntegratorProblem problem(kDense, {1e-9, 1.0});
  problem.bodies = {FreeBody{.moments = Vector3(1, 1, 3), .damping = 2.0}};
  problem.bodies[0].state.twist.angular = Vector3(0, 0, 4);
  problem.time_step = 1e-3;
  const Course course = follow(&problem, 1000, [](const BodyState& state, double t) {
    return std::hypot(turned_about_z(state) - 2.0 * (1.0 - std::exp(-2.0 * t)),
                      state.twist.angular.z() - 4.0 * std::exp(-2.0 * t));
  });
  EXPECT_LT(course.error, 1e-8);
}

TEST(DenseOutput, OfATumblingBodyKeepsItsAngularMomentum) {
  IntegratorProblem problem(kDense, {1e-9, 1.0});
  problem.bodies = {FreeBody{}};
  problem.bodies[0].state.twist.angular = Vector3(0.1, 2, 0.1);
  problem.time_step = 1e-3;
  const auto spin = [&](const BodyState& state) {
    const FreeBody& body = problem.bodies[0];
    return angular_momentum(body.mass, body.moments, {Vector3::Zero(), state.pose.orientation}, state.twist);
  };
  const Vector3 before = spin(problem.bodies[0].state);
  const Course course = follow(&problem, 5000, [&](const BodyState& state, double) {
    EXPECT_NEAR(state.pose.orientation.norm(), 1.0, 1e-14);
    return (spin(state) - before).norm();
  });
  EXPECT_LT(course.error, 1e-9);
  EXPECT_GT(course.error, 1e-12);
}

// A force that becomes another between two steps acts from there on, as it does on a body without history.
TEST(DenseOutput, IsDroppedWhereAForceHasChanged) {
  IntegratorProblem problem(kDense, {1e-10, 1.0});
  make_oscillator(&problem, 1.0);
  problem.time_step = 1e-3;
  problem.steps(500);
  ASSERT_GT(problem.plugin_state.size(), 1U);
  const BodyState there = problem.bodies[0].state;
  problem.plugin.derivative = [](const stage::IntegratorDerivativeRequest& question) {
    return std::vector<double>{-4.0 * question.position()[0], 0, 0, 0, 0, 0};
  };
  const double begin = problem.time, x = there.pose.position.x(), v = there.twist.linear.x();
  const Course course = follow(&problem, 500, [&](const BodyState& state, double t) {
    const double phase = 2.0 * (t - begin);
    return std::abs(state.pose.position.x() - x * std::cos(phase) - 0.5 * v * std::sin(phase));
  });
  EXPECT_LT(course.error, 1e-9);
}

TEST(DenseOutput, IsDroppedWhereABodyWasChanged) {
  IntegratorProblem problem(kDense, {1e-10, 1.0});
  make_oscillator(&problem, 1.0);
  problem.time_step = 1e-3;
  problem.steps(500);
  ASSERT_GT(problem.plugin_state.size(), 1U);
  problem.bodies[0].state.twist.linear.x() += 1.0;
  problem.changed = {1};
  const double t = 0.5;
  problem.steps(500);
  EXPECT_NEAR(problem.bodies[0].state.pose.position.x(), std::cos(1.0) + std::sin(1.0 - t), 1e-9);
}

TEST(DenseOutput, LeavesOtherBodiesAsTheyGo) {
  IntegratorProblem problem(kDense, {1e-6, 1.0});
  make_oscillator(&problem, 1.0);
  const BodyState still{{Vector3(5, 6, 7), exp_rotation(Vector3(1, 2, 0.5))}, {}};
  BodyState moving = still;
  moving.twist.linear = Vector3(1, 2, 3);
  problem.bodies.push_back({.state = still, .flags = 0});
  problem.bodies.push_back({.state = moving, .flags = kKinematic});
  problem.plugin.derivative = [](const stage::IntegratorDerivativeRequest& question) {
    std::vector<double> wrenches(18, 0.0);
    // of a spring to the moving body
    wrenches[0] = question.position()[6] - question.position()[0];
    return wrenches;
  };
  problem.time_step = 1e-2;
  problem.steps(300);
  EXPECT_GT(problem.plugin_state.size(), 1U);
  EXPECT_EQ(problem.bodies[1].state.pose.position, still.pose.position);
  EXPECT_EQ(problem.bodies[1].state.pose.orientation.coeffs(), still.pose.orientation.coeffs());
  EXPECT_LT((problem.bodies[2].state.pose.position - Vector3(8, 12, 16)).norm(), 1e-12);
  // x'' = 5 + t - x from (1, 0): 5 + t - 4 cos t - sin t
  EXPECT_NEAR(problem.bodies[0].state.pose.position.x(), 8.0 - 4.0 * std::cos(3.0) - std::sin(3.0), 1e-5);
}

}  // namespace
}  // namespace gravitas::test
