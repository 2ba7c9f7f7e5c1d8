// Force `Gravity`: m g at the centre of mass, and its potential.
#include <gtest/gtest.h>

#include <limits>

#include "plugin_sdk/conformance/draw.h"
#include "tests/workers/force/force_problem.h"

namespace gravitas::test {
namespace {

constexpr std::uint32_t kPromises = kConstantWrench | kHasPotential;

class Gravity : public testing::Test {
 protected:
  PluginUnderTest gravity_{"force_gravity"};
};

TEST_F(Gravity, PullsWithMassTimesAcceleration) {
  ForcedBody body;
  body.mass = 2.0;
  body.pose.position = Vector3(1, 10, -3);
  const ForceAnswer answer = ask_wrench(&gravity_, "Gravity", {0, -9.81, 0.5}, body);
  EXPECT_EQ(answer.wrench.force, Vector3(0, -19.62, 1));
  EXPECT_EQ(answer.wrench.torque, Vector3::Zero());
  EXPECT_EQ(answer.impulse.force, Vector3::Zero());
  EXPECT_EQ(answer.impulse.torque, Vector3::Zero());
  // U = -m g.x
  EXPECT_DOUBLE_EQ(answer.potential, 19.62 * 10 + 3.0);
  EXPECT_EQ(answer.flags, kPromises);
}

TEST_F(Gravity, RefusesWhatIsNotFinite) {
  for (const double bad : {std::numeric_limits<double>::quiet_NaN(), std::numeric_limits<double>::infinity(), 1e308}) {
    ForceProblem problem;
    problem.types = {type_id("Gravity")};
    problem.properties = {{0, bad, 0}};
    problem.bodies = {ForcedBody{.mass = 20.0}};
    problem.applications = {0, 0};
    EXPECT_EQ(gravity_.refusal(stage::Method::kForceWrenches, problem.request()),
              "application 0: the wrench on body 0 is not finite: the force's properties or the body's mass or state "
              "are not, or "
              "too large");
  }
}

// What a constant wrench with a potential promises: U(x) = U(x0) - f.(x - x0), f the same.
TEST_F(Gravity, KeepsItsPromises) {
  conformance::Draw random(1);
  for (int i = 0; i < 100; ++i) {
    const Vector3 g = random.vector(10.0);
    ForcedBody here, there;
    here.mass = there.mass = random.uniform(0.1, 5.0);
    here.pose = random.pose(5.0), there.pose = random.pose(5.0);
    here.geometry = there.geometry = random.pose(1.0);
    there.twist = {random.vector(3.0), random.vector(3.0)};
    const std::vector<double> properties = {g.x(), g.y(), g.z()};
    const ForceAnswer first = ask_wrench(&gravity_, "Gravity", properties, here);
    const ForceAnswer second = ask_wrench(&gravity_, "Gravity", properties, there, 17.0);
    EXPECT_EQ(first.wrench.force, second.wrench.force);
    EXPECT_EQ(second.wrench.torque, Vector3::Zero());
    const double work = first.wrench.force.dot(there.pose.position - here.pose.position);
    // sums of a few products below 1000
    EXPECT_NEAR(second.potential, first.potential - work, 1e-11);
  }
}

TEST_F(Gravity, AnswersEveryApplicationInOrder) {
  ForceProblem problem;
  problem.types = {type_id("Gravity"), type_id("Gravity")};
  problem.properties = {{0, -10, 0}, {1, 0, 0}};
  problem.bodies.resize(3);
  for (std::size_t i = 0; i < 3; ++i) problem.bodies[i].mass = 1.0 + static_cast<double>(i);
  problem.applications = {0, 2, 1, 0, 0, 0, 1, 2};
  const std::vector<ForceAnswer> answers = ask_wrenches(&gravity_, problem);
  ASSERT_EQ(answers.size(), 4U);
  EXPECT_EQ(answers[0].wrench.force, Vector3(0, -30, 0));
  EXPECT_EQ(answers[1].wrench.force, Vector3(1, 0, 0));
  EXPECT_EQ(answers[2].wrench.force, Vector3(0, -10, 0));
  EXPECT_EQ(answers[3].wrench.force, Vector3(3, 0, 0));
}

TEST_F(Gravity, RefusesApplicationsToNobody) {
  ForceProblem problem;
  problem.types = {type_id("Gravity")};
  problem.properties = {{0, -10, 0}};
  problem.bodies.resize(1);
  problem.applications = {0, 0, 0, 1};
  EXPECT_EQ(gravity_.refusal(stage::Method::kForceWrenches, problem.request()),
            "application 1 names a force or body that does not exist");
  problem.applications = {1, 0};
  EXPECT_EQ(gravity_.refusal(stage::Method::kForceWrenches, problem.request()),
            "application 0 names a force or body that does not exist");
}

TEST_F(Gravity, RefusesTooFewNumbers) {
  ForceProblem problem{0.0, {type_id("Gravity")}, {{0, -10}}, {ForcedBody{}}, {0, 0}};
  EXPECT_EQ(gravity_.refusal(stage::Method::kForceWrenches, problem.request()),
            "application 0: fewer numbers than the declared properties take");
}

}  // namespace
}  // namespace gravitas::test
