// DampingCoefficient, however strong: what integrators meet exactly, and what within Accuracy.
#include <gtest/gtest.h>

#include <cmath>
#include <string>
#include <vector>

#include "tests/workers/integrator/integrator_problem.h"

namespace gravitas::test {
namespace {

constexpr double kGravity = 10.0;  // m/s^2

bool has_accuracy(const std::string& library) {
  return library.find("dormand") != std::string::npos || library.find("radau") != std::string::npos ||
         library.find("rosenbrock") != std::string::npos;
}

std::vector<double> settings_of(const std::string& library, double accuracy) {
  if (library == "integrator_symplectic_splitting") return {4.0};
  if (!has_accuracy(library)) return {};
  return library == "integrator_dormand_prince54" ? std::vector<double>{accuracy, 1.0} : std::vector<double>{accuracy};
}

// Distance covered after t at a first speed of 1, and from rest at an acceleration of 1.
double coasted(double c, double t) { return -std::expm1(-c * t) / c; }
double fallen(double c, double t) { return (t - coasted(c, t)) / c; }

class StrongDamping : public testing::TestWithParam<const char*> {};
INSTANTIATE_TEST_SUITE_P(Integrators, StrongDamping,
                         testing::Values("integrator_rk4", "integrator_rkmk4", "integrator_implicit_midpoint",
                                         "integrator_symplectic_splitting", "integrator_dormand_prince54",
                                         "integrator_dormand_prince853", "integrator_rosenbrock", "integrator_radau"),
                         [](const auto& library) { return std::string(library.param); });

TEST_P(StrongDamping, SlowsFreeBodiesExactly) {
  for (const double c : {0.7, 30.0, 300.0}) {
    IntegratorProblem problem(GetParam(), settings_of(GetParam(), 1e-6));
    problem.bodies = {FreeBody{.damping = c}};
    problem.bodies[0].state.twist = {Vector3(1, -2, 0.5), Vector3(0, 0, 0.4)};
    problem.steps(10);
    const BodyState& state = problem.bodies[0].state;
    const double left = std::exp(-c);
    EXPECT_LT((state.twist.linear - left * Vector3(1, -2, 0.5)).norm(), 1e-13 * left) << c;
    EXPECT_LT((state.twist.angular - left * Vector3(0, 0, 0.4)).norm(), 1e-13 * left) << c;
    EXPECT_LT((state.pose.position - coasted(c, 1.0) * Vector3(1, -2, 0.5)).norm(), 1e-14) << c;
    // quaternions by Runge-Kutta and the Cayley map turn by less than the angle
    const bool is_exact = has_accuracy(GetParam()) || std::string(GetParam()) == "integrator_rkmk4";
    if (std::string(GetParam()) != "integrator_symplectic_splitting")
      EXPECT_NEAR(turned_about_z(state), 0.4 * coasted(c, 1.0), is_exact ? 1e-14 : 5e-5) << c;
  }
}

// To the speed that balances gravity, past it, and at it.
TEST_P(StrongDamping, LetsBodiesFall) {
  for (const double c : {0.7, 30.0, 1e3, 1e5}) {
    for (const double accuracy : {1e-4, 1e-10}) {
      for (const double time_step : {0.01, 0.1}) {
        IntegratorProblem problem(GetParam(), settings_of(GetParam(), accuracy));
        problem.bodies = {FreeBody{.mass = 2.0, .damping = c, .wrench = {.force = Vector3(0, -2.0 * kGravity, 0)}}};
        problem.bodies[0].state.twist.linear = Vector3(1, 0, 0);
        problem.time_step = time_step;
        problem.steps(static_cast<int>(std::lround(1.0 / time_step)));
        const BodyState& state = problem.bodies[0].state;
        const double allowed = has_accuracy(GetParam()) ? accuracy : 1e-13;
        EXPECT_LT((state.pose.position - Vector3(coasted(c, 1.0), -kGravity * fallen(c, 1.0), 0)).norm(), allowed)
            << c << ' ' << accuracy << ' ' << time_step;
        EXPECT_LT((state.twist.linear - Vector3(std::exp(-c), -kGravity * coasted(c, 1.0), 0)).norm(), allowed)
            << c << ' ' << accuracy << ' ' << time_step;
      }
    }
  }
}

// x'' = -k x - c x' from x = 1 m at rest, slow mode e^(s t) and fast one.
double spring_distance(double k, double c, double t) {
  const double square = 0.25 * c * c - k;
  if (square < 0.0) {
    const double w = std::sqrt(-square);
    return std::exp(-0.5 * c * t) * (std::cos(w * t) + 0.5 * c / w * std::sin(w * t));
  }
  const double fast = -0.5 * c - std::sqrt(square), slow = k / fast;
  return (slow * std::exp(fast * t) - fast * std::exp(slow * t)) / (slow - fast);
}

// Forces that change within the step.
class ControlledDamping : public testing::TestWithParam<const char*> {};
INSTANTIATE_TEST_SUITE_P(Integrators, ControlledDamping,
                         testing::Values("integrator_dormand_prince54", "integrator_dormand_prince853",
                                         "integrator_rosenbrock", "integrator_radau"),
                         [](const auto& library) { return std::string(library.param); });

TEST_P(ControlledDamping, LeavesTheErrorToAccuracy) {
  constexpr double kStiffness = 30.0;
  for (const double c : {1.0, 30.0, 1e3, 1e4}) {
    for (const double accuracy : {1e-4, 1e-7, 1e-10}) {
      IntegratorProblem problem(GetParam(), settings_of(GetParam(), accuracy));
      problem.wrench_is_constant = false;
      problem.bodies = {FreeBody{.mass = 1.0, .damping = c}};
      problem.bodies[0].state.pose.position = Vector3(1, 0, 0);
      problem.plugin.derivative = [](const stage::IntegratorDerivativeRequest& q) {
        return std::vector<double>{-kStiffness * q.position()[0], 0, 0, 0, 0, 0};
      };
      problem.steps(10);
      // an inner step's error may be Accuracy, and there are tens of them
      EXPECT_NEAR(problem.bodies[0].state.pose.position.x(), spring_distance(kStiffness, c, 1.0), 10.0 * accuracy)
          << c << ' ' << accuracy;
    }
  }
}

}  // namespace
}  // namespace gravitas::test
