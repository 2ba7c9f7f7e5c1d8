// What single methods promise of free and forced bodies: invariants, exactness, history, accuracy, stiffness.
#include <gtest/gtest.h>

#include <cmath>
#include <limits>

#include "plugin_sdk/conformance/draw.h"
#include "plugin_sdk/math/transcendental.h"
#include "tests/sanitized.h"
#include "tests/workers/integrator/integrator_problem.h"

namespace gravitas::test {
namespace {

double energy(const FreeBody& body) {
  return kinetic_energy(body.mass, body.moments, body.state.pose.orientation, body.state.twist);
}
Vector3 spin(const FreeBody& body) {
  return angular_momentum(body.mass, body.moments, {Vector3::Zero(), body.state.pose.orientation}, body.state.twist);
}
double angle_apart(const Quaternion& a, const Quaternion& b) { return log_rotation(a * b.conjugate()).norm(); }

FreeBody tumbling_box() {
  FreeBody body{.mass = 10.0, .moments = Vector3(0.97 / 1.2, 0.82 / 1.2, 0.17 / 1.2)};
  body.state.twist = {Vector3(-2, 2, 8), Vector3(0.1, 5, 0.1)};
  body.wrench.force = Vector3(0, 0, -98);
  return body;
}
const Quaternion kTumbled(0.2251645634139581639, -0.6199275624994524883, -0.2770291506871945918, 0.6987457236403101407);

// A point mass on a damped spring along x, from rest at 1 m: closed forms below.
void put_on_spring(IntegratorProblem* problem, double stiffness, double damping) {
  problem->wrench_is_constant = false;
  problem->bodies = {FreeBody{.mass = 1.0}};
  problem->bodies[0].state.pose.position = Vector3(1, 0, 0);
  problem->plugin.derivative = [=](const stage::IntegratorDerivativeRequest& q) {
    return std::vector<double>{-stiffness * q.position()[0] - damping * q.linear_velocity()[0], 0, 0, 0, 0, 0};
  };
}

// ---- SymplecticSplitting

// PROBLEMS 1, complex, at its targets: dt = 1 ms, angle 1e-8, E and L 1e-12 under gravity.
TEST(SymplecticSplitting, MeetsTheTumblingBox) {
  for (const double order : {2.0, 4.0, 6.0}) {
    IntegratorProblem problem("integrator_symplectic_splitting", {order});
    problem.bodies = {tumbling_box()};
    problem.time_step = 1e-3;
    const FreeBody start = problem.bodies[0];
    problem.steps(10000);
    const FreeBody& end = problem.bodies[0];
    EXPECT_LT(angle_apart(end.state.pose.orientation, kTumbled), 1e-8);
    const double rounding = 1e-12;
    EXPECT_LT((spin(end) - spin(start)).norm() / spin(start).norm(), rounding);
    const auto turning = [&](FreeBody b) {
      b.state.twist.linear.setZero();
      return energy(b);
    };
    EXPECT_NEAR(turning(end) / turning(start), 1.0, rounding);
    const auto total = [](const FreeBody& b) { return energy(b) + 98.0 * b.state.pose.position.z(); };
    // z, of 400 m, is a sum of 10,000 parts
    EXPECT_NEAR(total(end) / total(start), 1.0, 1e-10);
    const Vector3 right = 10.0 * start.state.twist.linear + 0.5 * 100.0 * Vector3(0, 0, -9.8);
    EXPECT_LT((end.state.pose.position - right).norm() / right.norm(), 1e-11);
  }
}

// ... and in one step of ten seconds.
TEST(SymplecticSplitting, IsExactInOneStep) {
  IntegratorProblem problem("integrator_symplectic_splitting", {2});
  problem.bodies = {tumbling_box()};
  problem.time_step = 10.0;
  problem.step();
  EXPECT_LT(angle_apart(problem.bodies[0].state.pose.orientation, kTumbled), 1e-12);
}

TEST(SymplecticSplitting, SpinsFastForManySteps) {
  IntegratorProblem problem("integrator_symplectic_splitting", {2});
  FreeBody body{.moments = Vector3(1, 0.9, 0.7)};
  body.state.twist.angular = Vector3(300, 500, 1e4);
  problem.bodies = {body};
  problem.time_step = 1e-3;
  problem.steps(harness::unless_sanitized(200000));
  const FreeBody& end = problem.bodies[0];
  // 2e5 roundings, not all independent
  EXPECT_NEAR(energy(end) / energy(body), 1.0, 1e-11);
  EXPECT_LT((spin(end) - spin(body)).norm() / spin(body).norm(), 1e-11);
  EXPECT_NEAR(end.state.pose.orientation.norm(), 1.0, 1e-15);
}

// A damped free rotor is one in slowed time.
TEST(SymplecticSplitting, IsExactForADampedRotor) {
  IntegratorProblem problem("integrator_symplectic_splitting", {4});
  FreeBody body = tumbling_box();
  body.wrench = {};
  body.damping = 0.5;
  problem.bodies = {body};
  problem.time_step = 0.01;
  problem.steps(400);
  IntegratorProblem undamped("integrator_symplectic_splitting", {4});
  undamped.bodies = {tumbling_box()};
  undamped.bodies[0].wrench = {};
  undamped.time_step = (1.0 - std::exp(-2.0)) / 0.5;
  undamped.step();
  EXPECT_LT(angle_apart(problem.bodies[0].state.pose.orientation, undamped.bodies[0].state.pose.orientation), 1e-11);
  EXPECT_LT((problem.bodies[0].state.twist.angular - std::exp(-2.0) * undamped.bodies[0].state.twist.angular).norm(),
            1e-11);
}

// The energy of a forced top does not drift.
TEST(SymplecticSplitting, KeepsTheEnergyOfAForcedTop) {
  for (const double order : {2.0, 4.0, 6.0}) {
    IntegratorProblem problem("integrator_symplectic_splitting", {order});
    problem.wrench_is_constant = false;
    problem.bodies = {FreeBody{.mass = 1.0}};
    problem.bodies[0].state = {{Vector3(1, 0, 0), Quaternion::Identity()}, {Vector3(0, 0.8, 0), Vector3(1, 2, 0.5)}};
    problem.plugin.derivative = [](const stage::IntegratorDerivativeRequest& q) {
      const Vector3 x = vector_at(q.position(), 0), arm = quaternion_at(q.orientation(), 0) * Vector3(0.1, 0.2, 0);
      const Vector3 f = -2.0 * (x + arm), t = arm.cross(f);
      return std::vector<double>{f.x(), f.y(), f.z(), t.x(), t.y(), t.z()};
    };
    const auto total = [&] {
      const FreeBody& b = problem.bodies[0];
      return energy(b) + (b.state.pose.position + b.state.pose.orientation * Vector3(0.1, 0.2, 0)).squaredNorm();
    };
    const double before = total();
    problem.time_step = 0.05;
    problem.steps(harness::unless_sanitized(10000));
    // what the order lets it wander, for good: (h w)^order / 12 and less
    EXPECT_NEAR(total() / before, 1.0, order == 2.0 ? 3e-3 : order == 4.0 ? 3e-6 : 1e-8) << order;
  }
}

TEST(SymplecticSplitting, RunsBackToItsStart) {
  for (const double order : {2.0, 4.0, 6.0}) {
    IntegratorProblem problem("integrator_symplectic_splitting", {order});
    problem.wrench_is_constant = false;
    problem.bodies = {FreeBody{.mass = 1.0}};
    problem.bodies[0].state = {{Vector3(1, 0, 0), Quaternion::Identity()}, {Vector3(0, 0.8, 0), Vector3(1, 2, 0.5)}};
    problem.plugin.derivative = [](const stage::IntegratorDerivativeRequest& q) {
      const Vector3 x = vector_at(q.position(), 0), f = -(1.0 + x.squaredNorm()) * x;
      return std::vector<double>{f.x(), f.y(), f.z(), 0, 0, 0};
    };
    const FreeBody start = problem.bodies[0];
    problem.time_step = 0.05;
    problem.steps(harness::unless_sanitized(20000));
    problem.bodies[0].state.twist = {-problem.bodies[0].state.twist.linear, -problem.bodies[0].state.twist.angular};
    problem.steps(harness::unless_sanitized(20000));
    // 40,000 roundings that act on phases for 2000 s
    EXPECT_LT((problem.bodies[0].state.pose.position - start.state.pose.position).norm(), 1e-9);
    // ... and of the spin, of 1e-12, on an angle of 4000 rad
    EXPECT_LT(angle_apart(problem.bodies[0].state.pose.orientation, start.state.pose.orientation), 1e-7);
  }
}

TEST(SymplecticSplitting, RefusesOtherOrders) {
  EXPECT_ANY_THROW(PluginUnderTest("integrator_symplectic_splitting", {3}));
  EXPECT_ANY_THROW(PluginUnderTest("integrator_symplectic_splitting", {5}));
}

TEST(SymplecticSplitting, TurnsPointMassesAsTheyTurn) {
  IntegratorProblem problem("integrator_symplectic_splitting", {4});
  MessageColumns request = PluginUnderTest::request_of(stage::Method::kIntegratorIntegrate);
  problem.bodies = {FreeBody{}};
  problem.bodies[0].state.twist = {Vector3(1, 0, 0), Vector3(0, 0, 3)};
  request = problem.request();
  request.f64("inertia") = {0, 0, 0};
  request.f64("inverse_inertia") = {0, 0, 0};
  const MessageColumns reply = problem.plugin.ask(stage::Method::kIntegratorIntegrate, request);
  EXPECT_LT(angle_apart(quaternion_at(reply.f64("orientation"), 0), exp_rotation(Vector3(0, 0, 0.3))), 1e-15);
  EXPECT_EQ(vector_at(reply.f64("angular_velocity"), 0), Vector3(0, 0, 3));
}

// ---- ImplicitMidpoint

TEST(ImplicitMidpoint, KeepsEnergyAndMomentumOfAFreeRotor) {
  for (const double h : {1e-3, 0.05, 0.2}) {
    IntegratorProblem problem("integrator_implicit_midpoint");
    FreeBody body = tumbling_box();
    body.wrench = {};
    problem.bodies = {body};
    problem.time_step = h;
    problem.steps(2000);
    // 2000 roundings and what the iteration leaves
    EXPECT_NEAR(energy(problem.bodies[0]) / energy(body), 1.0, 1e-12) << h;
    EXPECT_LT((spin(problem.bodies[0]) - spin(body)).norm() / spin(body).norm(), 1e-12) << h;
  }
}

// The energy of a linear spring is kept whatever its stiffness and the step.
TEST(ImplicitMidpoint, KeepsTheEnergyOfASpring) {
  for (const double k : {1.0, 1e4, 1e10}) {
    IntegratorProblem problem("integrator_implicit_midpoint");
    put_on_spring(&problem, k, 0.0);
    problem.time_step = 1.0 / 60.0;
    problem.steps(600);
    const Vector3 x = problem.bodies[0].state.pose.position, v = problem.bodies[0].state.twist.linear;
    EXPECT_NEAR((v.squaredNorm() + k * x.squaredNorm()) / k, 1.0, 1e-10) << k;
  }
}

// Two bodies on one spring feel each other; their momentum stays.
TEST(ImplicitMidpoint, SolvesForBodiesTogether) {
  IntegratorProblem problem("integrator_implicit_midpoint");
  problem.wrench_is_constant = false;
  problem.bodies = {FreeBody{.mass = 1.0}, FreeBody{.mass = 3.0}};
  problem.bodies[1].state.pose.position = Vector3(1.1, 0, 0);
  problem.plugin.derivative = [](const stage::IntegratorDerivativeRequest& q) {
    const Vector3 d = vector_at(q.position(), 1) - vector_at(q.position(), 0);
    const Vector3 f = 1e8 * (d.norm() - 1.0) * d.normalized();
    return std::vector<double>{f.x(), f.y(), f.z(), 0, 0, 0, -f.x(), -f.y(), -f.z(), 0, 0, 0};
  };
  const auto total = [&] {
    double sum =
        0.5e8 *
        std::pow((problem.bodies[1].state.pose.position - problem.bodies[0].state.pose.position).norm() - 1.0, 2);
    for (const FreeBody& body : problem.bodies) sum += energy(body);
    return sum;
  };
  const double before = total();
  problem.time_step = 1.0 / 60.0;
  problem.steps(200);
  EXPECT_NEAR(total() / before, 1.0, 1e-8);
  const Vector3 momentum = problem.bodies[0].state.twist.linear + 3.0 * problem.bodies[1].state.twist.linear;
  // of some 3e3 N s
  EXPECT_LT(momentum.norm(), 1e-8);
}

// ---- BasicVerlet

TEST(BasicVerlet, GoesWhereVelocityVerletGoes) {
  IntegratorProblem position("integrator_basic_verlet"), velocity("integrator_verlet");
  for (IntegratorProblem* problem : {&position, &velocity}) {
    make_oscillator(problem, 2.0);
    problem->bodies[0].state.twist.linear = Vector3(0.3, 0, 0);
    problem->time_step = 0.05;
    problem->steps(200);
  }
  EXPECT_EQ(position.plugin_state.size(), 7U);
  // the same recurrence, otherwise summed
  EXPECT_NEAR(position.bodies[0].state.pose.position.x(), velocity.bodies[0].state.pose.position.x(), 1e-12);
  EXPECT_NEAR(position.bodies[0].state.twist.linear.x(), velocity.bodies[0].state.twist.linear.x(), 1e-12);
}

TEST(BasicVerlet, ForgetsItsHistoryWhereItMust) {
  const auto run = [](bool kicked, bool flagged, double step_after) {
    IntegratorProblem problem("integrator_basic_verlet");
    make_oscillator(&problem, 1.0);
    problem.time_step = 0.1;
    problem.steps(5);
    if (kicked) problem.bodies[0].state.twist.linear = Vector3(5, 0, 0);
    if (flagged) problem.changed = {1};
    problem.time_step = step_after;
    problem.step();
    return problem.bodies[0].state.pose.position.x();
  };
  // a kick that nobody tells of is not seen, one that is flagged is; so is another time step
  EXPECT_EQ(run(true, false, 0.1), run(false, false, 0.1));
  EXPECT_NEAR(run(true, true, 0.1) - run(false, false, 0.1), 0.1 * (5.0 + std::sin(0.5)), 1e-3);
  EXPECT_NEAR(run(false, false, 0.05), std::cos(0.55), 2e-4);
}

// ---- DormandPrince54

// Of either pair.
struct DormandPrinceCase {
  const char* plugin;
  double order;
  double accuracy, angle;  // of the tumbling box, and what it leaves, rad
  std::vector<double> settings(double wanted) const {
    return order == 5.0 ? std::vector<double>{wanted, 1.0} : std::vector<double>{wanted};
  }
};

class DormandPrince : public testing::TestWithParam<DormandPrinceCase> {};

INSTANTIATE_TEST_SUITE_P(Of, DormandPrince,
                         testing::Values(DormandPrinceCase{"integrator_dormand_prince54", 5.0, 3e-14, 1e-9},
                                         DormandPrinceCase{"integrator_dormand_prince853", 8.0, 3e-14, 1e-8}),
                         [](const auto& given) { return std::string(given.param.plugin); });

TEST_P(DormandPrince, MeetsTheTumblingBox) {
  IntegratorProblem problem(GetParam().plugin, GetParam().settings(GetParam().accuracy));
  problem.bodies = {tumbling_box()};
  problem.wrench_is_constant = false;
  problem.plugin.derivative = [](const stage::IntegratorDerivativeRequest&) {
    return std::vector<double>{0, 0, -98, 0, 0, 0};
  };
  problem.time_step = 10.0;
  problem.step();
  EXPECT_LT(angle_apart(problem.bodies[0].state.pose.orientation, kTumbled), GetParam().angle);
  EXPECT_LE(problem.error_estimate, 1.0);
  RecordProperty("derivatives", problem.plugin.derivatives_asked);
}

// The error follows the accuracy, and the work that root of it which is the order.
TEST_P(DormandPrince, ObeysItsAccuracy) {
  int asked_before = 0;
  for (const double accuracy : {1e-4, 1e-6, 1e-8, 1e-10, 1e-12}) {
    IntegratorProblem problem(GetParam().plugin, GetParam().settings(accuracy));
    make_oscillator(&problem, 3.0);
    problem.time_step = 2.0;
    problem.step();
    const BodyState& state = problem.bodies[0].state;
    const double error =
        std::hypot(state.pose.position.x() - std::cos(6.0), state.twist.linear.x() / 3.0 + std::sin(6.0));
    // local errors of some tens of inner steps add up
    EXPECT_LT(error, 50.0 * accuracy + 1e-14) << accuracy;
    EXPECT_GT(problem.plugin.derivatives_asked, asked_before);
    EXPECT_LT(problem.plugin.derivatives_asked, 60 * std::pow(accuracy, -1.0 / GetParam().order)) << accuracy;
    asked_before = problem.plugin.derivatives_asked;
  }
}

TEST_P(DormandPrince, RefusesWhatNoStepCanFollow) {
  IntegratorProblem problem(GetParam().plugin, GetParam().settings(1e-8));
  make_oscillator(&problem, 1.0);
  int calls = 0;
  problem.plugin.derivative = [&](const stage::IntegratorDerivativeRequest&) {
    return std::vector<double>{(++calls % 2) * 1e9, 0, 0, 0, 0, 0};
  };
  EXPECT_NE(problem.plugin.refusal(stage::Method::kIntegratorIntegrate, problem.request()), "");
}

// ---- Rosenbrock and Radau: PROBLEMS 27

// x'' = -k x - c x': closed form.
double spring_position(double k, double c, double t) {
  const double d = 0.25 * c * c - k;
  if (d == 0.0) return (1.0 + 0.5 * c * t) * std::exp(-0.5 * c * t);
  if (d < 0.0) {
    const double w = std::sqrt(-d);
    return std::exp(-0.5 * c * t) * (std::cos(w * t) + 0.5 * c / w * std::sin(w * t));
  }
  const double s = std::sqrt(d), slow = -k / (0.5 * c + s), fast = -0.5 * c - s;
  return (slow * std::exp(fast * t) - fast * std::exp(slow * t)) / (slow - fast);
}

class StiffMotion : public ::testing::TestWithParam<const char*> {};
INSTANTIATE_TEST_SUITE_P(With, StiffMotion, ::testing::Values("integrator_rosenbrock", "integrator_radau"));

TEST_P(StiffMotion, FollowsDampedSpringsOfAnyStiffness) {
  for (double k = 1e2; k < (harness::kSanitized ? 2e6 : 2e14); k *= 100.0) {
    for (const double ratio : {0.1, 1.0, 100.0}) {
      IntegratorProblem problem(GetParam(), {1e-6});
      const double c = 2.0 * ratio * std::sqrt(k);
      put_on_spring(&problem, k, c);
      problem.time_step = 1.0 / 60.0;
      problem.steps(60);
      const double x = problem.bodies[0].state.pose.position.x();
      EXPECT_NEAR(x, spring_position(k, c, 1.0), 1e-4) << k << ' ' << ratio;
    }
  }
}

TEST_P(StiffMotion, StaysBoundedWithoutDamping) {
  for (double k = 1e2; k < (harness::kSanitized ? 2e6 : 2e14); k *= 1e4) {
    IntegratorProblem problem(GetParam(), {1e-2});
    put_on_spring(&problem, k, 0.0);
    problem.bodies[0].state.pose.position = Vector3(1e-4, 0, 0);
    problem.time_step = 1.0 / 60.0;
    problem.steps(harness::unless_sanitized(10));
    const Vector3 x = problem.bodies[0].state.pose.position, v = problem.bodies[0].state.twist.linear;
    EXPECT_LE(v.squaredNorm() + k * x.squaredNorm(), 1.01e-8 * k) << k;
  }
}

// Linear drag c dt / m from 1e-2 to 1e6: the closed form e^(-c t), no change of sign.
TEST_P(StiffMotion, SlowsByAnyDrag) {
  for (double share = 1e-2; share < 2e6; share *= 10.0) {
    IntegratorProblem problem(GetParam(), {1e-6});
    problem.wrench_is_constant = false;
    problem.bodies = {FreeBody{.mass = 1.0}};
    problem.bodies[0].state.twist.linear = Vector3(1, 0, 0);
    problem.time_step = 1.0 / 60.0;
    const double c = share / problem.time_step;
    problem.plugin.derivative = [=](const stage::IntegratorDerivativeRequest& q) {
      return std::vector<double>{-c * q.linear_velocity()[0], 0, 0, 0, 0, 0};
    };
    double before = 1.0;
    for (int i = 1; i <= 10; ++i) {
      problem.step();
      const double v = problem.bodies[0].state.twist.linear.x();
      EXPECT_NEAR(v, std::exp(-i * share), 1e-5) << share;
      // within the accuracy that it was asked for
      EXPECT_GT(v, -1e-6) << share;
      EXPECT_LE(v, before + 1e-6) << share;
      before = v;
    }
  }
}

// Bodies on a stiff spring between them are solved for together.
TEST_P(StiffMotion, SolvesForBodiesTogether) {
  IntegratorProblem problem(GetParam(), {1e-8});
  problem.wrench_is_constant = false;
  problem.bodies = {FreeBody{.mass = 1.0}, FreeBody{.mass = 3.0}};
  problem.bodies[1].state.pose.position = Vector3(1.1, 0, 0);
  problem.bodies[1].state.twist.linear = Vector3(0, 0.4, 0);
  const double k = 1e10, c = 1e6;
  problem.plugin.derivative = [=](const stage::IntegratorDerivativeRequest& q) {
    const Vector3 d = vector_at(q.position(), 1) - vector_at(q.position(), 0);
    const Vector3 u = vector_at(q.linear_velocity(), 1) - vector_at(q.linear_velocity(), 0);
    const Vector3 f = (k * (d.norm() - 1.0) + c * u.dot(d.normalized())) * d.normalized();
    return std::vector<double>{f.x(), f.y(), f.z(), 0, 0, 0, -f.x(), -f.y(), -f.z(), 0, 0, 0};
  };
  problem.time_step = 1.0 / 60.0;
  problem.steps(harness::unless_sanitized(30));
  const Vector3 d = problem.bodies[1].state.pose.position - problem.bodies[0].state.pose.position;
  const Vector3 u = problem.bodies[1].state.twist.linear - problem.bodies[0].state.twist.linear;
  EXPECT_NEAR(d.norm(), 1.0, 1e-6);
  // the angular momentum of the pair about its centre stays: mu d x u, from 1.1 x 0.4
  // thousands of inner steps of 1e-8 each
  EXPECT_NEAR(d.cross(u).z(), 0.44, 5e-5);
  const Vector3 momentum = problem.bodies[0].state.twist.linear + 3.0 * problem.bodies[1].state.twist.linear;
  EXPECT_LT((momentum - Vector3(0, 1.2, 0)).norm(), 1e-9);
}

// One that turns 1e14 times in the step is not followed for ever.
TEST_P(StiffMotion, EndsWhateverTurns) {
  for (const double rate : {1e16, 1e40}) {
    IntegratorProblem problem(GetParam(), {1e-6});
    problem.wrench_is_constant = false;
    problem.bodies = {FreeBody{.moments = Vector3(1, 1, 1)}};
    problem.bodies[0].state.twist.angular = Vector3(0, 0, rate);
    int derivatives = 0;
    problem.plugin.derivative = [&](const stage::IntegratorDerivativeRequest&) {
      // some 1e4 inner steps
      EXPECT_LT(++derivatives, 100'000);
      return std::vector<double>{derivatives < 100'000 ? 0.0 : HUGE_VAL, 0, 0, 0, 0, 0};
    };
    problem.plugin.refusal(stage::Method::kIntegratorIntegrate, problem.request());
  }
}

// ---- all

class EveryIntegrator : public testing::TestWithParam<std::pair<const char*, std::vector<double>>> {};

// Far from the origin, for steps from a nanosecond to a second, for moments 1 : 1e-8: finite, unit, and at rest is at rest.
TEST_P(EveryIntegrator, BearsExtremeBodiesOrRefuses) {
  for (const double h : {1e-9, 1e-3, 1.0}) {
    if (harness::kSanitized && h == 1.0) continue;
    IntegratorProblem problem(GetParam().first, GetParam().second);
    problem.time_step = h;
    FreeBody needle{.moments = Vector3(1, 1, 1e-8)};
    needle.state = {{Vector3(1e8, -1e8, 1e8), Quaternion::Identity()}, {Vector3(1, 2, 3), Vector3(0, 0, 1e4)}};
    FreeBody rest;
    rest.state.pose.position = Vector3(1e8, 0, 0);
    problem.bodies = {needle, rest};
    if (!problem.plugin.refusal(stage::Method::kIntegratorIntegrate, problem.request()).empty()) continue;
    problem.steps(5);
    EXPECT_TRUE(problem.bodies[0].state.twist.angular.allFinite());
    EXPECT_NEAR(problem.bodies[0].state.pose.orientation.norm(), 1.0, 1e-14);
    EXPECT_LT((problem.bodies[0].state.pose.position - needle.state.pose.position - 5 * h * Vector3(1, 2, 3)).norm(),
              2e-7);
    EXPECT_EQ(problem.bodies[1].state.pose.position, rest.state.pose.position);
  }
}

// A step that was refused half way leaves nothing behind: the next one has the bits of a first one.
TEST_P(EveryIntegrator, ForgetsAStepThatWasRefused) {
  const auto start = [](IntegratorProblem* problem) {
    make_oscillator(problem, 30.0);
    problem->bodies[0].state.twist.angular = Vector3(1, 2, 3);
  };
  IntegratorProblem quiet(GetParam().first, GetParam().second);
  start(&quiet);
  const MessageColumns right = quiet.plugin.ask(stage::Method::kIntegratorIntegrate, quiet.request());
  for (int until = 0; until < quiet.plugin.derivatives_asked; until += 1 + until / 4) {
    IntegratorProblem problem(GetParam().first, GetParam().second);
    start(&problem);
    const auto spring = problem.plugin.derivative;
    int asked = 0;
    problem.plugin.derivative = [&](const stage::IntegratorDerivativeRequest& question) {
      if (++asked > until) return std::vector<double>{HUGE_VAL, 0, 0, 0, 0, 0};
      return spring(question);
    };
    EXPECT_NE(problem.plugin.refusal(stage::Method::kIntegratorIntegrate, problem.request()), "");
    problem.plugin.derivative = spring;
    const MessageColumns again = problem.plugin.ask(stage::Method::kIntegratorIntegrate, problem.request());
    for (const char* column : {"position", "orientation", "linear_velocity", "angular_velocity", "plugin_state"})
      EXPECT_EQ(again.f64(column), right.f64(column)) << column << " after " << until;
  }
}

// A force that is not finite: the step is refused by the name of the body.
TEST_P(EveryIntegrator, RefusesForcesThatAreNotFinite) {
  for (const double bad : {std::numeric_limits<double>::quiet_NaN(), std::numeric_limits<double>::infinity()}) {
    IntegratorProblem problem(GetParam().first, GetParam().second);
    problem.wrench_is_constant = false;
    problem.bodies = {FreeBody{}, FreeBody{}};
    problem.plugin.derivative = [=](const stage::IntegratorDerivativeRequest&) {
      return std::vector<double>{0, 0, 0, 0, 0, 0, bad, 0, 0, 0, 0, 0};
    };
    EXPECT_NE(problem.plugin.refusal(stage::Method::kIntegratorIntegrate, problem.request()).find("body 1"),
              std::string::npos);
  }
}

INSTANTIATE_TEST_SUITE_P(Integrators, EveryIntegrator,
                         testing::Values(std::pair{"integrator_euler", std::vector<double>{}},
                                         std::pair{"integrator_semi_implicit_euler", std::vector<double>{}},
                                         std::pair{"integrator_verlet", std::vector<double>{}},
                                         std::pair{"integrator_basic_verlet", std::vector<double>{}},
                                         std::pair{"integrator_rk4", std::vector<double>{}},
                                         std::pair{"integrator_rkmk4", std::vector<double>{}},
                                         std::pair{"integrator_implicit_midpoint", std::vector<double>{}},
                                         std::pair{"integrator_symplectic_splitting", std::vector<double>{4.0}},
                                         std::pair{"integrator_dormand_prince54", std::vector<double>{1e-8, 1}},
                                         std::pair{"integrator_dormand_prince853", std::vector<double>{1e-8}},
                                         std::pair{"integrator_rosenbrock", std::vector<double>{1e-6}},
                                         std::pair{"integrator_radau", std::vector<double>{1e-10}}),
                         [](const auto& given) { return std::string(given.param.first); });

}  // namespace
}  // namespace gravitas::test
