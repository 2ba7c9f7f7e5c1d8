// Integrator `Radau`: long steps where stiff springs turn, also far away, and rounds that end where they should.
#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <vector>

#include "tests/workers/integrator/integrator_problem.h"

namespace gravitas::test {
namespace {

// Two masses on a stiff, damped spring that turn about each other, at the length at which it holds them: they stay there.
class TurningSpring {
 public:
  TurningSpring(const char* library, double accuracy, const Vector3& centre = Vector3::Zero())
      : problem(library, {accuracy}), centre_(centre) {
    problem.wrench_is_constant = false;
    problem.bodies = {FreeBody{.mass = kMass}, FreeBody{.mass = kMass}};
    for (const std::size_t i : {0U, 1U}) {
      const Vector3 arm(i == 0 ? -0.5 * kLength : 0.5 * kLength, 0, 0);
      problem.bodies[i].state = {{centre + arm, Quaternion::Identity()},
                                 {Vector3(0, kRate * arm.x(), 0), Vector3(0, 0, kRate)}};
    }
    problem.plugin.derivative = [this](const stage::IntegratorDerivativeRequest& q) {
      ++derivatives;
      const Vector3 d = vector_at(q.position(), 1) - vector_at(q.position(), 0);
      const Vector3 u = vector_at(q.linear_velocity(), 1) - vector_at(q.linear_velocity(), 0);
      const Vector3 f = (kStiffness * (d.norm() - kRest) + kDamping * u.dot(d.normalized())) * d.normalized();
      return std::vector<double>{f.x(), f.y(), f.z(), 0, 0, 0, -f.x(), -f.y(), -f.z(), 0, 0, 0};
    };
  }

  // Of the second mass after some steps.
  double distance(double time_step, int steps) {
    problem.time_step = time_step;
    problem.steps(steps);
    const double turned = kRate * time_step * steps;
    const Vector3 exact(0.5 * kLength * std::cos(turned), 0.5 * kLength * std::sin(turned), 0.0);
    return (problem.bodies[1].state.pose.position - centre_ - exact).norm();
  }

  IntegratorProblem problem;
  int derivatives = 0;

