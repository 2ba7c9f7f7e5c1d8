// Bodies that nothing touches: the closed form of each integrator, the order of its error, and the kinds of force.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <complex>
#include <string>

#include "tests/scenes/scene_run.h"

namespace gravitas {
namespace {

using harness::literal;
using harness::SceneRun;
using harness::set;

const Vector3 kDown(0.0, -9.81, 0.0);
const Vector3 kStart(1.0, 2.0, 3.0), kThrown(3.0, 4.0, -1.0);

// Rounding of n additions to a number of size s stays below n s 2^-53; the runs here have n <= 1000, s <= 20.
constexpr double kRounding = 2e-12;

class FreeFlight : public ::testing::TestWithParam<const char*> {
 protected:
  bool is_explicit() const { return std::string(GetParam()) == "Euler"; }
  std::string integrator() const { return set("Integrator", std::string(GetParam())); }
};

INSTANTIATE_TEST_SUITE_P(EachIntegrator, FreeFlight, ::testing::Values("Euler", "SemiImplicitEuler"),
                         [](const auto& which) { return std::string(which.param); });

TEST_P(FreeFlight, FollowsItsClosedForm) {
  SceneRun run("free_flight.gravitas", {integrator()});
  const double h = run.time_step();
  while (!run.is_done()) {
    run.step();
    // v_n = v_0 + n h g; x_n = x_0 + n h v_0 + h^2 g n (n -+ 1)/2 with the old, or with the new velocities
    const double n = run.step_count();
    const double sum = 0.5 * n * (is_explicit() ? n - 1.0 : n + 1.0);
    const SceneRun::Motion ball = run.body("Ball");
    ASSERT_NEAR((ball.twist.linear - (kThrown + n * h * kDown)).norm(), 0.0, kRounding);
    ASSERT_NEAR((ball.pose.position - (kStart + n * h * kThrown + h * h * sum * kDown)).norm(), 0.0, kRounding);
    ASSERT_NEAR((ball.twist.angular - Vector3(0, 0, 2)).norm(), 0.0, kRounding);
    ASSERT_NEAR(harness::angle_between(ball.pose.orientation, harness::turned(Vector3::UnitZ(), 2.0 * n * h)), 0.0,
                kRounding);
  }
  EXPECT_EQ(run.step_count(), 128U);
}

TEST_P(FreeFlight, ConvergesToTheParabolaWithOrderOne) {
  const Vector3 exact = kStart + kThrown + 0.5 * kDown;  // at t = 1
  double coarser = 0.0;
  for (const double h : {1.0 / 16, 1.0 / 32, 1.0 / 64, 1.0 / 128, 1.0 / 256}) {
    SceneRun run("free_flight.gravitas", {integrator(), set("Simulator.TimeStep", h)});
    run.to_end();
    const double error = (run.body("Ball").pose.position - exact).norm();
    // the error is g h t/2 exactly
    EXPECT_NEAR(error, 0.5 * 9.81 * h, kRounding);
    if (coarser > 0.0) {
      EXPECT_NEAR(std::log2(coarser / error), 1.0, 0.1) << "time step " << h;
    }
    coarser = error;
  }
}

TEST_P(FreeFlight, DampsByTheExactExponential) {
  const double c = 0.7;
  SceneRun run("free_flight.gravitas", {integrator(), set("Body.Ball.DampingCoefficient", c), "Body.Ball.Forces={}",
                                        set("Simulator.Duration", 4)});
  while (!run.is_done()) {
    run.step();
    const SceneRun::Motion ball = run.body("Ball");
    // a product of n <= 512 factors, each rounded: n 2^-53 relative
    const double left = std::exp(-c * run.time());
    ASSERT_NEAR((ball.twist.linear / left - kThrown).norm(), 0.0, 1e-12);
    ASSERT_NEAR(ball.twist.angular.z() / left, 2.0, 1e-12);
  }
  EXPECT_DOUBLE_EQ(run.time(), 4.0);
}

TEST_P(FreeFlight, TheLastStepIsShorterWhereTheDurationIsNoMultiple) {
  SceneRun run("free_flight.gravitas", {integrator(), set("Simulator.Duration", 0.51), "Body.Ball.Forces={}"});
  run.to_end();
  EXPECT_EQ(run.step_count(), 66U);  // 65.28 steps of 1/128 s
  EXPECT_NEAR(run.time(), 0.51, 1e-15);
  EXPECT_NEAR((run.body("Ball").pose.position - (kStart + 0.51 * kThrown)).norm(), 0.0, kRounding);
}

TEST(Plan, OfAFreeBodyIsTheIntegratorAndTheForceOnce) {
  SceneRun run("free_flight.gravitas");
  run.to_end();
  ASSERT_EQ(run.environment().plan().slots.size(), 1U);
  EXPECT_EQ(run.environment().plan().slots[0].slot, Slot::kIntegrator);
  // gravity on a rigid body is constant: it is never asked in a step
  EXPECT_EQ(run.environment().stage_time(kernel::Stage::kForce).count(), 1U);
  EXPECT_EQ(run.environment().stage_time(kernel::Stage::kIntegrate).count(), 128U);
}

TEST_P(FreeFlight, AnImpulseGivesItsMomentumWhateverTheTimeStep) {
  for (const double h : {0.25, 1.0 / 60, 1.0 / 240, 1e-4}) {
    SceneRun run("pushes.gravitas", {integrator(), set("Simulator.TimeStep", h)});
    const double i = run.moments("Kicked").x();
    for (int step = 0; step < 3; ++step) {
      run.step();
      const SceneRun::Motion kicked = run.body("Kicked");
      ASSERT_NEAR((kicked.twist.linear - Vector3(2, 0, 0)).norm(), 0.0, 1e-15) << h;
      // r x J = (0, 0.25, 0) x (6, 0, 0)
      ASSERT_NEAR((kicked.twist.angular - Vector3(0, 0, -1.5 / i)).norm(), 0.0, 1e-14) << h;
      // it counts from the first step on
      ASSERT_NEAR(kicked.pose.position.x(), 2.0 * run.time(), 1e-14) << h;
    }
  }
}

TEST_P(FreeFlight, AForceOverTimeIsTakenAtTheStartOfEachStep) {
  SceneRun run("pushes.gravitas", {integrator()});
  const double h = run.time_step();
  double speed = 0.0;
  while (!run.is_done()) {
    speed += h * 10.0 * std::min(1.0, run.time()) / 2.0;
    run.step();
    ASSERT_NEAR(run.body("Ramped").twist.linear.x(), speed, kRounding);
  }
  // 2.5 m/s on the ramp and 5 m/s after it, less the first-order lag of half a step: 10/2 h/2
  EXPECT_NEAR(speed, 7.5, 0.5 * h * 5.0 + kRounding);
}

TEST_P(FreeFlight, AForceInTheBodysAxesTurnsWithIt) {
  SceneRun run("pushes.gravitas", {integrator()});
  const double h = run.time_step();
  // v_n = h f/m sum of e^(i w h k) over k < n
  const std::complex<double> turn = std::polar(1.0, std::acos(-1.0) * h);
  std::complex<double> velocity = 0.0;
  while (!run.is_done()) {
    velocity += 2.0 * h * std::pow(turn, run.step_count());
    run.step();
    const Vector3 v = run.body("Steered").twist.linear;
    ASSERT_NEAR(std::abs(std::complex<double>(v.x(), v.y()) - velocity), 0.0, kRounding);
    ASSERT_EQ(v.z(), 0.0);
  }
  // a whole turn later the pushes have cancelled
  EXPECT_NEAR(std::abs(velocity), 0.0, kRounding);
}

TEST_P(FreeFlight, AForceOffTheCentreTurnsTheBody) {
  SceneRun run("pushes.gravitas", {integrator()});
  const double i = run.moments("Levered").x(), h = run.time_step();
  double turned = 0.0, spin = 0.0;
  while (!run.is_done()) {
    // the point of application turns with the body about y: r = (cos, 0, -sin)/2, r x f = (-f sin/2 ... ) + torque
    const Vector3 r(0.5 * std::cos(turned), 0.0, -0.5 * std::sin(turned));
    const double torque = r.cross(Vector3(0, 0, 1)).y() + 2.0;
    const double before = spin;
    spin += h * torque / i;
    turned += h * (is_explicit() ? before : spin);
    run.step();
    ASSERT_NEAR(run.body("Levered").twist.angular.y(), spin, 1e-10);
  }
  EXPECT_NEAR(run.body("Levered").twist.linear.z(), 1.0, kRounding);  // F t / m
}

}  // namespace
}  // namespace gravitas
