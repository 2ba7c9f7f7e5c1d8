// Reference problems of free and jointed motion at their targets: closed forms and references of 17 digits, each at a
// fixed step and at the best that is asked for. Jointed ones with the simulator Smooth and the solver Direct.
#include <gtest/gtest.h>

#include <cstdio>

#include "tests/numerics/motion_problem.h"
#include "tests/numerics/reached.h"

namespace gravitas {
namespace {

using harness::expect_reached;
using harness::MotionMethod;
using harness::MotionProblem;
using harness::MotionResult;

const MotionMethod kRk4{"RK4", "integrator_rk4", {}};
const MotionMethod kMidpoint{"ImplicitMidpoint", "integrator_implicit_midpoint", {}};
const MotionMethod kSecond{"SymplecticSplitting 2", "integrator_symplectic_splitting", {2}};
const MotionMethod kFourth{"SymplecticSplitting 4", "integrator_symplectic_splitting", {4}};
const MotionMethod kSixth{"SymplecticSplitting 6", "integrator_symplectic_splitting", {6}};

MotionMethod at_accuracy(const char* name, const char* library, double accuracy) {
  char text[64];
  std::snprintf(text, sizeof text, "%s %.0e", name, accuracy);
  return {text, library, {accuracy}};
}

MotionMethod dormand_prince(double accuracy) {
  MotionMethod method = at_accuracy("DormandPrince54", "integrator_dormand_prince54", accuracy);
  method.settings.push_back(1);
  return method;
}
MotionMethod dormand_prince8(double accuracy) {
  return at_accuracy("DormandPrince853", "integrator_dormand_prince853", accuracy);
}
MotionMethod rosenbrock(double accuracy) { return at_accuracy("Rosenbrock", "integrator_rosenbrock", accuracy); }
MotionMethod radau(double accuracy) { return at_accuracy("Radau", "integrator_radau", accuracy); }

// What is wanted of a run; 0: nothing.
struct Wanted {
  double error = 0.0, joint_error = 0.0, energy = 0.0, momentum = 0.0;
};

void expect_run(const MotionProblem& problem, const MotionMethod& method, std::uint32_t steps, const Wanted& wanted,
                const Wanted& missed = {}) {
  const MotionResult result = harness::run_motion(problem, method, steps);
  char text[96];
  std::snprintf(text, sizeof text, "%s, %.3g ms", method.name.c_str(), 1e3 * problem.duration / steps);
  const auto row = [&](const char* figure, double target, double bound, double value) {
    if (target > 0.0) expect_reached({problem.name, text, figure, target, value, result.seconds, bound});
  };
  row("end, relative to size", wanted.error, missed.error, result.error);
  row("joint error, m", wanted.joint_error, missed.joint_error, result.joint_error);
  row("energy, J", wanted.energy, missed.energy, result.energy_error);
  row("angular momentum, kg m^2/s", wanted.momentum, missed.momentum, result.momentum_error);
}

// ---- free

TEST(Problems, TumblingBox) {
  const MotionProblem problem = harness::tumbling_box();
  // 1e-12 of the largest kinetic energy, 41 kJ
  expect_run(problem, kSecond, 10000, {.error = 1e-8, .energy = 4e-8});
  expect_run(problem, kSecond, 100, {.error = 1e-11, .energy = 4e-8});
}

TEST(Problems, MuJoCosBox) {
  // energy: 0.49 J, momentum 0.09
  for (const MotionMethod& method : {kSecond, kFourth})
    expect_run(harness::mujoco_box(), method, 500, {.error = 1e-6, .energy = 0.5e-8, .momentum = 1e-12});
  expect_run(harness::mujoco_box(), dormand_prince(1e-10), 500, {.error = 1e-6, .energy = 0.5e-8});
}

TEST(Problems, SymmetricRotor) {
  for (const std::uint32_t steps : {100U, 10000U})
    expect_run(harness::symmetric_rotor(), kSecond, steps, {.error = 1e-12, .energy = 92e-12, .momentum = 6e-12});
}

// ---- jointed

// IFToMM A01.
TEST(Problems, PointPendulum) {
  const MotionProblem problem = harness::point_pendulum();
  expect_run(problem, kRk4, 10000, {.error = 1e-6, .joint_error = 1e-13});
  expect_run(problem, kSixth, 4000, {.error = 1e-11, .joint_error = 1e-13});
}

TEST(Problems, SphericalPendulum) {
  expect_run(harness::spherical_pendulum(), dormand_prince(1e-12), 200, {.error = 1e-10});
}

// Bruels and Cardona.
TEST(Problems, HeavyTop) {
  expect_run(harness::heavy_top(), kRk4, 2000, {.error = 1e-4});
  expect_run(harness::heavy_top(), dormand_prince(1e-12), 100, {.error = 1e-9, .joint_error = 1e-13});
  expect_run(harness::heavy_top(), dormand_prince8(1e-10), 100, {.error = 1e-9, .joint_error = 1e-13});
}

TEST(Problems, LagrangeTop) {
  expect_run(harness::lagrange_top(), kRk4, 2000, {.error = 1e-4});
  expect_run(harness::lagrange_top(), dormand_prince(1e-12), 200, {.error = 1e-9});
}

// Chaotic, so that 1e-12 at 5 s is some roundings at the start.
TEST(Problems, DoublePendulum) { expect_run(harness::double_pendulum(), dormand_prince(1e-12), 100, {.error = 1e-11}); }

// IFToMM A02: two loops of rods that are redundant in space and singular twice a turn.
TEST(Problems, FourBarPassesItsSingularities) {
  expect_run(harness::four_bar(10.0), kRk4, 800, {.error = 1e-3, .joint_error = 1e-12});
  expect_run(harness::four_bar(20.0), kRk4, 1600, {.error = 1e-3, .joint_error = 1e-12});
  expect_run(harness::four_bar(10.0), kRk4, 6400, {.error = 1e-8, .joint_error = 1e-12});
  expect_run(harness::four_bar(10.0), dormand_prince(1e-8), 50, {.error = 1e-5, .joint_error = 1e-12});
  expect_run(harness::four_bar(10.0), rosenbrock(1e-3), 400, {.error = 1e-3, .joint_error = 1e-12});
  expect_run(harness::four_bar(10.0), radau(1e-2), 400, {.error = 1e-4, .joint_error = 1e-12});
  expect_run(harness::four_bar(20.0), kMidpoint, 8000, {.error = 1e-2, .joint_error = 1e-12});
  if (harness::runs_long_problems())
    expect_run(harness::four_bar(20.0), kRk4, 25600, {.error = 1e-8, .joint_error = 1e-12});
}

// Andrews' mechanism of the DAE test set.
TEST(Problems, Squeezer) {
  expect_run(harness::squeezer(), dormand_prince(3e-10), 6, {.error = 1e-9, .joint_error = 1e-12});
  expect_run(harness::squeezer(), dormand_prince8(1e-9), 3, {.error = 1e-9, .joint_error = 1e-12});
}

// IFToMM A04.
TEST(Problems, BricardMovesThoughItsRowsAreTooMany) {
  expect_run(harness::bricard(), kRk4, 10000, {.joint_error = 1e-12, .energy = 1e-9});
}

// Mueller's pendulum challenge: frames of 1/60 s. Chaotic: what it keeps is asked for.
TEST(Problems, PendulumChallenge) {
  expect_run(harness::triple_pendulum(), dormand_prince(1e-10), 600, {.joint_error = 1e-12, .energy = 1e-6});
}

// IFToMM A05: stiff, some 2.7e4/s.
TEST(Problems, FlyballGovernor) {
  expect_run(harness::flyball_governor(), rosenbrock(1e-5), 1000, {.error = 1e-4});
  expect_run(harness::flyball_governor(), radau(1e-5), 1000, {.error = 1e-4});
  expect_run(harness::flyball_governor(), radau(5e-6), 100, {.error = 1e-8});
  expect_run(harness::flyball_governor(), dormand_prince(1e-5), 100, {.error = 1e-8});
}

}  // namespace
}  // namespace gravitas
