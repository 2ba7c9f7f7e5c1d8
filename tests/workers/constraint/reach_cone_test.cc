// The rows of an irregular reach cone: that of the regular cone which touches its edge and bends as it does, and at a corner
// outwards one of either piece.
#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <numbers>
#include <vector>

#include "plugin_sdk/math/rotation.h"
#include "tests/workers/constraint/joint_problem.h"

namespace gravitas::test {
namespace {

constexpr double kConeRounding = 2e-14;
constexpr double kRound = 2.0 * std::numbers::pi;
const Vector3 kConeAxis = Vector3(1.0, 2.0, -0.5).normalized();

struct EdgePoint {
  double azimuth, angle;
};
using Edge = std::vector<EdgePoint>;

// With corners outwards at the greater angles, and one whose first azimuth is beyond half a turn.
const std::vector<Edge> kEdges = {{{0.3, 0.4}, {1.8, 0.7}, {3.5, 0.35}, {5.0, 2.6}},
                                  {{4.0, 0.4}, {4.9, 0.7}, {5.6, 0.35}, {6.2, 0.6}},
                                  {{0.0, 0.08}, {2.1, 0.45}, {4.2, 0.9}}};

class ReachCone : public testing::TestWithParam<Edge> {
 protected:
  // A joint whose second body has turned to where its axis is in that direction.
  JointProblem turned_to(double azimuth, double angle) {
    const double none = std::numeric_limits<double>::quiet_NaN();
    std::vector<double> properties = {0.3, -0.2, 0.5, none, static_cast<double>(GetParam().size())};
    for (const EdgePoint& point : GetParam()) properties.insert(properties.end(), {point.azimuth, point.angle});
    properties.insert(properties.end(), {kConeAxis.x(), kConeAxis.y(), kConeAxis.z(), none, none});
    JointProblem socket(&plugin_, "Spherical");
    socket.bodies[0].pose = {{1, 2, 3}, exp_rotation({0.4, -1.0, 0.3})};
    socket.bodies[1].pose = {{0, -1, 2}, exp_rotation({-0.7, 0.2, 2.0})};
    socket.bind(properties);
    const Vector3 zero = (Vector3::UnitX() - kConeAxis.x() * kConeAxis).normalized();
    const Quaternion turn = exp_rotation(angle * kConeAxis.cross(exp_rotation(azimuth * kConeAxis) * zero));
    Pose& pose = socket.bodies[1].pose;
    pose.orientation = normalized(turn * pose.orientation);
    return socket;
  }

  static double error(const Discrepancy& d) { return to_rotation_matrix(d.axes).col(0).dot(d.point2 - d.point1); }

  PluginUnderTest plugin_{"constraint_spherical"};
};

INSTANTIATE_TEST_SUITE_P(Of, ReachCone, testing::ValuesIn(kEdges));

// So its error on the edge is of the third order of the way from where it was written: the odd part falls by 8 with half of the
// way, and the even one by 16.
TEST_P(ReachCone, RowsBendAsTheEdge) {
  for (std::size_t i = 0; i < GetParam().size(); ++i) {
    const bool is_last = i + 1 == GetParam().size();
    const EdgePoint from = GetParam()[i], to = GetParam()[is_last ? 0 : i + 1];
    const double width = to.azimuth - from.azimuth + (is_last ? kRound : 0.0);
    const auto at_edge = [&](double past) {
      return turned_to(from.azimuth + 0.5 * width + past,
                       0.5 * (from.angle + to.angle) + past / width * (to.angle - from.angle));
    };
    const JointProblem middle = at_edge(0.0);
    const Discrepancy row = middle.describe().at(1);
    const Vector3 axis = to_rotation_matrix(row.axes).col(0);
    const auto error_past = [&](double past) {
      const JointProblem there = at_edge(past);
      return axis.dot(
          error_at(row, middle.bodies[0].pose, middle.bodies[1].pose, there.bodies[0].pose, there.bodies[1].pose));
    };
    EXPECT_NEAR(error_past(0.0), 0.0, kConeRounding);
    const auto odd = [&](double way) { return 0.5 * (error_past(way) - error_past(-way)); };
    const auto even = [&](double way) { return 0.5 * (error_past(way) + error_past(-way)); };
    EXPECT_GT(std::fabs(odd(0.02)), 1e-8) << i;
    EXPECT_NEAR(odd(0.04) / odd(0.02), 8.0, 0.02) << i;
    EXPECT_NEAR(even(0.04) / even(0.02), 16.0, 0.1) << i;
  }
}

TEST_P(ReachCone, BothPiecesHoldAtACornerOutwards) {
  for (const EdgePoint& corner : GetParam())
    for (const double side : {-1e-9, 1e-9}) {
      const std::vector<Discrepancy> all = turned_to(corner.azimuth + side, corner.angle).describe();
      ASSERT_EQ(all.size(), 3U);
      EXPECT_NEAR(error(all[1]), 0.0, 1e-8) << corner.azimuth;
      EXPECT_NEAR(error(all[2]), 0.0, 1e-8) << corner.azimuth;
      EXPECT_EQ(all[1].upper.x(), 0.0) << corner.azimuth;
      EXPECT_EQ(all[2].upper.x(), corner.angle > 0.5 ? 0.0 : kUnlimited) << corner.azimuth;
    }
}

// A row of another piece is of no account where that piece is not: what lies inside the edge is free, however narrow it is there.
TEST_P(ReachCone, WhatLiesInsideIsFree) {
  const Edge& edge = GetParam();
  for (std::size_t i = 0; i < edge.size(); ++i) {
    const bool is_last = i + 1 == edge.size();
    const EdgePoint from = edge[i], to = edge[is_last ? 0 : i + 1];
    const double width = to.azimuth - from.azimuth + (is_last ? kRound : 0.0);
    for (double share = 0.02; share < 1.0; share += 0.04) {
      const double angle = from.angle + share * (to.angle - from.angle);
      const std::vector<Discrepancy> all = turned_to(from.azimuth + share * width, 0.99 * angle).describe();
      for (std::size_t row = 1; row < all.size(); ++row)
        if (all[row].upper.x() == 0.0) {
          EXPECT_LT(error(all[row]), 0.0) << i << ", " << share << ", row " << row;
        }
    }
  }
}

}  // namespace
}  // namespace gravitas::test
