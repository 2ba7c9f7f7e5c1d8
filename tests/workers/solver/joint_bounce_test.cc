// Stops that give back a share of the speed at which they are met, in every solver.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <limits>
#include <string>
#include <vector>

#include "plugin_sdk/conformance/draw.h"
#include "plugin_sdk/joint_rows.h"
#include "plugin_sdk/math/rotation.h"
#include "plugin_sdk/plugin.h"
#include "tests/sanitized.h"
#include "tests/workers/solver/end_of_step_problem.h"
#include "tests/workers/solver/solver_problem.h"
#include "workers/solver/sequential/sequential.h"

namespace gravitas {
namespace {

using conformance::Draw;

constexpr double kBounceRounding = 1e-14;

struct BouncingSolver {
  const char* name;
  std::function<SolverAnswer(const SolverProblem&)> solve;
};

SolverAnswer solve_sequential(const SolverProblem& problem, std::uint32_t iterations = 1000) {
  SequentialSettings settings;
  settings.iterations = iterations;
  SequentialSolver solver(settings);
  return problem.solve(solver);
}

const BouncingSolver kBouncingSolvers[] = {
    {"Sequential", [](const SolverProblem& problem) { return solve_sequential(problem); }},
    {"Newton", [](const SolverProblem& problem) { return problem.solve(newton()); }},
    {"Direct", [](const SolverProblem& problem) { return problem.solve(direct()); }}};

class JointBounce : public ::testing::TestWithParam<BouncingSolver> {
 protected:
  static SolverAnswer solve(const SolverProblem& problem) { return GetParam().solve(problem); }
};

INSTANTIATE_TEST_SUITE_P(Each, JointBounce, ::testing::ValuesIn(kBouncingSolvers),
                         [](const auto& which) { return std::string(which.param.name); });

// x of body 2's centre against that of body 1, or of the world, within limits.
Discrepancy stop(const SolverProblem& problem, std::uint32_t body1, std::uint32_t body2, double lower, double upper,
                 double restitution) {
  // where body 2 is, so that nothing turns
  const Vector3 to = problem.trial_pose(body2).position;
  const Vector3 from(body1 == kNone ? 0.0 : problem.trial_pose(body1).position.x(), to.y(), to.z());
  Discrepancy d = row_along(Vector3::UnitX(), from, to, AxisMode::kLimited);
  d.axes = Quaternion::Identity();
  d.lower.x() = lower, d.upper.x() = upper;
  d.restitution = restitution;
  return d;
}

SolverProblem against_world(double speed, double restitution) {
  SolverProblem problem;
  problem.add_body({.mass = 2.0, .pose = {{0.3, 0, 0}, Quaternion::Identity()}, .linear = {speed, 0.1, 0.2}});
  problem.make_trial(Vector3::Zero());
  problem.add_discrepancy(kNone, 0, stop(problem, kNone, 0, 0.3 - 0.004, 0.3 + 0.004, restitution));
  return problem;
}

TEST_P(JointBounce, LeavesAtItsShareOfTheSpeed) {
  for (const double speed : {1.0, -1.0, 3.7, -0.5}) {
    for (const double e : {0.0, 0.1, 0.5, 1.0}) {
      const SolverAnswer answer = solve(against_world(speed, e));
      EXPECT_TRUE(answer.converged());
      EXPECT_NEAR(answer.velocity(0).x(), -e * speed, kBounceRounding * std::fabs(speed)) << speed << ' ' << e;
      EXPECT_EQ(answer.velocity(0).y(), 0.1);
      EXPECT_EQ(answer.velocity(0).z(), 0.2);
      const double end = 0.3 + 0.01 * speed + answer.translation(0).x();
      EXPECT_NEAR(end, 0.3 + std::copysign(0.004, speed), 1e-15) << speed << ' ' << e;
    }
  }
}

// The speed is that of the impact, not that after the fall of the whole step: s^2 = u^2 + 2 g way.
TEST_P(JointBounce, IsOfTheImpactWithinTheStep) {
  constexpr double kSpeed = 1.0, kFall = 10.0, kGap = 0.004, kE = 0.8;
  SolverProblem problem;
  problem.add_body({.mass = 2.0, .linear = {-kSpeed, 0, 0}});
  problem.make_trial({-kFall, 0, 0});
  problem.add_discrepancy(kNone, 0, stop(problem, kNone, 0, -kGap, kUnlimited, kE));
  EXPECT_NEAR(solve(problem).velocity(0).x(), kE * std::sqrt(kSpeed * kSpeed + 2.0 * kFall * kGap), 1e-14);
}

// Slower than what two steps of its load make of nothing.
TEST_P(JointBounce, RestsBelowTheRestSpeed) {
  for (const double speed : {0.0, 0.05, 0.19}) {
    SolverProblem problem;
    problem.add_body({.mass = 2.0, .linear = {-speed, 0, 0}});
    problem.make_trial({-10.0, 0, 0});
    problem.add_discrepancy(kNone, 0, stop(problem, kNone, 0, 0.0, kUnlimited, 0.8));
    EXPECT_NEAR(solve(problem).velocity(0).x(), 0.0, 1e-15) << speed;
  }
}

TEST_P(JointBounce, BetweenTwoBodiesKeepsMomentum) {
  for (const double e : {0.0, 0.4, 1.0}) {
    SolverProblem problem;
    problem.add_body({.mass = 0.5, .linear = {2.0, 0, 0}});
    problem.add_body({.mass = 3.0, .pose = {{1, 0, 0}, Quaternion::Identity()}, .linear = {-1.0, 0, 0}});
    problem.make_trial(Vector3::Zero());
    problem.add_discrepancy(0, 1, stop(problem, 0, 1, 0.99, 1.5, e));
    const SolverAnswer answer = solve(problem);
    EXPECT_NEAR(answer.velocity(1).x() - answer.velocity(0).x(), e * 3.0, 1e-14) << e;
    EXPECT_NEAR(0.5 * answer.velocity(0).x() + 3.0 * answer.velocity(1).x(), -2.0, 1e-14) << e;
  }
}

// What moves by itself is met at the relative speed.
TEST_P(JointBounce, AgainstAMovingPartnerIsRelative) {
  for (const double partner : {-2.0, 0.0, 0.5}) {
    SolverProblem problem;
    problem.add_body({.mass = 1.0, .linear = {partner, 0, 0}, .kinematic = true});
    problem.add_body({.mass = 3.0, .pose = {{1, 0, 0}, Quaternion::Identity()}, .linear = {1.0, 0, 0}});
    problem.make_trial(Vector3::Zero());
    problem.add_discrepancy(0, 1, stop(problem, 0, 1, 0.5, 1.001, 0.6));
    EXPECT_NEAR(solve(problem).velocity(1).x(), partner - 0.6 * (1.0 - partner), 1e-14) << partner;
  }
}

// A rope that comes taut turns the speed along it round and leaves that across.
TEST_P(JointBounce, OfARopeIsAlongIt) {
  for (const double e : {0.0, 0.3, 1.0}) {
    SolverProblem problem;
    problem.time_step = 1e-4;
    problem.add_body({.mass = 2.0, .pose = {{1, 0, 0}, Quaternion::Identity()}, .linear = {2.0, 0.7, -0.4}});
    problem.make_trial(Vector3::Zero());
    Discrepancy rope = row_along((problem.trial_pose(0).position).normalized(), Vector3::Zero(),
                                 problem.trial_pose(0).position, AxisMode::kLimited);
    rope.modes |= kRadialDiscrepancy;
    rope.upper.x() = 1.0001;
    rope.restitution = e;
    problem.add_discrepancy(kNone, 0, rope);
    const SolverAnswer answer = solve(problem);
    // the rope turns by 1e-4 of the speed across in the step
    EXPECT_NEAR(answer.velocity(0).x(), -e * 2.0, 4e-4) << e;
    EXPECT_NEAR(answer.velocity(0).y(), 0.7, 4e-4) << e;
    EXPECT_NEAR(answer.velocity(0).z(), -0.4, 4e-4) << e;
    const Vector3 end = problem.committed(answer, 0).position, along = end.normalized();
    EXPECT_NEAR(end.norm(), 1.0001, 1e-12);
    // nothing acts across it, and along it the law holds as the free flight meets the end
    const Vector3 across = answer.velocity(0) - along.dot(answer.velocity(0)) * along;
    EXPECT_NEAR((across - (Vector3(2.0, 0.7, -0.4) - along.dot(Vector3(2.0, 0.7, -0.4)) * along)).norm(), 0.0, 1e-12);
  }
}

// A taut rope that swings fast, and what is spun against its stop, press and do not arrive: their axes turn in the step, with
// what the free flight goes outwards by.
TEST_P(JointBounce, IsNoneOfWhatPressesWhileItTurns) {
  for (const double speed : {1.0, 10.0, 40.0}) {
    SolverProblem problem;
    problem.add_body({.mass = 2.0, .pose = {{1, 0, 0}, Quaternion::Identity()}, .linear = {0, speed, 0}});
    problem.make_trial(Vector3::Zero());
    Discrepancy rope = row_along(problem.trial_pose(0).position.normalized(), Vector3::Zero(),
                                 problem.trial_pose(0).position, AxisMode::kLimited);
    rope.modes |= kRadialDiscrepancy;
    rope.upper.x() = 1.0;
    for (const double e : {0.0, 1.0}) {
      SolverProblem with = problem;
      rope.restitution = e;
      with.add_discrepancy(kNone, 0, rope);
      const SolverAnswer answer = solve(with);
      EXPECT_NEAR(with.committed(answer, 0).position.normalized().dot(answer.velocity(0)), 0.0, 1e-12 * speed) << e;
    }
  }
  // a bead at the end of an arm that spins
  for (const double spin : {1.0, 10.0, 30.0}) {
    SolverProblem problem;
    problem.add_body({.mass = 1.0, .angular = {0, 0, spin}, .kinematic = true});
    problem.add_body(
        {.mass = 2.0, .pose = {{1, 0, 0}, Quaternion::Identity()}, .linear = {0, spin, 0}, .angular = {0, 0, spin}});
    problem.make_trial(Vector3::Zero());
    const Pose arm = problem.trial_pose(0);
    problem.add_discrepancy(0, 1, held_point(arm, problem.trial_pose(1).position, {false, true, true}));
    Discrepancy limit =
        row_along(arm.orientation * Vector3::UnitX(), arm.position, problem.trial_pose(1).position, AxisMode::kLimited);
    limit.upper.x() = 1.0, limit.restitution = 1.0;
    problem.add_discrepancy(0, 1, limit);
    const SolverAnswer answer = solve(problem);
    const Vector3 outward = problem.committed(answer, 1).position.normalized();
    EXPECT_NEAR(outward.dot(answer.velocity(1)), 0.0, 1e-9 * spin) << spin;
  }
}

// What bore in the step before is not arrived at, on the side that bore.
TEST_P(JointBounce, IsNoneOfTheSideThatBore) {
  SolverProblem problem = against_world(1.0, 0.5);
  problem.discrepancy_warm_impulse[0] = -0.01;
  EXPECT_NEAR(solve(problem).velocity(0).x(), 0.0, kBounceRounding);
  problem.discrepancy_warm_impulse[0] = 0.01;
  EXPECT_NEAR(solve(problem).velocity(0).x(), -0.5, kBounceRounding);
}

// Between stops that leave no room, and where the stop is a lock or gives way, there is none.
TEST_P(JointBounce, IsNoneWithoutRoomOrOfWhatGivesWay) {
  SolverProblem problem = against_world(1.0, 0.0);
  problem.lower[0] = problem.upper[0] = 0.3;
  const std::string locked = solve(problem).bytes();
  problem.restitution[0] = 1.0;
  EXPECT_EQ(solve(problem).bytes(), locked);
  problem.upper[0] = 0.3 + 1e-13;
  EXPECT_NEAR(solve(problem).velocity(0).x(), 0.0, 1e-12);

  problem = against_world(1.0, 0.0);
  problem.compliance[0] = 1e-3, problem.damping[0] = 5.0;
  const std::string soft = solve(problem).bytes();
  problem.restitution[0] = 1.0;
  EXPECT_EQ(solve(problem).bytes(), soft);
}

// A drive without a bound stands at its stop; one with a bound bounces, and comes back by what its force makes of it.
TEST_P(JointBounce, OfWhatIsDriven) {
  for (const double force : {kUnlimited, 3.0}) {
    SolverProblem problem = against_world(1.0, 0.5);
    Discrepancy drive =
        row_along(Vector3::UnitX(), problem.trial_pose(0).position, problem.trial_pose(0).position, AxisMode::kDriven);
    drive.axes = Quaternion::Identity();
    drive.velocity.x() = 1.0, drive.maximum_force.x() = force;
    problem.add_discrepancy(kNone, 0, drive);
    EXPECT_NEAR(solve(problem).velocity(0).x(), force < kUnlimited ? -0.5 : 0.0, 1e-12) << force;
  }
}

TEST_P(JointBounce, IsRefusedOutsideOfZeroToOne) {
  for (const double wrong : {-0.1, 1.5, std::nan(""), std::numeric_limits<double>::infinity()}) {
    try {
      solve(against_world(1.0, wrong));
      ADD_FAILURE() << wrong;
    } catch (const Refusal& refusal) {
      EXPECT_NE(std::string(refusal.what()).find("restitution"), std::string::npos) << refusal.what();
    }
  }
}

// ---- energy

// Bodies in a row on points, with stops of their turns and contacts with each other and the ground, of which many close at once.
SolverProblem random_stops(std::uint64_t seed) {
  Draw draw(seed);
  SolverProblem p;
  p.theta = 0.0;
  const std::uint32_t ground = p.add_immovable();
  const std::uint32_t count = 2 + draw.below(4);
  for (std::uint32_t i = 0; i < count; ++i) {
    const double mass = draw.uniform(0.3, 3.0);
    p.add_body({.mass = mass,
                .moments = Vector3::Constant(mass * draw.uniform(0.05, 0.3)),
                .pose = {Vector3(i, 0, 0), draw.rotation()},
                .linear = draw.vector(2.0),
                .angular = draw.vector(4.0)});
  }
  p.time_step = 1e-4;
  p.make_trial(Vector3::Zero());
  const bool is_elastic = seed % 3 == 0;
  const auto restitution = [&] { return is_elastic ? 1.0 : draw.uniform(0.0, 1.0); };
  for (std::uint32_t i = 0; i < count; ++i) {
    const std::uint32_t one = i == 0 ? kNone : i, two = i + 1;
    p.add_discrepancy(one, two, p.joint_at(one, two, {i - 0.5, 0, 0}));
    // turns about up to three axes at their stops
    for (std::uint32_t k = 0; k < 1 + draw.below(3); ++k) {
      Discrepancy limit = row_about(draw.vector(1.0).normalized(), 0.0, AxisMode::kLimited);
      limit.upper.x() = draw.below(2) == 0 ? 0.0 : kUnlimited;
      limit.lower.x() = limit.upper.x() == 0.0 ? -1.0 : 0.0;
      limit.upper.x() = std::min(limit.upper.x(), 1.0);
      limit.restitution = restitution();
      p.add_discrepancy(one, two, limit);
    }
    if (draw.below(2) == 0) continue;
    const double friction = draw.uniform(0.0, 1.0);
    p.add_contact({.body1 = i > 1 && draw.below(2) == 0 ? i - 1 : ground,
                   .body2 = two,
                   .normal = draw.vector(1.0).normalized(),
                   .point = Vector3(i, 0, 0) + draw.vector(0.4),
                   .restitution = restitution(),
                   .static_friction = friction,
                   .dynamic_friction = friction,
                   .key = i});
  }
  return p;
}

double energy_gained(const SolverProblem& problem, const SolverAnswer& answer) {
  const double before = problem.energy(problem.trial_linear_velocity, problem.trial_angular_velocity);
  return problem.energy(answer.linear_velocity, answer.angular_velocity) / before - 1.0;
}

TEST_P(JointBounce, NeverAddsEnergy) {
  std::uint32_t bounced = 0;
  for (std::uint64_t seed = 1; seed <= harness::unless_sanitized(1000); ++seed) {
    const SolverProblem problem = random_stops(seed);
    const SolverAnswer answer = solve(problem);
    EXPECT_LE(energy_gained(problem, answer), 1e-11) << "seed " << seed;
    for (std::size_t i = 0; i < problem.mode.size(); ++i)
      if (problem.restitution[i] > 0.0 && answer.discrepancy_impulse[3 * i] != 0.0) ++bounced;
  }
  EXPECT_GT(bounced, harness::unless_sanitized(1000));
}

// Sweeps that ran out, and what they begin with.
TEST(JointBounceOfSequential, NeverAddsEnergyUnfinished) {
  for (std::uint64_t seed = 1; seed <= harness::unless_sanitized(500); ++seed) {
    SolverProblem problem = random_stops(seed);
    Draw draw(seed + 10'000);
    for (double& impulse : problem.discrepancy_warm_impulse) impulse = draw.uniform(-0.3, 0.3);
    for (const std::uint32_t sweeps : {1U, 3U, 10U})
      EXPECT_LE(energy_gained(problem, solve_sequential(problem, sweeps)), 1e-11) << "seed " << seed << ' ' << sweeps;
  }
}

// Where one stop closes of an open chain, what each solver says is what the others say.
TEST(JointBounceOfAll, IsTheSame) {
  for (std::uint64_t seed = 1; seed <= 100; ++seed) {
    Draw draw(seed);
    SolverProblem p;
    const std::uint32_t count = 1 + draw.below(4);
    p.time_step = 1e-6;  // Sequential's rows are those of S*
    for (std::uint32_t i = 0; i < count; ++i)
      p.add_body({.mass = draw.uniform(0.5, 2.0),
                  .moments = Vector3(0.1, 0.2, 0.3) * draw.uniform(0.5, 2.0),
                  .pose = {Vector3(i, 0, 0), draw.rotation()},
                  .linear = draw.vector(2.0),
                  .angular = draw.vector(3.0)});
    p.make_trial(Vector3::Zero());
    for (std::uint32_t i = 0; i < count; ++i) {
      const std::uint32_t one = i == 0 ? kNone : i - 1;
      p.add_discrepancy(one, i, p.joint_at(one, i, {i - 0.5, 0, 0}));
    }
    Discrepancy limit = row_about(draw.vector(1.0).normalized(), 0.0, AxisMode::kLimited);
    limit.lower.x() = 0.0, limit.upper.x() = 1.0, limit.restitution = draw.uniform(0.0, 1.0);
    p.add_discrepancy(count > 1 ? 0 : kNone, count > 1 ? 1 : 0, limit);
    const SolverAnswer reference = p.solve(newton());
    for (const BouncingSolver& solver : kBouncingSolvers) {
      const SolverAnswer answer = solver.solve(p);
      for (std::uint32_t i = 0; i < count; ++i) {
        EXPECT_NEAR((answer.velocity(i) - reference.velocity(i)).norm(), 0.0, 1e-6) << solver.name << ' ' << seed;
        EXPECT_NEAR((answer.turning(i) - reference.turning(i)).norm(), 0.0, 1e-6) << solver.name << ' ' << seed;
      }
    }
  }
}

}  // namespace
}  // namespace gravitas
