// What the Sequential solver promises of every answer: refusals, purity, bodies left alone; and the
// parts it is made of.
#include <gtest/gtest.h>

#include <cmath>
#include <functional>
#include <limits>
#include <string>

#include "plugin_sdk/plugin.h"
#include "plugin_sdk/solver/arrival.h"
#include "plugin_sdk/solver/coulomb_contact.h"
#include "plugin_sdk/solver/surface_perturbation.h"
#include "tests/workers/solver/solver_problem.h"
#include "workers/solver/sequential/sequential.h"

namespace gravitas {
namespace {

SolverProblem small_scene() {
  SolverProblem problem;
  const auto ground = problem.add_immovable();
  const auto a = problem.add_body({.mass = 2.0, .pose = {{0, 0.5, 0}, Quaternion::Identity()}, .linear = {1, -1, 0}});
  const auto b =
      problem.add_body({.mass = 1.0, .pose = {{1, 0.5, 0}, exp_rotation({0.1, 0.2, 0.3})}, .angular = {1, 2, 3}});
  problem.add_body(
      {.mass = 3.0, .pose = {{9, 9, 9}, exp_rotation({1, 2, 0})}, .linear = {0.1, 0.2, 0.3}, .angular = {3, 1, 2}});
  problem.make_trial({0, -9.81, 0});
  problem.add_discrepancy(a, b, problem.joint_at(a, b, {0.5, 0.5, 0}));
  problem.add_contact({.body1 = ground,
                       .body2 = a,
                       .point = {0, -0.005, 0},
                       .depth = 0.01,
                       .restitution = 0.5,
                       .static_friction = 0.6,
                       .dynamic_friction = 0.4,
                       .rolling = 0.01,
                       .perturbation = 0.05,
                       .key = 77});
  return problem;
}

SequentialSolver fresh() { return SequentialSolver(SequentialSettings{}); }

TEST(SequentialRequest, TheSameRequestGivesTheSameBytesWhateverWasAskedBefore) {
  SequentialSolver solver = fresh();
  const std::string first = small_scene().solve(solver).bytes();
  SolverProblem other = small_scene();
  other.linear_velocity[4] = -7.0;
  other.trial_linear_velocity[4] = -7.0;
  other.add_contact(
      {.body1 = 0, .body2 = 3, .point = {9, 8, 9}, .depth = 0.2, .static_friction = 1.0, .dynamic_friction = 1.0});
  EXPECT_NE(other.solve(solver).bytes(), first);
  SolverProblem empty;
  empty.solve(solver);
  EXPECT_EQ(small_scene().solve(solver).bytes(), first);
  EXPECT_EQ(small_scene().solve(fresh()).bytes(), first);
}

TEST(SequentialRequest, BodiesThatNothingTouchesKeepTheirTrialStateBitForBit) {
  const SolverProblem problem = small_scene();
  const SolverAnswer answer = problem.solve(fresh());
  for (const std::uint32_t body : {0U, 3U}) {
    EXPECT_EQ(answer.velocity(body), problem.trial_twist(body).linear);
    EXPECT_EQ(answer.turning(body), problem.trial_twist(body).angular);
    EXPECT_EQ(answer.translation(body), Vector3::Zero());
    EXPECT_EQ(answer.rotation(body), Vector3::Zero());
  }
  EXPECT_NE(answer.velocity(1), problem.trial_twist(1).linear);
}

TEST(SequentialRequest, NothingToDoIsSaid) {
  SolverProblem problem;
  problem.add_body({.linear = {1, 2, 3}});
  const SolverAnswer answer = problem.solve(fresh());
  EXPECT_EQ(answer.stop_reason[0], static_cast<std::uint32_t>(StopReason::kNothingToDo));
  EXPECT_EQ(answer.iterations[0], 0U);
  EXPECT_EQ(answer.residual[0], 0.0);
  EXPECT_EQ(answer.linear_velocity, problem.trial_linear_velocity);
}

TEST(SequentialRequest, RunningOutOfSweepsIsSaid) {
  const SolverAnswer answer = small_scene().solve(SequentialSolver(SequentialSettings{1, 1.0}));
  EXPECT_EQ(answer.stop_reason[0], static_cast<std::uint32_t>(StopReason::kIterations));
  EXPECT_GT(answer.residual[0], 0.0);
}

TEST(SequentialRequest, AnAnswerWithoutRoomIsCountedAndNotWritten) {
  // the first answer tells how much room it takes; the view itself keeps from writing
  struct Cramped {
    SequentialSolver solver = fresh();
    void solve(const stage::SolverSolveRequest& request, const stage::SolverSolveReply&) {
      gravitas_reply_column none[stage::SolverSolveReply::kColumnCount] = {};
      solver.solve(request, stage::SolverSolveReply(none));
      EXPECT_EQ(none[stage::SolverSolveReply::kPoseChange].count, 24U);
      EXPECT_EQ(none[stage::SolverSolveReply::kContactImpulse].count, 3U);
    }
  };
  small_scene().solve(Cramped{});
}

TEST(SequentialRequest, ImpossibleRequestsAreRefusedWithColumnAndRow) {
  const double nan = std::numeric_limits<double>::quiet_NaN();
  const double infinity = std::numeric_limits<double>::infinity();
  struct Case {
    std::function<void(SolverProblem&)> spoil;
    const char* names;
  };
  const Case cases[] = {
      {[](SolverProblem& p) { p.time_step = 0.0; }, "time_step"},
      {[&](SolverProblem& p) { p.time_step = nan; }, "time_step"},
      {[](SolverProblem& p) { p.theta = 1.5; }, "theta"},
      {[&](SolverProblem& p) { p.trial_linear_velocity[4] = nan; }, "trial_linear_velocity, row 1"},
      {[&](SolverProblem& p) { p.position[7] = infinity; }, "position, row 2"},
      {[](SolverProblem& p) { p.inverse_mass[2] = -1.0; }, "inverse_mass, row 2"},
      {[](SolverProblem& p) { p.inverse_inertia[5] = -1e-9; }, "inverse_inertia, row 1"},
      {[](SolverProblem& p) { p.trial_orientation[4] = 1.1; }, "trial_orientation, row 1"},
      {[](SolverProblem& p) { p.wrench.pop_back(); }, "wrench"},
      {[](SolverProblem& p) { p.discrepancy_body[1] = 4; }, "discrepancy_body, row 0"},
      {[](SolverProblem& p) { p.discrepancy_body[1] = 1; }, "discrepancy_body, row 0"},
      {[](SolverProblem& p) { p.mode[0] = 7; }, "mode, row 0"},
      {[](SolverProblem& p) { p.correction[0] = 1.01; }, "correction, row 0"},
      {[](SolverProblem& p) { p.compliance[1] = -1.0; }, "compliance, row 0"},
      {[](SolverProblem& p) {
         p.mode[0] = pack_modes(AxisMode::kFree, AxisMode::kLimited, AxisMode::kFree);
         p.lower[1] = 0.1;
       },
       "lower, row 0"},
      {[](SolverProblem& p) { p.contact_body[0] = kNone; }, "contact_body, row 0"},
      {[](SolverProblem& p) { p.contact_normal[1] = 0.999; }, "contact_normal, row 0"},
      {[&](SolverProblem& p) { p.contact_depth[0] = nan; }, "contact_depth, row 0"},
      {[](SolverProblem& p) { p.contact_material[kRestitution] = 1.1; }, "contact_material, row 0"},
      {[](SolverProblem& p) { p.contact_material[kStaticFriction] = -0.1; }, "contact_material, row 0"},
      {[](SolverProblem& p) { p.contact_warm_impulse.clear(); }, "contact_warm_impulse"},
      // finite, but the answer is not
      {[](SolverProblem& p) {
         p.trial_linear_velocity[4] = -1e308;
         p.linear_velocity[4] = -1e308;
       },
       "not finite"},
  };
  for (const Case& c : cases) {
    SolverProblem problem = small_scene();
    c.spoil(problem);
    try {
      problem.solve(fresh());
      ADD_FAILURE() << "not refused: " << c.names;
    } catch (const Refusal& refusal) {
      EXPECT_NE(std::string(refusal.what()).find(c.names), std::string::npos) << refusal.what();
    }
  }
}

TEST(SequentialRequest, DegenerateBodiesAreBorne) {
  // without moments, without mass but turning, both held, all contacts at one point, coincident
  // bodies
  SolverProblem problem = small_scene();
  for (std::size_t i = 0; i < 3; ++i) problem.inverse_inertia[3 + i] = 0.0;
  problem.inverse_mass[2] = 0.0;
  const auto held = problem.add_immovable();
  problem.add_discrepancy(0, held, Discrepancy{});
  problem.add_discrepancy(kNone, 1, problem.joint_at(kNone, 1, {0, 0.5, 0}));
  problem.add_contact({.body1 = 0, .body2 = held, .depth = 1.0});
  for (int i = 0; i < 5; ++i)
    problem.add_contact({.body1 = 1,
                         .body2 = 2,
                         .point = {0.5, 0.5, 0},
                         .depth = 1e-3,
                         .static_friction = 2.0,
                         .dynamic_friction = 1.0});
  const SolverAnswer answer = problem.solve(fresh());
  for (const double value : answer.linear_velocity) EXPECT_TRUE(std::isfinite(value));
  for (const double value : answer.pose_change) EXPECT_TRUE(std::isfinite(value));
  EXPECT_EQ(answer.velocity(2), problem.trial_twist(2).linear);
}

// ---- parts

TEST(SurfacePerturbation, PhiloxGivesItsPublishedNumbers) {
  using Words = std::array<std::uint32_t, 4>;
  // known answers of the Random123 distribution
  EXPECT_EQ(philox4x32({0, 0, 0, 0}, {0, 0}), (Words{0x6627e8d5U, 0xe169c58dU, 0xbc57ac4cU, 0x9b00dbd8U}));
  EXPECT_EQ(philox4x32({~0U, ~0U, ~0U, ~0U}, {~0U, ~0U}), (Words{0x408f276dU, 0x41c83b0eU, 0xa20bc7c6U, 0x6d5451fdU}));
  EXPECT_EQ(philox4x32({0x243f6a88U, 0x85a308d3U, 0x13198a2eU, 0x03707344U}, {0xa4093822U, 0x299f31d0U}),
            (Words{0xd16cfe09U, 0x94fdccebU, 0x5001e420U, 0x24126ea1U}));
}

TEST(SurfacePerturbation, LargeTiltsFallBackToTheNormal) {
  for (std::uint64_t key = 0; key < 100; ++key) {
    const Vector3 n = perturbed_normal(Vector3::UnitZ(), 1.5, key);
    EXPECT_NEAR(n.norm(), 1.0, 1e-15);
  }
  EXPECT_EQ(perturbed_normal(Vector3::UnitZ(), 0.0, 5), Vector3::UnitZ());
}

TEST(Arrival, SpeedOfAFallFromRestIsExact) {
  // y(t) = H - g t^2/2 hits the ground between two steps; both ends lie on the parabola
  const double g = 9.81, height = 1.0, h = 0.01;
  const double t = 0.45;
  const double gap = height - 0.5 * g * t * t;
  EXPECT_NEAR(arrival_speed(-g * t, -g * (t + h), gap, h), std::sqrt(2.0 * g * height), 1e-14);
  EXPECT_EQ(arrival_speed(0.0, -g * h, 0.0, h), 0.0);
  EXPECT_EQ(arrival_speed(-1.0, 0.5, 0.0, h), 0.0);
}

TEST(CoulombContact, EverySolutionObeysTheLaw) {
  std::uint64_t state = 12345;
  const auto draw = [&state] {
    state = state * 6364136223846793005ULL + 1442695040888963407ULL;
    return static_cast<double>(state >> 11) * 0x1p-53 * 2.0 - 1.0;
  };
  for (int trial = 0; trial < 5000; ++trial) {
    Matrix3 factor;
    for (int i = 0; i < 9; ++i) factor(i / 3, i % 3) = draw();
    const Matrix3 w = factor * factor.transpose() + 0.05 * Matrix3::Identity();
    const Vector3 q{draw(), draw(), draw()};
    const double target = 0.5 * (1.0 + draw());
    const double mu = 1.0 + draw();
    Vector3 impulse{0.0, draw(), draw()};
    ASSERT_TRUE(solve_coulomb_contact(w, w.inverse(), q, target, mu, &impulse)) << trial;
    const Vector3 u = q + w * impulse;
    const double slip = u.tail<2>().norm();
    const double tangent = impulse.tail<2>().norm();
    // conditioned by W of at most 60
    const double tolerance = 1e-11 * (1.0 + impulse.norm());
    EXPECT_GE(impulse.x(), 0.0);
    EXPECT_GE(u.x() - target, -tolerance) << trial;
    EXPECT_LE(std::min(impulse.x(), u.x() - target), tolerance) << trial;
    EXPECT_LE(tangent, mu * impulse.x() + tolerance);
    if (slip > 1e-6) {
      EXPECT_LE((impulse.tail<2>() + mu * impulse.x() * u.tail<2>() / slip).norm(), tolerance / slip) << trial;
    }
  }
}

}  // namespace
}  // namespace gravitas
