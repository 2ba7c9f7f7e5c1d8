// What the ways of relaxing are for (relaxation_order.h, shock_propagation.h): each beside the plain one, with the same
// answer in the end.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <numeric>
#include <vector>

#include "tests/workers/solver/solver_problem.h"
#include "workers/solver/sequential/sequential.h"

namespace gravitas {
namespace {

constexpr double kPull = 9.81;

enum class Numbered { kUpwards, kDownwards };

// Cubes of 1 m on each other and on the ground, at rest before the step; four contacts between any two.
struct Stack {
  SolverProblem problem;
  std::vector<std::uint32_t> cubes;  // from below
  std::vector<double> masses;

  Stack(const std::vector<double>& all, Numbered numbered, double friction = 0.5) : cubes(all.size()), masses(all) {
    const std::uint32_t ground = problem.add_immovable();
    std::vector<std::size_t> order(all.size());
    std::iota(order.begin(), order.end(), 0U);
    if (numbered == Numbered::kDownwards) std::reverse(order.begin(), order.end());
    for (const std::size_t i : order)
      cubes[i] = problem.add_body({.mass = all[i],
                                   .moments = Vector3::Constant(all[i] / 6.0),
                                   .pose = {{0, 0.5 + static_cast<double>(i), 0}, Quaternion::Identity()}});
    problem.make_trial({0, -kPull, 0});
    // pairs in order, as a collision plugin answers them
    std::vector<TestContact> contacts;
    for (std::size_t i = 0; i < all.size(); ++i) {
      const double fall = kPull * problem.time_step * problem.time_step;
      const std::uint32_t below = i == 0 ? ground : cubes[i - 1];
      for (int corner = 0; corner < 4; ++corner)
        contacts.push_back({.body1 = std::min(below, cubes[i]),
                            .body2 = std::max(below, cubes[i]),
                            .normal = below < cubes[i] ? Vector3::UnitY() : Vector3(-Vector3::UnitY()),
                            .point = {corner % 2 == 0 ? 0.5 : -0.5,
                                      static_cast<double>(i) - (i == 0 ? 0.5 : 1.0) * fall, corner < 2 ? 0.5 : -0.5},
                            .depth = i == 0 ? fall : 0.0,
                            .static_friction = friction,
                            .dynamic_friction = friction,
                            .key = 4 * i + static_cast<std::uint64_t>(corner)});
    }
    std::stable_sort(contacts.begin(), contacts.end(), [](const TestContact& a, const TestContact& b) {
      return std::pair(a.body1, a.body2) < std::pair(b.body1, b.body2);
    });
    for (const TestContact& contact : contacts) problem.add_contact(contact);
  }

