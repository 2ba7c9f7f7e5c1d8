// Ball joints: periods, what dissipates and at which order, closed joints in chaotic motion, momentum.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <string>
#include <vector>

#include "tests/scenes/scene_run.h"

namespace gravitas {
namespace {

using harness::SceneRun;
using harness::set;

constexpr double kArm = 1.0, kBobRadius = 0.1;

// K(k) pi/2 times its inverse is the arithmetic-geometric mean of 1 and k'.
double arithmetic_geometric_mean(double a, double b) {
  for (int i = 0; i < 8; ++i) {
    const double mean = 0.5 * (a + b);
    b = std::sqrt(a * b);
    a = mean;
  }
  return a;
}

// Period of the compound pendulum of pendulum.gravitas with an amplitude.
double exact_period(double amplitude) {
  const double inertia = kArm * kArm + 0.4 * kBobRadius * kBobRadius;
  return 2.0 * kPi * std::sqrt(inertia / (kG * kArm)) / arithmetic_geometric_mean(1.0, std::cos(0.5 * amplitude));
}

std::vector<std::string> released(const std::string& integrator, double amplitude, double time_step) {
  return {set("Integrator", integrator), set("Simulator.TimeStep", time_step),
          set("Body.Ball.Position", Vector3(std::sin(amplitude), -std::cos(amplitude), 0.0))};
}

// Time between the first two crossings of the vertical to the left, each by the secant between two states.
double first_period(SceneRun* run) {
  double first = 0.0;
  for (;;) {
    const double before = run->body("Ball").pose.position.x(), time = run->time();
    run->step();
    const double after = run->body("Ball").pose.position.x();
    if (!(before > 0.0 && after <= 0.0)) continue;
    const double crossing = time + run->time_step() * before / (before - after);
    if (first > 0.0) return crossing - first;
    first = crossing;
  }
}

// A first-order method sees positions half a step late or early: an error of m g |v| h/2, with |v| that of a fall through
// the arm at most.
double first_order_energy(double mass, double time_step, double arm) {
  return 0.5 * mass * kG * time_step * std::sqrt(2.0 * kG * arm);
}

class Pendulum : public ::testing::TestWithParam<const char*> {};

INSTANTIATE_TEST_SUITE_P(EachIntegrator, Pendulum, ::testing::Values("Euler", "SemiImplicitEuler"),
                         [](const auto& which) { return std::string(which.param); });

TEST_P(Pendulum, SwingsLittleWithTheSmallAnglePeriod) {
  for (const double h : {1.0 / 240, 1.0 / 1000}) {
    SceneRun run("pendulum.gravitas", released(GetParam(), 0.01, h));
    // of second order: (w h)^2 with w^2 = 9.77
    EXPECT_NEAR(first_period(&run) / exact_period(0.01), 1.0, 10.0 * h * h) << "time step " << h;
  }
}

// The velocity is made to fit the joint where the free step ends, which costs a share (w h)^2 of it in each step: energy
// and with it the amplitude shrink at the rate h w^2. The limit of small steps is exact.
TEST_P(Pendulum, SwingsWideWithTheEllipticPeriodToFirstOrder) {
  const double exact = exact_period(kPi / 2.0);
  double coarser = 0.0, coarser_period = 0.0;
  for (const double h : {0.004, 0.002, 0.001, 0.0005}) {
    SceneRun run("pendulum.gravitas", released(GetParam(), kPi / 2.0, h));
    const double period = first_period(&run), error = std::fabs(period / exact - 1.0);
    EXPECT_LE(error, 8.0 * h) << "time step " << h;
    if (coarser > 0.0) {
      EXPECT_NEAR(std::log2(coarser / error), 1.0, 0.15) << "time step " << h;
      // without the term of first order
      EXPECT_NEAR((2.0 * period - coarser_period) / exact, 1.0, 400.0 * h * h) << "time step " << h;
    }
    coarser = error, coarser_period = period;
  }
}

TEST_P(Pendulum, KeepsItsJointClosedItsPlaneAndItsEnergyBelowTheStart) {
  for (const double h : {1.0 / 240, 1.0 / 1000}) {
    SceneRun run("pendulum.gravitas", released(GetParam(), kPi / 2.0, h));
    double energy = run.energy();
    while (!run.is_done()) {
      run.step();
      ASSERT_EQ(run.body("Ball").pose.position.z(), 0.0);
      ASSERT_LE(run.energy(), first_order_energy(1.0, h, kArm)) << "at " << run.time();
      energy = run.energy();
    }
    EXPECT_LT(energy, 0.0);
    EXPECT_LE(run.report().max_joint_error(), 1e-6) << "time step " << h;
  }
}

// What a step leaves of the joint error is of fourth order: the square of a correction that is itself (w h)^2.
TEST_P(Pendulum, JointErrorIsOfFourthOrder) {
  const auto joint_error = [&](double h) {
    SceneRun run("pendulum.gravitas", released(GetParam(), kPi / 2.0, h));
    run.steps(static_cast<std::uint32_t>(1.0 / h));
    return run.report().max_joint_error();
  };
  const double coarse = joint_error(1.0 / 60), fine = joint_error(1.0 / 120);
  EXPECT_LE(coarse, 1e-5);
  EXPECT_GE(std::log2(coarse / fine), 3.0);
}

TEST_P(Pendulum, TwoJoinedBodiesKeepTheirMomentum) {
  double coarser_turn = 0.0, coarser_energy = 0.0;
  for (const double h : {1.0 / 60, 1.0 / 120, 1.0 / 240, 1.0 / 480}) {
    SceneRun run("joined_pair.gravitas", {set("Integrator", std::string(GetParam())), set("Simulator.TimeStep", h)});
    const Vector3 momentum = run.momentum(), turn = run.angular_momentum();
    const double energy = run.energy();
    while (!run.is_done()) {
      run.step();
      // rounding of 2400 steps with numbers of size 2
      ASSERT_LE((run.momentum() - momentum).norm(), 1e-12) << "at " << run.time();
      ASSERT_LE(run.energy(), energy * (1.0 + 1e-12)) << "at " << run.time();
    }
    EXPECT_LE(run.report().max_joint_error(), 1e-7);
    // closing the joint shifts each body across the other's momentum: first order, like the energy
    const double turn_error = (run.angular_momentum() - turn).norm() / turn.norm();
    const double energy_error = (energy - run.energy()) / energy;
    EXPECT_LE(turn_error, 3.0 * h) << "time step " << h;
    EXPECT_LE(energy_error, 5.0 * h) << "time step " << h;
    if (coarser_turn > 0.0) {
      EXPECT_NEAR(std::log2(coarser_turn / turn_error), 1.0, 0.1) << "time step " << h;
      EXPECT_NEAR(std::log2(coarser_energy / energy_error), 1.0, 0.1) << "time step " << h;
    }
    coarser_turn = turn_error, coarser_energy = energy_error;
  }
}

struct Chain {
  const char* scene;
  const char* last;
  double mass;         // kg
  double reach;        // m
  double joint_error;  // m, largest at 1/240 s: of fourth order in turn per step, which is 0.1 rad at the whip's end
};

class HangingChain : public ::testing::TestWithParam<Chain> {};

INSTANTIATE_TEST_SUITE_P(EachLength, HangingChain,
                         ::testing::Values(Chain{"double_pendulum.gravitas", "Lower", 2.0, 1.5, 1e-6},
                                           Chain{"chain.gravitas", "Link5", 5.0, 4.5, 1e-5}),
                         [](const auto& which) { return std::string(which.param.last); });

TEST_P(HangingChain, DoesNotFlyApart) {
  for (const char* integrator : {"Euler", "SemiImplicitEuler"}) {
    SceneRun run(GetParam().scene, {set("Integrator", std::string(integrator))});
    double highest = run.energy(), lowest = run.energy();
    while (!run.is_done()) {
      run.step();
      highest = std::max(highest, run.energy());
      lowest = std::min(lowest, run.energy());
      const Vector3 tip = run.body(GetParam().last).pose.position;
      ASSERT_LE(tip.norm(), GetParam().reach + 1e-4) << "at " << run.time();
      ASSERT_NEAR(tip.z(), 0.0, 1e-9) << "at " << run.time();
    }
    EXPECT_LE(highest, first_order_energy(GetParam().mass, run.time_step(), GetParam().reach)) << integrator;
    // what hangs straight down has lost all it can
    EXPECT_GE(lowest, -kG * GetParam().mass * 0.5 * (GetParam().reach + 0.5)) << integrator;
    EXPECT_LE(run.report().max_joint_error(), GetParam().joint_error) << integrator;
  }
}

}  // namespace
}  // namespace gravitas