 private:
  static constexpr double kStiffness = 1e8, kDamping = 1e5, kMass = 2.0, kRate = 3.0, kRest = 1.0;
  // k (r - l) = (m/2) rate^2 r
  static constexpr double kLength = kStiffness * kRest / (kStiffness - 0.5 * kMass * kRate * kRate);
  Vector3 centre_;
};

// The spring bends away from its direction at the start of a step, which costs a linearly implicit method its long steps.
TEST(Radau, TakesLongStepsWhereStiffSpringsTurn) {
  TurningSpring few("integrator_radau", 1e-6), many("integrator_rosenbrock", 1e-6);
  EXPECT_LT(few.distance(0.1, 10), 1e-6);
  EXPECT_LT(many.distance(0.1, 10), 1e-3);
  EXPECT_LT(10 * few.derivatives, many.derivatives);
}

// Its rounds end where the rounding of places far from the origin, which the spring answers with velocities, ends them.
TEST(Radau, TakesLongStepsFarFromTheOrigin) {
  for (const double away : {1e3, 1e5}) {
    TurningSpring here("integrator_radau", 1e-6), there("integrator_radau", 1e-6, Vector3(away, -away, away));
    here.distance(0.02, 10);
    EXPECT_LT(there.distance(0.02, 10), 1e-6 + 1e-13 * away);
    EXPECT_LT(there.derivatives, 2 * here.derivatives) << away;
  }
}

// A stiff rate that falls within the step: the error's second estimate, from the state that it leads to, is small, and what
// the rounds leave has to be, too.
TEST(Radau, EndsItsRoundsWhereATransientEnds) {
  for (const double slope : {-4.0, 0.0, 3.0}) {
    for (const double speed : {1e-2, 1e-1}) {
      IntegratorProblem problem("integrator_radau", {1e-6});
      problem.wrench_is_constant = false;
      problem.bodies = {FreeBody{.mass = 1.0}};
      problem.bodies[0].state.twist.linear = Vector3(speed, 0, 0);
      problem.plugin.derivative = [=](const stage::IntegratorDerivativeRequest& q) {
        return std::vector<double>{-1e8 * (1.0 + slope * q.time()) * q.linear_velocity()[0], 0, 0, 0, 0, 0};
      };
      problem.step();
      EXPECT_LT(std::fabs(problem.bodies[0].state.twist.linear.x()), 1e-6) << slope << ' ' << speed;
    }
  }
}

// A body on a stiff spring of a length, kicked along it after a quiet step: it is not thrown through the anchor.
TEST(Radau, GuessesNoStatesThatStiffForcesDoNotReach) {
  for (const double stiffness : {1e10, 1e12, 1e14}) {
    for (const double ratio : {0.1, 1.0}) {
      for (const double time_step : {1.0 / 60.0, 0.1}) {
        IntegratorProblem problem("integrator_radau", {1e-3});
        problem.wrench_is_constant = false;
        problem.bodies = {FreeBody{.mass = 1.0}};
        problem.bodies[0].state.pose.position = Vector3(1, 0, 0);
        const double damping = 2.0 * ratio * std::sqrt(stiffness);
        problem.plugin.derivative = [=](const stage::IntegratorDerivativeRequest& q) {
          const Vector3 d = vector_at(q.position(), 0), along = d.normalized();
          const Vector3 force =
              -(stiffness * (d.norm() - 1.0) + damping * along.dot(vector_at(q.linear_velocity(), 0))) * along;
          return std::vector<double>{force.x(), force.y(), force.z(), 0, 0, 0};
        };
        problem.time_step = time_step;
        problem.step();
        problem.bodies[0].state.twist.linear = Vector3(10, 0, 0);
        problem.changed = {1};
        problem.steps(3);
        EXPECT_NEAR(problem.bodies[0].state.pose.position.x(), 1.0, 1e-3)
            << stiffness << ' ' << ratio << ' ' << time_step;
      }
    }
  }
}

// What rounding leaves of fast bodies ends rounds, too.
TEST(Radau, MovesFastBodiesInOneInnerStep) {
  for (const auto& [speed, turning, time_step, accuracy] :
       {std::array{1e3, 1.0, 1.0, 1e-6}, {3e4, 10.0, 0.1, 1e-12}, {1e5, 50.0, 0.03, 1e-10}, {0.0, 1.0, 1.0, 1e-6}}) {
    IntegratorProblem problem("integrator_radau", {accuracy});
    problem.wrench_is_constant = false;
    problem.bodies = {FreeBody{.mass = 1.0, .moments = Vector3(1, 1, 1)}};
    problem.bodies[0].state.twist = {Vector3(speed, -speed, 0.3 * speed), Vector3(0, 0.6 * turning, 0.8 * turning)};
    const double force = speed == 0.0 ? 1e6 : 1.0;
    int derivatives = 0;
    problem.plugin.derivative = [&](const stage::IntegratorDerivativeRequest&) {
      ++derivatives;
      return std::vector<double>{force, 0, 0, 0, 0, 0};
    };
    problem.time_step = time_step;
    problem.steps(20);
    // a step of one inner step, asked twice: a Jacobian and ten rounds
    EXPECT_LT(derivatives, 20 * 2 * (1 + 12 + 3 * 10)) << speed;
  }
}

TEST(Radau, TakesShortTimeStepsAtOnce) {
  for (const double time_step : {1e-2, 1e-3, 1e-4, 1e-5, 1e-6}) {
    TurningSpring spring("integrator_radau", 1e-6);
    EXPECT_LT(spring.distance(time_step, 20), 1e-8) << time_step;
    // a step of one inner step, asked twice: who feels whom, a Jacobian, the start, and ten rounds
    EXPECT_LT(spring.derivatives, 20 * 2 * (4 + 24 + 1 + 3 * 10)) << time_step;
  }
}

}  // namespace
}  // namespace gravitas::test
