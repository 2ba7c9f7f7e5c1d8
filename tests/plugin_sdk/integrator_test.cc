// What integrators are written with: trial columns, the loop over bodies, derivatives, damping.
#include "plugin_sdk/integrator.h"

#include <gtest/gtest.h>

#include <cmath>
#include <cstring>
#include <limits>
#include <string>
#include <vector>

#include "plugin_sdk/conformance/draw.h"
#include "plugin_sdk/math/rotation.h"
#include "tests/plugin_sdk/integrator_call.h"

namespace gravitas {
namespace {

using conformance::Draw;
using Request = stage::IntegratorIntegrateRequest;
using Reply = stage::IntegratorIntegrateReply;
using test::Source;
using test::Step;

bool same_bits(const BodyState& a, const BodyState& b) {
  TrialColumns first, second;
  first.resize(1), second.resize(1);
  first.set(0, a), second.set(0, b);
  const auto equal = [](const std::vector<double>& x, const std::vector<double>& y) {
    return std::memcmp(x.data(), y.data(), x.size() * sizeof(double)) == 0;
  };
  return equal(first.position, second.position) && equal(first.orientation, second.orientation) &&
         equal(first.linear_velocity, second.linear_velocity) && equal(first.angular_velocity, second.angular_velocity);
}

TEST(TrialColumns, GiveBackEachBodysState) {
  Draw random(1);
  TrialColumns columns;
  columns.resize(4);
  EXPECT_EQ(columns.position.size(), 12U);
  EXPECT_EQ(columns.orientation.size(), 16U);
  std::vector<BodyState> states;
  for (std::size_t i = 0; i < 4; ++i) {
    states.push_back({random.pose(3.0), {random.vector(1.0), random.vector(1.0)}});
    columns.set(i, states.back());
  }
  for (std::size_t i = 0; i < 4; ++i) EXPECT_TRUE(same_bits(columns.at(i), states[i]));
  // w stands first
  EXPECT_EQ(columns.orientation[4], states[1].pose.orientation.w());
}

// ---- bodies -------------------------------------------------------------------------------------

TEST(ForEachBody, AsksForMovableBodiesOnly) {
  Step step({kMovable, 0, kMovable | kHasShape, kKinematic, kHasShape | kUnbounded});
  std::vector<std::size_t> asked;
  for_each_body(step.request(), step.reply(), [&](std::size_t body, const BodyState& state) {
    asked.push_back(body);
    EXPECT_TRUE(same_bits(state, step.state.at(body)));
    BodyState next = state;
    next.pose.position = Vector3(1, 2, 3);
    return next;
  });
  EXPECT_EQ(asked, (std::vector<std::size_t>{0, 2}));
  EXPECT_EQ(step.trial.at(0).pose.position, Vector3(1, 2, 3));
  EXPECT_EQ(step.trial.at(2).pose.position, Vector3(1, 2, 3));
}

TEST(ForEachBody, LeavesEveryBitOfImmovableBodies) {
  Step step({0, kHasShape, kHasShape | kUnbounded});
  // what arithmetic would lose: the sign of zero, a norm off by rounding, a denormal
  step.state.position[0] = -0.0;
  step.state.position[1] = std::numeric_limits<double>::denorm_min();
  step.state.orientation[3] *= 1.0 + 1e-12;
  for_each_body(step.request(), step.reply(), [](std::size_t, const BodyState&) -> BodyState {
    ADD_FAILURE() << "asked for an immovable body";
    return {};
  });
  for (std::size_t i = 0; i < 3; ++i) EXPECT_TRUE(same_bits(step.trial.at(i), step.state.at(i))) << i;
}

TEST(ForEachBody, KinematicBodiesGoOnWithTheirVelocities) {
  Step step({kKinematic});
  for_each_body(step.request(), step.reply(), [](std::size_t, const BodyState& s) { return s; });
  const BodyState before = step.state.at(0), after = step.trial.at(0);
  EXPECT_EQ(after.twist.linear, before.twist.linear);
  EXPECT_EQ(after.twist.angular, before.twist.angular);
  EXPECT_EQ(after.pose.position, Vector3(before.pose.position + 0.1 * before.twist.linear));
  const Quaternion turn = after.pose.orientation * before.pose.orientation.conjugate();
  EXPECT_LT((log_rotation(turn) - 0.1 * before.twist.angular).norm(), 1e-15);
}

TEST(ForEachBody, RefusesAStateThatIsNotFinite) {
  Step step({kMovable, kMovable});
  try {
    for_each_body(step.request(), step.reply(), [](std::size_t body, const BodyState& s) {
      BodyState next = s;
      if (body == 1) next.twist.angular.y() = std::numeric_limits<double>::infinity();
      return next;
    });
    FAIL() << "an infinite spin was answered";
  } catch (const Refusal& refusal) {
    EXPECT_TRUE(std::string(refusal.what()).starts_with("body 1 comes to a state that is not finite"))
        << refusal.what();
  }
}

TEST(ForEachBody, FillsEveryColumnAndEstimatesNoError) {
  Step step({kMovable, 0});
  for_each_body(step.request(), step.reply(), [](std::size_t, const BodyState& s) { return s; });
  EXPECT_EQ(step.count(Reply::kPosition), 6U);
  EXPECT_EQ(step.count(Reply::kOrientation), 8U);
  EXPECT_EQ(step.count(Reply::kLinearVelocity), 6U);
  EXPECT_EQ(step.count(Reply::kAngularVelocity), 6U);
  EXPECT_EQ(step.count(Reply::kPluginState), 0U);
  EXPECT_EQ(step.count(Reply::kErrorEstimate), 1U);
  EXPECT_EQ(step.error_estimate[0], 0.0);
}

// ---- damping ------------------------------------------------------------------------------------

TEST(DampingFactor, IsTheExponential) {
  EXPECT_EQ(damping_factor(0.0, 0.1), 1.0);
  for (const double c : {1e-6, 0.1, 1.0, 25.0, 300.0})
    // two roundings of the exponent and one of the exponential
    EXPECT_NEAR(damping_factor(c, 0.1) / std::exp(-0.1 * c), 1.0, 1e-14) << c;
}

TEST(DampingFactor, NeverChangesSign) {
  for (const double c : {20.0, 1e3, 1e6, 1e300}) {
    EXPECT_GE(damping_factor(c, 0.1), 0.0) << c;
    EXPECT_LT(damping_factor(c, 0.1), 0.2) << c;
  }
  EXPECT_EQ(damping_factor(1e6, 1.0), 0.0);
}

// Far from rounding, whether a series or a difference gives it; the reference has 11 bits more, and the series' first terms.
TEST(DampedDistance, IsTheSecondIntegral) {
  EXPECT_EQ(damped_distance(0.0, 0.5), 0.125);
  for (double share = 1e-12; share < 1e9; share *= 1.7) {
    const long double z = share;
    const long double exact = share < 1e-3 ? 0.5L - z / 6 + z * z / 24 - z * z * z / 120 + z * z * z * z / 720
                                           : (z + std::expm1(-z)) / (z * z);
    EXPECT_NEAR(damped_distance(4.0 * share, 0.25) * 16.0 / static_cast<double>(exact), 1.0, 2e-15) << share;
  }
}

// v' = a - c v, x' = v.
TEST(DampedMotion, SolvesItsEquations) {
  const Twist start = {Vector3(1, 2, 3), Vector3(-1, 0, 2)};
  const Acceleration a = {Vector3(0, -10, 1), Vector3(3, 0.5, 0)};
  for (const double c : {0.0, 0.3, 8.0}) {
    constexpr double kTime = 0.7, kMoment = 1e-5;
    const DampedMotion now = damped_motion(start, a, c, kTime);
    const DampedMotion before = damped_motion(start, a, c, kTime - kMoment);
    const DampedMotion after = damped_motion(start, a, c, kTime + kMoment);
    const auto rate = [](const Vector3& from, const Vector3& to) { return Vector3((to - from) / (2.0 * kMoment)); };
    EXPECT_LT((rate(before.moved, after.moved) - now.twist.linear).norm(), 1e-8) << c;
    EXPECT_LT((rate(before.turned, after.turned) - now.twist.angular).norm(), 1e-8) << c;
    EXPECT_LT((rate(before.twist.linear, after.twist.linear) - (a.linear - c * now.twist.linear)).norm(), 1e-7) << c;
    EXPECT_LT((rate(before.twist.angular, after.twist.angular) - (a.angular - c * now.twist.angular)).norm(), 1e-7)
        << c;
  }
}

// ---- derivatives --------------------------------------------------------------------------------

std::int32_t never(const gravitas_column*, gravitas_reply_column*) {
  ADD_FAILURE() << "asked although the wrench is constant";
  return GRAVITAS_CALLBACK_FAILED;
}

TEST(Derivatives, OfAConstantWrenchAreNotAskedFor) {
  Step step({kMovable});
  step.wrench[0] = 5.0;
  Source source(never);
  std::vector<double> room;
  const Request request = step.request();
  Derivatives derivatives(request, source.host(), &room);
  EXPECT_EQ(derivatives.wrenches_at_start().data(), step.wrench.data());
  EXPECT_EQ(derivatives.wrenches(9.0, step.trial).data(), step.wrench.data());
  EXPECT_EQ(source.asked, 0);
}

TEST(Derivatives, AreAskedForInTheStateAndAtTheTimeOfTheQuestion) {
  Step step({kMovable, 0});
  step.constant[0] = 0;
  using Question = stage::IntegratorDerivativeRequest;
  double time = 0.0;
  std::vector<double> positions, turning;
  Source source([&](const gravitas_column* columns, gravitas_reply_column* reply) {
    const Question question(columns);
    time = question.time();
    positions.assign(question.position().begin(), question.position().end());
    turning.assign(question.angular_velocity().begin(), question.angular_velocity().end());
    const stage::ReplyColumn<double> wrench = stage::IntegratorDerivativeReply(reply).wrench();
    for (int i = 0; i < 12; ++i) wrench.push(100.0 + i);
    return std::int32_t{GRAVITAS_OK};
  });
  std::vector<double> room;
  const Request request = step.request();
  Derivatives derivatives(request, source.host(), &room);

  const std::span<const double> at_start = derivatives.wrenches_at_start();
  EXPECT_EQ(time, 2.0);
  EXPECT_EQ(positions, step.state.position);
  EXPECT_EQ(turning, step.state.angular_velocity);
  ASSERT_EQ(at_start.size(), 12U);
  EXPECT_EQ(at_start[11], 111.0);

  step.trial.set(1, {{Vector3(7, 8, 9), Quaternion::Identity()}, {}});
  EXPECT_EQ(derivatives.wrenches(2.05, step.trial).size(), 12U);
  EXPECT_EQ(time, 2.05);
  EXPECT_EQ(positions, step.trial.position);
  EXPECT_EQ(source.asked, 2);
}

TEST(Derivatives, ThatCannotBeHadEndTheCall) {
  Step step({kMovable});
  step.constant[0] = 0;
  const Request request = step.request();
  std::vector<double> room;
  Source failing([](auto*, auto*) { return std::int32_t{GRAVITAS_CALLBACK_FAILED}; });
  EXPECT_THROW(Derivatives(request, failing.host(), &room).wrenches_at_start(), std::runtime_error);
  Source short_answer([](auto*, gravitas_reply_column* reply) {
    stage::ReplyColumn<double>(reply).push(1, 2, 3);
    return std::int32_t{GRAVITAS_OK};
  });
  EXPECT_THROW(Derivatives(request, short_answer.host(), &room).wrenches_at_start(), std::runtime_error);
}

TEST(Derivatives, AccelerationIsNewtonsAndEulers) {
  Step step({kMovable, kMovable});
  Source source(never);
  std::vector<double> room;
  const Request request = step.request();
  const Derivatives derivatives(request, source.host(), &room);
  const std::vector<double> wrench = {9, 9, 9, 9, 9, 9, 2, 4, -6, 1, 2, 3};
  const BodyState state = step.state.at(1);
  const Acceleration a = derivatives.acceleration(1, state, wrench);
  EXPECT_EQ(a.linear, Vector3(1, 2, -3));
  // tau = I_w alpha + w x I_w w, with the world's inertia
  const Matrix3 inertia = world_inertia(state.pose.orientation, Vector3(1, 2, 4));
  const Vector3& w = state.twist.angular;
  const Vector3 torque = inertia * a.angular + w.cross(inertia * w);
  EXPECT_LT((torque - Vector3(1, 2, 3)).norm(), 1e-13);
  EXPECT_TRUE(same_bits(derivatives.start(1), state));
  EXPECT_EQ(derivatives.size(), 2U);
}

}  // namespace
}  // namespace gravitas
