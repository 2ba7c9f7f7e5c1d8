// Impacts, rest and gaps of the Sequential solver against closed forms.
#include <gtest/gtest.h>

#include <cmath>
#include <random>

#include "tests/workers/solver/solver_problem.h"
#include "workers/solver/sequential/sequential.h"

namespace gravitas {
namespace {

constexpr double kG = 9.81;
const Vector3 kDownwards(0.0, -kG, 0.0);

SequentialSolver contact_solver_with(std::uint32_t iterations, double correction_factor = 1.0) {
  return SequentialSolver(SequentialSettings{iterations, correction_factor});
}

// Two spheres that touch at S_n, without forces: S* is one free step later.
struct Pair {
  SolverProblem problem;
  std::uint32_t a = 0, b = 0;
};

Pair touching_spheres(double mass_a, double mass_b, const Vector3& va, const Vector3& vb, const Vector3& normal,
                      double restitution, double friction) {
  const double radius = 0.5;
  Pair pair;
  pair.a = pair.problem.add_body(
      {.mass = mass_a, .moments = Vector3::Constant(0.4 * mass_a * radius * radius), .linear = va});
  pair.b = pair.problem.add_body({.mass = mass_b,
                                  .moments = Vector3::Constant(0.4 * mass_b * radius * radius),
                                  .pose = {2.0 * radius * normal, Quaternion::Identity()},
                                  .linear = vb});
  pair.problem.make_trial(Vector3::Zero());
  const Vector3 between = pair.problem.trial_pose(pair.b).position - pair.problem.trial_pose(pair.a).position;
  const Vector3 n = between.normalized();
  const Vector3 middle = 0.5 * (pair.problem.trial_pose(pair.b).position + pair.problem.trial_pose(pair.a).position);
  pair.problem.add_contact({.body1 = pair.a,
                            .body2 = pair.b,
                            .normal = n,
                            .point = middle,
                            .depth = 2.0 * radius - between.norm(),
                            .restitution = restitution,
                            .static_friction = friction,
                            .dynamic_friction = friction});
  return pair;
}

TEST(SequentialImpact, HeadOnSpheresFollowTheClosedForm) {
  for (const double e : {0.0, 0.3, 1.0}) {
    const double ma = 2.0, mb = 0.5, ua = 3.0, ub = -1.0;
    Pair pair = touching_spheres(ma, mb, {ua, 0, 0}, {ub, 0, 0}, Vector3::UnitX(), e, 0.0);
    const SolverAnswer answer = pair.problem.solve(contact_solver_with(100));
    const double centre = (ma * ua + mb * ub) / (ma + mb);
    const double va = centre - e * mb * (ua - ub) / (ma + mb);
    const double vb = centre + e * ma * (ua - ub) / (ma + mb);
    // a few roundings of speeds of order one
    EXPECT_NEAR(answer.velocity(pair.a).x(), va, 2e-15);
    EXPECT_NEAR(answer.velocity(pair.b).x(), vb, 2e-15);
    EXPECT_LE((pair.problem.momentum(answer.linear_velocity) - Vector3(ma * ua + mb * ub, 0, 0)).norm(), 2e-15);
    EXPECT_TRUE(answer.converged());
    // no overlap is left: the pose change closes the gap exactly
    const Vector3 gap =
        pair.problem.committed(answer, pair.b).position - pair.problem.committed(answer, pair.a).position;
    EXPECT_NEAR(gap.norm(), 1.0, 1e-15);
  }
}

// (2.64) along the normal, and sticking or sliding friction, whose impulses are known for spheres:
// with K_t = (7/2)(1/ma + 1/mb) independent of the direction and normal and tangent uncoupled.
TEST(SequentialImpact, ObliqueSpheresFollowTheClosedForm) {
  const double ma = 1.0, mb = 3.0, e = 0.6;
  const Vector3 va(2.0, 0.4, -0.3), vb(-1.0, -0.2, 0.5);
  for (const double mu : {0.0, 0.05, 5.0}) {
    Pair pair = touching_spheres(ma, mb, va, vb, Vector3::UnitX(), e, mu);
    const SolverAnswer answer = pair.problem.solve(contact_solver_with(200));
    const Vector3 n = vector_at(pair.problem.contact_normal, 0);
    const Vector3 relative = vb - va;
    const double normal = -(1.0 + e) * relative.dot(n) / (1.0 / ma + 1.0 / mb);
    const Vector3 slip = relative - relative.dot(n) * n;
    const double k = 3.5 * (1.0 / ma + 1.0 / mb);
    const double stop = slip.norm() / k;
    const Vector3 tangent = -std::min(stop, mu * normal) * slip.normalized();
    const Vector3 expected = normal * n + tangent;
    EXPECT_LE((answer.impulse(0) - expected).norm(), 1e-14) << mu;
    EXPECT_LE((answer.velocity(pair.b) - vb - expected / mb).norm(), 1e-14);
    EXPECT_NEAR((answer.velocity(pair.b) - answer.velocity(pair.a)).dot(n), -e * relative.dot(n), 1e-14);
    // angular momentum about the centre of a, the centre of b being at n once they no longer overlap
    const auto spin = [&](std::uint32_t body, double mass) {
      return Vector3(0.4 * mass * 0.25 * (answer.turning(body) - pair.problem.trial_twist(body).angular));
    };
    EXPECT_LE((spin(pair.a, ma) + spin(pair.b, mb) + n.cross(mb * (answer.velocity(pair.b) - vb))).norm(), 1e-14);
    EXPECT_LE((pair.problem.momentum(answer.linear_velocity) - ma * va - mb * vb).norm(), 1e-14);
  }
}

// A ball that falls on the ground: S_n above it, S* below it.
SolverProblem falling_ball(double height, double speed, double restitution, double time_step) {
  SolverProblem problem;
  problem.time_step = time_step;
  const auto ground = problem.add_immovable();
  const auto ball = problem.add_body(
      {.mass = 2.0, .pose = {{0.3, 0.5 + height, 0.0}, Quaternion::Identity()}, .linear = {0, speed, 0}});
  problem.make_trial(kDownwards);
  const double gap = problem.trial_pose(ball).position.y() - 0.5;
  problem.add_contact(
      {.body1 = ground, .body2 = ball, .point = {0.3, 0.5 * gap, 0.0}, .depth = -gap, .restitution = restitution});
  return problem;
}

TEST(SequentialImpact, AnElasticBallOnTheGroundKeepsItsSpeed) {
  SolverProblem problem = falling_ball(0.0, -3.0, 1.0, 0.01);
  const SolverAnswer answer = problem.solve(contact_solver_with(100));
  // gap 0 at S_n: s = |v_n|; one rounding of v* + lambda/m
  EXPECT_NEAR(answer.velocity(1).y(), 3.0, 5e-16);
  EXPECT_EQ(answer.velocity(1).x(), 0.0);
  EXPECT_EQ(problem.committed(answer, 1).position.y(), 0.5);
}

TEST(SequentialImpact, ABallThatArrivesWithinTheStepHasItsSpeedOfArrival) {
  const double height = 0.02, speed = -3.0;
  const SolverAnswer answer = falling_ball(height, speed, 0.5, 0.01).solve(contact_solver_with(100));
  // energy at the ground: v^2 + 2 g height
  EXPECT_NEAR(answer.velocity(1).y(), 0.5 * std::sqrt(speed * speed + 2.0 * kG * height), 1e-14);
}

TEST(SequentialImpact, BelowTheRestSpeedNothingBounces) {
  const SolverAnswer answer = falling_ball(0.0, -0.1, 1.0, 0.01).solve(contact_solver_with(100));
  EXPECT_NEAR(answer.velocity(1).y(), 0.0, 1e-16);
}

TEST(SequentialImpact, ABallThatLeavesIsLeftAlone) {
  SolverProblem problem = falling_ball(0.0, 2.0, 1.0, 0.01);
  const SolverAnswer answer = problem.solve(contact_solver_with(100));
  EXPECT_EQ(answer.linear_velocity, problem.trial_linear_velocity);
  EXPECT_EQ(answer.pose_change, std::vector<double>(12, 0.0));
}

TEST(SequentialImpact, AKinematicPaddleHitsAndKeepsItsOwnMotion) {
  SolverProblem problem;
  const auto paddle = problem.add_body({.linear = {0, 4.0, 0}, .angular = {0, 0, 0.3}, .kinematic = true});
  const auto ball = problem.add_body({.pose = {{0, 0.5, 0}, Quaternion::Identity()}});
  problem.make_trial(Vector3::Zero());
  problem.add_contact({.body1 = paddle, .body2 = ball, .point = {0, 0.02, 0}, .depth = 0.04, .restitution = 1.0});
  const SolverAnswer answer = problem.solve(contact_solver_with(100));
  // elastic against an infinite mass: leaves at twice its speed
  EXPECT_NEAR(answer.velocity(ball).y(), 8.0, 2e-15);
  EXPECT_EQ(answer.velocity(paddle), Vector3(0, 4.0, 0));
  EXPECT_EQ(answer.turning(paddle), Vector3(0, 0, 0.3));
  EXPECT_EQ(answer.translation(paddle), Vector3::Zero());
  EXPECT_EQ(answer.rotation(paddle), Vector3::Zero());
}

// A box on the ground with the contacts of its four lower corners.
SolverProblem box_on_ground(const Vector3& half, double mass, double overlap_at_start,
                            const TestContact& material = {}) {
  SolverProblem problem;
  const auto ground = problem.add_immovable();
  const Vector3 s = half.cwiseProduct(half);
  const Vector3 moments = mass / 3.0 * Vector3(s.y() + s.z(), s.x() + s.z(), s.x() + s.y());
  const auto box = problem.add_body(
      {.mass = mass, .moments = moments, .pose = {{0.0, half.y() - overlap_at_start, 0.0}, Quaternion::Identity()}});
  problem.make_trial(kDownwards);
  const double depth = half.y() - problem.trial_pose(box).position.y();
  for (int corner = 0; corner < 4; ++corner) {
    TestContact contact = material;
    contact.body1 = ground;
    contact.body2 = box;
    contact.depth = depth;
    contact.key = static_cast<std::uint64_t>(corner) + 1;
    contact.point = {corner % 2 == 0 ? half.x() : -half.x(), -0.5 * depth, corner < 2 ? half.z() : -half.z()};
    problem.add_contact(contact);
  }
  return problem;
}

TEST(SequentialRest, ABoxOnFourContactsRests) {
  for (const Vector3& half : {Vector3(0.5, 0.5, 0.5), Vector3(1.0, 0.05, 0.3), Vector3(0.1, 2.0, 0.1)}) {
    const double mass = 7.0;
    SolverProblem problem = box_on_ground(half, mass, 0.0, {.static_friction = 0.5, .dynamic_friction = 0.4});
    const SolverAnswer answer = problem.solve(contact_solver_with(200));
    EXPECT_TRUE(answer.converged());
    // speeds of order g h = 0.1
    EXPECT_LE(answer.velocity(1).norm(), 1e-15);
    EXPECT_LE(answer.turning(1).norm(), 2e-14);
    const Pose committed = problem.committed(answer, 1);
    EXPECT_NEAR(committed.position.y(), half.y(), 1e-16 * (1.0 + half.y()));
    EXPECT_LE(answer.rotation(1).norm(), 1e-15);
    Vector3 sum = Vector3::Zero();
    for (std::size_t i = 0; i < 4; ++i) {
      sum += answer.impulse(i);
      EXPECT_GE(answer.impulse(i).y(), 0.0);
    }
    EXPECT_LE((sum - Vector3(0, mass * kG * problem.time_step, 0)).norm(), 1e-14);
  }
}

// Corners that overlap by different amounts, as those of all that is not alone on the ground, are pushed at points which no motion
// of two rigid bodies moves alike: the whole of them was given up for that, and swept one by one (a pole on its foot: 190 sweeps).
TEST(SequentialRest, CornersOfDifferentDepthsComeToRestAsAWhole) {
  SolverProblem problem = box_on_ground({0.1, 1.0, 0.1}, 3.0, 0.0, {.static_friction = 0.8, .dynamic_friction = 0.8});
  for (std::size_t corner = 0; corner < 4; ++corner)
    problem.contact_depth[corner] += 1e-5 * static_cast<double>(corner);
  problem.set_trial_velocity(1, {0.002, -0.3, 0.003}, {0.004, 0.05, -0.006});
  const SolverAnswer answer = problem.solve(contact_solver_with(200));
  EXPECT_TRUE(answer.converged());
  EXPECT_LE(answer.velocity(1).norm(), 1e-14);
  EXPECT_LE(answer.turning(1).norm(), 1e-13);
  EXPECT_LE(answer.iterations[0], 10U);
}

TEST(SequentialRest, OldOverlapGoesByTheCorrectionFactorAndNewOverlapAtOnce) {
  const double overlap = 1e-3;
  for (const double factor : {1.0, 0.2, 0.0}) {
    SolverProblem problem = box_on_ground({0.5, 0.5, 0.5}, 1.0, overlap);
    const SolverAnswer answer = problem.solve(contact_solver_with(1000, factor));
    const double left = 0.5 - problem.committed(answer, 1).position.y();
    EXPECT_NEAR(left, (1.0 - factor) * overlap, 2e-16);
    EXPECT_NEAR(answer.velocity(1).y(), 0.0, 1e-15);
  }
}

TEST(SequentialRest, WarmStartedRestIsReachedInFewerSweepsWithTheSameAnswer) {
  SolverProblem problem = box_on_ground({0.5, 0.3, 0.2}, 3.0, 0.0, {.static_friction = 0.5, .dynamic_friction = 0.5});
  const SolverAnswer cold = problem.solve(contact_solver_with(200));
  problem.contact_warm_impulse = cold.contact_impulse;
  problem.contact_warm_correction = cold.contact_correction;
  const SolverAnswer warm = problem.solve(contact_solver_with(200));
  EXPECT_LT(warm.iterations[0], cold.iterations[0]);
  EXPECT_LE((warm.velocity(1) - cold.velocity(1)).norm(), 1e-15);
  EXPECT_LE((warm.translation(1) - cold.translation(1)).norm(), 1e-17);
}

TEST(SequentialRest, AStackOfFiveRests) {
  SolverProblem problem;
  std::uint32_t below = problem.add_immovable();
  std::vector<std::uint32_t> boxes;
  for (int i = 0; i < 5; ++i)
    boxes.push_back(problem.add_body(
        {.mass = 1.0, .moments = Vector3::Constant(1.0 / 6.0), .pose = {{0, 0.5 + i, 0}, Quaternion::Identity()}}));
  problem.make_trial(kDownwards);
  for (std::size_t i = 0; i < boxes.size(); ++i) {
    const double fall = kG * problem.time_step * problem.time_step;
    for (int corner = 0; corner < 4; ++corner)
      problem.add_contact({.body1 = below,
                           .body2 = boxes[i],
                           .point = {corner % 2 == 0 ? 0.5 : -0.5, static_cast<double>(i) - (i == 0 ? 0.5 : 1.0) * fall,
                                     corner < 2 ? 0.5 : -0.5},
                           .depth = i == 0 ? fall : 0.0,
                           .static_friction = 0.5,
                           .dynamic_friction = 0.5,
                           .key = 4 * i + static_cast<std::uint64_t>(corner)});
    below = boxes[i];
  }
  const SolverAnswer answer = problem.solve(contact_solver_with(5000));
  EXPECT_TRUE(answer.converged());
  for (const std::uint32_t box : boxes) {
    // the sweeps end at changes of 3e-15 m/s; the slowest mode of five boxes fades by some 0.9 a
    // sweep
    EXPECT_LE(answer.velocity(box).norm(), 1e-13);
    EXPECT_NEAR(problem.committed(answer, box).position.y(), problem.bodies[box].pose.position.y(), 1e-15);
  }
}

// A ball rolling on the flat at 5 m/s with restitution: the points that touch were r(1 - cos w h)
// apart a step ago, which is no way to fall.
TEST(SequentialRest, AFastRollingBallDoesNotBounce) {
  for (const double spin : {1.0, 10.0, 100.0, 1000.0}) {
    SolverProblem problem;
    problem.time_step = 1.0 / 60.0;
    const double radius = 0.5;
    const auto ground = problem.add_immovable();
    const auto ball = problem.add_body({.mass = 1.0,
                                        .moments = Vector3::Constant(0.1),
                                        .pose = {{0, radius, 0}, Quaternion::Identity()},
                                        .linear = {spin * radius, 0, 0},
                                        .angular = {0, 0, -spin}});
    problem.make_trial(kDownwards);
    const double depth = radius - problem.trial_pose(ball).position.y();
    problem.add_contact({.body1 = ground,
                         .body2 = ball,
                         .point = {problem.trial_pose(ball).position.x(), -0.5 * depth, 0},
                         .depth = depth,
                         .restitution = 0.8,
                         .static_friction = 0.5,
                         .dynamic_friction = 0.5});
    const SolverAnswer answer = problem.solve(contact_solver_with(200));
    EXPECT_NEAR(answer.velocity(ball).y(), 0.0, 1e-15 * spin);
  }
}

// ---- imperfect surfaces
// --------------------------------------------------------------------------

TEST(SequentialSurface, TheSameKeyDrawsTheSameTiltWithinItsCap) {
  const double epsilon = 0.1;
  std::vector<Vector3> drawn;
  for (std::uint64_t key = 1; key <= 200; ++key) {
    SolverProblem problem = falling_ball(0.0, -3.0, 0.5, 0.01);
    problem.contact_material[kSurfacePerturbation] = epsilon;
    problem.contact_key[0] = key;
    const SolverAnswer answer = problem.solve(contact_solver_with(100));
    const Vector3 n = answer.direction(0);
    EXPECT_NEAR(n.norm(), 1.0, 1e-15);
    // asin(sqrt(3) epsilon) is the widest tilt
    EXPECT_LE(n.cross(Vector3::UnitY()).norm(), std::sqrt(3.0) * epsilon);
    EXPECT_GT(n.y(), 0.98);
    EXPECT_NE(n, Vector3::UnitY());
    // the law holds along the direction used: s = |n_mu . v_n|, the gap being zero
    const Vector3 arm = vector_at(problem.contact_point, 0) - 0.5 * problem.contact_depth[0] * Vector3::UnitY() -
                        problem.trial_pose(1).position;
    const Vector3 leaving = answer.velocity(1) + answer.turning(1).cross(arm);
    EXPECT_NEAR(leaving.dot(n), 0.5 * n.y() * 3.0, 1e-14);
    EXPECT_EQ(answer.direction(0), problem.solve(contact_solver_with(100)).direction(0));
    drawn.push_back(n);
  }
  Vector3 mean = Vector3::Zero();
  for (const Vector3& n : drawn) mean += n / 200.0;
  // uniform of variance epsilon^2/3 over 200 draws: standard error 0.004
  EXPECT_LE(std::fabs(mean.x()), 0.015);
  EXPECT_LE(std::fabs(mean.z()), 0.015);
}

TEST(SequentialSurface, RestIsNotTilted) {
  SolverProblem problem = falling_ball(0.0, 0.0, 0.5, 0.01);
  problem.contact_material[kSurfacePerturbation] = 0.1;
  const SolverAnswer answer = problem.solve(contact_solver_with(100));
  EXPECT_EQ(answer.direction(0), Vector3::UnitY());
  EXPECT_EQ(answer.velocity(1).x(), 0.0);
  EXPECT_EQ(answer.velocity(1).z(), 0.0);
}

TEST(SequentialSurface, AGrazingImpactNeverBecomesALeaving) {
  for (std::uint64_t key = 1; key <= 100; ++key) {
    SolverProblem problem;
    const auto ground = problem.add_immovable();
    const auto ball = problem.add_body({.pose = {{0, 0.5, 0}, Quaternion::Identity()}, .linear = {10, -0.5, 0}});
    problem.make_trial(Vector3::Zero());
    problem.add_contact({.body1 = ground,
                         .body2 = ball,
                         .point = {0.1, -0.0025, 0},
                         .depth = 0.005,
                         .restitution = 0.5,
                         .perturbation = 0.2,
                         .key = key});
    const SolverAnswer answer = problem.solve(contact_solver_with(100));
    EXPECT_LT(Vector3(10, -0.5, 0).dot(answer.direction(0)), 0.0);
    EXPECT_GT(answer.impulse(0).y(), 0.0);
  }
}

}  // namespace
}  // namespace gravitas