  // Largest share by which the load on a cube's foot is off the weight above.
  double load_error(const SolverAnswer& answer) const {
    double largest = 0.0;
    double weight = 0.0;
    for (std::size_t i = cubes.size(); i-- > 0;) {
      weight += masses[i] * kPull * problem.time_step;
      double load = 0.0;
      for (std::size_t c = 0; c < problem.contact_key.size(); ++c)
        if (problem.contact_key[c] / 4 == i) load += std::fabs(answer.impulse(c).y());
      largest = std::max(largest, std::fabs(load / weight - 1.0));
    }
    return largest;
  }
  // Largest speed that is left, m/s.
  double speed(const SolverAnswer& answer) const {
    double largest = 0.0;
    for (const std::uint32_t cube : cubes) largest = std::max(largest, answer.velocity(cube).norm());
    return largest;
  }
};

SolverAnswer solve(const SolverProblem& problem, const SequentialSettings& settings) {
  return problem.solve(SequentialSolver(settings));
}

// v_{n+1} = v* + M^-1 J^T lambda: the sum of the impulses on the ground is what the bodies lost of their momentum.
void expect_momentum(const SolverProblem& problem, const SolverAnswer& answer) {
  Vector3 from_ground = Vector3::Zero();
  double size = 1e-300;
  for (std::size_t i = 0; i < problem.contact_key.size(); ++i) {
    if (problem.contact_body[2 * i] == 0) from_ground += answer.impulse(i);
    size += answer.impulse(i).norm();
  }
  const Vector3 gained = problem.momentum(answer.linear_velocity) - problem.momentum(problem.trial_linear_velocity);
  EXPECT_LE((gained - from_ground).norm(), 1e-13 * size);
}

// A ball in plates of rising depth. Whoever takes the shallow ones first pushes at all of them, though the deepest alone
// can stay closed; one sweep from the deepest on is the answer.
TEST(SequentialWays, TheDeepestFirstPushesOnceWhatOneContactHolds) {
  SolverProblem problem;
  for (int i = 0; i < 5; ++i) problem.add_immovable();
  const std::uint32_t ball = problem.add_body({.mass = 2.0});
  problem.make_trial({0, -kPull, 0});
  for (std::uint32_t i = 0; i < 5; ++i)
    problem.add_contact({.body1 = i, .body2 = ball, .point = {0, -0.5, 0}, .depth = 1e-3 * (i + 1), .key = i});
  const SolverAnswer given = solve(problem, {.iterations = 1});
  const SolverAnswer deepest = solve(problem, {.iterations = 1, .order = RelaxationOrder::kDeepestFirst});
  EXPECT_NEAR(given.contact_correction[0], 2.0 * 1e-3, 1e-15);
  for (std::size_t i = 0; i < 4; ++i) EXPECT_EQ(deepest.contact_correction[i], 0.0);
  EXPECT_NEAR(deepest.contact_correction[4], 2.0 * 5e-3, 1e-15);
  EXPECT_NEAR(deepest.translation(ball).y(), 5e-3, 1e-15);
}

// Bodies that nobody has sorted, thrown together, after two sweeps: numbered the other way round they move alike.
TEST(SequentialWays, TheDeepestFirstDoesNotMindHowBodiesAreNumbered) {
  constexpr std::uint32_t kBodies = 12;
  const auto thrown = [&](bool backwards) {
    SolverProblem problem;
    const auto place = [&](std::uint32_t i) { return backwards ? kBodies - 1 - i : i; };
    for (std::uint32_t k = 0; k < kBodies; ++k) {
      const double i = place(k);
      problem.add_body({.mass = 1.0 + 0.1 * i,
                        .pose = {{i, 0, 0}, Quaternion::Identity()},
                        .linear = {std::cos(3.0 * i), 0.1 * std::cos(i), 0}});
    }
    problem.make_trial(Vector3::Zero());
    std::vector<TestContact> contacts;
    for (std::uint32_t i = 0; i + 1 < kBodies; ++i) {
      const std::uint32_t a = place(i), b = place(i + 1);
      contacts.push_back({.body1 = std::min(a, b),
                          .body2 = std::max(a, b),
                          .normal = a < b ? Vector3::UnitX() : Vector3(-Vector3::UnitX()),
                          .point = {i + 0.5, 0, 0},
                          .depth = 1e-3 * (1.0 + std::cos(2.0 * i)),
                          .static_friction = 0.3,
                          .dynamic_friction = 0.3,
                          .key = i});
    }
    std::stable_sort(contacts.begin(), contacts.end(), [](const TestContact& a, const TestContact& b) {
      return std::pair(a.body1, a.body2) < std::pair(b.body1, b.body2);
    });
    for (const TestContact& contact : contacts) problem.add_contact(contact);
    return problem;
  };
  const auto difference = [&](RelaxationOrder order) {
    const SolverAnswer forwards = solve(thrown(false), {.iterations = 2, .order = order});
    const SolverAnswer backwards = solve(thrown(true), {.iterations = 2, .order = order});
    double largest = 0.0;
    for (std::uint32_t i = 0; i < kBodies; ++i)
      largest = std::max(largest, (forwards.velocity(i) - backwards.velocity(kBodies - 1 - i)).norm() +
                                      (forwards.translation(i) - backwards.translation(kBodies - 1 - i)).norm());
    return largest;
  };
  EXPECT_GT(difference(RelaxationOrder::kGiven), 1e-4);
  EXPECT_LE(difference(RelaxationOrder::kDeepestFirst), 1e-14);
  EXPECT_LE(difference(RelaxationOrder::kSimultaneous), 1e-14);
}

// A beam on two posts: whoever comes first carries more until the sweeps have converged, unless nobody comes first.
TEST(SequentialWays, SimultaneousSweepsKeepWhatIsSymmetric) {
  SolverProblem problem;
  const std::uint32_t ground = problem.add_immovable();
  const std::uint32_t left = problem.add_body({.pose = {{-2, 0.5, 0}, Quaternion::Identity()}});
  const std::uint32_t right = problem.add_body({.pose = {{2, 0.5, 0}, Quaternion::Identity()}});
  const std::uint32_t beam =
      problem.add_body({.mass = 10.0, .moments = {1.0, 30.0, 30.0}, .pose = {{0, 1.25, 0}, Quaternion::Identity()}});
  problem.make_trial({0, -kPull, 0});
  std::uint64_t key = 0;
  for (const std::uint32_t post : {left, right}) {
    const double x = post == left ? -2.0 : 2.0;
    for (const double z : {-0.4, 0.4})
      problem.add_contact({.body1 = ground, .body2 = post, .point = {x, 0.0, z}, .depth = 1e-3, .key = ++key});
  }
  for (const std::uint32_t post : {left, right}) {
    const double x = post == left ? -2.0 : 2.0;
    for (const double z : {-0.2, 0.2})
      problem.add_contact({.body1 = post, .body2 = beam, .point = {x, 1.0, z}, .key = ++key});
  }
  const auto tilt = [&](RelaxationOrder order, std::uint32_t sweeps) {
    const SolverAnswer answer = solve(problem, {.iterations = sweeps, .order = order});
    return std::max(answer.turning(beam).norm(), answer.rotation(beam).norm());
  };
  for (const std::uint32_t sweeps : {1U, 3U, 10U}) {
    EXPECT_GT(tilt(RelaxationOrder::kGiven, sweeps), 1e-9) << sweeps;
    EXPECT_LE(tilt(RelaxationOrder::kSimultaneous, sweeps), 1e-16) << sweeps;
  }
  const SolverAnswer end = solve(problem, {.iterations = 100000, .order = RelaxationOrder::kSimultaneous});
  EXPECT_TRUE(end.converged());
  for (const std::uint32_t body : {left, right, beam}) EXPECT_LE(end.velocity(body).norm(), 1e-13);
  for (std::size_t i = 4; i < 8; ++i) EXPECT_NEAR(end.impulse(i).y(), 0.25 * 10 * kPull * problem.time_step, 1e-12);
}

// And acceleration still less.
TEST(SequentialWays, OverRelaxationTakesAFractionOfTheSweeps) {
  const Stack stack(std::vector<double>(20, 1.0), Numbered::kUpwards, 0.0);
  const SolverAnswer plain =
      solve(stack.problem,
            {.iterations = 100000, .shock_propagation = ShockPropagation::kNever, .nesterov_acceleration = false});
  const SolverAnswer accelerated =
      solve(stack.problem, {.iterations = 100000, .shock_propagation = ShockPropagation::kNever});
  const SolverAnswer over = solve(
      stack.problem, {.iterations = 100000, .relaxation_factor = 1.8, .shock_propagation = ShockPropagation::kNever});
  const SolverAnswer under = solve(
      stack.problem, {.iterations = 100000, .relaxation_factor = 0.7, .shock_propagation = ShockPropagation::kNever});
  ASSERT_TRUE(plain.converged() && over.converged() && under.converged() && accelerated.converged());
  EXPECT_LT(5 * over.iterations[0], plain.iterations[0]);
  EXPECT_LT(accelerated.iterations[0], over.iterations[0]);
  EXPECT_GT(under.iterations[0], plain.iterations[0]);
  for (const SolverAnswer* answer : {&plain, &over, &under, &accelerated}) {
    EXPECT_LE(stack.load_error(*answer), 1e-9);
    EXPECT_LE(stack.speed(*answer), 1e-11);
    expect_momentum(stack.problem, *answer);
  }
}

// Ten under a thousand times their mass: thousands of plain sweeps, or the layers once.
TEST(SequentialWays, LayersCarryAnyRatioOfMassAtOnce) {
  for (const double top : {1.0, 1e3, 1e6}) {
    std::vector<double> masses(10, 1.0);
    masses.back() = top;
    for (const Numbered numbered : {Numbered::kUpwards, Numbered::kDownwards}) {
      const Stack stack(masses, numbered);
      const SolverAnswer answer = solve(stack.problem, {.iterations = 20});
      EXPECT_EQ(answer.bytes(),
                solve(stack.problem, {.iterations = 20, .shock_propagation = ShockPropagation::kAlways}).bytes());
      EXPECT_TRUE(answer.converged()) << top;
      EXPECT_LE(answer.iterations[0], 6U) << top;
      EXPECT_LE(stack.load_error(answer), 1e-12) << top;
      // the load's rounding moves what weighs 1 kg
      const double rounding = 4e-16 * (10.0 + top) * kPull * stack.problem.time_step;
      EXPECT_LE(stack.speed(answer), 10.0 * rounding) << top;
      for (std::size_t i = 0; i < masses.size(); ++i)
        EXPECT_NEAR(stack.problem.committed(answer, stack.cubes[i]).position.y(), 0.5 + static_cast<double>(i),
                    1e-14 + 10.0 * rounding * stack.problem.time_step);
      expect_momentum(stack.problem, answer);
      if (top > 1.0) {
        EXPECT_GT(
            stack.load_error(solve(stack.problem, {.iterations = 200, .shock_propagation = ShockPropagation::kNever})),
            0.1)
            << top;
      }
    }
  }
}

// What layers say is used only where it is closer: they do not know of a stack that is hit from above, and take hundreds
// of sweeps from there, where the answer is known already.
TEST(SequentialWays, LayersAreLeftWhereTheyDoNotHelp) {
  const Stack stack(std::vector<double>(5, 1.0), Numbered::kUpwards);
  SolverProblem hit = stack.problem;
  hit.set_trial_velocity(stack.cubes.back(), {0, -5, 0}, Vector3::Zero());
  hit.set_trial_velocity(stack.cubes[2], {0, 1, 0}, Vector3::Zero());
  const SolverAnswer slow = solve(hit, {.iterations = 100000});
  const SolverAnswer fast = solve(hit, {.iterations = 100000, .shock_propagation = ShockPropagation::kAlways});
  ASSERT_TRUE(slow.converged() && fast.converged());
  for (const std::uint32_t cube : stack.cubes) EXPECT_LE((slow.velocity(cube) - fast.velocity(cube)).norm(), 1e-10);

  hit.contact_warm_impulse = slow.contact_impulse;
  hit.contact_warm_correction = slow.contact_correction;
  const SolverAnswer known = solve(hit, {.iterations = 100000, .shock_propagation = ShockPropagation::kAlways});
  ASSERT_TRUE(known.converged());
  EXPECT_LE(4 * known.iterations[0], fast.iterations[0]);
}

TEST(SequentialWays, TheSameRequestGivesTheSameBytesWhateverWasAskedBefore) {
  const Stack a(std::vector<double>(6, 1.0), Numbered::kDownwards);
  const Stack b({1.0, 1.0, 50.0}, Numbered::kUpwards);
  for (const SequentialSettings& way :
       {SequentialSettings{.order = RelaxationOrder::kDeepestFirst},
        SequentialSettings{.order = RelaxationOrder::kSimultaneous}, SequentialSettings{.relaxation_factor = 1.7},
        SequentialSettings{.shock_propagation = ShockPropagation::kAlways}}) {
    SequentialSolver used(way);
    const std::string before = a.problem.solve(used).bytes();
    (void)b.problem.solve(used);
    EXPECT_EQ(a.problem.solve(used).bytes(), before);
    EXPECT_EQ(solve(a.problem, way).bytes(), before);
  }
}

// A chain of locks that hangs: joints are blocks like others.
TEST(SequentialWays, JointsEndAtTheSamePlace) {
  SolverProblem problem;
  std::uint32_t before = kNone;
  std::vector<std::uint32_t> links;
  for (int i = 0; i < 8; ++i) links.push_back(problem.add_body({.pose = {{0, -0.5 - i, 0}, Quaternion::Identity()}}));
  problem.make_trial({0, -kPull, 0});
  for (std::size_t i = 0; i < links.size(); ++i) {
    problem.add_discrepancy(before, links[i], problem.joint_at(before, links[i], {0, -static_cast<double>(i), 0}));
    before = links[i];
  }
  const SolverAnswer plain = solve(problem, {.iterations = 100000, .nesterov_acceleration = false});
  ASSERT_TRUE(plain.converged());
  for (const SequentialSettings& way :
       {SequentialSettings{.iterations = 100000},
        SequentialSettings{.iterations = 100000, .order = RelaxationOrder::kDeepestFirst},
        SequentialSettings{.iterations = 100000, .order = RelaxationOrder::kSimultaneous},
        SequentialSettings{.iterations = 100000, .relaxation_factor = 1.6}}) {
    const SolverAnswer answer = solve(problem, way);
    ASSERT_TRUE(answer.converged());
    for (std::size_t i = 0; i < links.size(); ++i) {
      const double tension = kPull * problem.time_step * static_cast<double>(links.size() - i);
      EXPECT_NEAR(answer.discrepancy_impulse[3 * i + 1], tension, 1e-10);
      EXPECT_NEAR(plain.discrepancy_impulse[3 * i + 1], tension, 1e-10);
    }
    if (way.relaxation_factor > 1.0) {
      EXPECT_LT(2 * answer.iterations[0], plain.iterations[0]);
    }
  }
}

// A stop that bore and is far now is let go of in whatever way: what is left of an impulse would count as closed.
TEST(SequentialWays, StopsThatGoBearNothing) {
  SolverProblem problem;
  const auto ground = problem.add_immovable();
  const auto body = problem.add_body({.linear = {1, 0, 0}});
  Discrepancy stop;
  stop.modes = pack_modes(AxisMode::kLimited, AxisMode::kFree, AxisMode::kFree, false);
  stop.point2 = {0.5, 0, 0};
  stop.lower.x() = 0.0, stop.upper.x() = kUnlimited;
  problem.add_discrepancy(kNone, body, stop);
  problem.discrepancy_warm_impulse = {1.0, 0, 0};
  problem.discrepancy_warm_correction = {0.01, 0, 0};
  // so that it is relaxed at all
  const auto other = problem.add_body({.pose = {{5, 1, 0}, Quaternion::Identity()}, .linear = {0, -1.0, 0}});
  problem.add_contact({.body1 = ground, .body2 = other, .point = {5, 0, 0}, .depth = 0.001, .key = 2});
  for (const SequentialSettings& way :
       {SequentialSettings{.order = RelaxationOrder::kSimultaneous}, SequentialSettings{.relaxation_factor = 0.5}}) {
    const SolverAnswer answer = solve(problem, way);
    EXPECT_EQ(answer.discrepancy_impulse[0], 0.0);
    EXPECT_EQ(answer.discrepancy_correction[0], 0.0);
    EXPECT_EQ(answer.velocity(body), Vector3(1, 0, 0));
  }
}

// An impulse that is let go of goes by a share in each sweep: it ends as none, and not as numbers whose squares are none.
TEST(SequentialWays, ImpulsesThatGoEndInTheirCones) {
  SolverProblem problem;
  const auto ground = problem.add_immovable();
  const auto ball = problem.add_body({.pose = {{0, 1, 0}, Quaternion::Identity()}, .linear = {0.3, 1.0, 0.2}});
  problem.add_contact(
      {.body1 = ground, .body2 = ball, .point = {0, 0, 0}, .static_friction = 0.5, .dynamic_friction = 0.5, .key = 1});
  problem.contact_warm_impulse = {0.2, 1.0, 0.3};
  // so that it is relaxed at all
  const auto other = problem.add_body({.pose = {{5, 1, 0}, Quaternion::Identity()}, .linear = {0, -1.0, 0}});
  problem.add_contact({.body1 = ground, .body2 = other, .point = {5, 0, 0}, .key = 2});
  for (const double share : {0.9999999, 0.99, 0.5})
    for (const std::uint32_t sweeps : {1U, 5U, 20U, 22U, 23U, 24U, 40U, 80U, 400U, 1100U}) {
      const SolverAnswer answer = solve(problem, {.iterations = sweeps, .relaxation_factor = share});
      const Vector3 impulse = answer.impulse(0);
      const double tangent = std::hypot(impulse.x(), impulse.z());
      EXPECT_LE(tangent, 0.5 * impulse.y() * (1.0 + 1e-12)) << share << ", " << sweeps << " sweeps";
      EXPECT_TRUE(impulse.isZero(0.0) || impulse.y() > 1e-150) << share << ", " << sweeps << " sweeps";
    }
}

}  // namespace
}  // namespace gravitas
