// Joints of the Sequential solver: points, hinges, drives, limits, springs.
#include <gtest/gtest.h>

#include <cmath>

#include "plugin_sdk/math/transcendental.h"
#include "plugin_sdk/solver/joint_laws.h"
#include "tests/workers/solver/solver_problem.h"
#include "workers/solver/sequential/sequential.h"

namespace gravitas {
namespace {

const Vector3 kDown(0.0, -9.81, 0.0);

SequentialSolver joint_solver_with(std::uint32_t iterations, double correction_factor = 1.0) {
  return SequentialSolver(SequentialSettings{iterations, correction_factor});
}

// Velocity of body2's point relative to body1's where a discrepancy holds both, at the end of the step: each its own, or of
// several the one midway.
Vector3 relative_velocity(const SolverProblem& problem, const SolverAnswer& answer, std::size_t row) {
  const bool has_own = problem.discrepancy_body.size() == 2;
  const auto end = [&](std::size_t side) {
    const std::uint32_t body = problem.discrepancy_body[2 * row + side];
    const Vector3 own = vector_at(side == 0 ? problem.point1 : problem.point2, row);
    return body == kNone ? own : carried(own, problem.trial_pose(body), problem.committed(answer, body));
  };
  const Vector3 middle = 0.5 * (end(0) + end(1));
  Vector3 sum = Vector3::Zero();
  for (std::size_t side = 0; side < 2; ++side) {
    const std::uint32_t body = problem.discrepancy_body[2 * row + side];
    if (body == kNone) continue;
    const Vector3 arm = (has_own ? end(side) : middle) - problem.committed(answer, body).position;
    const Vector3 v = answer.velocity(body) + answer.turning(body).cross(arm);
    sum += side == 0 ? Vector3(-v) : v;
  }
  return sum;
}

// Error of a discrepancy in the committed state: its points are carried along.
Vector3 committed_error(const SolverProblem& problem, const SolverAnswer& answer, std::size_t row) {
  const auto moved = [&](std::uint32_t body, const Vector3& point) {
    return body == kNone ? point : carried(point, problem.trial_pose(body), problem.committed(answer, body));
  };
  return moved(problem.discrepancy_body[2 * row + 1], vector_at(problem.point2, row)) -
         moved(problem.discrepancy_body[2 * row], vector_at(problem.point1, row));
}

SolverProblem pendulum(const Vector3& spin = {0.3, -0.2, 2.0}) {
  SolverProblem problem;
  const auto bob = problem.add_body({.mass = 2.0,
                                     .moments = {0.1, 0.2, 0.3},
                                     .pose = {{1.0, -0.5, 0.2}, exp_rotation({0.4, 0.1, -0.3})},
                                     .linear = {0.5, 1.0, -0.3},
                                     .angular = spin});
  problem.make_trial(kDown);
  problem.add_discrepancy(kNone, bob, problem.joint_at(kNone, bob, Vector3::Zero()));
  return problem;
}

TEST(SequentialJoint, APendulumsPointStandsStill) {
  const SolverProblem problem = pendulum();
  const SolverAnswer answer = problem.solve(joint_solver_with(100));
  EXPECT_TRUE(answer.converged());
  EXPECT_LE(relative_velocity(problem, answer, 0).norm(), 1e-14);
  // one sweep of each relaxation solves it, the second sees nothing left; the pose change is relaxed twice
  EXPECT_LE(answer.iterations[0], 6U);
}

TEST(SequentialJoint, TheErrorGoesByTheCorrection) {
  // at rest, off by a fixed error before and after: no turn, so the linearisation is exact
  for (const double factor : {1.0, 0.25}) {
    for (const double correction : {1.0, 0.5}) {
      SolverProblem problem;
      const auto bob = problem.add_body({.mass = 2.0, .pose = {{0, -1, 0}, Quaternion::Identity()}});
      Discrepancy d;
      d.point2 = {1e-3, -2e-3, 5e-4};
      d.correction = correction;
      problem.add_discrepancy(kNone, bob, d);
      const SolverAnswer answer = problem.solve(joint_solver_with(100, factor));
      const Vector3 left = committed_error(problem, answer, 0);
      const Vector3 expected = (1.0 - factor * correction) * d.point2;
      // second order in the correction's turn of 1e-3 rad
      EXPECT_LE((left - expected).norm(), 1e-6) << factor << " " << correction;
    }
  }
}

TEST(SequentialJoint, TheErrorOfAStepIsOfSecondOrder) {
  // what one step leaves falls with the square of the correction: (h^2)^2, and so by 16 per halving; what would be more than a
  // thousandth of the radius of gyration is closed
  double previous = 0.0;
  for (const double h : {0.08, 0.04, 0.02, 0.01, 0.005}) {
    SolverProblem problem;
    problem.time_step = h;
    const auto bob = problem.add_body({.mass = 1.0,
                                       .moments = {0.1, 0.2, 0.3},
                                       .pose = {{1, 0, 0}, Quaternion::Identity()},
                                       .linear = {0, 2.0, 0},
                                       .angular = {0, 0, 2.0}});
    problem.make_trial(kDown);
    problem.add_discrepancy(kNone, bob, problem.joint_at(kNone, bob, Vector3::Zero()));
    const SolverAnswer answer = problem.solve(joint_solver_with(100));
    const double left = committed_error(problem, answer, 0).norm();
    if (h > 0.06) {
      EXPECT_LE(left, 1e-6);
      continue;
    }
    if (previous > 0.0) {
      EXPECT_LE(left, previous / 12.0);
    }
    previous = left;
  }
  EXPECT_LE(previous, 1e-6);
}

// Angular momentum is that of where the points meet, up to what the step leaves them apart, and spins turn with their bodies.
TEST(SequentialJoint, TwoBodiesConserveMomentumWhateverTheirError) {
  for (const double gap : {0.0, 0.1}) {
    SolverProblem problem;
    const auto a = problem.add_body({.mass = 1.0,
                                     .moments = {0.1, 0.2, 0.3},
                                     .pose = {{0.2, 0.3, 0.1}, exp_rotation({0.2, 0.5, 0.1})},
                                     .linear = {1, 2, 3},
                                     .angular = {3, -1, 2}});
    const auto b = problem.add_body({.mass = 5.0,
                                     .moments = {1.1, 0.7, 0.9},
                                     .pose = {{1.2, -0.3, 0.6}, exp_rotation({-0.2, 0.3, 0.8})},
                                     .linear = {-1, 0.5, 0},
                                     .angular = {0.5, 1, -2}});
    Discrepancy d;
    d.point1 = {0.7, 0.1, 0.3};
    d.point2 = Vector3(0.7, 0.1, 0.3) + gap * Vector3(0.6, -0.8, 0.3);
    problem.add_discrepancy(a, b, d);
    const SolverAnswer answer = problem.solve(joint_solver_with(100));
    EXPECT_LE((problem.momentum(answer.linear_velocity) - problem.momentum(problem.trial_linear_velocity)).norm(),
              5e-15);
    std::vector<double> turned = problem.trial_angular_velocity;
    for (const auto body : {a, b})
      set_vector(turned, body, exp_rotation(answer.rotation(body)) * vector_at(turned, body));
    // pushes are where the step ends, with the inertia there
    const auto momentum = [&](const std::vector<double>& linear, const std::vector<double>& angular) {
      Vector3 sum = Vector3::Zero();
      for (const auto body : {a, b})
        sum += angular_momentum(problem.bodies[body].mass, problem.bodies[body].moments,
                                problem.committed(answer, body), {vector_at(linear, body), vector_at(angular, body)});
      return sum;
    };
    // along axes that have turned with body 1
    const Vector3 impulse = exp_rotation(answer.rotation(a)) * vector_at(answer.discrepancy_impulse, 0);
    EXPECT_LE((momentum(answer.linear_velocity, answer.angular_velocity) -
               momentum(problem.trial_linear_velocity, turned) - committed_error(problem, answer, 0).cross(impulse))
                  .norm(),
              1e-14);
    EXPECT_LE(relative_velocity(problem, answer, 0).norm(), 1e-14);
    // the mass centre stays where the free motion has it
    EXPECT_LE((1.0 * answer.translation(a) + 5.0 * answer.translation(b)).norm(), 1e-16);
    // no row drives: the energy falls
    EXPECT_LT(problem.energy(answer.linear_velocity, answer.angular_velocity),
              problem.energy(problem.trial_linear_velocity, problem.trial_angular_velocity));
  }
}

// A door on two points `apart` from each other: 6 rows of rank 5.
SolverProblem hinge(double apart, const Vector3& spin) {
  SolverProblem problem;
  const auto frame = problem.add_body({.mass = 4.0, .moments = {1.0, 0.8, 1.2}});
  const auto door = problem.add_body({.mass = 1.0,
                                      .moments = {0.2, 0.1, 0.3},
                                      .pose = {{1.0, 0.0, 0.0}, Quaternion::Identity()},
                                      .linear = {0.1, 0.4, -0.3},
                                      .angular = spin});
  problem.make_trial(kDown);
  for (const double side : {-0.5, 0.5}) {
    const Vector3 anchor(0.3, side * apart, 0.0);
    problem.add_discrepancy(frame, door, problem.joint_at(frame, door, anchor));
  }
  return problem;
}

TEST(SequentialJoint, AHingeWithSixRowsOfRankFiveConverges) {
  for (const double apart : {1.0, 0.1, 0.001}) {
    const SolverProblem problem = hinge(apart, {0.5, 3.0, -0.4});
    const SolverAnswer answer = problem.solve(joint_solver_with(100));
    EXPECT_TRUE(answer.converged()) << apart;
    EXPECT_LE(answer.iterations[0], 10U);
    // the rows of points that lie close differ by their distance: rounding grows by its inverse
    const double tolerance = 1e-14 + 1e-15 / apart;
    EXPECT_LE(relative_velocity(problem, answer, 0).norm(), tolerance);
    EXPECT_LE(relative_velocity(problem, answer, 1).norm(), tolerance);
    // about the hinge it turns on
    EXPECT_GT(std::fabs((answer.turning(1) - answer.turning(0)).y()), 1.0);
  }
}

TEST(SequentialJoint, ARigidJointOfThreePointsHoldsAllSixWays) {
  SolverProblem problem = hinge(0.5, {0.5, 3.0, -0.4});
  problem.add_discrepancy(0, 1, problem.joint_at(0, 1, {0.3, 0.0, 0.4}));
  const SolverAnswer answer = problem.solve(joint_solver_with(100));
  EXPECT_TRUE(answer.converged());
  EXPECT_LE((answer.turning(1) - answer.turning(0)).norm(), 1e-13);
  for (std::size_t row = 0; row < 3; ++row) EXPECT_LE(relative_velocity(problem, answer, row).norm(), 1e-14);
}

// ---- drives
// --------------------------------------------------------------------------------------

Discrepancy turning_drive(const Vector3& axis, double speed, double torque) {
  Discrepancy d;
  d.axes = axes_along(axis);
  d.modes = pack_modes(AxisMode::kDriven, AxisMode::kFree, AxisMode::kFree, true);
  d.velocity = speed * axis;
  d.maximum_force = Vector3::Constant(torque);
  return d;
}

TEST(SequentialJoint, AMotorReachesItsSpeed) {
  SolverProblem problem = hinge(0.2, {0, 0, 0});
  problem.add_discrepancy(0, 1, turning_drive(Vector3::UnitY(), 7.0, kUnlimited));
  const SolverAnswer answer = problem.solve(joint_solver_with(100));
  EXPECT_TRUE(answer.converged());
  EXPECT_LE(answer.iterations[0], 16U);
  EXPECT_NEAR((answer.turning(1) - answer.turning(0)).y(), 7.0, 1e-13);
  // theta = 1: the pose has turned with it, although the joint's own rows were right before
  EXPECT_NEAR((answer.rotation(1) - answer.rotation(0)).y(), 7.0 * problem.time_step, 1e-3);
  // rows are where bodies are before the drive moves them
  problem.theta = 0.0;
  EXPECT_LE(relative_velocity(problem, problem.solve(joint_solver_with(100)), 0).norm(), 1e-13);
}

TEST(SequentialJoint, AMotorOfRedundantPointsReachesItsSpeed) {
  // the seed's motor: points round the axis driven along the tangent, redundant with each other
  SolverProblem problem = hinge(0.5, {0, 0, 0});
  const double speed = 3.0;
  for (int i = 0; i < 4; ++i) {
    const math::SinCos at = math::sincos(i * 1.57079632679489662);
    const Vector3 offset(at.cos, 0.0, at.sin);
    const Vector3 tangent = Vector3::UnitY().cross(offset);
    Discrepancy d;
    d.point1 = d.point2 = Vector3(0.3, 0, 0) + offset;
    d.axes = axes_along(tangent);
    d.modes = pack_modes(AxisMode::kDriven, AxisMode::kFree, AxisMode::kFree);
    d.velocity = speed * tangent;
    problem.add_discrepancy(0, 1, d);
  }
  SolverAnswer answer = problem.solve(joint_solver_with(100));
  EXPECT_TRUE(answer.converged());
  EXPECT_NEAR((answer.turning(1) - answer.turning(0)).y(), speed, 1e-2);
  problem.theta = 0.0;
  answer = problem.solve(joint_solver_with(100));
  for (std::size_t row = 0; row < 2; ++row) EXPECT_LE(relative_velocity(problem, answer, row).norm(), 1e-13);
}

TEST(SequentialJoint, AMotorPushesNoHarderThanItMay) {
  SolverProblem problem;
  const auto wheel = problem.add_body({.mass = 1.0, .moments = {0.2, 0.5, 0.2}});
  const double torque = 4.0;
  problem.add_discrepancy(kNone, wheel, turning_drive(Vector3::UnitY(), 100.0, torque));
  const SolverAnswer answer = problem.solve(joint_solver_with(100));
  EXPECT_NEAR(answer.turning(wheel).y(), torque * problem.time_step / 0.5, 1e-16);
  EXPECT_NEAR(answer.discrepancy_impulse[0], torque * problem.time_step, 1e-17);
}

TEST(SequentialJoint, AWeakLockSlips) {
  SolverProblem problem;
  const auto body = problem.add_body({.mass = 2.0, .linear = {1, 0, 0}});
  problem.make_trial(Vector3::Zero());
  Discrepancy d = problem.joint_at(kNone, body, Vector3::Zero());
  d.maximum_force = Vector3::Constant(10.0);
  problem.add_discrepancy(kNone, body, d);
  const SolverAnswer answer = problem.solve(joint_solver_with(100));
  EXPECT_NEAR(answer.velocity(body).x(), 1.0 - 10.0 * problem.time_step / 2.0, 1e-15);
  // F h^2/m of way
  EXPECT_NEAR(answer.translation(body).x(), -10.0 * 1e-4 / 2.0, 1e-17);
}

TEST(SequentialJoint, ADampedDriveIsALinearDamper) {
  SolverProblem problem;
  const auto body = problem.add_body({.mass = 2.0, .linear = {3, 0, 0}});
  Discrepancy d;
  d.modes = pack_modes(AxisMode::kDriven, AxisMode::kFree, AxisMode::kFree);
  d.damping = {50.0, 0, 0};
  problem.add_discrepancy(kNone, body, d);
  const SolverAnswer answer = problem.solve(joint_solver_with(100));
  // implicit: v = v* / (1 + h d/m)
  EXPECT_NEAR(answer.velocity(body).x(), 3.0 / (1.0 + 0.01 * 50.0 / 2.0), 1e-15);
}

// ---- limits
// --------------------------------------------------------------------------------------

TEST(SequentialJoint, ALimitStopsAndNeverPulls) {
  Discrepancy d;
  d.modes = pack_modes(AxisMode::kLimited, AxisMode::kFree, AxisMode::kFree);
  d.lower = {-0.1, 0, 0};
  d.upper = {0.2, 0, 0};
  const auto solved = [&](double x, double v) {
    SolverProblem problem;
    const auto body = problem.add_body({.pose = {{x, 0, 0}, Quaternion::Identity()}, .linear = {v, 0, 0}});
    problem.make_trial(Vector3::Zero());
    Discrepancy at = d;
    at.point2 = problem.trial_pose(body).position;
    problem.add_discrepancy(kNone, body, at);
    const SolverAnswer answer = problem.solve(joint_solver_with(100));
    return std::pair(problem.committed(answer, body).position.x(), answer.velocity(body).x());
  };
  // within: untouched, bit for bit
  EXPECT_EQ(solved(0.05, 1.0), std::pair(0.05 + 0.01 * 1.0, 1.0));
  // into the upper and the lower limit: stands there
  EXPECT_NEAR(solved(0.199, 1.0).first, 0.2, 1e-16);
  EXPECT_NEAR(solved(0.199, 1.0).second, 0.0, 1e-16);
  EXPECT_NEAR(solved(-0.099, -1.0).first, -0.1, 1e-16);
  EXPECT_NEAR(solved(-0.099, -1.0).second, 0.0, 1e-16);
  // away from a limit: not held
  EXPECT_EQ(solved(0.2, -1.0).second, -1.0);
  EXPECT_EQ(solved(-0.1, 1.0).second, 1.0);
}

TEST(SequentialJoint, AUnilateralRowNeverPulls) {
  const auto solved = [](double v) {
    SolverProblem problem;
    const auto body = problem.add_body({.linear = {0, v, 0}});
    problem.make_trial(Vector3::Zero());
    Discrepancy d = problem.joint_at(kNone, body, Vector3::Zero());
    d.axes = axes_along(Vector3::UnitY());
    d.modes = pack_modes(AxisMode::kUnilateral, AxisMode::kFree, AxisMode::kFree);
    problem.add_discrepancy(kNone, body, d);
    return problem.solve(joint_solver_with(100));
  };
  EXPECT_EQ(solved(2.0).velocity(0).y(), 2.0);
  EXPECT_EQ(solved(2.0).discrepancy_impulse[0], 0.0);
  EXPECT_NEAR(solved(-2.0).velocity(0).y(), 0.0, 1e-15);
  EXPECT_GT(solved(-2.0).discrepancy_impulse[0], 0.0);
  EXPECT_GT(solved(-2.0).discrepancy_correction[0], 0.0);
}

TEST(SequentialJoint, ARodKeepsItsLengthAndARopeGoesSlack) {
  const auto solved = [](double lower, double speed) {
    SolverProblem problem;
    const auto bob = problem.add_body({.pose = {{0, -1, 0}, Quaternion::Identity()}, .linear = {0.0, speed, 0}});
    problem.make_trial(Vector3::Zero());
    Discrepancy d = problem.joint_at(kNone, bob, {0, -1, 0});
    d.point1.setZero();
    d.axes = axes_along(-Vector3::UnitY());
    d.modes = pack_modes(AxisMode::kLimited, AxisMode::kFree, AxisMode::kFree);
    d.lower = {lower, 0, 0};
    d.upper = {1.0, 0, 0};
    problem.add_discrepancy(kNone, bob, d);
    const SolverAnswer answer = problem.solve(joint_solver_with(100));
    return std::pair(problem.committed(answer, bob).position.y(), answer.velocity(bob).y());
  };
  // a rod holds both ways
  EXPECT_NEAR(solved(1.0, 3.0).first, -1.0, 3e-16);
  EXPECT_NEAR(solved(1.0, 3.0).second, 0.0, 1e-15);
  EXPECT_NEAR(solved(1.0, -3.0).second, 0.0, 1e-15);
  // a rope only against stretching
  EXPECT_EQ(solved(0.0, 3.0).second, 3.0);
  EXPECT_NEAR(solved(0.0, -3.0).first, -1.0, 3e-16);
}

// ---- springs
// -------------------------------------------------------------------------------------

TEST(SequentialJoint, ACompliantRowIsTheImplicitSpring) {
  for (const double stiffness : {1e2, 1e6, 1e12}) {
    for (const double damping : {0.0, 3.0}) {
      SolverProblem problem;
      const double mass = 2.0, h = problem.time_step, x = 0.1, v = 0.7;
      const auto body =
          problem.add_body({.mass = mass, .pose = {{x, 0, 0}, Quaternion::Identity()}, .linear = {v, 0, 0}});
      problem.make_trial(Vector3::Zero());
      Discrepancy d;
      d.point2 = problem.trial_pose(body).position;
      d.modes = pack_modes(AxisMode::kLocked, AxisMode::kFree, AxisMode::kFree);
      d.compliance = {1.0 / stiffness, 0, 0};
      d.damping = {damping, 0, 0};
      problem.add_discrepancy(kNone, body, d);
      const SolverAnswer answer = problem.solve(joint_solver_with(100));
      // m (v' - v) = -h (k (x + h v') + c v')
      const double expected = (v - h * stiffness * x / mass) / (1.0 + (h * damping + h * h * stiffness) / mass);
      EXPECT_NEAR(answer.velocity(body).x(), expected, 1e-13 * (1.0 + std::fabs(expected)))
          << stiffness << " " << damping;
      // theta = 1: x' = x + h v'
      EXPECT_NEAR(problem.committed(answer, body).position.x(), x + h * expected, 1e-14);
    }
  }
}

TEST(SequentialJoint, ASoftLimitPushesOnlyOutsideIt) {
  const auto pushed = [](double x) {
    SolverProblem problem;
    const auto body = problem.add_body({.pose = {{x, 0, 0}, Quaternion::Identity()}});
    Discrepancy d;
    d.point2 = {x, 0, 0};
    d.modes = pack_modes(AxisMode::kLimited, AxisMode::kFree, AxisMode::kFree);
    d.lower = {-1.0, 0, 0};
    d.upper = {1.0, 0, 0};
    d.compliance = {1e-3, 0, 0};
    problem.add_discrepancy(kNone, body, d);
    return problem.solve(joint_solver_with(100)).velocity(body).x();
  };
  EXPECT_EQ(pushed(0.5), 0.0);
  // k e h/(m + k h^2)
  const double expected = 1e3 * 0.1 * 0.01 / (1.0 + 1e3 * 1e-4);
  EXPECT_NEAR(pushed(1.1), -expected, 1e-15);
  EXPECT_NEAR(pushed(-1.1), expected, 1e-15);
}

TEST(SequentialJoint, AChainHangsAtItsTension) {
  SolverProblem problem;
  const int links = 6;
  for (int i = 0; i < links; ++i)
    problem.add_body({.mass = 1.0, .moments = {0.1, 0.01, 0.1}, .pose = {{0, -0.5 - i, 0}, Quaternion::Identity()}});
  problem.make_trial(kDown);
  for (std::uint32_t i = 0; i < links; ++i) {
    const std::uint32_t above = i == 0 ? kNone : i - 1;
    problem.add_discrepancy(above, i, problem.joint_at(above, i, {0, -1.0 * i, 0}));
  }
  const SolverAnswer answer = problem.solve(joint_solver_with(20000));
  EXPECT_TRUE(answer.converged());
  for (std::uint32_t i = 0; i < links; ++i) {
    EXPECT_LE(answer.velocity(i).norm(), 1e-12);
    EXPECT_NEAR(answer.discrepancy_impulse[3 * i + 1], (links - i) * 9.81 * problem.time_step, 1e-11);
    EXPECT_LE((problem.committed(answer, i).position - problem.bodies[i].pose.position).norm(), 1e-13);
  }
}

}  // namespace
}  // namespace gravitas
