// Forces `Drag`, `Vortex` and `Spring` against their closed forms.
#include <gtest/gtest.h>

#include <cmath>
#include <limits>

#include "plugin_sdk/conformance/draw.h"
#include "plugin_sdk/math/rotation.h"
#include "tests/workers/force/force_problem.h"

namespace gravitas::test {
namespace {

// Rounding of a few products of numbers below a thousand.
constexpr double kFieldRounding = 1e-12;

// ---- Drag

TEST(Drag, ResistsLinearlyAndQuadratically) {
  PluginUnderTest drag("force_drag");
  ForcedBody body;
  body.twist = {Vector3(3, 4, 0), Vector3(0, 0, 7)};
  EXPECT_EQ(ask_wrench(&drag, "Drag", {2, 0}, body).wrench.force, Vector3(-6, -8, 0));
  EXPECT_EQ(ask_wrench(&drag, "Drag", {0, 2}, body).wrench.force, Vector3(-30, -40, 0));
  EXPECT_EQ(ask_wrench(&drag, "Drag", {1, 2}, body).wrench.torque, Vector3::Zero());
  EXPECT_EQ(ask_wrench(&drag, "Drag", {1, 2}, ForcedBody{}).wrench.force.norm(), 0.0);
  EXPECT_EQ(ask_wrench(&drag, "Drag", {1, 2}, body).flags, 0U);
}

// ---- Vortex

std::vector<double> vortex(const Vector3& centre, const Vector3& axis, double strength, double lift, double inflow,
                           double radius) {
  return {centre.x(), centre.y(), centre.z(), axis.x(), axis.y(), axis.z(), strength, lift, inflow, radius};
}

TEST(Vortex, IsStrongestAtItsRadius) {
  PluginUnderTest force("force_vortex");
  ForcedBody body;
  body.pose.position = Vector3(1 + 2, 50, 3);
  // the way out is +x, around +y leads to -z
  const ForceAnswer at = ask_wrench(&force, "Vortex", vortex({1, 0, 3}, {0, 5, 0}, 10, 4, 3, 2), body);
  EXPECT_LT((at.wrench.force - Vector3(-3, 2, -10)).norm(), kFieldRounding);
  EXPECT_EQ(at.wrench.torque, Vector3::Zero());
  for (const double r : {0.1, 1.0, 1.9, 2.1, 5.0, 100.0}) {
    body.pose.position = Vector3(1 + r, 0, 3);
    const Vector3 f = ask_wrench(&force, "Vortex", vortex({1, 0, 3}, {0, 1, 0}, 10, 0, 0, 2), body).wrench.force;
    const double rho = r / 2;
    EXPECT_NEAR(f.norm(), 10 * 2 * rho / (1 + rho * rho), kFieldRounding);
    EXPECT_LT(f.norm(), 10.0);
  }
  body.pose.position = Vector3(1, -7, 3);
  const Vector3 on_axis = ask_wrench(&force, "Vortex", vortex({1, 0, 3}, {0, 1, 0}, 10, 4, 3, 2), body).wrench.force;
  EXPECT_LT((on_axis - Vector3(0, 4, 0)).norm(), kFieldRounding);
}

TEST(Vortex, RefusesAnAxisWithoutDirection) {
  PluginUnderTest force("force_vortex");
  const ForceProblem problem{
      0.0, {type_id("Vortex")}, {vortex(Vector3::Zero(), Vector3::Zero(), 1, 0, 0, 1)}, {ForcedBody{}}, {0, 0}};
  EXPECT_EQ(force.refusal(stage::Method::kForceWrenches, problem.request()),
            "application 0: Axis: a direction has a length above 0");
}

// ---- Spring

struct SpringProperties {
  double stiffness = 10, damping = 0, rest_length = 0;
  Vector3 attachment = Vector3::Zero();
  double anchor_body = std::numeric_limits<double>::quiet_NaN();
  Vector3 anchor = Vector3::Zero();

