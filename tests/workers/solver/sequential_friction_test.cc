// Friction of the Sequential solver: sticking, sliding, every direction alike, static and dynamic,
// rolling, spinning.
#include <gtest/gtest.h>

#include <cmath>

#include "plugin_sdk/math/transcendental.h"
#include "tests/workers/solver/solver_problem.h"
#include "workers/solver/sequential/sequential.h"

namespace gravitas {
namespace {

constexpr double kGravity = 9.81;
constexpr double kPi = 3.14159265358979323846;

SequentialSolver solver_with(std::uint32_t iterations) { return SequentialSolver(SequentialSettings{iterations, 1.0}); }

// A box with its lower face on the plane y = 0, and a load tilted by `slope` towards the direction
// `heading` (rad about y): an incline in its own frame.
SolverProblem box_on_incline(double slope, double heading, double speed, double static_friction,
                             double dynamic_friction) {
  SolverProblem problem;
  const math::SinCos way = math::sincos(heading);
  const math::SinCos tilt = math::sincos(slope);
  const Vector3 downhill(way.cos, 0.0, way.sin);
  const auto ground = problem.add_immovable();
  const Vector3 half(0.5, 0.1, 0.5);
  const double mass = 3.0;
  const Vector3 s = half.cwiseProduct(half);
  const auto box = problem.add_body({.mass = mass,
                                     .moments = mass / 3.0 * Vector3(s.y() + s.z(), s.x() + s.z(), s.x() + s.y()),
                                     .pose = {{0, half.y(), 0}, Quaternion::Identity()},
                                     .linear = speed * downhill});
  problem.make_trial(kGravity * (tilt.sin * downhill - tilt.cos * Vector3::UnitY()));
  const Vector3 at = problem.trial_pose(box).position;
  const double depth = half.y() - at.y();
  for (int corner = 0; corner < 4; ++corner)
    problem.add_contact(
        {.body1 = ground,
         .body2 = box,
         .point = {at.x() + (corner % 2 == 0 ? 0.5 : -0.5), -0.5 * depth, at.z() + (corner < 2 ? 0.5 : -0.5)},
         .depth = depth,
         .static_friction = static_friction,
         .dynamic_friction = dynamic_friction,
         .key = static_cast<std::uint64_t>(corner)});
  return problem;
}

Vector3 heading_of(int direction) {
  const math::SinCos way = math::sincos(direction * kPi / 8.0);
  return {way.cos, 0.0, way.sin};
}

TEST(SequentialFriction, ABlockSticksInEveryDirection) {
  const double slope = math::atan(0.5);
  for (int direction = 0; direction < 16; ++direction) {
    const SolverProblem problem = box_on_incline(slope, direction * kPi / 8.0, 0.0, 0.500001, 0.4);
    const SolverAnswer answer = problem.solve(solver_with(2000));
    EXPECT_TRUE(answer.converged());
    // speeds of order g h = 0.1
    EXPECT_LE(answer.velocity(1).norm(), 1e-15) << direction;
    EXPECT_LE(answer.turning(1).norm(), 1e-14);
    // theta = 1: the pose stays, too
    EXPECT_LE((problem.committed(answer, 1).position - Vector3(0, 0.1, 0)).norm(), 1e-17);
  }
}

TEST(SequentialFriction, ABlockSlidesAlikeInEveryDirection) {
  const double slope = math::atan(0.5);
  const double mu = 0.3;
  const math::SinCos tilt = math::sincos(slope);
  const double acceleration = kGravity * (tilt.sin - mu * tilt.cos);
  for (const double speed : {0.0, 2.0}) {
    for (int direction = 0; direction < 16; ++direction) {
      const SolverProblem problem = box_on_incline(slope, direction * kPi / 8.0, speed, mu, mu);
      const SolverAnswer answer = problem.solve(solver_with(20000));
      EXPECT_TRUE(answer.converged()) << direction;
      const Vector3 expected = (speed + acceleration * problem.time_step) * heading_of(direction);
      // relative to the speed: the whole contract of isotropy
      EXPECT_LE((answer.velocity(1) - expected).norm(), 1e-12 * expected.norm()) << direction << " at " << speed;
      EXPECT_LE(answer.turning(1).norm(), 1e-12);
    }
  }
}

TEST(SequentialFriction, StaticFrictionHoldsWhatDynamicFrictionWouldLetSlide) {
  const double mu_static = 0.6, mu_dynamic = 0.4;
  const math::SinCos below = math::sincos(math::atan(0.599));
  const SolverAnswer holds =
      box_on_incline(math::atan(0.599), 0.3, 0.0, mu_static, mu_dynamic).solve(solver_with(2000));
  EXPECT_TRUE(holds.converged());
  EXPECT_LE(holds.velocity(1).norm(), 1e-14);
  EXPECT_GT(below.sin, mu_dynamic * below.cos);

  // just too steep: it starts, and then with the dynamic coefficient
  const math::SinCos above = math::sincos(math::atan(0.601));
  const SolverProblem problem = box_on_incline(math::atan(0.601), 0.3, 0.0, mu_static, mu_dynamic);
  const SolverAnswer slides = problem.solve(solver_with(20000));
  EXPECT_TRUE(slides.converged());
  const double expected = kGravity * (above.sin - mu_dynamic * above.cos) * problem.time_step;
  EXPECT_NEAR(slides.velocity(1).norm(), expected, 1e-12);
}

TEST(SequentialFriction, ASlidingBlockStopsAndDoesNotReverse) {
  const double mu = 0.5;
  // what friction takes in a step is 0.049 m/s
  for (const double speed : {0.001, 0.02, 0.049}) {
    const SolverAnswer answer = box_on_incline(0.0, 1.1, speed, mu, mu).solve(solver_with(2000));
    EXPECT_LE(answer.velocity(1).norm(), 1e-14) << speed;
  }
  const SolverProblem problem = box_on_incline(0.0, 1.1, 0.06, mu, mu);
  const SolverAnswer answer = problem.solve(solver_with(20000));
  EXPECT_NEAR(answer.velocity(1).norm(), 0.06 - mu * kGravity * problem.time_step, 1e-13);
}

TEST(SequentialFriction, WithoutThetaFrictionLeavesThePoseAlone) {
  SolverProblem problem = box_on_incline(math::atan(0.5), 0.0, 0.0, 0.3, 0.3);
  problem.theta = 0.0;
  const SolverAnswer answer = problem.solve(solver_with(20000));
  EXPECT_EQ(answer.translation(1).x(), 0.0);
  problem.theta = 0.5;
  const SolverAnswer half = problem.solve(solver_with(20000));
  // theta h lambda/m
  const double change = half.velocity(1).x() - problem.trial_twist(1).linear.x();
  EXPECT_NEAR(half.translation(1).x(), 0.5 * problem.time_step * change, 1e-16);
}

TEST(SequentialFriction, AMirroredProblemHasTheMirroredAnswer) {
  // friction, an oblique load and a spin about the normal; mirror: x -> -x, so turns about y and z
  // change sign
  const auto made = [](double sign) {
    SolverProblem problem;
    const auto ground = problem.add_immovable();
    const auto box = problem.add_body({.mass = 2.0,
                                       .moments = {0.3, 0.4, 0.2},
                                       .pose = {{0, 0.2, 0}, Quaternion::Identity()},
                                       .linear = {sign * 1.0, -1.0, 0.4},
                                       .angular = {0.5, sign * 2.0, sign * 0.3}});
    problem.make_trial({0, -kGravity, 0});
    for (int corner = 0; corner < 4; ++corner)
      problem.add_contact({.body1 = ground,
                           .body2 = box,
                           .point = {sign * (corner % 2 == 0 ? 0.4 : -0.4), -0.005, corner < 2 ? 0.3 : -0.3},
                           .depth = 0.01,
                           .restitution = 0.3,
                           .static_friction = 0.4,
                           .dynamic_friction = 0.4});
    return problem;
  };
  const SolverAnswer right = made(1.0).solve(solver_with(100000));
  const SolverAnswer left = made(-1.0).solve(solver_with(100000));
  ASSERT_TRUE(right.converged());
  const Vector3 flip(-1, 1, 1);
  const Vector3 flip_turn(1, -1, -1);
  EXPECT_LE((left.velocity(1) - flip.cwiseProduct(right.velocity(1))).norm(), 1e-13);
  EXPECT_LE((left.turning(1) - flip_turn.cwiseProduct(right.turning(1))).norm(), 1e-13);
  for (std::size_t i = 0; i < 4; ++i) EXPECT_LE((left.impulse(i) - flip.cwiseProduct(right.impulse(i))).norm(), 1e-12);
}

// A ball on the ground: rolling friction mu_r, spinning friction mu_sp (both m).
SolverProblem ball_on_ground(const Vector3& linear, const Vector3& angular, double friction, double rolling,
                             double spinning) {
  SolverProblem problem;
  const double radius = 0.5;
  const auto ground = problem.add_immovable();
  const auto ball = problem.add_body({.mass = 2.0,
                                      .moments = Vector3::Constant(0.4 * 2.0 * radius * radius),
                                      .pose = {{0, radius, 0}, Quaternion::Identity()},
                                      .linear = linear,
                                      .angular = angular});
  problem.make_trial({0, -kGravity, 0});
  const Vector3 at = problem.trial_pose(ball).position;
  const double depth = radius - at.y();
  problem.add_contact({.body1 = ground,
                       .body2 = ball,
                       .point = {at.x(), -0.5 * depth, at.z()},
                       .depth = depth,
                       .static_friction = friction,
                       .dynamic_friction = friction,
                       .rolling = rolling,
                       .spinning = spinning});
  return problem;
}

TEST(SequentialFriction, SpinningFrictionSlowsAndStopsASpin) {
  const double mu = 0.02, inertia = 0.2, load = 2.0 * kGravity * 0.01;
  const SolverAnswer slows = ball_on_ground(Vector3::Zero(), {0, 5.0, 0}, 0.0, 0.0, mu).solve(solver_with(1000));
  EXPECT_NEAR(slows.turning(1).y(), 5.0 - mu * load / inertia, 1e-14);
  EXPECT_LE((slows.torque_impulse(0) - Vector3(0, -mu * load, 0)).norm(), 1e-14);
  const SolverAnswer stops = ball_on_ground(Vector3::Zero(), {0, 0.01, 0}, 0.0, 0.0, mu).solve(solver_with(1000));
  EXPECT_NEAR(stops.turning(1).y(), 0.0, 1e-16);
  EXPECT_EQ(stops.turning(1).x(), 0.0);
  EXPECT_LE((stops.torque_impulse(0) - Vector3(0, -0.01 * inertia, 0)).norm(), 1e-14);
}

TEST(SequentialFriction, RollingFrictionSlowsARollingBallInEveryDirection) {
  const double mu = 0.01, radius = 0.5, mass = 2.0, inertia = 0.2;
  for (int direction = 0; direction < 16; ++direction) {
    const Vector3 way = heading_of(direction);
    const double speed = 3.0;
    // rolling: v = w x (r n)
    const Vector3 spin = Vector3::UnitY().cross(way) * (speed / radius);
    const SolverProblem problem = ball_on_ground(speed * way, spin, 0.8, mu, 0.0);
    const SolverAnswer answer = problem.solve(solver_with(5000));
    EXPECT_TRUE(answer.converged());
    // the torque mu N about the contact slows I + m r^2
    const double load = mass * kGravity * problem.time_step;
    const double rate = speed / radius - mu * load / (inertia + mass * radius * radius);
    EXPECT_LE((answer.velocity(1) - rate * radius * way).norm(), 1e-12 * speed) << direction;
    EXPECT_LE((answer.turning(1) - rate * Vector3::UnitY().cross(way)).norm(), 1e-12 * rate);
    EXPECT_LE((answer.torque_impulse(0) + mu * load * Vector3::UnitY().cross(way)).norm(), 1e-12 * load);
  }
  // it stops in finite time and does not turn back
  const SolverAnswer stops = ball_on_ground({0.0005, 0, 0}, {0, 0, -0.001}, 0.8, mu, 0.0).solve(solver_with(5000));
  EXPECT_LE(stops.velocity(1).norm(), 1e-14);
  EXPECT_LE(stops.turning(1).norm(), 1e-14);
}

TEST(SequentialFriction, SlidingStartsToRollByTwoSeventhsAtRest) {
  // stick within one step: a ball that slides by less than friction can stop rolls at 5/7 of its
  // speed
  const SolverAnswer answer = ball_on_ground({0.1, 0, 0}, Vector3::Zero(), 10.0, 0.0, 0.0).solve(solver_with(1000));
  EXPECT_NEAR(answer.velocity(1).x(), 0.1 * 5.0 / 7.0, 1e-15);
  EXPECT_NEAR(answer.turning(1).z(), -0.1 * 5.0 / 7.0 / 0.5, 1e-15);
  EXPECT_EQ(answer.torque_impulse(0), Vector3::Zero());
}

}  // namespace
}  // namespace gravitas
