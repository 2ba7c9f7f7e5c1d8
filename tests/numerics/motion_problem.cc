#include "tests/numerics/motion_problem.h"

#include <algorithm>
#include <cmath>
#include <ctime>
#include <limits>
#include <numbers>
#include <stdexcept>

#include "plugin_sdk/body.h"
#include "plugin_sdk/math/rotation.h"

namespace gravitas::testing {
namespace {

constexpr double kAbsent = std::numeric_limits<double>::quiet_NaN();

double angle_between(const Quaternion& a, const Quaternion& b) {
  return log_rotation(shorter_arc(a * b.conjugate())).norm();
}

WorldBuilder jointed_world() {
  WorldBuilder world;
  world.plugin(Slot::kSolver, plugin_path("solver_direct"), {0.0, 1000.0});
  return world;
}

void hinge(WorldBuilder* world, std::uint32_t one, std::uint32_t two, const Vector3& at) {
  world->joint("Revolute", "constraint_revolute", one, two,
               {at.x(), at.y(), at.z(), at.x(), at.y(), at.z() + 1.0, kAbsent, kAbsent});
}

Vector3 position_of(const kernel::StateView& state, std::size_t body) { return vector_at(state.position, body); }

}  // namespace

std::vector<MotionMethod> fixed_step_methods() {
  return {{"Euler", "integrator_euler", {}, 1, 1},
          {"SemiImplicitEuler", "integrator_semi_implicit_euler", {}, 1, 1},
          {"Verlet", "integrator_verlet", {}, 2, 0},
          {"BasicVerlet", "integrator_basic_verlet", {}, 2, 0},
          {"ImplicitMidpoint", "integrator_implicit_midpoint", {}, 2, 2},
          {"RK4", "integrator_rk4", {}, 4, 4},
          {"RKMK4", "integrator_rkmk4", {}, 4, 4},
          {"SymplecticSplitting 2", "integrator_symplectic_splitting", {2}, 2, 0},
          {"SymplecticSplitting 4", "integrator_symplectic_splitting", {4}, 4, 0},
          {"SymplecticSplitting 6", "integrator_symplectic_splitting", {6}, 6, 0}};
}

std::vector<MotionMethod> adaptive_methods(double accuracy) {
  return {{"DormandPrince54", "integrator_dormand_prince54", {accuracy}, 5, 5},
          {"Rosenbrock", "integrator_rosenbrock", {accuracy}, 4, 0}};
}

MotionProblem tumbling_box() {
  WorldBuilder world;
  world.point(10.0, {0.80833333333333333, 0.68333333333333333, 0.14166666666666667}, {0, 0, 0});
  world.body().twist = {{-2, 2, 8}, {0.1, 5, 0.1}};
  world.gravity({0, 0, -9.8});
  return {"tumbling box", 10.0, false, world, [](const kernel::StateView& state) {
            const Quaternion exact(0.2251645634139581639, -0.6199275624994524883, -0.2770291506871945918,
                                   0.6987457236403101107);
            return angle_between(quaternion_at(state.orientation, 0), exact);
          }};
}

// k/m = 36; the spring holds the centre of mass, so that the rotor is free: I = (2, 2, 1), axis along z at the start.
MotionProblem spring_and_spin() {
  WorldBuilder world;
  world.point(1.0, {2.0, 2.0, 1.0}, {1, 0, 0});
  world.body().twist = {{0, 2, 0}, {1, 0, 3}};
  world.force("Spring", "force_spring", {36.0, 0.0, 0.0, 0.0, 0.0, 0.0, kAbsent, 0.0, 0.0, 0.0});
  return {"spring and spin", 2.0, false, world, [](const kernel::StateView& state) {
            const double w = 6.0, t = 2.0;
            const Vector3 exact(std::cos(w * t), 2.0 / w * std::sin(w * t), 0.0);
            // L = (2, 0, 3): turns about L at |L|/I, after a turn about the body's axis at w3 (1 - I3/I1)
            const Vector3 momentum(2.0, 0.0, 3.0);
            const Quaternion turned =
                exp_rotation(t * momentum / 2.0) * exp_rotation(Vector3(0.0, 0.0, t * 3.0 * (1.0 - 0.5)));
            return std::max((position_of(state, 0) - exact).norm(),
                            angle_between(quaternion_at(state.orientation, 0), turned));
          }};
}

MotionProblem point_pendulum() {
  WorldBuilder world = jointed_world();
  world.point(1.0, {0.1, 0.1, 0.1}, {-1, 0, 0});
  world.gravity({0, -9.81, 0});
  world.joint("Distance", "constraint_distance", kNone, 0, {0, 0, 0, -1, 0, 0, kAbsent, kAbsent});
  return {"point pendulum", 10.0, true, world, [](const kernel::StateView& state) {
            return (position_of(state, 0) - Vector3(-0.275087462576116860, -0.961419205099125064, 0)).norm();
          }};
}

MotionProblem spherical_pendulum() {
  WorldBuilder world = jointed_world();
  const Vector3 start(std::sqrt(0.75), 0, -0.5);
  world.point(1.0, {0.1, 0.1, 0.1}, start);
  world.body().twist.linear = {0, 2, 0};
  world.gravity({0, 0, -9.81});
  world.joint("Distance", "constraint_distance", kNone, 0,
              {0, 0, 0, start.x(), start.y(), start.z(), kAbsent, kAbsent});
  return {
      "spherical pendulum", 10.0, true, world, [](const kernel::StateView& state) {
        return (position_of(state, 0) - Vector3(0.04578256339846101085, -0.7377486044706621106, -0.6735213088613132007))
            .norm();
      }};
}

MotionProblem double_pendulum() {
  WorldBuilder world = jointed_world();
  world.point(1.0, {0.5, 1.0, 1.0}, {0.5, 0, 0});
  world.point(1.0, {0.5, 1.0, 1.0}, {1.5, 0, 0});
  world.gravity({0, -10, 0});
  hinge(&world, kNone, 0, {0, 0, 0});
  hinge(&world, 0, 1, {1, 0, 0});
  return {"double pendulum", 5.0, true, world, [](const kernel::StateView& state) {
            const double one = -0.9145987843839328747, two = -7.577710906986686579;
            const Vector3 first(0.5 * std::cos(one), 0.5 * std::sin(one), 0.0);
            const Vector3 second(std::cos(one) + 0.5 * std::cos(two), std::sin(one) + 0.5 * std::sin(two), 0.0);
            return std::max((position_of(state, 0) - first).norm(), (position_of(state, 1) - second).norm());
          }};
}

MotionProblem heavy_top() {
  WorldBuilder world = jointed_world();
  world.point(15.0, {0.234375, 0.46875, 0.234375}, {0, 1, 0});
  const Vector3 w(0, 150, -4.61538);
  world.body().twist = {w.cross(Vector3(0, 1, 0)), w};
  world.gravity({0, 0, -9.81});
  world.joint("Spherical", "constraint_spherical", kNone, 0,
              {0, 0, 0, kAbsent, 0, kAbsent, kAbsent, kAbsent, kAbsent, kAbsent});
  return {
      "heavy top", 2.0, true, world, [](const kernel::StateView& state) {
        const Quaternion exact(0.1229471350415334671, -0.4910798925500270147, 0.3504300303436209618,
                               -0.7879868875504856693);
        return std::max(
            angle_between(quaternion_at(state.orientation, 0), exact),
            (position_of(state, 0) - Vector3(-0.15041682274564176, -0.72416559163689565, -0.67302226956044410)).norm());
      }};
}

// Rods of 1 m and 1 kg: cranks from (i, 0) up to (i, 1), couplers between, i = 0, 1, 2.
MotionProblem four_bar() {
  WorldBuilder world = jointed_world();
  const double across = 1.0 / 12.0;
  for (int i = 0; i < 3; ++i) {
    world.point(1.0, {across, 1e-3, across}, {i + 0.0, 0.5, 0});
    world.body().twist = {{0.5, 0, 0}, {0, 0, -1}};
  }
  for (int i = 0; i < 2; ++i) {
    world.point(1.0, {1e-3, across, across}, {i + 0.5, 1, 0});
    world.body().twist = {{1, 0, 0}, {0, 0, 0}};
  }
  world.gravity({0, -9.81, 0});
  for (std::uint32_t i = 0; i < 3; ++i) hinge(&world, kNone, i, {i + 0.0, 0, 0});
  for (std::uint32_t i = 0; i < 2; ++i) {
    hinge(&world, i, 3 + i, {i + 0.0, 1, 0});
    hinge(&world, 3 + i, i + 1, {i + 1.0, 1, 0});
  }
  return {"four-bar", 10.0, true, world, [](const kernel::StateView& state) {
            const Vector3 tip = 2.0 * position_of(state, 0);
            return (tip - Vector3(0.328458111540815379, 0.944518538178600962, 0)).norm();
          }};
}

MotionResult run_motion(const MotionProblem& problem, const MotionMethod& method, std::uint32_t steps,
                        kernel::Simulator simulator) {
  WorldBuilder world = problem.world;
  world.steps(steps, problem.duration / steps);
  world.plugin(Slot::kIntegrator, plugin_path(method.library), method.settings);
  world.description().simulator = simulator;
  kernel::Environment environment(world.description());
  MotionResult result;
  const std::clock_t start = std::clock();
  for (std::uint32_t i = 0; i < steps; ++i) {
    if (environment.step() != kernel::StepOutcome::kCommitted)
      throw std::runtime_error(problem.name + ", " + method.name + ": " + environment.fault()->fault.what());
    result.joint_error = std::max(result.joint_error, environment.figures().joint_error);
  }
  result.seconds = static_cast<double>(std::clock() - start) / CLOCKS_PER_SEC;
  result.error = problem.error(environment.state());
  const auto stage = problem.is_jointed ? kernel::Stage::kConstrain : kernel::Stage::kForce;
  result.derivatives = environment.stage_time(stage).count();
  return result;
}

}  // namespace gravitas::testing
