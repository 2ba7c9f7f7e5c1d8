// Courses over time and the rows that keep bodies on them: values, rates, rests, ends, what is refused, how fast a bounded one
// comes nearer.
#include "plugin_sdk/joint_motion.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>
#include <string>
#include <vector>

#include "plugin_sdk/math/rotation.h"

namespace gravitas {
namespace {

JointMotion course(const std::vector<double>& rows) { return JointMotion::of(rows, "Crank: Motion"); }

std::string refusal_of(const std::vector<double>& rows) {
  try {
    course(rows);
  } catch (const Refusal& refusal) {
    return refusal.what();
  }
  return {};
}

TEST(JointMotion, AtConstantAccelerationIsExactAlsoAsItWasBound) {
  std::vector<double> rows;
  for (const double t : {-1.0, 0.2, 0.5, 2.0}) rows.insert(rows.end(), {t, 3.0 - 2.0 * t + 1.5 * t * t});
  BoundWriter writer;
  course(rows).write(&writer);
  PropertyCursor bound(writer.numbers());
  const JointMotion motion = JointMotion::read(&bound);
  EXPECT_TRUE(bound.at_end());
  for (double t = -1.0; t < 2.0; t += 0.01) {
    const CourseState state = motion.at(t);
    ASSERT_NEAR(state.value, 3.0 - 2.0 * t + 1.5 * t * t, 1e-14);
    ASSERT_NEAR(state.rate, -2.0 + 3.0 * t, 1e-13);
    ASSERT_NEAR(state.change, 3.0, 1e-12);
  }
  EXPECT_EQ(motion.at(2.0).value, rows.back());
  // beyond its ends at the rates there
  EXPECT_NEAR(motion.at(5.0).value, 5.0 + 3.0 * 4.0, 1e-13);
  EXPECT_NEAR(motion.at(-3.0).value, 6.5 + 2.0 * 5.0, 1e-13);
  EXPECT_EQ(motion.at(5.0).change, 0.0);
}

TEST(JointMotion, IsContinuousWithItsRateAndRestsWhereAValueStandsTwice) {
  const JointMotion motion = course({0, 1, 0.5, 4, 1, 4, 1.2, 2});
  for (const double row : {0.0, 0.5, 1.0, 1.2}) {
    const CourseState before = motion.at(std::nextafter(row, -1.0)), at = motion.at(row);
    EXPECT_NEAR(before.value, at.value, 1e-14) << row;
    EXPECT_NEAR(before.rate, at.rate, 1e-12) << row;
  }
  for (const double t : {0.5, 0.7, 1.0}) {
    EXPECT_EQ(motion.at(t).value, 4.0) << t;
    EXPECT_EQ(motion.at(t).rate, 0.0) << t;
  }
  const JointMotion alone = course({7, 3});
  EXPECT_EQ(alone.at(-1.0).value, 3.0);
  EXPECT_EQ(alone.at(9.0).rate, 0.0);
  EXPECT_TRUE(course({}).is_none());
}

TEST(JointMotion, NamesWhatCannotBeFollowed) {
  constexpr double kHuge = std::numeric_limits<double>::max(), kTiny = std::numeric_limits<double>::denorm_min();
  EXPECT_EQ(refusal_of({0, 1, 1, 2}), "");
  EXPECT_EQ(refusal_of({0, 1, 0, 2}), "Crank: Motion cannot be followed: row 1 has a time that does not ascend");
  EXPECT_EQ(refusal_of({0, 1, 1, std::nan("")}),
            "Crank: Motion cannot be followed: row 1 has a number that is not finite");
  EXPECT_EQ(refusal_of({0, -kHuge, 1, kHuge}), "Crank: Motion cannot be followed: row 0 has a rate that is not finite");
  EXPECT_EQ(refusal_of({0, 0, kTiny, 1}), "Crank: Motion cannot be followed: row 0 has a rate that is not finite");
}

TEST(JointMotion, LimitsStopIt) {
  JointLimits limits;
  limits.upper = 2.0;
  const CourseState going{2.5, 3.0, 1.0}, within{1.5, 3.0, 1.0};
  EXPECT_EQ(going.within(limits).value, 2.0);
  EXPECT_EQ(going.within(limits).rate, 0.0);
  EXPECT_EQ(going.within(limits).change, 0.0);
  EXPECT_EQ(within.within(limits).rate, 3.0);
}

// The error is the turn that is missing to the course, however many turns that has made.
TEST(JointMotion, ATwistIsKnownWithinHalfATurnOfItsCourse) {
  for (const double turns : {0.0, 1.0, -3.0, 1e6}) {
    for (const double missing : {0.0, 0.3, -2.0}) {
      const Pose one{{1, 2, 3}, exp_rotation({0.4, -1.0, 0.3})};
      const double angle = 1.1;
      const Pose two{one.position, one.orientation * exp_rotation(angle * Vector3::UnitX())};
      const CourseState state{angle + missing + turns * kWholeTurn, 2.5, -4.0};
      const Discrepancy d = followed_twist(one, two, {}, {}, state, kUnlimited);
      const Vector3 axis = one.orientation * Vector3::UnitX();
      EXPECT_NEAR(axis.dot(d.point2 - d.point1), -missing, 1e-8 * std::fabs(turns) / 1e6 + 1e-14);
      EXPECT_LT((d.velocity - 2.5 * axis).norm(), 1e-14);
      EXPECT_LT((d.acceleration + 4.0 * axis).norm(), 1e-14);
      EXPECT_EQ(d.maximum_force.x(), kUnlimited);
    }
  }
}

// What is far behind comes nearer at the speed that a quarter of the force takes away on the way, what is near in two steps.
TEST(JointMotion, ABoundedOneComesNearer) {
  JointBodies bodies;
  bodies.time_step = bodies.elapsed = 1e-4;
  bodies.inverse_mass2 = 0.5;
  bodies.velocity2 = Vector3::UnitX() * 3.0;
  const auto speed = [&](double behind) {
    const Discrepancy d = followed_way(Vector3::UnitX(), Vector3::Zero(), (5.0 - behind) * Vector3::UnitX(), bodies,
                                       {5.0, 3.0, 7.0}, 40.0);
    EXPECT_EQ(axis_mode(d.modes, 0), AxisMode::kDriven);
    EXPECT_EQ(d.maximum_force.x(), 40.0);
    EXPECT_EQ(d.acceleration, 7.0 * Vector3::UnitX());
    return d.velocity.x() - 3.0;
  };
  // a = 40/2/4 m/s^2
  EXPECT_NEAR(speed(1.0), std::sqrt(2.0 * 5.0), 2e-3);
  EXPECT_NEAR(speed(-1.0), -std::sqrt(2.0 * 5.0), 2e-3);
  EXPECT_NEAR(speed(1e-11), 1e-11 / 2e-4, 1e-11);
  EXPECT_EQ(speed(0.0), 0.0);
  // nothing that can be moved, nothing to move with
  bodies.inverse_mass2 = 0.0;
  EXPECT_EQ(speed(1.0), 0.0);
}

// A bar that turns about its end: its moment there, not about its centre.
TEST(JointMotion, ABoundedOneKnowsTheMomentAboutItsAxis) {
  JointBodies bodies;
  bodies.time_step = bodies.elapsed = 1e-4;
  bodies.pose2.position = {0, 1.5, 0};
  bodies.inverse_mass2 = 0.5, bodies.inverse_inertia2 = {1.0 / 1.5, 1.0, 1.0};
  const Discrepancy d = followed_twist({}, {}, bodies, {}, {1.0, 0.0, 0.0}, 24.0);
  // 24/(1.5 + 2 1.5^2)/4 rad/s^2
  EXPECT_NEAR(d.velocity.x(), std::sqrt(2.0 * 1.0), 1e-3);
}

}  // namespace
}  // namespace gravitas
