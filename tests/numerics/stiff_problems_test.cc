// Stiff springs and drags against their closed forms, over twelve orders of magnitude, and a lattice of stiff springs
// against the rigid body that it becomes.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <string>
#include <vector>

#include "plugin_sdk/body.h"
#include "tests/kernel/run_to_end.h"
#include "tests/numerics/motion_problem.h"
#include "tests/numerics/reached.h"

namespace gravitas {
namespace {

using harness::CpuClock;
using harness::expect_reached;
using harness::plugin_path;
using harness::WorldBuilder;
using kernel::Environment;

constexpr std::uint32_t kSteps = 60;  // of 1/60 s: one second

WorldBuilder world_with(const std::string& integrator, std::vector<double> settings) {
  WorldBuilder world;
  world.steps(kSteps, 1.0 / kSteps).plugin(Slot::kIntegrator, plugin_path(integrator), std::move(settings));
  world.point(1.0, {1, 1, 1}, {1, 0, 0});
  return world;
}

// 1 kg at rest, 1 m from the end of a spring, after t: x'' = -w^2 x - 2 zeta w x'.
double damped_swing(double w, double zeta, double t) {
  if (zeta < 1.0) {
    const double wd = w * std::sqrt(1.0 - zeta * zeta), decay = zeta * w;
    return std::exp(-decay * t) * (std::cos(wd * t) + decay / wd * std::sin(wd * t));
  }
  if (zeta == 1.0) return std::exp(-w * t) * (1.0 + w * t);
  const double root = std::sqrt(zeta * zeta - 1.0), fast = w * (zeta + root), slow = w / (zeta + root);
  return (fast * std::exp(-slow * t) - slow * std::exp(-fast * t)) / (fast - slow);
}

struct Damper {
  std::string name, library;
};
const Damper kDampers[] = {{"Rosenbrock 1e-06, 1/60 s", "integrator_rosenbrock"},
                           {"Radau 1e-06, 1/60 s", "integrator_radau"}};

void expect_damped_springs(const Damper& method) {
  for (const double zeta : {0.1, 1.0, 100.0}) {
    double worst = 0.0;
    const CpuClock clock;
    for (int exponent = 2; exponent <= 14; ++exponent) {
      const double w = std::pow(10.0, 0.5 * exponent);
      WorldBuilder builder = world_with(method.library, {1e-6});
      harness::spring_between(&builder, {w * w, 2.0 * zeta * w, 0.0}, Vector3::Zero(), kNone, Vector3::Zero());
      Environment world(builder.description());
      while (world.step_count() < kSteps) {
        ASSERT_NO_FATAL_FAILURE(step(&world)) << exponent;
        worst = std::max(worst, std::fabs(world.state().position[0] - damped_swing(w, zeta, world.time())));
      }
    }
    char text[64];
    std::snprintf(text, sizeof text, "springs 1e2 ... 1e14 N/m, zeta %g", zeta);
    expect_reached({text, method.name, "position, m", 1e-4, worst, clock.seconds()});
  }
}

TEST(StiffProblems, DampedSpringsFollowTheirClosedForms) {
  for (const Damper& method : kDampers) expect_damped_springs(method);
}

// What it does not resolve keeps ringing, with the energy that it had.
TEST(StiffProblems, UndampedSpringsKeepTheirEnergyAtAnyStiffness) {
  double worst = 0.0;
  const CpuClock clock;
  for (int exponent = 2; exponent <= 14; ++exponent) {
    const double stiffness = std::pow(10.0, exponent);
    WorldBuilder builder = world_with("integrator_implicit_midpoint", {});
    harness::spring_between(&builder, {stiffness, 0.0, 0.0}, Vector3::Zero(), kNone, Vector3::Zero());
    Environment world(builder.description());
    while (world.step_count() < kSteps) {
      ASSERT_NO_FATAL_FAILURE(step(&world)) << exponent;
      worst = std::max(worst, std::fabs(harness::energy_of(&world) / (0.5 * stiffness) - 1.0));
    }
  }
  expect_reached(
      {"springs 1e2 ... 1e14 N/m", "ImplicitMidpoint, 1/60 s", "energy, relative", 1e-9, worst, clock.seconds()});
}

// c dt/m from 1e-2 to 1e6.
void expect_drags(const Damper& method) {
  for (const bool is_quadratic : {false, true}) {
    double worst = 0.0, rises = 0.0, reversal = 0.0;
    const CpuClock clock;
    for (int exponent = -2; exponent <= 6; ++exponent) {
      const double c = kSteps * std::pow(10.0, exponent);
      WorldBuilder builder = world_with(method.library, {1e-6});
      builder.body().twist.linear = {1, 0, 0};
      builder.force("Drag", "force_drag", {is_quadratic ? 0.0 : c, is_quadratic ? c : 0.0});
      Environment world(builder.description());
      double last = 1.0;
      while (world.step_count() < kSteps) {
        ASSERT_NO_FATAL_FAILURE(step(&world)) << exponent;
        const double speed = world.state().linear_velocity[0], t = world.time();
        worst = std::max(worst, std::fabs(speed - (is_quadratic ? 1.0 / (1.0 + c * t) : std::exp(-c * t))));
        rises = std::max(rises, speed - last), reversal = std::max(reversal, -speed);
        last = speed;
      }
    }
    const char* problem = is_quadratic ? "quadratic drag, c v dt/m to 1e6" : "linear drag, c dt/m to 1e6";
    expect_reached({problem, method.name, "speed, m/s", 1e-4, worst, clock.seconds()});
    expect_reached({problem, method.name, "rise of the speed, m/s", 0.0, rises, clock.seconds(), 1e-6});
    expect_reached({problem, method.name, "reversed speed, m/s", 0.0, reversal, clock.seconds(), 1e-6});
  }
}

TEST(StiffProblems, DragsFollowTheirClosedForms) {
  for (const Damper& method : kDampers) expect_drags(method);
}

// Eight masses at the corners of a box, each two joined by a spring, set turning; or the rigid body of them.
struct Corners {
  std::vector<Vector3> at_rest;
  Vector3 spin{0.3, 2.0, 0.2};  // rad/s

