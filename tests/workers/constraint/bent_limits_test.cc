// Limits of the angles of a cross and of the bend of two shafts: what their rows say in poses whose angles are known.
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <string>
#include <vector>

#include "plugin_sdk/conformance/draw.h"
#include "plugin_sdk/math/rotation.h"
#include "tests/workers/constraint/joint_problem.h"

namespace gravitas::test {
namespace {

constexpr double kLimitRounding = 1e-13;
const double kNotGiven = std::nan("");
const Vector3 kCross(0.3, -0.2, 0.5);
const Vector3 kBar1 = Vector3(1.0, 2.0, -0.5).normalized();
const Vector3 kSquare = kBar1.cross(Vector3::UnitZ()).normalized();
const Vector3 kInclined = 0.6 * kBar1 + 0.8 * kSquare;

struct AngleRange {
  double lower, upper;
};

class BentLimits : public testing::Test {
 protected:
  static std::vector<double> given(const Vector3& axis1, const Vector3& axis2, const std::vector<double>& rest) {
    std::vector<double> all;
    for (const Vector3& v : {kCross, axis1, axis2}) all.insert(all.end(), v.begin(), v.end());
    all.insert(all.end(), rest.begin(), rest.end());
    return all;
  }
  static std::vector<double> cross(const Vector3& bar2, const AngleRange& one, const AngleRange& two) {
    std::vector<double> rest(8, kNotGiven);
    rest.insert(rest.end(), {one.lower, one.upper, two.lower, two.upper});
    return given(kBar1, bar2, rest);
  }
  JointProblem joint(PluginUnderTest* plugin, const char* type, const std::vector<double>& properties) {
    JointProblem made(plugin, type);
    for (JointedBody& body : made.bodies) body.pose = random_.pose(3.0);
    made.bind(properties);
    return made;
  }
  static std::string refused(const char* library, const char* type, const std::vector<double>& properties) {
    PluginUnderTest plugin(library);
    return plugin.refusal(stage::Method::kConstraintBind, JointProblem(&plugin, type).bind_request(properties));
  }
  // Body 2 about the point of the cross, and then both bodies as one.
  void turn(JointProblem* joint, const Quaternion& by) {
    Pose& pose = joint->bodies[1].pose;
    pose = {kCross + by * (pose.position - kCross), normalized(by * pose.orientation)};
    const Pose both = random_.pose(2.0);
    for (JointedBody& body : joint->bodies) {
      body.pose = compose(both, body.pose);
      body.pose.orientation = normalized(body.pose.orientation);
    }
  }
  static double error_of(const Discrepancy& d) { return to_rotation_matrix(d.axes).col(0).dot(d.point2 - d.point1); }
  // Below 0 beyond a limit, by as much as the row says.
  static double room(const Discrepancy& d) {
    const double below = d.lower.x() > -kUnlimited ? error_of(d) - d.lower.x() : kUnlimited;
    const double above = d.upper.x() < kUnlimited ? d.upper.x() - error_of(d) : kUnlimited;
    return std::min(below, above);
  }
  void expect_rates(JointProblem* joint, std::size_t which) {
    constexpr double kTime = 1e-5;
    for (JointedBody& body : joint->bodies) body.twist = {random_.vector(1.0), random_.vector(1.0)};
    const std::vector<JointedBody> now = joint->bodies;
    const Discrepancy d = joint->describe().at(which);
    const double rate = joint->row_velocity(d, to_rotation_matrix(d.axes).col(0));
    double at[2];
    for (int side = 0; side < 2; ++side) {
      const double time = side == 0 ? -kTime : kTime;
      for (std::size_t b = 0; b < 2; ++b)
        joint->bodies[b].pose = displaced(now[b].pose, time * now[b].twist.linear, time * now[b].twist.angular);
      at[side] = error_of(joint->describe().at(which));
    }
    joint->bodies = now;
    EXPECT_NEAR((at[1] - at[0]) / (2.0 * kTime), rate, 1e-8);
  }

