// Jacobians of the shipped forces: of springs between bodies, which are in closed form, and of those by differences where the
// slope is known.
#include <gtest/gtest.h>

#include <cmath>
#include <map>

#include "plugin_sdk/conformance/draw.h"
#include "plugin_sdk/math/rotation.h"
#include "plugin_sdk/wrench_jacobian.h"
#include "tests/workers/force/force_problem.h"

namespace gravitas::test {
namespace {

using conformance::Draw;

constexpr stage::Method kJacobians = stage::Method::kForceJacobians;

using Pair = std::pair<std::uint32_t, std::uint32_t>;
std::map<Pair, JacobianBlock> blocks_of(PluginUnderTest* plugin, const ForceProblem& problem) {
  const MessageColumns reply = plugin->ask(kJacobians, problem.request());
  const std::vector<std::uint32_t>& bodies = reply.u32("block_body");
  std::map<Pair, JacobianBlock> sums;
  for (std::size_t i = 0; i < bodies.size() / 2; ++i) {
    const auto at = sums.try_emplace({bodies[2 * i], bodies[2 * i + 1]}, JacobianBlock::Zero()).first;
    at->second += Eigen::Map<const JacobianBlock>(&reply.f64("block")[kBlockNumbers * i]);
  }
  return sums;
}

using Wrenches = Eigen::Matrix<double, Eigen::Dynamic, 1>;
Wrenches wrenches_of(PluginUnderTest* plugin, const ForceProblem& problem) {
  const MessageColumns reply = plugin->ask(stage::Method::kForceWrenches, problem.request());
  Wrenches sum = Wrenches::Zero(6 * static_cast<Eigen::Index>(problem.bodies.size()));
  for (std::size_t i = 0; i < problem.applications.size() / 2; ++i)
    sum.segment<6>(6 * static_cast<Eigen::Index>(problem.applications[2 * i + 1])) +=
        Eigen::Map<const Eigen::Matrix<double, 6, 1>>(&reply.f64("wrench")[6 * i]);
  return sum;
}

void move(ForcedBody* body, int number, double by) {
  const Vector3 change = by * Vector3::Unit(number % 3);
  if (number < 3) body->pose.position += change;
  if (number >= 3 && number < 6) body->pose = displaced(body->pose, Vector3::Zero(), change);
  if (number >= 6) (number < 9 ? body->twist.linear : body->twist.angular) += change;
}

// Against central differences of all wrenches.
void expect_slopes(PluginUnderTest* plugin, ForceProblem problem, double tolerance) {
  constexpr double kMoved = 1e-5;
  const std::map<Pair, JacobianBlock> came = blocks_of(plugin, problem);
  for (std::uint32_t by = 0; by < problem.bodies.size(); ++by) {
    const ForcedBody before = problem.bodies[by];
    for (int number = 0; number < 12; ++number) {
      move(&problem.bodies[by], number, kMoved);
      Wrenches slope = wrenches_of(plugin, problem);
      problem.bodies[by] = before;
      move(&problem.bodies[by], number, -kMoved);
      slope = (slope - wrenches_of(plugin, problem)) / (2.0 * kMoved);
      problem.bodies[by] = before;
      for (std::uint32_t body = 0; body < problem.bodies.size(); ++body) {
        const auto found = came.find({body, by});
        Eigen::Matrix<double, 6, 1> block = Eigen::Matrix<double, 6, 1>::Zero();
        if (found != came.end()) block = found->second.col(number);
        const auto right = slope.segment<6>(6 * static_cast<Eigen::Index>(body));
        EXPECT_LT((block - right).cwiseAbs().maxCoeff(), tolerance * (1.0 + right.cwiseAbs().maxCoeff()))
            << "wrench of body " << body << " by number " << number << " of body " << by;
      }
    }
  }
}

// Three bodies on one spring that is anchored at a fourth, and one on a spring to the world.
TEST(Jacobians, OfSpringsAreSlopes) {
  PluginUnderTest plugin("force_spring");
  Draw draw(11);
  for (const double rest_length : {0.0, 0.7, 5.0}) {
    ForceProblem problem;
    for (int i = 0; i < 4; ++i)
      problem.bodies.push_back(
          {.pose = draw.pose(2.0), .geometry = draw.pose(0.5), .twist = {draw.vector(2.0), draw.vector(2.0)}});
    problem.types = {type_id("Spring"), type_id("Spring")};
    const double none = std::nan("");
    problem.properties = {{120.0, 3.0, rest_length, 0.1, 0.2, -0.3, 3.0, -0.4, 0.5, 0.6},
                          {40.0, 1.5, rest_length, 0.0, 0.3, 0.2, none, 1.0, 2.0, 3.0}};
    problem.applications = {0, 0, 0, 1, 0, 2, 0, 3, 1, 1};
    expect_slopes(&plugin, problem, 1e-7);
    EXPECT_EQ(blocks_of(&plugin, problem).size(), 10U);
    // who does not answer at the anchor has no blocks there
    problem.applications = {0, 0};
    expect_slopes(&plugin, problem, 1e-7);
    EXPECT_EQ(blocks_of(&plugin, problem).size(), 2U);
  }
}

// A spring without length has no direction.
TEST(Jacobians, OfASpringWithoutLengthAreFinite) {
  PluginUnderTest plugin("force_spring");
  ForceProblem problem;
  problem.bodies = {ForcedBody{}};
  problem.types = {type_id("Spring")};
  problem.properties = {{120.0, 3.0, 0.5, 0, 0, 0, std::nan(""), 0, 0, 0}};
  problem.applications = {0, 0};
  EXPECT_TRUE(blocks_of(&plugin, problem).at({0, 0}).isZero(0.0));
}

// -c v - q |v| v
TEST(Jacobians, OfDragAreThoseOfItsLaw) {
  PluginUnderTest plugin("force_drag");
  ForceProblem problem;
  problem.bodies = {{.twist = {Vector3(3, 0, 4), Vector3(1, 2, 3)}}, {.twist = {Vector3(1e4, 0, 0), Vector3::Zero()}}};
  problem.types = {type_id("Drag")};
  problem.properties = {{2.0, 0.5}};
  problem.applications = {0, 0, 0, 1};
  const std::map<Pair, JacobianBlock> blocks = blocks_of(&plugin, problem);
  ASSERT_EQ(blocks.size(), 2U);
  for (std::uint32_t body = 0; body < 2; ++body) {
    const Vector3 v = problem.bodies[body].twist.linear;
    JacobianBlock right = JacobianBlock::Zero();
    right.block<3, 3>(0, 6) =
        -2.0 * Matrix3::Identity() - 0.5 * (v.norm() * Matrix3::Identity() + v * v.transpose() / v.norm());
    EXPECT_LT((blocks.at({body, body}) - right).cwiseAbs().maxCoeff(), 1e-8 * right.cwiseAbs().maxCoeff());
  }
}

// A constant force is in no block. One in the axes of its body turns along: d(R f) = r x R f.
TEST(Jacobians, OfAForceInBodyAxesTurn) {
  PluginUnderTest plugin("force_basic");
  Draw draw(12);
  ForceProblem problem;
  problem.bodies = {{.pose = draw.pose(3.0)}, {.pose = draw.pose(3.0)}};
  problem.types = {type_id("Basic"), type_id("Basic")};
  const std::vector<double> world = {1, 2, 3, 0, 0, 0, 0, 0, 0, 0, 0, 0}, body = {1, 2, 3, 0, 0, 0, 0, 0, 0, 1, 0, 0};
  problem.properties = {world, body};
  problem.applications = {0, 0, 1, 1};
  const std::map<Pair, JacobianBlock> blocks = blocks_of(&plugin, problem);
  ASSERT_EQ(blocks.size(), 1U);
  JacobianBlock right = JacobianBlock::Zero();
  right.block<3, 3>(0, 3) = -skew(problem.bodies[1].pose.orientation * Vector3(1, 2, 3));
  EXPECT_LT((blocks.at({1, 1}) - right).cwiseAbs().maxCoeff(), 1e-8);
}

}  // namespace
}  // namespace gravitas::test
