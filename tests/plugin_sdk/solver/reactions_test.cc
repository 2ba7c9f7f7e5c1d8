// Reactions of joints in states whose tensions are known, redundant and contradicting joints, what is left out.
#include "plugin_sdk/solver/reactions.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <vector>

#include "plugin_sdk/body.h"
#include "plugin_sdk/discrepancy.h"
#include "plugin_sdk/joint_rows.h"
#include "plugin_sdk/math/rotation.h"
#include "tests/plugin_sdk/solver/reaction_problem.h"
#include "tests/turn_between.h"

namespace gravitas {
namespace {

using ::testing::HasSubstr;
using Problem = harness::ReactionProblem;

constexpr double kG = 9.81;

Discrepancy rod(const Vector3& from, const Vector3& to) {
  Discrepancy d;
  d.point1 = from, d.point2 = to;
  d.axes = test::turn_between(Vector3::UnitX(), to - from);
  d.modes = pack_modes(AxisMode::kLimited, AxisMode::kFree, AxisMode::kFree) | kRadialDiscrepancy;
  d.lower.x() = d.upper.x() = (to - from).norm();
  return d;
}

Discrepancy pin(const Vector3& at) {
  Discrepancy d;
  d.point1 = d.point2 = at;
  return d;
}

// A bob of 2 kg at the end of a rod of 3 m, 0.4 rad from the vertical, at 5 m/s.
Vector3 bob_at() { return {3.0 * std::sin(0.4), -3.0 * std::cos(0.4), 0.0}; }
Problem swinging() {
  Problem problem;
  problem.add_body(2.0, bob_at(), 5.0 * Vector3(std::cos(0.4), std::sin(0.4), 0.0), {0.0, -2.0 * kG, 0.0});
  problem.add_joint(kNone, 0, rod({0, 0, 0}, bob_at()));
  return problem;
}
// T = m v^2/l + m g cos phi
const double kTension = 2.0 * 25.0 / 3.0 + 2.0 * kG * std::cos(0.4);

TEST(Reactions, OfARodIsItsTension) {
  Problem problem = swinging();
  problem.solve();
  // some roundings of 35 N
  EXPECT_LT((problem.reaction(0) + kTension * bob_at() / 3.0).norm(), 1e-13);
  EXPECT_LT(problem.torque(0).norm(), 1e-13);
  EXPECT_NEAR(problem.force(0).x(), -kTension, 1e-13);
  EXPECT_EQ(problem.residual(), 0.0);
}

TEST(Reactions, OfJointsThatSayTheSameAddUpToOne) {
  Problem problem = swinging();
  for (int i = 0; i < 3; ++i) problem.add_joint(kNone, 0, rod({0, 0, 0}, bob_at()));
  problem.solve();
  EXPECT_LT((problem.reaction(0) + kTension * bob_at() / 3.0).norm(), 1e-12);
  // two kinds of rounding in numbers that agree
  EXPECT_LT(problem.residual(), 1e-13);
}

// Pinned to a body that is driven with 7 m/s^2: m a; hung from it beside the centre: alpha = (r x R)/I too.
// Two bobs of 1 kg on rods of 1 m side by side, a rod of 2 m between them: each swings as if it were alone, and the rod
// between them bears nothing. `phi` from where all rods are in line, and there is no telling whether the bobs will go on the
// same way or against each other. Off the joints as an integrator's trial state is, by `e`.
Problem parallel_bobs(double phi, double rate, double e) {
  constexpr double kBetween = 2.0;
  const Vector3 at(std::cos(phi), std::sin(phi), 0.0), along(-std::sin(phi), std::cos(phi), 0.0);
  const Vector3 off(0.3 * e, e, 0.0), other(kBetween, 0.0, 0.0);
  Problem problem;
  problem.add_body(1.0, at - off, rate * along - off, {0.0, -kG, 0.0});
  problem.add_body(1.0, at + other + off, rate * along + 2.0 * off, {0.0, -kG, 0.0});
  const std::array<Discrepancy, 3> rods = {rod({0, 0, 0}, at - off), rod(at - off, at + other + off),
                                           rod(other, at + other + off)};
  const std::array<std::array<std::uint32_t, 2>, 3> bodies = {{{kNone, 0}, {0, 1}, {kNone, 1}}};
  for (std::size_t i = 0; i < rods.size(); ++i) {
    Discrepancy d = rods[i];
    d.lower.x() = d.upper.x() = i == 1 ? kBetween : 1.0;
    problem.add_joint(bodies[i][0], bodies[i][1], d);
  }
  problem.solve();
  return problem;
}

TEST(Reactions, NearASingularConfigurationAreThoseOfTheNearestStateThatAgrees) {
  constexpr double kRate = 3.0;
  for (const double phi : {0.3, 1e-2, -1e-3}) {
    const Vector3 pull = -(kRate * kRate - kG * std::sin(phi)) * Vector3(std::cos(phi), std::sin(phi), 0.0);
    for (const double e : {0.0, 1e-9, 1e-5}) {
      // as directions differ, and rounding by the cube of the distance
      const double bound = 100.0 * e + 1e-14 / std::abs(phi * phi * phi);
      const Problem problem = parallel_bobs(phi, kRate, e);
      EXPECT_LT((problem.reaction(0) - pull).norm(), bound) << phi << ", " << e;
      EXPECT_LT((problem.reaction(1) - pull).norm(), bound) << phi << ", " << e;
      EXPECT_LT(std::abs(problem.force(1).x()), bound / std::abs(phi)) << phi << ", " << e;
      EXPECT_LT(problem.residual(), 1e-10);
    }
  }
}

// A ball that holds a load by its centre, in a state where the two are off by e: it is pushed at its centre still, as a torque
// e x force would turn a small ball ever faster.
TEST(Reactions, OfAStateThatIsOffTheJointTurnNoBallHeldByItsCentre) {
  const double e = 1e-3;
  for (const bool is_first : {true, false}) {
    Problem problem;
    const std::uint32_t ball = problem.add_body(1.0, {0, 0, 0}, {0, 0, 0}, {3, 0, 0});
    const std::uint32_t load = problem.add_body(2.0, {0, e, 0}, {0, 0, 0}, {0, 0, 0});
    Discrepancy d;
    (is_first ? d.point2 : d.point1) = Vector3(0, e, 0);
    problem.add_joint(is_first ? ball : load, is_first ? load : ball, d);
    problem.solve();
    // 3 N move 3 kg
    EXPECT_LT((problem.reaction(load) - Vector3(2, 0, 0)).norm(), 1e-15);
    EXPECT_EQ(problem.torque(ball), Vector3::Zero());
    EXPECT_EQ(problem.torque(load), Vector3::Zero());
  }
}

// What is not held is no error: a load that has slid 2 m along a guide presses on it there.
TEST(Reactions, OfAGuideActWhereItsLoadIs) {
  Problem problem;
  const std::uint32_t guide = problem.add_body(2.0, {0, 0, 0}, {0, 0, 0}, {0, 0, 0});
  const std::uint32_t load = problem.add_body(1.0, {2, 0, 0}, {0, 0, 0}, {0, 5, 0});
  Discrepancy d;
  d.point2 = Vector3(2, 0, 0);
  d.modes = pack_modes(AxisMode::kFree, AxisMode::kLocked, AxisMode::kLocked);
  problem.add_joint(guide, load, d);
  problem.solve();
  // R (1/2 + 2^2/3 + 1) = 5 N, I_z = 3
  const double force = 5.0 / (0.5 + 4.0 / 3.0 + 1.0);
  EXPECT_NEAR(problem.reaction(guide).y(), force, 1e-14);
  EXPECT_NEAR(problem.torque(guide).z(), 2.0 * force, 1e-14);
}

TEST(Reactions, CarryTheAccelerationOfAKinematicBody) {
  Problem problem;
  const std::uint32_t driven = problem.add_body(0.0, {0, 0, 0}, {0, 0, 0}, {0, 0, 0});
  const std::uint32_t load = problem.add_body(4.0, {1, 0, 0}, {0, 0, 0}, {0, 0, 0});
  problem.acceleration[6 * driven + 1] = 7.0;
  problem.add_joint(driven, load, pin({1, 0, 0}));
  problem.solve();
  EXPECT_LT((problem.reaction(load) - Vector3(0, 28, 0)).norm(), 1e-13);
  EXPECT_EQ(problem.reaction(driven), Vector3::Zero());

  Problem beside;
  beside.add_body(0.0, {0, 0, 0}, {0, 0, 0}, {0, 0, 0});
  beside.add_body(4.0, {1, 0, 0}, {0, 0, 0}, {0, 0, 0});
  beside.acceleration[1] = 7.0;
  beside.add_joint(0, 1, pin({0.5, 0, 0}));
  beside.solve();
  // a = F/m + (r^2/I_z) F at r = 1/2, I_z = 3
  EXPECT_NEAR(beside.reaction(1).y(), 7.0 / (0.25 + 0.25 / 3.0), 1e-13);
}

// What drag takes, the joint gives: m d v.
TEST(Reactions, MakeUpForDrag) {
  Problem problem;
  problem.add_body(0.0, {0, 0, 0}, {6, 0, 0}, {0, 0, 0});
  problem.add_body(4.0, {0, 0, 0}, {6, 0, 0}, {0, 0, 0});
  problem.drag[1] = 0.5;
  problem.add_joint(0, 1, pin({0, 0, 0}));
  problem.solve();
  EXPECT_LT((problem.reaction(1) - Vector3(12, 0, 0)).norm(), 1e-13);
}

// Pulled two ways by 1 m/s^2 and -1 m/s^2: the residual is what each misses, and the load stays between.
TEST(Reactions, OfContradictingJointsAreACompromiseAndSaySo) {
  for (const double mass : {1.0, 4.0, 1e-3}) {
    Problem problem;
    problem.add_body(0.0, {0, 0, 0}, {0, 0, 0}, {0, 0, 0});
    problem.add_body(0.0, {0, 0, 0}, {0, 0, 0}, {0, 0, 0});
    problem.add_body(mass, {0, 0, 0}, {0, 0, 0}, {0, 0, 0});
    problem.acceleration[0] = 1.0, problem.acceleration[6] = -1.0;
    problem.add_joint(0, 2, pin({0, 0, 0}));
    problem.add_joint(1, 2, pin({0, 0, 0}));
    problem.solve();
    EXPECT_NEAR(problem.residual(), std::sqrt(2.0), 1e-12) << mass;
    EXPECT_LT(problem.reaction(2).norm(), 1e-12 * std::max(1.0, mass)) << mass;
  }
}

// What contradicts itself in one mechanism says nothing of another, and the worst is told.
TEST(Reactions, TellTheWorstResidual) {
  Problem problem;
  for (const double pull : {1.0, 3.0, 2.0}) {
    const auto body = problem.add_body(1.0, bob_at(), {0, 0, 0}, {0, 0, 0});
    Discrepancy one = pin(bob_at()), two = pin(bob_at());
    one.acceleration.x() = pull, two.acceleration.x() = -pull;
    problem.add_joint(kNone, body, one), problem.add_joint(kNone, body, two);
  }
  problem.solve();
  EXPECT_NEAR(problem.residual(), 3.0 * std::sqrt(2.0), 1e-12);
}

TEST(Reactions, AreNoneOfALockWithABound) {
  Discrepancy bounded = pin(bob_at());
  bounded.maximum_force = Vector3::Constant(1e6);
  Problem problem;
  problem.add_body(2.0, bob_at(), {5, 0, 0}, {0, -1, 0});
  problem.add_joint(kNone, 0, bounded);
  problem.solve();
  EXPECT_EQ(problem.reaction(0), Vector3::Zero());
}

TEST(Reactions, OfARopeThatIsTautAreARods) {
  Problem problem = swinging();
  problem.lower[0] = 0.0;
  problem.solve();
  EXPECT_LT((problem.reaction(0) + kTension * bob_at() / 3.0).norm(), 1e-13);
  // a trial state within it is that of a rope that was taut
  problem.begin_step();
  problem.position[1] += 1e-4, problem.point2[1] += 1e-4;
  problem.solve();
  EXPECT_NEAR(problem.force(0).x(), -kTension, 1e-2);
  // slack, or opening, where the step began; or pushed into
  Problem slack = swinging(), opening = swinging(), pushed = swinging();
  slack.lower[0] = opening.lower[0] = pushed.lower[0] = 0.0;
  slack.upper[0] += 1e-6;
  opening.linear_velocity[1] += 1e-3;
  pushed.wrench[1] += 40.0;
  for (Problem* loose : {&slack, &opening, &pushed}) {
    loose->solve();
    EXPECT_EQ(loose->reaction(0), Vector3::Zero());
  }
}

// Along x with 3 m/s, at 20 N, under 12 N along x and what else there is.
Problem driven(double speed, double force) {
  Discrepancy drive;
  drive.modes = pack_modes(AxisMode::kDriven, AxisMode::kFree, AxisMode::kFree);
  drive.velocity.x() = 3.0;
  drive.maximum_force.x() = 20.0;
  Problem problem;
  problem.add_body(2.0, {0, 0, 0}, {speed, 0, 0}, {force, 1.0, 0});
  problem.add_joint(kNone, 0, drive);
  problem.solve();
  return problem;
}

TEST(Reactions, OfABoundedDriveHoldItsVelocityWithinTheBound) {
  EXPECT_EQ(driven(3.0, 12.0).reaction(0), Vector3(-12, 0, 0));
  EXPECT_EQ(driven(3.0, 25.0).reaction(0), Vector3(-20, 0, 0));
  EXPECT_EQ(driven(3.0, -25.0).reaction(0), Vector3(20, 0, 0));
  EXPECT_EQ(driven(2.8, 12.0).reaction(0), Vector3(20, 0, 0));
  // (12 + 20)/2 m/s^2 are more than it needs in the step of 10 ms: where it would go far beyond, it is left to the step's end
  EXPECT_EQ(driven(2.9, 12.0).reaction(0), Vector3(20, 0, 0));
  EXPECT_EQ(driven(2.95, 12.0).reaction(0), Vector3(20, 0, 0));
  EXPECT_EQ(driven(2.97, 12.0).reaction(0), Vector3(0, 0, 0));
  EXPECT_EQ(driven(3.1, 12.0).reaction(0), Vector3(-20, 0, 0));
}

// What it is asked for changes by 7 m/s^2: 12 + F = 2 7. In S_n it was asked for another velocity than in the state, by up to
// what that changes by in the step.
TEST(Reactions, OfADriveGiveItTheAccelerationThatIsDesired) {
  for (const double bound : {kUnlimited, 20.0})
    for (const AxisMode mode : {AxisMode::kDriven, AxisMode::kLocked}) {
      if (mode == AxisMode::kLocked && bound < kUnlimited) continue;
      Discrepancy drive;
      drive.modes = pack_modes(mode, AxisMode::kFree, AxisMode::kFree);
      drive.velocity.x() = 3.0, drive.acceleration = {7.0, 5.0, 0.0}, drive.maximum_force.x() = bound;
      Problem problem;
      problem.add_body(2.0, {0, 0, 0}, {2.95, 0, 0}, {12, 1.0, 0});
      problem.add_joint(kNone, 0, drive);
      problem.begin_step();
      problem.linear_velocity = {3.0, 0.0, 0.0};
      problem.solve();
      EXPECT_NEAR(problem.reaction(0).x(), 2.0, 1e-14);
      EXPECT_EQ(problem.reaction(0).y(), 0.0);
    }
}

// Two bodies in a row on a stop, the first pressed on it by 10 N, the second pressed on the first or pulled off.
TEST(Reactions, OfStopsAreThoseThatPress) {
  const auto stop = [](double at) {
    Discrepancy d;
    d.modes = pack_modes(AxisMode::kUnilateral, AxisMode::kFree, AxisMode::kFree);
    d.point1.x() = d.point2.x() = at;
    return d;
  };
  for (const double pull : {-10.0, 15.0, 5.0}) {
    Problem problem;
    problem.add_body(2.0, {0, 0, 0}, {0, 0, 0}, {-10, 0, 0});
    problem.add_body(2.0, {1, 0, 0}, {0, 0, 0}, {pull, 0, 0});
    problem.add_joint(kNone, 0, stop(0.0));
    problem.add_joint(0, 1, stop(1.0));
    problem.solve();
    EXPECT_NEAR(problem.force(0).x(), 10.0 + std::max(0.0, -pull), 1e-12) << pull;
    EXPECT_NEAR(problem.force(1).x(), std::max(0.0, -pull), 1e-12) << pull;
  }
}

// By what the joints are told to be there, whatever those of the state would be if they were carried back: closed, in both.
TEST(Reactions, OfStopsAreThoseThatWereClosedWhereTheStepBegan) {
  for (const double gap : {0.0, 0.1})
    for (const bool is_told : {false, true}) {
      Problem problem;
      problem.add_body(2.0, {0, 0, 0}, {0, 0, 0}, {-10, 0, 0});
      Discrepancy stop;
      stop.modes = pack_modes(AxisMode::kUnilateral, AxisMode::kFree, AxisMode::kFree);
      problem.add_joint(kNone, 0, stop);
      problem.begin_step();
      if (is_told) problem.tell_start_joints(), problem.start_point2[0] = gap;
      problem.solve();
      EXPECT_NEAR(problem.force(0).x(), is_told && gap > 0.0 ? 0.0 : 10.0, 1e-12) << gap << is_told;
    }
}

// A drive of 3 N at most is at the speed that it was asked for there, though it is asked for another now.
TEST(Reactions, OfDrivesAreOfTheSpeedThatWasAskedWhereTheStepBegan) {
  for (const double asked : {1.0, 2.0}) {
    Problem problem;
    problem.add_body(2.0, {0, 0, 0}, {1, 0, 0}, {-2, 0, 0});
    Discrepancy drive;
    drive.modes = pack_modes(AxisMode::kDriven, AxisMode::kFree, AxisMode::kFree);
    drive.maximum_force.x() = 3.0, drive.velocity.x() = 1.5;
    problem.add_joint(kNone, 0, drive);
    problem.begin_step();
    problem.tell_start_joints();
    problem.start_velocity[0] = asked;
    problem.solve();
    EXPECT_NEAR(problem.force(0).x(), asked == 1.0 ? 2.0 : 3.0, 1e-12) << asked;
  }
}

TEST(Reactions, RefuseJointsOfTheStartThatAreNone) {
  const auto refusal_with = [](auto&& spoil) {
    Problem problem;
    problem.add_body(2.0, {0, 0, 0}, {0, 0, 0}, {-10, 0, 0});
    problem.add_joint(kNone, 0, pin({0, 0, 0}));
    problem.tell_start_joints();
    spoil(&problem);
    try {
      problem.solve();
    } catch (const Refusal& refusal) {
      return std::string(refusal.what());
    }
    return std::string();
  };
  EXPECT_EQ(refusal_with([](Problem*) {}), "");
  EXPECT_THAT(refusal_with([](Problem* one) { one->start_mode.push_back(0x111); }), HasSubstr("start_mode"));
  EXPECT_THAT(refusal_with([](Problem* one) { one->start_mode[0] = 7; }), HasSubstr("start_mode"));
  EXPECT_THAT(refusal_with([](Problem* one) { one->start_lower.pop_back(); }), HasSubstr("start_lower"));
  EXPECT_THAT(refusal_with([](Problem* one) { one->start_point1[1] = std::nan(""); }), HasSubstr("start_point1"));
}

// Of one body at the origin that moves at (0.5, 0, 0) and is off by `error` along x; only that axis is said to do anything.
Discrepancy soft_along_x(AxisMode mode, double error) {
  Discrepancy d;
  d.point2.x() = error;
  d.modes = pack_modes(mode, AxisMode::kFree, AxisMode::kFree);
  d.compliance.x() = 0.01, d.damping.x() = 4.0;
  return d;
}
double force_along_x(const Discrepancy& d) {
  Problem problem;
  problem.add_body(2.0, {0, 0, 0}, {0.5, 0, 0}, {0, 0, 0});
  problem.add_joint(kNone, 0, d);
  problem.solve();
  EXPECT_EQ(problem.reaction(0), problem.force(0));
  return problem.force(0).x();
}

TEST(Reactions, OfWhatGivesWayAreItsSpringAndDamper) {
  constexpr double kRounding = 1e-13;
  // -(e/c + d (v - v_d)) = -(30 + 2)
  Discrepancy d = soft_along_x(AxisMode::kLocked, 0.3);
  EXPECT_NEAR(force_along_x(d), -32.0, kRounding);
  d.velocity.x() = 1.5;
  EXPECT_NEAR(force_along_x(d), -26.0, kRounding);
  d.maximum_force.x() = 5.0;
  EXPECT_EQ(force_along_x(d), -5.0);
  // one limit: the error is counted from there
  d = soft_along_x(AxisMode::kLimited, 0.3);
  d.lower.x() = d.upper.x() = 0.1;
  EXPECT_NEAR(force_along_x(d), -22.0, kRounding);
  // two: nothing between them, and no pull back to the one that is left
  d.lower.x() = -0.2, d.upper.x() = 0.4;
  EXPECT_EQ(force_along_x(d), 0.0);
  d.upper.x() = 0.2;
  EXPECT_NEAR(force_along_x(d), -12.0, kRounding);
  d = soft_along_x(AxisMode::kUnilateral, -0.3);
  EXPECT_NEAR(force_along_x(d), 28.0, kRounding);
  d.point2.x() = -0.01;
  EXPECT_EQ(force_along_x(d), 0.0);
  d.point2.x() = 0.3;
  EXPECT_EQ(force_along_x(d), 0.0);
  // d (v_d - v), whatever the error
  for (const AxisMode mode : {AxisMode::kDriven, AxisMode::kFriction}) {
    d = soft_along_x(mode, 0.3);
    d.velocity.x() = 2.0;
    EXPECT_NEAR(force_along_x(d), 6.0, kRounding);
    d.maximum_force.x() = 1.5;
    EXPECT_EQ(force_along_x(d), 1.5);
  }
}

TEST(Reactions, OfASpringAboutAnAxisAreCouples) {
  Problem problem;
  problem.add_body(2.0, {0, 0, 0}, {0, 0, 0}, {0, 0, 0});
  problem.add_body(1.0, {1, 2, 3}, {0, 0, 0}, {0, 0, 0});
  problem.angular_velocity[5] = 3.0;
  Discrepancy d;
  d.point2 = {0, 0, 0.2};
  d.modes = pack_modes(AxisMode::kFree, AxisMode::kFree, AxisMode::kLocked, true);
  d.compliance.z() = 0.5, d.damping.z() = 0.25;
  problem.add_joint(0, 1, d);
  problem.solve();
  EXPECT_LT((problem.torque(1) - Vector3(0, 0, -1.15)).norm(), 1e-15);
  EXPECT_EQ(problem.torque(0), Vector3(-problem.torque(1)));
  EXPECT_EQ(problem.reaction(0), Vector3::Zero());
  EXPECT_EQ(problem.reaction(1), Vector3::Zero());
}

// Of any shape of spring between bodies that move and turn anyhow: it takes what it stores, -d/dt sum e^2/2c, and gives no
// momentum to the two.
TEST(Reactions, OfASpringAreTheGradientOfItsEnergy) {
  const Vector3 x1(0.3, -0.4, 0.2), x2(1.1, 0.7, -0.5), v1(0.4, 0.1, -0.6), v2(-0.7, 0.9, 0.2), w1(0.5, -1.2, 0.8),
      w2(-0.3, 0.4, 1.1);
  Discrepancy d;
  d.point1 = {0.5, 0.1, 0.3}, d.point2 = {0.9, 0.45, -0.2};
  d.axes = Quaternion(0.5, 0.5, -0.1, 0.7).normalized();
  for (const bool is_radial : {false, true}) {
    d.modes = is_radial ? pack_modes(AxisMode::kLimited, AxisMode::kFree, AxisMode::kFree) | kRadialDiscrepancy
                        : pack_modes(AxisMode::kLocked, AxisMode::kLimited, AxisMode::kUnilateral);
    d.lower = d.upper = Vector3(0.05, 0.1, 0.0);
    d.compliance = {0.01, 0.03, 0.002};
    const auto energy_at = [&](double t) {
      const auto moved = [&](const Vector3& point, const Vector3& x, const Vector3& v, const Vector3& w) {
        return Vector3(x + t * v + exp_rotation(t * w) * (point - x));
      };
      const Vector3 error = moved(d.point2, x2, v2, w2) - moved(d.point1, x1, v1, w1);
      const Matrix3 axes = to_rotation_matrix(exp_rotation(t * w1) * d.axes);
      if (is_radial) return 0.5 * std::pow(error.norm() - 0.05, 2) / 0.01;
      const Vector3 along = axes.transpose() * error - Vector3(0.0, 0.1, 0.0);
      const double third = std::min(0.0, along.z());
      return 0.5 * (along.x() * along.x() / 0.01 + along.y() * along.y() / 0.03 + third * third / 0.002);
    };
    Problem problem;
    problem.add_body(2.0, x1, v1, {0, 0, 0});
    problem.add_body(1.0, x2, v2, {0, 0, 0});
    for (int k = 0; k < 3; ++k) {
      problem.angular_velocity[static_cast<std::size_t>(k)] = w1[k];
      problem.angular_velocity[static_cast<std::size_t>(3 + k)] = w2[k];
    }
    problem.add_joint(0, 1, d);
    problem.solve();
    const double power = problem.reaction(0).dot(v1) + problem.torque(0).dot(w1) + problem.reaction(1).dot(v2) +
                         problem.torque(1).dot(w2);
    constexpr double kDt = 1e-5;
    // a central difference is off by its square, and rounding over it
    EXPECT_NEAR(power, -(energy_at(kDt) - energy_at(-kDt)) / (2.0 * kDt), 1e-7 * std::fabs(power)) << is_radial;
    EXPECT_GT(std::fabs(power), 1.0);
    EXPECT_LT((problem.reaction(0) + problem.reaction(1)).norm(), 1e-12);
    const Vector3 moment =
        problem.torque(0) + problem.torque(1) + x1.cross(problem.reaction(0)) + x2.cross(problem.reaction(1));
    EXPECT_LT(moment.norm(), 1e-12);
  }
}

// A bob on a rod, and a spring that pulls it along and across: the rod bears what comes along.
TEST(Reactions, OfARodKnowTheSpringBesideIt) {
  Problem problem = swinging();
  Discrepancy spring = rod(bob_at() + Vector3(0.4, 0, 0), bob_at());
  spring.lower.x() = spring.upper.x() = 0.1;
  spring.compliance.x() = 0.01;
  problem.add_joint(kNone, 0, spring);
  problem.solve();
  // a pull of 30 N along x, of which sin 0.4 is along the rod
  EXPECT_NEAR(problem.force(1).x(), -30.0, 1e-12);
  EXPECT_NEAR(problem.force(0).x(), -(kTension + 30.0 * std::sin(0.4)), 1e-12);
  EXPECT_EQ(problem.residual(), 0.0);
}

TEST(Reactions, OfASpringThatOverflowsAreRefused) {
  Problem problem;
  problem.add_body(2.0, {0, 0, 0}, {0, 0, 0}, {0, 0, 0});
  Discrepancy d = soft_along_x(AxisMode::kLocked, 1e10);
  d.compliance.x() = 1e-300;
  problem.add_joint(kNone, 0, d);
  EXPECT_THAT([&] { problem.solve(); },
              ::testing::ThrowsMessage<Refusal>(::testing::HasSubstr("a reaction is not finite")));
  problem.compliance[0] = std::numeric_limits<double>::quiet_NaN();
  EXPECT_THAT([&] { problem.solve(); },
              ::testing::ThrowsMessage<Refusal>(::testing::HasSubstr("compliance, row 0: nan is not finite")));
}

// A wheel that steers at a about s = y and rolls at b about r = z. Steered, r turns towards x, and with it the rolling: w' has
// a b along x, so that the camber bears I_x a b + (I_z - I_y) a b. The moments here are (1, 2, 3).
TEST(Reactions, OfACamberAreTheGyroscopicCouple) {
  Problem problem;
  problem.add_body(1.0, {0, 0, 0}, {0, 0, 0}, {0, 0, 0});
  problem.angular_velocity = {0, 1.5, 4.0};
  problem.add_joint(kNone, 0, swing_row(Vector3::UnitY(), Vector3::UnitZ(), 0.5 * 3.14159265358979323846));
  problem.solve();
  EXPECT_LT((problem.torque(0) - Vector3((1.0 + 3.0 - 2.0) * 1.5 * 4.0, 0, 0)).norm(), 1e-13);
}

// A twist that was closed when the step began holds in a trial state in which the joint is bent otherwise, as a lock does.
TEST(Reactions, OfATwistAtItsLimitHoldWhileTheBendChanges) {
  constexpr double kLimit = 0.4;
  JointLimits limits;
  limits.upper = kLimit;
  const auto frame_at = [&](double bend) {
    return Quaternion(exp_rotation(bend * Vector3::UnitZ()) * exp_rotation(kLimit * Vector3::UnitX()));
  };
  for (const double bend : {0.5, 0.9}) {
    const Quaternion now = frame_at(bend);
    Problem held, limited;
    for (Problem* problem : {&held, &limited}) {
      problem->add_body(1.0, {0, 0, 0}, {0, 0, 0}, {0, 0, 0});
      set_vector(problem->wrench, 1, Vector3(3, 1, 0));
      set_quaternion(problem->orientation, 0, frame_at(0.7));
      problem->begin_step();
      set_quaternion(problem->orientation, 0, now);
    }
    double scale = 0.0;
    held.add_joint(kNone, 0, twist_row(Quaternion::Identity(), now, AxisMode::kLocked, &scale));
    limited.add_joint(kNone, 0, limited_twist_row(Quaternion::Identity(), now, JointBodies{}, limits));
    held.solve(), limited.solve();
    EXPECT_LT(held.force(0).x(), -1.0) << bend;
    EXPECT_NEAR(limited.force(0).x(), held.force(0).x(), 1e-13) << bend;
  }
}

// A stage that is beyond a single limit and comes back looks like what passes it a turn later.
TEST(Reactions, OfATwistAtItsLimitHoldWhicheverTurnIsTold) {
  JointLimits limits;
  limits.upper = 0.4;
  const Quaternion start = exp_rotation(limits.upper * Vector3::UnitX()),
                   now = exp_rotation((limits.upper + 1e-5) * Vector3::UnitX());
  JointBodies bodies;
  bodies.time_step = bodies.elapsed = 0.01;
  bodies.spin2 = bodies.start_spin2 = -5e-6 / bodies.time_step * Vector3::UnitX();
  const Discrepancy told = limited_twist_row(Quaternion::Identity(), now, bodies, limits);
  EXPECT_LT((told.point2 - told.point1).dot(Vector3::UnitX()), -5.0);
  Problem problem;
  problem.add_body(1.0, {0, 0, 0}, {0, 0, 0}, {0, 0, 0});
  set_vector(problem.wrench, 1, Vector3(3, 0, 0));
  set_quaternion(problem.orientation, 0, start);
  problem.begin_step();
  set_quaternion(problem.orientation, 0, now);
  problem.add_joint(kNone, 0, told);
  problem.solve();
  EXPECT_NEAR(problem.force(0).x(), -3.0, 1e-13);
  // what leaves it when the step begins is free
  problem.start_angular_velocity[0] = -1e-3;
  problem.solve();
  EXPECT_EQ(problem.force(0).x(), 0.0);
}

TEST(Reactions, RefuseARequestThatIsImpossible) {
  Problem problem = swinging();
  problem.wrench[1] = std::numeric_limits<double>::quiet_NaN();
  EXPECT_THAT([&] { problem.solve(); },
              ::testing::ThrowsMessage<Refusal>(::testing::HasSubstr("wrench, row 0: nan is not finite")));
  problem = swinging();
  problem.discrepancy_body[1] = 5;
  EXPECT_THAT([&] { problem.solve(); }, ::testing::ThrowsMessage<Refusal>(::testing::HasSubstr("does not exist")));
  // a mark of the end of the step
  problem = swinging();
  problem.mode[0] |= kForcesApplied;
  EXPECT_THAT([&] { problem.solve(); }, ::testing::ThrowsMessage<Refusal>(::testing::HasSubstr("is no mode")));
}

// A body that two pins hold cannot turn: what they miss is finite as long as its terms are.
TEST(Reactions, OverflowOnlyWhereTheirTermsDo) {
  const auto spinning = [](double speed) {
    Problem problem;
    problem.add_body(2.0, bob_at(), {0, 0, 0}, {0, -1, 0});
    problem.angular_velocity[2] = speed;
    problem.add_joint(kNone, 0, pin(bob_at() + Vector3(1, 0, 0)));
    problem.add_joint(kNone, 0, pin(bob_at() - Vector3(0, 1, 0)));
    return problem;
  };
  const auto missed_at = [&](double speed) {
    Problem problem = spinning(speed);
    problem.solve();
    return problem.residual();
  };
  EXPECT_GT(missed_at(1.0), 0.1);
  EXPECT_NEAR(missed_at(1e100), 1e200 * missed_at(1.0), 1e190);
  Problem problem = spinning(1e200);
  EXPECT_THAT([&] { problem.solve(); },
              ::testing::ThrowsMessage<Refusal>(::testing::HasSubstr("a reaction is not finite")));
}

}  // namespace
}  // namespace gravitas
