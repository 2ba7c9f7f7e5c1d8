// Motion at the ends of the range: fast spin, thin rotors, steps from 1e-9 s to 1 s, far from the origin, a million steps
// there and back, forces that are no numbers. GRAVITAS_LONG_PROBLEMS makes a million steps of what is else a tenth of it.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <string>
#include <vector>

#include "plugin_sdk/body.h"
#include "plugin_sdk/math/rotation.h"
#include "tests/kernel/run_to_end.h"
#include "tests/numerics/motion_problem.h"
#include "tests/numerics/reached.h"

namespace gravitas {
namespace {

using harness::CpuClock;
using harness::expect_reached;
using harness::MotionMethod;
using harness::plugin_path;
using harness::WorldBuilder;
using kernel::Environment;
using kernel::Simulator;

constexpr double kG = 9.81;

std::uint32_t many_steps() { return harness::runs_long_problems() ? 1'000'000 : 100'000; }

WorldBuilder world_of(const MotionMethod& method, std::uint32_t steps, double time_step) {
  WorldBuilder world;
  world.steps(steps, time_step).plugin(Slot::kIntegrator, plugin_path(method.library), method.settings);
  return world;
}

const MotionMethod kExactRotor{"SymplecticSplitting 2", "integrator_symplectic_splitting", {2}};

// Largest relative change of energy and angular momentum of a free rotor.
void expect_rotor_keeps(const std::string& problem, const Vector3& moments, const Vector3& spin, std::uint32_t steps,
                        double time_step, double target) {
  WorldBuilder builder = world_of(kExactRotor, steps, time_step);
  builder.point(1.0, moments, {0, 0, 0});
  builder.body().twist.angular = spin;
  const CpuClock clock;
  Environment world(builder.description());
  const double energy = harness::energy_of(&world);
  const Vector3 momentum = harness::angular_momentum_of(world);
  ASSERT_NO_FATAL_FAILURE(run_to_end(&world));
  const std::string method = kExactRotor.name + ", " + std::to_string(steps) + " steps";
  expect_reached({problem, method, "energy, relative", target, std::fabs(harness::energy_of(&world) / energy - 1.0),
                  clock.seconds()});
  expect_reached({problem, method, "angular momentum, relative", target,
                  (harness::angular_momentum_of(world) - momentum).norm() / momentum.norm(), clock.seconds()});
}

TEST(Extremes, AFastRotorKeepsWhatItHas) {
  expect_rotor_keeps("spin of 1e4 rad/s", {1, 2, 3}, {3e3, 9e3, 3e3}, many_steps(), 1e-3, 1e-9);
}

TEST(Extremes, AThinRotorKeepsWhatItHas) {
  expect_rotor_keeps("moments 1 : 1e-8", {1, 1, 1e-8}, {1, 0.5, 100}, 10'000, 1e-2, 1e-10);
  expect_rotor_keeps("moments 1 : 1 + 1e-8 : 1e-8", {1, 1 + 1e-8, 1e-8}, {1, 0.5, 1e4}, 10'000, 1e-2, 1e-10);
}

// Thrown and turning about a principal axis: both in closed form, whatever the step.
TEST(Extremes, StepsFromANanosecondToASecond) {
  for (const MotionMethod& method :
       {kExactRotor, MotionMethod{"Verlet", "integrator_verlet", {}}, MotionMethod{"RKMK4", "integrator_rkmk4", {}},
        MotionMethod{"DormandPrince54", "integrator_dormand_prince54", {1e-10, 1}},
        MotionMethod{"DormandPrince853", "integrator_dormand_prince853", {1e-10}},
        MotionMethod{"Rosenbrock", "integrator_rosenbrock", {1e-8}}, MotionMethod{"Radau", "integrator_radau", {1e-8}},
        MotionMethod{"ImplicitMidpoint", "integrator_implicit_midpoint", {}}}) {
    double worst = 0.0;
    const CpuClock clock;
    for (const double time_step : {1e-9, 1e-6, 1e-3, 1.0}) {
      WorldBuilder builder = world_of(method, 100, time_step);
      builder.point(1.0, {1, 2, 3}, {0, 0, 0});
      builder.body().twist = {{3, 4, 0}, {0, 0, 0.5}};
      builder.gravity({0, -kG, 0});
      Environment world(builder.description());
      ASSERT_NO_FATAL_FAILURE(run_to_end(&world)) << method.name;
      const double t = world.time();
      const Vector3 place(3 * t, 4 * t - 0.5 * kG * t * t, 0);
      worst = std::max(worst, (vector_at(world.state().position, 0) - place).norm() / place.norm());
      const Quaternion turn = exp_rotation(Vector3(0, 0, 0.5 * t));
      // Cayley's map turns by 2 atan(w h / 2)
      if (method.name != "ImplicitMidpoint" || time_step < 1.0)
        worst = std::max(
            worst, log_rotation(shorter_arc(quaternion_at(world.state().orientation, 0) * turn.conjugate())).norm());
    }
    expect_reached(
        {"steps of 1e-9 ... 1 s", method.name, "place and attitude, relative", 1e-8, worst, clock.seconds()});
  }
}

// A box slides to rest and a ball comes to roll as they do at the origin, but for what a double resolves there.
TEST(Extremes, AHundredThousandKilometresFromTheOrigin) {
  const CpuClock clock;
  std::vector<Vector3> way[2];
  for (const int run_of : {0, 1}) {
    const Vector3 origin(run_of == 0 ? 0.0 : 1e8, 0, 0);
    WorldBuilder builder = world_of({"", "integrator_verlet", {}}, 120, 1.0 / 60);
    builder.plugin(Slot::kSolver, plugin_path("solver_newton"), {1e-12, 500}).material({0.0, 0.3, 0.3, 0.0});
    builder.description().simulator = Simulator::kContinuous;
    builder.ground().box({0.3, 0.2, 0.25}, 2.0, origin + Vector3(0, 0.2, 0), {3, 0, 4});
    builder.sphere(0.2, 1.5, origin + Vector3(0, 0.2, -4), {5, 0, 0}).gravity({0, -kG, 0});
    Environment world(builder.description());
    ASSERT_NO_FATAL_FAILURE(run_to_end(&world));
    for (const std::size_t body : {1U, 2U}) way[run_of].push_back(vector_at(world.state().position, body) - origin);
  }
  double worst = 0.0;
  for (const std::size_t i : {0U, 1U}) worst = std::max(worst, (way[1][i] - way[0][i]).norm());
  // 1.5e-8 m is a rounding there, and each of 120 steps rounds
  expect_reached(
      {"1e8 m from the origin", "Continuous, Verlet, Newton, 1/60 s", "way, m", 2e-6, worst, clock.seconds()});
}

// ---- there and back

// A turning body swings on a spring of some length through two dimensions.
WorldBuilder swing(const MotionMethod& method, std::uint32_t steps, double time_step) {
  WorldBuilder builder = world_of(method, steps, time_step);
  builder.point(1.0, {1, 2, 3}, {1, 0, 0});
  builder.body().twist.linear = {0, 1.5, 0};
  harness::spring_between(&builder, {10.0, 0.0, 0.6}, Vector3::Zero(), kNone, Vector3::Zero());
  return builder;
}

std::vector<MotionMethod> symmetric_methods() {
  return {{"Verlet", "integrator_verlet", {}},
          {"ImplicitMidpoint", "integrator_implicit_midpoint", {}},
          {"SymplecticSplitting 2", "integrator_symplectic_splitting", {2}},
          {"SymplecticSplitting 4", "integrator_symplectic_splitting", {4}},
          {"SymplecticSplitting 6", "integrator_symplectic_splitting", {6}}};
}

TEST(Extremes, SymmetricMethodsGoThereAndBack) {
  const std::uint32_t steps = many_steps();
  for (const MotionMethod& method : symmetric_methods()) {
    const CpuClock clock;
    WorldBuilder builder = swing(method, steps, 0.01);
    builder.body().twist.angular = {0.5, 1.0, 0.3};
    const Vector3 start = builder.body().pose.position;
    Environment there(builder.description());
    ASSERT_NO_FATAL_FAILURE(run_to_end(&there)) << method.name;
    const kernel::StateView end = there.state();
    builder.body().pose = {vector_at(end.position, 0), quaternion_at(end.orientation, 0)};
    builder.body().twist = {-vector_at(end.linear_velocity, 0), -vector_at(end.angular_velocity, 0)};
    Environment back(builder.description());
    ASSERT_NO_FATAL_FAILURE(run_to_end(&back)) << method.name;
    const double place = (vector_at(back.state().position, 0) - start).norm();
    const double attitude = log_rotation(shorter_arc(quaternion_at(back.state().orientation, 0))).norm();
    // roundings change the energy a little more with each step, and what that changes in the phase grows with the square
    // of their number; solving equations to rounding leaves more of them
    const double bound = (method.name == "ImplicitMidpoint" ? 1e-7 : 1e-9) * std::pow(steps / 1e5, 2);
    expect_reached({"there and back, " + std::to_string(steps) + " steps", method.name, "place, m; attitude, rad",
                    bound, std::max(place, attitude), clock.seconds()});
  }
}

TEST(Extremes, EnergyOfSymplecticMethodsHasNoSlope) {
  const std::uint32_t steps = many_steps();
  for (const MotionMethod& method : symmetric_methods()) {
    const CpuClock clock;
    Environment world(swing(method, steps, 0.01).description());
    // means over the first and last tenth; each holds the same swings but for a part of one
    const double start = harness::energy_of(&world);
    double first = 0.0, last = 0.0, swing_of_energy = 0.0;
    for (std::uint32_t i = 0; i < steps; ++i) {
      ASSERT_EQ(world.step(), kernel::StepOutcome::kCommitted);
      if (i >= steps / 10 && i < steps - steps / 10) continue;
      const double error = harness::energy_of(&world) / start - 1.0;
      swing_of_energy = std::max(swing_of_energy, std::fabs(error));
      (i < steps / 10 ? first : last) += error / (steps / 10);
    }
    // a part of a swing of some 200 steps weighs 200 in steps/10; roundings walk
    const double bound = 2000.0 * swing_of_energy / steps + 1e-15 * std::sqrt(steps);
    expect_reached({"slope of the energy, " + std::to_string(steps) + " steps", method.name, "drift, relative", bound,
                    std::fabs(last - first), clock.seconds()});
  }
}

// ---- forces that are no numbers

TEST(Extremes, AForceThatOverflowsIsRefusedWithItsBody) {
  WorldBuilder builder;
  builder.steps(5, 0.01).point(1.0, {1, 1, 1}, {1, 0, 0}).point(1.0, {1, 1, 1}, {1e10, 0, 0});
  harness::spring_between(&builder, {1e300, 0.0, 0.0}, Vector3::Zero(), kNone, Vector3::Zero());
  try {
    const Environment world(builder.description());
    ADD_FAILURE() << "it was accepted";
  } catch (const kernel::StageFault& fault) {
    EXPECT_NE(fault.text().find("on body 1 is not finite"), std::string::npos) << fault.text();
  }
}

// Far too stiff for its step, so that the numbers grow until they overflow: then the step is refused, and the last
// committed state stands. The other body goes its way.
TEST(Extremes, AMotionThatOverflowsIsRefusedWithItsBody) {
  for (const char* library : {"integrator_euler", "integrator_verlet", "integrator_rk4", "integrator_rkmk4"}) {
    WorldBuilder builder = world_of({"", library, {}}, 200, 0.01);
    builder.point(1.0, {1, 1, 1}, {0, 0, 0}).point(1.0, {1, 1, 1}, {1, 0, 0});
    harness::spring_between(&builder, {1e14, 0.0, 0.0}, Vector3::Zero(), kNone, Vector3::Zero());
    Environment world(builder.description());
    while (world.step_count() < world.total_steps() && world.step() == kernel::StepOutcome::kCommitted) {
    }
    ASSERT_TRUE(world.fault()) << library;
    EXPECT_NE(world.fault()->fault.text().find("body 1"), std::string::npos)
        << library << ": " << world.fault()->fault.text();
    EXPECT_LT(world.step_count(), 200U);
    for (const double number : world.state().position) EXPECT_TRUE(std::isfinite(number));
    EXPECT_EQ(vector_at(world.state().position, 0), Vector3::Zero());
  }
}

}  // namespace
}  // namespace gravitas
