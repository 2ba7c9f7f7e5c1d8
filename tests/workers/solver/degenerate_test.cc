// What no scene should ask for, and some do: every solver answers with finite numbers, says so where there is no solution,
// and makes nothing out of nothing.
#include <gtest/gtest.h>

#include <cmath>
#include <functional>
#include <string>
#include <vector>

#include "plugin_sdk/math/rotation.h"
#include "tests/workers/solver/end_of_step_problem.h"
#include "tests/workers/solver/solver_problem.h"
#include "workers/solver/sequential/sequential.h"

namespace gravitas {
namespace {

struct Solver {
  const char* name;
  std::function<SolverAnswer(const SolverProblem&)> solve;
  // Solves joints together and where the step ends, not by relaxation where it began.
  bool factorises_joints;
};

SolverAnswer relaxed(const SolverProblem& problem, const SequentialSettings& settings) {
  return problem.solve(SequentialSolver(settings));
}

const std::vector<Solver> kSolvers = {
    {"Newton", [](const SolverProblem& p) { return p.solve(newton()); }, true},
    {"Direct", [](const SolverProblem& p) { return p.solve(direct()); }, true},
    {"Sequential", [](const SolverProblem& p) { return relaxed(p, {.iterations = 5000}); }, false},
    {"Layered",
     [](const SolverProblem& p) {
       return relaxed(p, {.iterations = 5000, .shock_propagation = ShockPropagation::kAlways});
     },
     false},
    {"Simultaneous",
     [](const SolverProblem& p) { return relaxed(p, {.iterations = 20000, .order = RelaxationOrder::kSimultaneous}); },
     false}};

class Degenerate : public ::testing::TestWithParam<Solver> {
 protected:
  static SolverAnswer solve(const SolverProblem& problem) { return GetParam().solve(problem); }
};
INSTANTIATE_TEST_SUITE_P(Each, Degenerate, ::testing::ValuesIn(kSolvers),
                         [](const auto& one) { return std::string(one.param.name); });

TEST_P(Degenerate, WithoutRowsTheTrialStands) {
  SolverProblem p;
  p.add_body({.linear = {1, 2, 3}});
  const SolverAnswer answer = solve(p);
  EXPECT_EQ(answer.velocity(0), Vector3(1, 2, 3));
  EXPECT_EQ(answer.stop_reason[0], static_cast<std::uint32_t>(StopReason::kNothingToDo));
}

TEST_P(Degenerate, ThousandsOfContactsOnOneBody) {
  SolverProblem p;
  const auto ground = p.add_immovable();
  const auto plate = p.add_body({.mass = 3.0, .pose = {{0, 0.1, 0}, Quaternion::Identity()}, .linear = {0.5, -1, 0}});
  for (int i = 0; i < 1500; ++i)
    p.add_contact({.body1 = ground,
                   .body2 = plate,
                   .point = {0.01 * (i % 50) - 0.245, 0.0, 0.01 * (i / 50) - 0.145},
                   .static_friction = 0.4,
                   .dynamic_friction = 0.4,
                   .key = static_cast<std::uint64_t>(i + 1)});
  const SolverAnswer answer = solve(p);
  EXPECT_NEAR(answer.velocity(plate).y(), 0.0, 1e-6);
  // mu times the normal impulse
  EXPECT_NEAR(answer.velocity(plate).x(), 0.5 - 0.4, 1e-6);
}

TEST_P(Degenerate, MomentsOfOneTo1em8) {
  const Vector3 anchor(0.3, 0.2, 0.1);
  SolverProblem p;
  const auto rod = p.add_body({.moments = {1.0, 1.0, 1e-8}, .linear = {0, -1, 0}, .angular = {0.1, 0.2, 5}});
  p.make_trial({0, -9.81, 0});
  p.add_discrepancy(kNone, rod, p.joint_at(kNone, rod, anchor));
  const SolverAnswer answer = solve(p);
  // whether the velocities count as converged hangs on rounding: rows meet a response of 1e8
  const Vector3 end = carried(p.at_trial(rod, anchor), p.trial_pose(rod), p.committed(answer, rod));
  const double left = (end - anchor).norm();
  if (GetParam().factorises_joints) {
    EXPECT_LE(left, 1e-12);
    EXPECT_TRUE(std::isfinite(answer.turning(rod).norm()));
  } else {
    // the pose change by the arms of S*
    EXPECT_LE(left, 1e-2);
    const Vector3 arm = end - p.committed(answer, rod).position;
    EXPECT_LE((answer.velocity(rod) + answer.turning(rod).cross(arm)).norm(), 1e-6);
  }
}

// Two joints that move apart and hold one body: no solution. That is said, and their compromise is the middle, whatever spins
// beside them.
TEST_P(Degenerate, ContradictionsAreReportedAndCompromised) {
  for (const bool has_spinner : {false, true}) {
    SolverProblem p;
    const auto left = p.add_body({.linear = {-1, 0, 0}, .kinematic = true});
    const auto right = p.add_body({.linear = {1, 0, 0}, .kinematic = true});
    const auto middle = p.add_body({.mass = 2.0});
    if (has_spinner) p.add_body({.pose = {{9, 0, 0}, Quaternion::Identity()}, .angular = {0, 0, 100}});
    p.make_trial(Vector3::Zero());
    for (const auto end : {left, right}) p.add_discrepancy(end, middle, p.joint_at(end, middle, Vector3::Zero()));
    const SolverAnswer answer = solve(p);
    EXPECT_EQ(answer.stop_reason[0], static_cast<std::uint32_t>(StopReason::kContradiction)) << has_spinner;
    EXPECT_LE(answer.velocity(middle).norm(), 1e-9) << has_spinner;
    EXPECT_LE(answer.translation(middle).norm(), 1e-9 * p.time_step) << has_spinner;
  }
}

// Two motors that nothing limits drive one body about one axis at 3 and at -1 rad/s: it turns at 1.
TEST_P(Degenerate, MotorsThatContradictEachOtherMeetInTheMiddle) {
  SolverProblem p;
  const auto body = p.add_body({.mass = 2.0, .moments = {1.0, 2.0, 3.0}});
  p.make_trial(Vector3::Zero());
  for (const double speed : {3.0, -1.0}) {
    Discrepancy d;
    d.modes = pack_modes(AxisMode::kDriven, AxisMode::kFree, AxisMode::kFree, true);
    d.velocity = {speed, 0, 0};
    p.add_discrepancy(kNone, body, d);
  }
  const SolverAnswer answer = solve(p);
  EXPECT_EQ(answer.stop_reason[0], static_cast<std::uint32_t>(StopReason::kContradiction));
  EXPECT_LE((answer.turning(body) - Vector3(1, 0, 0)).norm(), 1e-9);
}

// A plate held at its four corners, each a ball joint: 12 rows of rank 6. It stands, and they bear its weight together.
TEST_P(Degenerate, RedundantJointsBearTheLoadTogether) {
  SolverProblem p;
  const auto plate = p.add_body({.mass = 8.0, .moments = {1.0, 2.0, 1.0}});
  p.make_trial({0, -9.81, 0});
  for (int corner = 0; corner < 4; ++corner)
    p.add_discrepancy(kNone, plate, p.joint_at(kNone, plate, {corner % 2 - 0.5, 0, corner / 2 - 0.5}));
  const SolverAnswer answer = solve(p);
  EXPECT_TRUE(answer.converged());
  EXPECT_LE(answer.velocity(plate).norm() + answer.turning(plate).norm(), 1e-12);
  EXPECT_LE(p.committed(answer, plate).position.norm(), 1e-12);
  Vector3 sum = Vector3::Zero();
  for (std::size_t i = 0; i < 4; ++i) sum += vector_at(answer.discrepancy_impulse, i);
  EXPECT_LE((sum - Vector3(0, 8.0 * 9.81 * p.time_step, 0)).norm(), 1e-11);
}

// Six bodies in a ring of hinges that hold two points each: a loop that is closed one row too often, thrown into the air.
TEST_P(Degenerate, AClosedLoopKeepsItsMomentum) {
  constexpr int kBodies = 6;
  SolverProblem p;
  std::vector<std::uint32_t> ring;
  const auto place = [](double i) {
    const double angle = 2.0 * std::acos(-1.0) * i / kBodies;
    return Vector3(std::cos(angle), std::sin(angle), 0.0);
  };
  for (int i = 0; i < kBodies; ++i)
    ring.push_back(p.add_body({.mass = 1.0 + 0.2 * i,
                               .pose = {place(i), Quaternion::Identity()},
                               .linear = {0.3 * std::cos(2.0 * i), 1.0, 0.2 * std::sin(3.0 * i)},
                               .angular = {0.1, 0.2, -0.1 * i}}));
  p.make_trial(Vector3::Zero());
  for (int i = 0; i < kBodies; ++i) {
    const std::uint32_t one = ring[static_cast<std::size_t>(i)],
                        two = ring[static_cast<std::size_t>((i + 1) % kBodies)];
    for (const double z : {-0.2, 0.2})
      p.add_discrepancy(one, two, p.joint_at(one, two, 0.5 * (place(i) + place(i + 1.0)) + Vector3(0, 0, z)));
  }
  const SolverAnswer answer = solve(p);
  EXPECT_LE((p.momentum(answer.linear_velocity) - p.momentum(p.trial_linear_velocity)).norm(), 1e-12);
  EXPECT_LE(p.energy(answer.linear_velocity, answer.angular_velocity),
            p.energy(p.trial_linear_velocity, p.trial_angular_velocity) * (1.0 + 1e-12));
  double open = 0.0;
  for (std::size_t i = 0; i < p.mode.size(); ++i) {
    const std::uint32_t one = p.discrepancy_body[2 * i], two = p.discrepancy_body[2 * i + 1];
    const auto point = [&](std::uint32_t body, const std::vector<double>& points) {
      return carried(vector_at(points, i), p.trial_pose(body), p.committed(answer, body));
    };
    open = std::max(open, (point(one, p.point1) - point(two, p.point2)).norm());
  }
  // relaxed at S*, it is open by the square of the step's turn
  EXPECT_LE(open, GetParam().factorises_joints ? 1e-11 : 1e-4);
  // by so much its rows contradict each other at S*, but not where it closes
  EXPECT_EQ(answer.converged(), GetParam().factorises_joints);
  EXPECT_NE(answer.stop_reason[0], static_cast<std::uint32_t>(StopReason::kContradiction));
}

// Half of a ball is in the ground: it comes out whole in a step, and with no speed of its own.
TEST_P(Degenerate, OverlapGivesNoSpeed) {
  SolverProblem p;
  const auto ground = p.add_immovable();
  const auto ball = p.add_body({.pose = {{0, 0, 0}, Quaternion::Identity()}});
  p.make_trial({0, -9.81, 0});
  const double depth = 0.5 - p.trial_pose(ball).position.y();
  p.add_contact({.body1 = ground, .body2 = ball, .point = {0, -0.5 * depth, 0}, .depth = depth, .restitution = 0.5});
  const SolverAnswer answer = solve(p);
  EXPECT_NEAR(p.committed(answer, ball).position.y(), 0.5, 1e-12);
  EXPECT_LE(answer.velocity(ball).norm(), 1e-12);
}

// Walls that leave a box no room, a little out of parallel: the way out is 0.01/1e-6 m long, and no step takes it.
TEST_P(Degenerate, ABoxThatIsCrushedStaysWhereItIs) {
  SolverProblem p;
  const auto left = p.add_body({.linear = {0.1, 0, 0}, .kinematic = true});
  const auto right = p.add_body({.linear = {-0.1, 0, 0}, .kinematic = true});
  const auto box = p.add_body({.pose = {{0, 0, 0}, Quaternion::Identity()}});
  p.make_trial({0, -9.81, 0});
  const Vector3 into_left = Vector3(1, 0, 1e-6).normalized();
  p.add_contact({.body1 = left, .body2 = box, .normal = into_left, .point = {-0.5, 0, 0}, .depth = 0.01});
  p.add_contact({.body1 = box, .body2 = right, .normal = Vector3::UnitX(), .point = {0.5, 0, 0}, .depth = 0.01});
  const SolverAnswer answer = solve(p);
  EXPECT_LE(answer.translation(box).norm(), 0.5);
}

// Immovable and kinematic bodies on both sides of a joint and of a contact: nothing to push, nothing done.
TEST_P(Degenerate, InfiniteMassesOnBothSidesAreLeftAlone) {
  SolverProblem p;
  const auto ground = p.add_immovable();
  const auto lift = p.add_body({.linear = {0, -1, 0}, .kinematic = true});
  const auto ball = p.add_body({.pose = {{5, 0, 0}, Quaternion::Identity()}});
  p.make_trial({0, -9.81, 0});
  p.add_contact({.body1 = ground, .body2 = lift, .depth = 0.1});
  p.add_discrepancy(ground, lift, p.joint_at(ground, lift, {0, 0, 0}));
  const SolverAnswer answer = solve(p);
  EXPECT_EQ(answer.velocity(lift), Vector3(0, -1, 0));
  EXPECT_EQ(answer.translation(lift), Vector3::Zero());
  EXPECT_EQ(answer.impulse(0), Vector3::Zero());
  EXPECT_EQ(answer.velocity(ball), p.trial_twist(ball).linear);
}

// Two balls at one place, pushed apart along whatever normal was chosen: the whole overlap, shared by mass, and no speed.
TEST_P(Degenerate, CoincidentBodiesPart) {
  SolverProblem p;
  const auto one = p.add_body({.mass = 1.0}), two = p.add_body({.mass = 3.0});
  p.make_trial(Vector3::Zero());
  p.add_contact({.body1 = one, .body2 = two, .normal = Vector3::UnitX(), .depth = 1.0, .restitution = 0.5});
  const SolverAnswer answer = solve(p);
  EXPECT_NEAR(answer.translation(one).x(), -0.75, 1e-12);
  EXPECT_NEAR(answer.translation(two).x(), 0.25, 1e-12);
  EXPECT_LE(answer.velocity(one).norm() + answer.velocity(two).norm(), 1e-12);
}

// At 1000 g a ball on the ground stays where it is, and the ground bears 1000 times its weight.
TEST_P(Degenerate, AThousandTimesGravityIsCarried) {
  SolverProblem p;
  const auto ground = p.add_immovable();
  const auto ball = p.add_body({.pose = {{0, 0.5, 0}, Quaternion::Identity()}});
  p.make_trial({0, -9810, 0});
  const double depth = 0.5 - p.trial_pose(ball).position.y();
  p.add_contact({.body1 = ground,
                 .body2 = ball,
                 .point = {0, -0.5 * depth, 0},
                 .depth = depth,
                 .static_friction = 0.5,
                 .dynamic_friction = 0.5});
  const SolverAnswer answer = solve(p);
  EXPECT_NEAR(answer.impulse(0).y(), 98.1, 98.1 * 1e-14);
  EXPECT_NEAR(p.committed(answer, ball).position.y(), 0.5, 1e-14);
  EXPECT_LE(answer.velocity(ball).norm(), 98.1 * 1e-14);
}

// Painlevé's rod, mu beyond 4/3: no solution may exist; the answer is finite and gains nothing.
TEST_P(Degenerate, PainlevesRodIsAnswered) {
  for (const double mu : {0.5, 1.5, 3.0}) {
    for (const double angle : {0.3, 0.9, 1.2}) {
      SolverProblem p;
      const auto ground = p.add_immovable();
      const Vector3 foot = -0.5 * Vector3(std::cos(angle), std::sin(angle), 0);
      const auto rod = p.add_body(
          {.moments = Vector3::Constant(1.0 / 12.0), .pose = {-foot, Quaternion::Identity()}, .linear = {1.5, 0, 0}});
      p.set_trial_velocity(rod, {1.5, -0.0981, 0}, Vector3::Zero());
      p.add_contact({.body1 = ground, .body2 = rod, .static_friction = mu, .dynamic_friction = mu});
      const SolverAnswer answer = solve(p);
      EXPECT_TRUE(std::isfinite(answer.velocity(rod).norm() + answer.turning(rod).norm()));
      const double before = p.energy(p.trial_linear_velocity, p.trial_angular_velocity);
      EXPECT_LE(p.energy(answer.linear_velocity, answer.angular_velocity), before * (1.0 + 1e-9));
    }
  }
}

}  // namespace
}  // namespace gravitas