  std::vector<double> flat() const {
    return {stiffness,      damping,     rest_length, attachment.x(), attachment.y(),
            attachment.z(), anchor_body, anchor.x(),  anchor.y(),     anchor.z()};
  }
};

class Spring : public testing::Test {
 protected:
  ForceAnswer ask(const SpringProperties& properties, const ForcedBody& body) {
    return ask_wrench(&spring_, "Spring", properties.flat(), body);
  }
  PluginUnderTest spring_{"force_spring"};
};

TEST_F(Spring, PullsToItsAnchor) {
  ForcedBody body;
  body.pose.position = Vector3(3, 4, 0);
  const ForceAnswer smooth = ask({}, body);
  EXPECT_LT((smooth.wrench.force - Vector3(-30, -40, 0)).norm(), kFieldRounding);
  EXPECT_NEAR(smooth.potential, 125.0, kFieldRounding);
  EXPECT_EQ(smooth.flags, std::uint32_t{kHasPotential});
  const ForceAnswer stretched = ask({.rest_length = 3}, body);
  EXPECT_LT((stretched.wrench.force - Vector3(-12, -16, 0)).norm(), kFieldRounding);
  EXPECT_NEAR(stretched.potential, 20.0, kFieldRounding);
  const ForceAnswer pressed = ask({.rest_length = 7}, body);
  EXPECT_LT((pressed.wrench.force - Vector3(12, 16, 0)).norm(), kFieldRounding);
  EXPECT_LT((ask({.anchor = {3, 0, 0}}, body).wrench.force - Vector3(0, -40, 0)).norm(), kFieldRounding);
}

TEST_F(Spring, DampsAlongItself) {
  ForcedBody body;
  body.pose.position = Vector3(0, 2, 0);
  body.twist.linear = Vector3(5, 3, 0);
  EXPECT_LT((ask({.stiffness = 0, .damping = 2, .rest_length = 2}, body).wrench.force - Vector3(0, -6, 0)).norm(),
            kFieldRounding);
  // the smooth form resists all of it
  EXPECT_LT((ask({.stiffness = 0, .damping = 2}, body).wrench.force - Vector3(-10, -6, 0)).norm(), kFieldRounding);
}

TEST_F(Spring, OfNoLengthHasNoDirection) {
  EXPECT_EQ(ask({.rest_length = 1}, ForcedBody{}).wrench.force, Vector3::Zero());
}

TEST_F(Spring, TurnsABodyByItsPoint) {
  ForcedBody body;
  body.pose = {Vector3(0, 0, 0), exp_rotation(Vector3(0, 0, 1.5707963267948966))};
  body.geometry.position = Vector3(0.5, 0, 0);
  body.twist.angular = Vector3(0, 0, 2);
  // the point, 1 m out along the body's x, is at (0, 1, 0) and moves along -x at 2 m/s
  const ForceAnswer answer = ask({.stiffness = 10, .damping = 3, .attachment = {0.5, 0, 0}, .anchor = {1, 1, 0}}, body);
  EXPECT_LT((answer.wrench.force - Vector3(10 + 6, 0, 0)).norm(), kFieldRounding);
  EXPECT_LT((answer.wrench.torque - Vector3(0, 0, -16)).norm(), kFieldRounding);
}

// Action is reaction, about any point, and the energy is counted once.
TEST_F(Spring, PullsBothBodiesAlike) {
  conformance::Draw random(1);
  for (int i = 0; i < 100; ++i) {
    ForceProblem problem;
    problem.types = {type_id("Spring")};
    // damped, the smooth form is no central force
    const bool smooth = i % 2 == 0;
    SpringProperties p{.stiffness = 7, .damping = smooth ? 0.0 : 2.0, .rest_length = smooth ? 0.0 : 0.7};
    p.attachment = random.vector(1.0), p.anchor = random.vector(1.0), p.anchor_body = 1;
    problem.properties = {p.flat()};
    for (int k = 0; k < 3; ++k) {
      ForcedBody body;
      body.pose = random.pose(3.0), body.geometry = random.pose(0.5);
      body.twist = {random.vector(2.0), random.vector(2.0)};
      problem.bodies.push_back(body);
    }
    problem.applications = {0, 0, 0, 1, 0, 2};
    const std::vector<ForceAnswer> answers = ask_wrenches(&spring_, problem);
    Vector3 force = Vector3::Zero(), torque = Vector3::Zero();
    for (std::size_t k = 0; k < 3; ++k) {
      force += answers[k].wrench.force;
      torque += answers[k].wrench.torque + problem.bodies[k].pose.position.cross(answers[k].wrench.force);
    }
    EXPECT_LT(force.norm(), kFieldRounding);
    EXPECT_LT(torque.norm(), 10 * kFieldRounding);
    EXPECT_EQ(answers[1].potential, 0.0);
  }
}

TEST_F(Spring, RefusesAnAnchorThatIsNoBody) {
  ForceProblem problem{0.0, {type_id("Spring")}, {SpringProperties{.anchor_body = 5}.flat()}, {ForcedBody{}}, {0, 0}};
  EXPECT_EQ(spring_.refusal(stage::Method::kForceWrenches, problem.request()),
            "application 0: AnchorBody is no row of the bodies");
}

}  // namespace
}  // namespace gravitas::test
