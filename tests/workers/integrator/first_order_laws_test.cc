// Laws that all integrators of first order obey, whichever velocity they move with.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstring>
#include <limits>
#include <string>

#include "plugin_sdk/conformance/draw.h"
#include "plugin_sdk/math/rotation.h"
#include "tests/workers/integrator/integrator_problem.h"

namespace gravitas::test {
namespace {

class FirstOrderLaws : public testing::TestWithParam<const char*> {
 protected:
  IntegratorProblem problem_{GetParam()};
};

// At any angle of a step: the seed's sum would turn by 2 atan(h w / 2).
TEST_P(FirstOrderLaws, AFreeBodyTurnsExactlyAboutAPrincipalAxis) {
  conformance::Draw random(1);
  for (const double speed : {0.1, 10.0, 25.0, 100.0}) {
    for (int axis = 0; axis < 3; ++axis) {
      const Quaternion start = random.rotation();
      const Vector3 w = speed * (start * Vector3::Unit(axis));
      problem_.bodies = {FreeBody{}};
      problem_.bodies[0].state = {{Vector3::Zero(), start}, {Vector3::Zero(), w}};
      problem_.step();
      const BodyState& state = problem_.bodies[0].state;
      // the gyroscopic term of a turned principal axis is rounding: 1e-16 w^2 h; about the middle one it grows by
      // e^(w h sqrt((2 - 1)(4 - 2) / (1 4)))
      const double rounding = 1e-15 * speed * (1.0 + speed);
      const double grown = 2.3e-16 * speed * std::exp(std::sqrt(0.5) * speed * problem_.time_step);
      EXPECT_LT((state.twist.angular - w).norm(), axis == 1 ? std::max(rounding, grown) : rounding);
      const Quaternion expected = rotate_by(start, problem_.time_step * w);
      EXPECT_LT((state.pose.orientation.coeffs() - expected.coeffs()).norm(), 1e-14 * (1 + speed));
      EXPECT_NEAR(state.pose.orientation.norm(), 1.0, 1e-15);
    }
  }
}

// Free of force, both methods are exact.
TEST_P(FirstOrderLaws, AFreeBodyMovesInAStraightLine) {
  problem_.bodies = {FreeBody{}};
  problem_.bodies[0].state.twist.linear = Vector3(1, -2, 0.5);
  problem_.steps(64);
  EXPECT_EQ(problem_.bodies[0].state.twist.linear, Vector3(1, -2, 0.5));
  EXPECT_LT((problem_.bodies[0].state.pose.position - 6.4 * Vector3(1, -2, 0.5)).norm(), 1e-13);
}

TEST_P(FirstOrderLaws, DampingIsTheExponentialOfEachStep) {
  for (const double damping : {0.3, 5.0, 1000.0}) {
    problem_.bodies = {FreeBody{.damping = damping}};
    problem_.bodies[0].state.twist = {Vector3(1, 2, 3), Vector3(0, 0, 2)};
    problem_.step();
    const Twist& twist = problem_.bodies[0].state.twist;
    const double slowed = std::exp(-damping * problem_.time_step);
    // the exponential's last bits
    EXPECT_LT((twist.linear - slowed * Vector3(1, 2, 3)).norm(), 1e-13 * slowed);
    EXPECT_LT((twist.angular - slowed * Vector3(0, 0, 2)).norm(), 1e-13 * slowed);
  }
}

TEST_P(FirstOrderLaws, DampingDoesNotDependOnTheStep) {
  const auto speed_after_one_second = [&](int steps) {
    problem_.bodies = {FreeBody{.damping = 2.0}};
    problem_.bodies[0].state.twist.linear = Vector3(1, 0, 0);
    problem_.time_step = 1.0 / steps;
    problem_.steps(steps);
    return problem_.bodies[0].state.twist.linear.x();
  };
  for (const int steps : {1, 4, 100}) EXPECT_NEAR(speed_after_one_second(steps), std::exp(-2.0), 1e-14) << steps;
}

TEST_P(FirstOrderLaws, ConvergesWithOrderOne) {
  const std::string library = GetParam();
  double before = oscillator_error(library, 64);
  for (const int steps : {128, 256, 512}) {
    const double error = oscillator_error(library, steps);
    // halves with the step, but for the next order
    EXPECT_NEAR(before / error, 2.0, 0.05) << steps;
    before = error;
  }
}

TEST_P(FirstOrderLaws, AsksForTheDerivativeExactlyOnceAndAtTheStart) {
  problem_.time = 3.0;
  problem_.wrench_is_constant = false;
  problem_.bodies = {FreeBody{}, FreeBody{.wrench = {.force = Vector3(1e6, 0, 0)}}};
  problem_.bodies[1].state.pose.position = Vector3(4, 5, 6);
  problem_.plugin.derivative = [](const stage::IntegratorDerivativeRequest& question) {
    EXPECT_EQ(question.time(), 3.0);
    EXPECT_EQ(vector_at(question.position(), 1), Vector3(4, 5, 6));
    return std::vector<double>{2, 0, 0, 0, 0, 0, 0, 4, 0, 0, 0, 0};
  };
  problem_.step();
  EXPECT_EQ(problem_.plugin.derivatives_asked, 1);
  // what was answered counts, not the wrench of the request
  EXPECT_EQ(problem_.bodies[0].state.twist.linear, Vector3(0.1, 0, 0));
  EXPECT_EQ(problem_.bodies[1].state.twist.linear, Vector3(0, 0.2, 0));
}

TEST_P(FirstOrderLaws, AsksNothingUnderConstantWrenches) {
  problem_.bodies = {FreeBody{.wrench = {.force = Vector3(2, 0, 0)}}};
  problem_.step();
  EXPECT_EQ(problem_.plugin.derivatives_asked, 0);
  EXPECT_EQ(problem_.bodies[0].state.twist.linear, Vector3(0.1, 0, 0));
}

TEST_P(FirstOrderLaws, LeavesImmovableBodiesAloneAndLetsKinematicOnesGoOn) {
  FreeBody ground{.wrench = {.force = Vector3(5, 5, 5)}, .flags = kHasShape};
  ground.state.pose.position = Vector3(-0.0, std::numeric_limits<double>::denorm_min(), 3);
  FreeBody lift{.damping = 3.0, .wrench = {.force = Vector3(5, 5, 5)}, .flags = kKinematic};
  lift.state.twist = {Vector3(0, 2, 0), Vector3(0, 0, 40)};
  problem_.bodies = {ground, lift, FreeBody{}};
  problem_.step();

  const Pose& still = problem_.bodies[0].state.pose;
  EXPECT_EQ(std::memcmp(still.position.data(), ground.state.pose.position.data(), 24), 0);
  EXPECT_EQ(still.orientation.coeffs(), Quaternion::Identity().coeffs());
  const BodyState& moved = problem_.bodies[1].state;
  EXPECT_EQ(moved.twist.linear, Vector3(0, 2, 0));
  EXPECT_EQ(moved.twist.angular, Vector3(0, 0, 40));
  EXPECT_EQ(moved.pose.position, Vector3(0, 0.2, 0));
  EXPECT_LT((moved.pose.orientation.coeffs() - exp_rotation(Vector3(0, 0, 4)).coeffs()).norm(), 1e-15);
}

TEST_P(FirstOrderLaws, OfNoBodiesIsNothing) {
  problem_.step();
  EXPECT_EQ(problem_.plugin.derivatives_asked, 0);
  const MessageColumns reply = problem_.plugin.ask(stage::Method::kIntegratorIntegrate, problem_.request());
  EXPECT_EQ(reply.f64("error_estimate"), std::vector<double>{0.0});
  EXPECT_TRUE(reply.f64("position").empty());
}

// What was integrated before must not matter.
TEST_P(FirstOrderLaws, GivesTheSameBytesForTheSameRequest) {
  conformance::Draw random(2);
  for (int i = 0; i < 20; ++i) {
    FreeBody body{.damping = 0.1, .wrench = {random.vector(3.0), random.vector(3.0)}};
    body.state = {random.pose(3.0), {random.vector(2.0), random.vector(2.0)}};
    problem_.bodies.push_back(body);
  }
  const MessageColumns request = problem_.request();
  const auto ask = [&] { return problem_.plugin.ask(stage::Method::kIntegratorIntegrate, request).bytes(); };
  const std::string first = ask();
  problem_.steps(5);
  EXPECT_EQ(ask(), first);
  PluginUnderTest fresh(GetParam());
  EXPECT_EQ(fresh.ask(stage::Method::kIntegratorIntegrate, request).bytes(), first);
}

INSTANTIATE_TEST_SUITE_P(Integrators, FirstOrderLaws,
                         testing::Values("integrator_euler", "integrator_semi_implicit_euler"),
                         [](const auto& library) { return std::string(library.param); });

}  // namespace
}  // namespace gravitas::test
