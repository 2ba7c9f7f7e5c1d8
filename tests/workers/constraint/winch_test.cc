// Constraint `Winch`: what is paid out, wherever drum and load turn, and which turn it is.
#include <gtest/gtest.h>

#include <cmath>
#include <numbers>
#include <vector>

#include "plugin_sdk/conformance/draw.h"
#include "plugin_sdk/math/rotation.h"
#include "tests/workers/constraint/joint_problem.h"

namespace gravitas::test {
namespace {

constexpr double kDrumRadius = 0.2;

class OnADrum : public testing::Test {
 protected:
  // About z through the origin, which is where the drum is; of the end of a rope.
  static std::vector<double> properties(const Vector3& end, double slack = 0.0, bool is_taut = false) {
    const double absent = std::nan("");
    return {0,      0,      2,      kDrumRadius, end.x(), end.y(), end.z(),
            absent, absent, absent, slack,       absent,  absent,  is_taut ? 1.0 : 0.0};
  }
  static void turn(double angle, Pose* pose) { pose->orientation = exp_rotation(angle * Vector3::UnitZ()); }
  // What is too long, along the row.
  static double error(const Discrepancy& d) { return (d.point2 - d.point1).norm() - d.upper.x(); }

  PluginUnderTest plugin_{"constraint_winch"};
  conformance::Draw random_{7};
};

// Drum and load are where some turns and the involute bring them: nothing is off, and the row is the rope.
TEST_F(OnADrum, ARopeRunsOnInvolutes) {
  for (int i = 0; i < 40; ++i) {
    const double length = random_.uniform(0.1, 2.0), unwound = random_.uniform(-9.0, 9.0),
                 round = random_.uniform(-3.0, 3.0), off = random_.uniform(-0.1, 0.1);
    const double now = length + kDrumRadius * (round + unwound);
    if (now < 0.05) continue;
    JointProblem joint(&plugin_, "Winch");
    joint.bodies[1].pose.position = Vector3(kDrumRadius, -length, 0);
    joint.bind(properties(joint.bodies[1].pose.position));
    // unwound by the drum, which turns back, and by the load, which goes round
    turn(-unwound, &joint.bodies[0].pose);
    const Vector3 normal(std::cos(round), std::sin(round), 0), along = normal.cross(Vector3::UnitZ());
    joint.bodies[1].pose.position = kDrumRadius * normal + (now + off) * along;
    const std::vector<Discrepancy> all = joint.describe();
    ASSERT_EQ(all.size(), 1U);
    EXPECT_NEAR(error(all[0]), off, 1e-13);
    EXPECT_LT((all[0].point1 - kDrumRadius * normal).norm(), 1e-13);
    EXPECT_LT((all[0].axes * Vector3::UnitX() - along).norm(), 1e-13);
  }
}

// Of a slanting rope, and of one whose end is in the drum, too.
TEST_F(OnADrum, RowsAreTheRatesOfTheErrors) {
  constexpr double kTime = 1e-6;
  for (int i = 0; i < 60; ++i) {
    JointProblem joint(&plugin_, "Winch");
    const Vector3 start = random_.vector(0.6);
    if (std::fabs(std::hypot(start.x(), start.y()) - kDrumRadius) < 0.03 || std::hypot(start.x(), start.y()) < 0.03)
      continue;
    joint.bodies[1].pose.position = start;
    joint.bind(properties(start + Vector3(0, 0, 1e-3), 0.0, true));
    for (JointedBody& body : joint.bodies) body.twist = {random_.vector(1.0), random_.vector(1.0)};
    const std::vector<JointedBody> now = joint.bodies;
    const Discrepancy d = joint.describe().at(0);
    const double rate = joint.row_velocity(d, d.axes * Vector3::UnitX());
    // the error is over the gradient, which changes nothing of the rate where it is 0
    const auto at = [&](double time) {
      for (std::size_t b = 0; b < 2; ++b)
        joint.bodies[b].pose = displaced(now[b].pose, time * now[b].twist.linear, time * now[b].twist.angular);
      return error(joint.describe().at(0));
    };
    EXPECT_NEAR(at(0.0), 0.0, 1e-12);
    EXPECT_NEAR((at(kTime) - at(-kTime)) / (2.0 * kTime), rate, 1e-7);
  }
}

// Second derivatives of what is too long, while it is not: those of the row, whose x1 goes along with the drum, and what is told.
TEST_F(OnADrum, AccelerationsAreThoseOfTheErrors) {
  constexpr double kTime = 1e-4;
  int tried = 0;
  for (int i = 0; i < 60; ++i) {
    JointProblem joint(&plugin_, "Winch");
    const Vector3 start = random_.vector(0.6);
    if (std::hypot(start.x(), start.y()) < kDrumRadius + 0.05) continue;
    joint.bodies[1].pose.position = start;
    joint.bind(properties(start + Vector3(0, 0, 1e-3), 0.0, true));
    for (JointedBody& body : joint.bodies) body.twist = {random_.vector(1.0), random_.vector(1.0)};
    Discrepancy d = joint.describe().at(0);
    const Vector3 along = d.axes * Vector3::UnitX();
    joint.bodies[1].twist.linear -= joint.row_velocity(d, along) * along;
    d = joint.describe().at(0);
    const std::vector<JointedBody> now = joint.bodies;
    const auto at = [&](double time) {
      for (std::size_t b = 0; b < 2; ++b)
        joint.bodies[b].pose = displaced(now[b].pose, time * now[b].twist.linear, time * now[b].twist.angular);
      const double of_row =
          (carried(d.point2, now[1].pose, joint.bodies[1].pose) - carried(d.point1, now[0].pose, joint.bodies[0].pose))
              .norm();
      return Vector3(error(joint.describe().at(0)), of_row, 0);
    };
    const Vector3 second = (at(kTime) - 2.0 * at(0.0) + at(-kTime)) / (kTime * kTime);
    EXPECT_NEAR(second[0], second[1] - along.dot(d.acceleration), 2e-6 * (1.0 + std::fabs(second[0]))) << i;
    ++tried;
  }
  EXPECT_GT(tried, 20);
}

TEST_F(OnADrum, TheStepTellsTheTurn) {
  constexpr double kTurn = 2.0 * std::numbers::pi * kDrumRadius;
  const Vector3 end(kDrumRadius, -3, 0);
  for (const bool is_taut : {false, true})
    for (const double off : {0.05, -0.5, -0.85 * kTurn}) {
      JointProblem joint(&plugin_, "Winch");
      joint.bodies[1].pose.position = end;
      joint.bind(properties(end, 0.0, is_taut));
      joint.bodies[1].pose.position += Vector3(0, -off, 0);
      // the drum at rest: slack by less than 0.9 turns, or, what is always taut, off by less than half a turn
      EXPECT_NEAR(error(joint.describe().at(0)), is_taut && off < -0.5 * kTurn ? off + kTurn : off, 1e-12) << is_taut;
      // and by the way that a step of 0.01 s made
      joint.bodies[1].twist.linear = Vector3(0, -off / 0.01, 0);
      EXPECT_NEAR(error(joint.describe().at(0)), off, 1e-12) << is_taut;
    }
  // a taut rope that a step pulls by a whole turn and more
  JointProblem joint(&plugin_, "Winch");
  joint.bodies[1].pose.position = end;
  joint.bind(properties(end));
  joint.bodies[1].pose.position += Vector3(0, -1.3 * kTurn, 0);
  joint.bodies[1].twist.linear = Vector3(0, -1.3 * kTurn / 0.01, 0);
  EXPECT_NEAR(error(joint.describe().at(0)), 1.3 * kTurn, 1e-12);
}

// Wound up to its end, or to the axis itself.
TEST_F(OnADrum, AnEndWithinTheDrumIsNoFault) {
  for (const double far : {1.0, 1.0 - 1e-12, 0.5, 0.0}) {
    JointProblem joint(&plugin_, "Winch");
    joint.bodies[1].pose.position = Vector3(kDrumRadius, -1, 0);
    joint.bind(properties(joint.bodies[1].pose.position));
    joint.bodies[1].pose.position = Vector3(far * kDrumRadius, 0, 0);
    const std::vector<Discrepancy> all = joint.describe();
    ASSERT_EQ(all.size(), far > 0.0 ? 1U : 0U);
    if (far == 0.0) continue;
    EXPECT_LT((all[0].axes * Vector3::UnitX() + Vector3::UnitY()).norm(), 1e-13);
    // slack by the metre, which is four fifths of a turn; its lever is that much shorter
    EXPECT_NEAR(error(all[0]), -1.0 * far, 1e-5);
  }
}

}  // namespace
}  // namespace gravitas::test