  conformance::Draw random_{17};
};

// asin(sin(g) sin(angle - limit)) is what is beyond a limit within a right angle, for bars across each other that angle itself.
TEST_F(BentLimits, OfACrossTellHowFarABarIsFromThem) {
  PluginUnderTest plugin("constraint_universal");
  for (const Vector3& bar2 : {kSquare, kInclined}) {
    const double sine = kBar1.cross(bar2).norm();
    const AngleRange wide{-2.9, 2.9}, ahead{0.0, 3.0}, uneven{-1.0, 2.0}, behind{-3.0, 0.5};
    for (const auto& [one, two] : {std::array{uneven, behind}, std::array{wide, ahead}}) {
      for (int i = 0; i < 100; ++i) {
        JointProblem held = joint(&plugin, "Universal", cross(bar2, one, two));
        const double angles[] = {random_.uniform(one.lower - 0.12, one.upper + 0.12),
                                 random_.uniform(two.lower - 0.12, two.upper + 0.12)};
        turn(&held, exp_rotation(angles[0] * kBar1) * exp_rotation(angles[1] * bar2));
        const std::vector<Discrepancy> all = held.describe();
        ASSERT_EQ(all.size(), 4U);
        for (std::size_t bar = 0; bar < 2; ++bar) {
          const AngleRange& range = bar == 0 ? one : two;
          const double left = std::min(angles[bar] - range.lower, range.upper - angles[bar]);
          const double told = left > 0.5 * M_PI ? kUnlimited : std::asin(sine * std::sin(left));
          EXPECT_NEAR(room(all[2 + bar]), told, kLimitRounding) << "bar " << bar << " at " << angles[bar];
          // near a right angle from the limit the swing's direction turns fast
          if (told < 1.2) expect_rates(&held, 2 + bar);
        }
      }
    }
  }
}

// Near limits are both told, equal ones hold, and what went far beyond is told to be beyond by half of it at least.
TEST_F(BentLimits, OfACrossMayMeet) {
  PluginUnderTest plugin("constraint_universal");
  for (const double angle : {-2.8, -1.4, -0.3, 0.1, 0.45, 1.5, 2.9}) {
    JointProblem held = joint(&plugin, "Universal", cross(kSquare, {-0.2, 0.4}, {0.0, 0.0}));
    turn(&held, exp_rotation(angle * kBar1) * exp_rotation(0.25 * angle * kSquare));
    const std::vector<Discrepancy> all = held.describe();
    ASSERT_EQ(all.size(), 4U);
    const double beyond = std::max(-0.2 - angle, angle - 0.4);
    EXPECT_NEAR(room(all[2]), -beyond, kLimitRounding) << angle;
    EXPECT_EQ(all[3].lower.x(), 0.0);
    EXPECT_EQ(all[3].upper.x(), 0.0);
    EXPECT_NEAR(error_of(all[3]), 0.25 * angle, kLimitRounding) << angle;
  }
}

TEST_F(BentLimits, OfACrossLeaveTheOtherRowsAlone) {
  PluginUnderTest plugin("constraint_universal");
  JointProblem free = joint(&plugin, "Universal", given(kBar1, kSquare, std::vector<double>(8, kNotGiven)));
  EXPECT_EQ(free.describe().size(), 2U);
  JointProblem one = joint(&plugin, "Universal", cross(kSquare, {kNotGiven, kNotGiven}, {kNotGiven, 0.4}));
  EXPECT_EQ(one.describe().size(), 3U);
}

TEST_F(BentLimits, OfShaftsAreAConeRoundTheFirst) {
  PluginUnderTest plugin("constraint_constant_velocity");
  for (int i = 0; i < 50; ++i) {
    JointProblem shafts = joint(&plugin, "ConstantVelocity", given(kBar1, kBar1, {kNotGiven, kNotGiven, 0.7}));
    const double bend = random_.uniform(0.01, 1.4), azimuth = random_.uniform(-3.0, 3.0);
    turn(&shafts, exp_rotation(bend * (exp_rotation(azimuth * kBar1) * kSquare)));
    ASSERT_EQ(shafts.describe().size(), 3U);
    EXPECT_NEAR(room(shafts.describe()[2]), 0.7 - bend, kLimitRounding);
    expect_rates(&shafts, 2);
  }
}

TEST_F(BentLimits, ThatContradictAreRefusedWithTheField) {
  const auto universal = [](const AngleRange& one, const AngleRange& two) {
    return refused("constraint_universal", "Universal", cross(kSquare, one, two));
  };
  const AngleRange none{kNotGiven, kNotGiven};
  EXPECT_NE(universal({0.1, 0.5}, none).find("Universal: LowerLimit1"), std::string::npos);
  EXPECT_NE(universal(none, {-0.5, -0.1}).find("Universal: UpperLimit2"), std::string::npos);
  EXPECT_NE(universal(none, {-4.0, 3.0}).find("Universal: UpperLimit2"), std::string::npos);
  const auto shafts = [](const Vector3& axis2, double most) {
    return refused("constraint_constant_velocity", "ConstantVelocity",
                   given(kBar1, axis2, {kNotGiven, kNotGiven, most}));
  };
  EXPECT_NE(shafts(kBar1, -1.0).find("ConstantVelocity: MaximumAngle"), std::string::npos);
  EXPECT_NE(shafts(kInclined, 0.9).find("ConstantVelocity: MaximumAngle 0.900000 lies below"), std::string::npos);
  // acos(0.6), as it is
  PluginUnderTest plugin("constraint_constant_velocity");
  EXPECT_NO_THROW(joint(&plugin, "ConstantVelocity", given(kBar1, kInclined, {kNotGiven, kNotGiven, std::acos(0.6)})));
}

}  // namespace
}  // namespace gravitas::test
