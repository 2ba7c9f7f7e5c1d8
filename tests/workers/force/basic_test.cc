// Force `Basic`: a force at a point, in world or body axes, over time, or as an impulse.
#include <gtest/gtest.h>

#include "plugin_sdk/conformance/draw.h"
#include "plugin_sdk/math/rotation.h"
#include "tests/workers/force/force_problem.h"

namespace gravitas::test {
namespace {

constexpr double kQuarter = 1.5707963267948966;  // of a turn, rad
// Rounding of a few products of numbers below ten.
constexpr double kRounding = 1e-14;

// The properties of the type, flattened.
struct BasicProperties {
  Vector3 force = Vector3::Zero();
  Vector3 point = Vector3::Zero();
  Vector3 torque = Vector3::Zero();
  bool in_body = false;
  std::vector<double> table = {};  // rows t, fx, fy, fz
  bool instantaneous = false;

  std::vector<double> flat() const {
    std::vector<double> numbers;
    for (const Vector3& v : {force, point, torque}) numbers.insert(numbers.end(), {v.x(), v.y(), v.z()});
    numbers.push_back(in_body ? 1 : 0);
    numbers.push_back(static_cast<double>(table.size() / 4));
    numbers.insert(numbers.end(), table.begin(), table.end());
    numbers.push_back(instantaneous ? 1 : 0);
    return numbers;
  }
};

class BasicForce : public testing::Test {
 protected:
  ForceAnswer ask(const BasicProperties& properties, const ForcedBody& body = {}, double time = 0.0) {
    return ask_wrench(&force_, "Basic", properties.flat(), body, time);
  }
  static bool is_nothing(const Wrench& wrench) { return wrench.force.isZero(0.0) && wrench.torque.isZero(0.0); }
  PluginUnderTest force_{"force_basic"};
};

TEST_F(BasicForce, AtTheCentreIsTheForceAndNoTorque) {
  const ForceAnswer answer = ask({.force = {1, 2, 3}});
  EXPECT_EQ(answer.wrench.force, Vector3(1, 2, 3));
  EXPECT_EQ(answer.wrench.torque, Vector3::Zero());
  EXPECT_TRUE(is_nothing(answer.impulse));
  EXPECT_EQ(answer.potential, 0.0);
}

TEST_F(BasicForce, AtAPointTurnsByItsArm) {
  // a push along y, one metre out along x, turns about z
  const ForceAnswer answer = ask({.force = {0, 3, 0}, .point = {1, 0, 0}});
  EXPECT_EQ(answer.wrench.force, Vector3(0, 3, 0));
  EXPECT_EQ(answer.wrench.torque, Vector3(0, 0, 3));
  EXPECT_EQ(ask({.force = {0, 3, 0}, .point = {1, 0, 0}, .torque = {5, 0, -1}}).wrench.torque, Vector3(5, 0, 2));
}

TEST_F(BasicForce, ThePointMovesWithTheGeometry) {
  ForcedBody body;
  body.pose = {Vector3(100, 200, 300), exp_rotation(Vector3(0, 0, kQuarter))};
  body.geometry.position = Vector3(0.5, 0, 0);
  // the point is 1.5 m from the centre along the body's x, which points along the world's y
  const ForceAnswer answer = ask({.force = {2, 0, 0}, .point = {1, 0, 0}}, body);
  EXPECT_EQ(answer.wrench.force, Vector3(2, 0, 0));
  EXPECT_LT((answer.wrench.torque - Vector3(0, 0, -3)).norm(), kRounding);
}

TEST_F(BasicForce, InBodyAxesTurnsWithTheGeometry) {
  ForcedBody body;
  body.pose.orientation = exp_rotation(Vector3(0, 0, kQuarter));
  const ForceAnswer answer = ask({.force = {2, 0, 0}, .point = {0, 1, 0}, .torque = {0, 3, 0}, .in_body = true}, body);
  EXPECT_LT((answer.wrench.force - Vector3(0, 2, 0)).norm(), kRounding);
  EXPECT_LT((answer.wrench.torque - Vector3(-3, 0, -2)).norm(), kRounding);
}

// Turning the whole world turns the answer.
TEST_F(BasicForce, InBodyAxesIsTheSameInATurnedWorld) {
  conformance::Draw random(1);
  for (int i = 0; i < 100; ++i) {
    const BasicProperties properties = {
        .force = random.vector(5.0), .point = random.vector(1.0), .torque = random.vector(5.0), .in_body = true};
    ForcedBody body, turned;
    body.pose = random.pose(3.0);
    body.geometry = turned.geometry = random.pose(1.0);
    const Pose turn = random.pose(3.0);
    turned.pose = compose(turn, body.pose);
    const Wrench first = ask(properties, body).wrench, second = ask(properties, turned).wrench;
    EXPECT_LT((second.force - turn.orientation * first.force).norm(), kRounding);
    EXPECT_LT((second.torque - turn.orientation * first.torque).norm(), 10 * kRounding);
  }
}

// ---- tables -------------------------------------------------------------------------------------

TEST_F(BasicForce, ATableIsLinearBetweenItsRowsAndConstantOutside) {
  const BasicProperties properties = {.force = {99, 99, 99},  // the table replaces it
                                      .table = {1, 0, 0, 0, 3, 4, -8, 2, 4, 4, 0, 0}};
  const auto at = [&](double time) { return ask(properties, {}, time).wrench.force; };
  EXPECT_EQ(at(-5.0), Vector3(0, 0, 0));
  EXPECT_EQ(at(1.0), Vector3(0, 0, 0));
  EXPECT_EQ(at(1.5), Vector3(1, -2, 0.5));
  EXPECT_EQ(at(2.0), Vector3(2, -4, 1));
  EXPECT_EQ(at(3.0), Vector3(4, -8, 2));
  EXPECT_EQ(at(3.5), Vector3(4, -4, 1));
  EXPECT_EQ(at(4.0), Vector3(4, 0, 0));
  EXPECT_EQ(at(1e9), Vector3(4, 0, 0));
}

TEST_F(BasicForce, ATableOfOneRowIsConstant) {
  const BasicProperties properties = {.table = {2, 1, 2, 3}};
  for (const double time : {0.0, 2.0, 5.0}) EXPECT_EQ(ask(properties, {}, time).wrench.force, Vector3(1, 2, 3)) << time;
}

TEST_F(BasicForce, ATableActsAtThePointAndInTheAxesOfTheForce) {
  ForcedBody body;
  body.pose.orientation = exp_rotation(Vector3(0, 0, kQuarter));
  const ForceAnswer answer = ask({.point = {0, 1, 0}, .in_body = true, .table = {0, 0, 0, 0, 1, 2, 0, 0}}, body, 0.5);
  EXPECT_LT((answer.wrench.force - Vector3(0, 1, 0)).norm(), kRounding);
  EXPECT_LT((answer.wrench.torque - Vector3(0, 0, -1)).norm(), kRounding);
}

TEST_F(BasicForce, RefusesATableWhoseTimesDoNotAscend) {
  const auto refusal = [&](std::vector<double> table) {
    const BasicProperties properties = {.table = std::move(table)};
    const ForceProblem problem{0.0, {type_id("Basic")}, {properties.flat()}, {ForcedBody{}}, {0, 0}};
    return force_.refusal(stage::Method::kForceWrenches, problem.request());
  };
  EXPECT_EQ(refusal({1, 0, 0, 0, 0.5, 1, 0, 0}), "application 0: Table: times must ascend");
  EXPECT_EQ(refusal({1, 0, 0, 0, 1, 1, 0, 0, 1, 2, 0, 0}), "application 0: Table: more than two rows of one time");
}

TEST_F(BasicForce, ATableJumpsWhereTwoRowsHaveOneTime) {
  const BasicProperties properties = {.table = {0, 0, 0, 0, 1, 2, 0, 0, 1, 5, 0, 0, 2, 7, 0, 0}};
  const auto at = [&](double time) { return ask(properties, {}, time).wrench.force.x(); };
  EXPECT_EQ(at(0.5), 1.0);
  EXPECT_EQ(at(std::nextafter(1.0, 0.0)), std::nextafter(2.0, 0.0));
  EXPECT_EQ(at(1.0), 5.0);
  EXPECT_EQ(at(1.5), 6.0);
}

// ---- impulses -----------------------------------------------------------------------------------

TEST_F(BasicForce, InstantaneousIsAnImpulseAndNoForce) {
  ForcedBody body;
  body.pose.orientation = exp_rotation(Vector3(0, 0, kQuarter));
  const ForceAnswer answer =
      ask({.force = {0, 3, 0}, .point = {0, -1, 0}, .torque = {1, 0, 0}, .instantaneous = true}, body);
  EXPECT_TRUE(is_nothing(answer.wrench));
  EXPECT_EQ(answer.impulse.force, Vector3(0, 3, 0));
  // the point lies at world (1, 0, 0)
  EXPECT_LT((answer.impulse.torque - Vector3(1, 0, 3)).norm(), kRounding);
  EXPECT_EQ(answer.potential, 0.0);
  // its wrench is zero for ever
  EXPECT_EQ(answer.flags, std::uint32_t{kConstantWrench});
}

// ---- promises -----------------------------------------------------------------------------------

TEST_F(BasicForce, PromisesAConstantWrenchOnlyWhereItIsOne) {
  const Vector3 f(1, 0, 0);
  EXPECT_EQ(ask({.force = f}).flags, std::uint32_t{kConstantWrench});
  EXPECT_EQ(ask({.force = f, .torque = {1, 2, 3}}).flags, std::uint32_t{kConstantWrench});
  EXPECT_EQ(ask({.force = f, .point = {0, 1, 0}}).flags, 0U);
  EXPECT_EQ(ask({.force = f, .in_body = true}).flags, 0U);
  EXPECT_EQ(ask({.table = {0, 1, 0, 0, 1, 2, 0, 0}}).flags, 0U);
  ForcedBody off_centre;
  off_centre.geometry.position = Vector3(0, 0.1, 0);
  EXPECT_EQ(ask({.force = f}, off_centre).flags, 0U);
}

TEST_F(BasicForce, KeepsThePromise) {
  conformance::Draw random(2);
  for (int i = 0; i < 50; ++i) {
    const BasicProperties properties = {.force = random.vector(5.0), .torque = random.vector(5.0)};
    ForcedBody first, second;
    first.pose = random.pose(3.0), second.pose = random.pose(3.0);
    second.twist = {random.vector(1.0), random.vector(1.0)};
    second.geometry.orientation = random.rotation();
    const ForceAnswer now = ask(properties, first), later = ask(properties, second, 100.0);
    ASSERT_EQ(now.flags, std::uint32_t{kConstantWrench});
    EXPECT_EQ(now.wrench.force, later.wrench.force);
    EXPECT_EQ(now.wrench.torque, later.wrench.torque);
  }
}

}  // namespace
}  // namespace gravitas::test
