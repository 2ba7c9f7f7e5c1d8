// Reactions of joints in states whose tensions are known, redundant and contradicting joints, what is left out.
#include "plugin_sdk/solver/reactions.h"

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <limits>
#include <vector>

#include "plugin_sdk/body.h"
#include "plugin_sdk/discrepancy.h"

namespace gravitas {
namespace {

constexpr double kG = 9.81;

// Bodies without rotation unless said, and joints between them or to the world.
class Problem {
 public:
  std::uint32_t add_body(double mass, const Vector3& x, const Vector3& v, const Vector3& force) {
    const auto body = static_cast<std::uint32_t>(flags.size());
    flags.push_back(mass > 0.0 ? kMovable : kKinematic);
    inverse_mass.push_back(mass > 0.0 ? 1.0 / mass : 0.0);
    append(inertia, Vector3(1, 2, 3));
    append(inverse_inertia, mass > 0.0 ? Vector3(1, 1.0 / 2, 1.0 / 3) : Vector3::Zero());
    drag.push_back(0.0);
    append(position, x);
    orientation.insert(orientation.end(), {1, 0, 0, 0});
    append(linear_velocity, v);
    append(angular_velocity, Vector3::Zero());
    append(wrench, force), append(wrench, Vector3::Zero());
    acceleration.insert(acceleration.end(), 6, 0.0);
    return body;
  }

  void add_joint(std::uint32_t one, std::uint32_t two, const Discrepancy& d) {
    discrepancy_body.insert(discrepancy_body.end(), {one, two});
    append(point1, d.point1), append(point2, d.point2), append(velocity, d.velocity);
    correction.push_back(d.correction);
    axes.insert(axes.end(), {d.axes.w(), d.axes.x(), d.axes.y(), d.axes.z()});
    mode.push_back(d.modes);
    append(lower, d.lower), append(upper, d.upper), append(compliance, d.compliance), append(damping, d.damping);
    append(maximum_force, d.maximum_force);
  }

  void solve() {
    using Request = stage::SolverReactionsRequest;
    const auto column = [](const auto& values) { return gravitas_column{values.data(), values.size()}; };
    const std::array<gravitas_column, Request::kColumnCount> request = {column(flags),
                                                                        column(inverse_mass),
                                                                        column(inertia),
                                                                        column(inverse_inertia),
                                                                        column(drag),
                                                                        column(position),
                                                                        column(orientation),
                                                                        column(linear_velocity),
                                                                        column(angular_velocity),
                                                                        column(wrench),
                                                                        column(acceleration),
                                                                        column(discrepancy_body),
                                                                        column(point1),
                                                                        column(point2),
                                                                        column(velocity),
                                                                        column(correction),
                                                                        column(axes),
                                                                        column(mode),
                                                                        column(lower),
                                                                        column(upper),
                                                                        column(compliance),
                                                                        column(damping),
                                                                        column(maximum_force)};
    reaction_.assign(6 * flags.size(), 0.0), force_.assign(3 * mode.size(), 0.0);
    std::array<gravitas_reply_column, 3> reply = {
        {{reaction_.data(), reaction_.size(), 0}, {force_.data(), force_.size(), 0}, {&residual_, 1, 0}}};
    solve_reactions(Request(request.data()), stage::SolverReactionsReply(reply.data()));
  }

  Vector3 reaction(std::size_t body) const { return vector_at(reaction_, 2 * body); }
  Vector3 torque(std::size_t body) const { return vector_at(reaction_, 2 * body + 1); }
  Vector3 force(std::size_t joint) const { return vector_at(force_, joint); }
  double residual() const { return residual_; }

  std::vector<std::uint32_t> flags, discrepancy_body, mode;
  std::vector<double> inverse_mass, inertia, inverse_inertia, drag, position, orientation, linear_velocity,
      angular_velocity, wrench, acceleration, point1, point2, velocity, correction, axes, lower, upper, compliance,
      damping, maximum_force;

 private:
  static void append(std::vector<double>& column, const Vector3& v) { column.insert(column.end(), v.begin(), v.end()); }

  std::vector<double> reaction_, force_;
  double residual_ = 0.0;
};

Discrepancy rod(const Vector3& from, const Vector3& to) {
  Discrepancy d;
  d.point1 = from, d.point2 = to;
  d.axes = Quaternion::FromTwoVectors(Vector3::UnitX(), to - from);
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
  Problem problem;
  problem.add_body(0.0, {0, 0, 0}, {0, 0, 0}, {0, 0, 0});
  problem.add_body(0.0, {0, 0, 0}, {0, 0, 0}, {0, 0, 0});
  problem.add_body(1.0, {0, 0, 0}, {0, 0, 0}, {0, 0, 0});
  problem.acceleration[0] = 1.0, problem.acceleration[6] = -1.0;
  problem.add_joint(0, 2, pin({0, 0, 0}));
  problem.add_joint(1, 2, pin({0, 0, 0}));
  problem.solve();
  EXPECT_NEAR(problem.residual(), std::sqrt(2.0), 1e-12);
  EXPECT_LT(problem.reaction(2).norm(), 1e-12);
}

TEST(Reactions, AreNoneOfWhatGivesWayOrIsBounded) {
  Discrepancy soft = pin(bob_at()), bounded = pin(bob_at()), rope = rod({0, 0, 0}, bob_at()), damper = pin(bob_at());
  soft.compliance = Vector3::Constant(1e-6);
  bounded.maximum_force = Vector3::Constant(1e6);
  rope.lower.x() = 0.0;
  damper.modes = pack_modes(AxisMode::kDriven, AxisMode::kFriction, AxisMode::kUnilateral);
  damper.damping = Vector3::Constant(3.0);
  for (const Discrepancy& d : {soft, bounded, rope, damper}) {
    Problem problem;
    problem.add_body(2.0, bob_at(), {5, 0, 0}, {0, -1, 0});
    problem.add_joint(kNone, 0, d);
    problem.solve();
    EXPECT_EQ(problem.reaction(0), Vector3::Zero());
  }
}

TEST(Reactions, RefuseARequestThatIsImpossible) {
  Problem problem = swinging();
  problem.wrench[1] = std::numeric_limits<double>::quiet_NaN();
  EXPECT_THAT([&] { problem.solve(); },
              ::testing::ThrowsMessage<Refusal>(::testing::HasSubstr("wrench, row 0: nan is not finite")));
  problem = swinging();
  problem.discrepancy_body[1] = 5;
  EXPECT_THAT([&] { problem.solve(); }, ::testing::ThrowsMessage<Refusal>(::testing::HasSubstr("does not exist")));
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