  Corners() {
    for (int k = 0; k < 8; ++k) at_rest.emplace_back(k & 1 ? 0.1 : -0.1, k & 2 ? 0.2 : -0.2, k & 4 ? 0.3 : -0.3);
  }
};

void add_lattice(WorldBuilder* world, double stiffness, double damping) {
  const Corners corners;
  WorldBuilder& builder = *world;
  for (std::uint32_t i = 0; i < 8; ++i) {
    const Vector3 at = corners.at_rest[i];
    builder.point(0.125, {1, 1, 1}, at);
    builder.body().twist.linear = corners.spin.cross(at);
    for (std::uint32_t k = 0; k < i; ++k)
      harness::spring_between(world, {stiffness, damping, (at - corners.at_rest[k]).norm()}, Vector3::Zero(), k,
                              Vector3::Zero());
  }
}

std::vector<Vector3> corners_of_lattice(double stiffness, double* momentum_error) {
  WorldBuilder builder;
  builder.steps(60, 1.0 / 60).plugin(Slot::kIntegrator, plugin_path("integrator_dormand_prince54"), {1e-11, 1});
  add_lattice(&builder, stiffness, 0.0);
  Environment world(builder.description());
  const Vector3 momentum = harness::angular_momentum_of(world);
  while (world.step_count() < world.total_steps() && world.step() == kernel::StepOutcome::kCommitted) {
  }
  *momentum_error = (harness::angular_momentum_of(world) - momentum).norm() / momentum.norm();
  std::vector<Vector3> places;
  for (std::size_t i = 0; i < 8; ++i) places.push_back(vector_at(world.state().position, i));
  return places;
}

std::vector<Vector3> corners_of_rigid_body() {
  const Corners corners;
  WorldBuilder builder;
  // m (y^2 + z^2) and so on, of 1 kg in all
  builder.point(1.0, {0.13, 0.10, 0.05}, {0, 0, 0}).steps(60, 1.0 / 60);
  builder.plugin(Slot::kIntegrator, plugin_path("integrator_symplectic_splitting"), {2});
  builder.body().twist.angular = corners.spin;
  Environment world(builder.description());
  while (world.step_count() < world.total_steps() && world.step() == kernel::StepOutcome::kCommitted) {
  }
  std::vector<Vector3> places;
  for (const Vector3& at : corners.at_rest) places.push_back(quaternion_at(world.state().orientation, 0) * at);
  return places;
}

// It stretches by what the turning asks for, which falls as 1/k: the two meet.
TEST(StiffProblems, ALatticeOfSpringsBecomesTheRigidBox) {
  const std::vector<Vector3> rigid = corners_of_rigid_body();
  std::vector<double> errors;
  for (const double stiffness : {1e3, 1e4, 1e5, 1e6}) {
    double momentum_error = 0.0, worst = 0.0;
    const CpuClock clock;
    const std::vector<Vector3> places = corners_of_lattice(stiffness, &momentum_error);
    for (std::size_t i = 0; i < 8; ++i) worst = std::max(worst, (places[i] - rigid[i]).norm());
    errors.push_back(worst);
    char text[64];
    std::snprintf(text, sizeof text, "lattice of 28 springs, %.0e N/m", stiffness);
    // corners go 0.6 m in the second; the stretch is w^2 m / k of it
    expect_reached(
        {text, "DormandPrince54 1e-11", "corners off the rigid box, m", 4.0 / stiffness, worst, clock.seconds()});
    expect_reached(
        {text, "DormandPrince54 1e-11", "angular momentum, relative", 1e-9, momentum_error, clock.seconds()});
  }
  for (std::size_t i = 1; i < errors.size(); ++i) EXPECT_NEAR(std::log10(errors[i - 1] / errors[i]), 1.0, 0.2) << i;
}

struct End {
  std::vector<double> positions;
  std::uint64_t asked;  // how often for forces
};

End end_of(const WorldBuilder& builder) {
  Environment world(builder.description());
  for (std::uint32_t step = 0; step < world.total_steps(); ++step)
    EXPECT_EQ(world.step(), kernel::StepOutcome::kCommitted);
  const std::span<const double> position = world.state().position;
  return {{position.begin(), position.end()}, world.stage_time(kernel::Stage::kForce).count()};
}

// With the springs' Jacobian an implicit method goes the same way and asks for forces ten times less: one Jacobian in place
// of a derivative for each number of 8 bodies.
TEST(StiffProblems, AJacobianOfTheForcesSavesDerivatives) {
  const auto run = [](const char* integrator, const std::vector<double>& settings, bool has_jacobians) {
    WorldBuilder builder;
    builder.steps(6, 1.0 / 60).plugin(Slot::kIntegrator, plugin_path(integrator), settings);
    add_lattice(&builder, 1e6, 100.0);
    if (!has_jacobians)
      for (kernel::PluginChoice& plugin : builder.description().force.plugins)
        std::erase(plugin.declaration.capabilities, "jacobians");
    return end_of(builder);
  };
  for (const char* integrator : {"integrator_rosenbrock", "integrator_implicit_midpoint"}) {
    const std::vector<double> settings =
        std::string(integrator) == "integrator_rosenbrock" ? std::vector<double>{1e-7} : std::vector<double>{};
    const End with = run(integrator, settings, true), without = run(integrator, settings, false);
    for (std::size_t i = 0; i < with.positions.size(); ++i)
      EXPECT_NEAR(with.positions[i], without.positions[i], 1e-6) << integrator << ", number " << i;
    EXPECT_LT(5 * with.asked, without.asked) << integrator << " asked " << with.asked << " and " << without.asked;
  }
}

// With the Jacobian of the reactions, too, where forces act on a mechanism.
TEST(StiffProblems, AJacobianOfTheReactionsSavesDerivatives) {
  const auto run = [](const char* integrator, const std::vector<double>& settings, bool has_jacobians) {
    WorldBuilder builder = harness::flyball_governor().world;
    builder.steps(10, 0.01).plugin(Slot::kIntegrator, plugin_path(integrator), settings);
    builder.description().simulator = kernel::Simulator::kSmooth;
    if (!has_jacobians)
      for (kernel::PluginChoice& plugin : builder.description().solver.plugins)
        std::erase(plugin.declaration.capabilities, "reaction_jacobians");
    return end_of(builder);
  };
  for (const char* integrator : {"integrator_rosenbrock", "integrator_radau"}) {
    const End with = run(integrator, {1e-6}, true), without = run(integrator, {1e-6}, false);
    for (std::size_t i = 0; i < with.positions.size(); ++i)
      EXPECT_NEAR(with.positions[i], without.positions[i], 1e-7) << integrator << ", number " << i;
    EXPECT_LT(2 * with.asked, without.asked) << integrator << " asked " << with.asked << " and " << without.asked;
  }
}

}  // namespace
}  // namespace gravitas
