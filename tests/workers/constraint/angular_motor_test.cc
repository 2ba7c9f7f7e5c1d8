// Constraint `AngularMotor`: a hinge of two anchors and a drive of four points.
#include <gtest/gtest.h>

#include <cmath>
#include <limits>

#include "plugin_sdk/conformance/draw.h"
#include "plugin_sdk/math/rotation.h"
#include "tests/workers/constraint/joint_problem.h"

namespace gravitas::test {
namespace {

// Rounding of transforms of points within ten metres.
constexpr double kMotorRounding = 1e-14;
const double kAbsent = std::nan("");

class AngularMotor : public testing::Test {
 protected:
  AngularMotor() {
    for (JointedBody& body : joint_.bodies) body.pose = random_.pose(3.0);
    point1_ = random_.vector(3.0);
    point2_ = point1_ + random_.uniform(0.5, 2.0) * random_.direction();
  }
  std::vector<double> properties(double speed, double torque = kAbsent) const {
    return {point1_.x(), point1_.y(), point1_.z(), point2_.x(), point2_.y(), point2_.z(), speed, torque};
  }
  Vector3 axis() const { return (point2_ - point1_).normalized(); }
  Vector3 middle() const { return 0.5 * (point1_ + point2_); }
  double lever() const { return 0.5 * (point2_ - point1_).norm(); }

  // Gives body 1 any motion and body 2 the one that turns at `speed` about the axis in body 1.
  void turn(double speed) {
    JointedBody &first = joint_.bodies[0], &second = joint_.bodies[1];
    first.twist = {random_.vector(2.0), random_.vector(2.0)};
    const Vector3 of_axis = first.twist.linear + first.twist.angular.cross(middle() - first.pose.position);
    second.twist.angular = first.twist.angular + speed * axis();
    second.twist.linear = of_axis - second.twist.angular.cross(middle() - second.pose.position);
  }

  static bool is_drive(const Discrepancy& d) { return axis_mode(d.modes, 0) == AxisMode::kDriven; }

  PluginUnderTest plugin_{"constraint_angular_motor"};
  JointProblem joint_{&plugin_, "AngularMotor"};
  conformance::Draw random_{1};
  Vector3 point1_, point2_;
};

TEST_F(AngularMotor, IsTwoAnchorsAndFourDrivingPoints) {
  joint_.bind(properties(3.0));
  const std::vector<Discrepancy> all = joint_.describe();
  ASSERT_EQ(all.size(), 6U);
  for (std::size_t i = 0; i < 2; ++i)
    EXPECT_EQ(all[i].modes, pack_modes(AxisMode::kLocked, AxisMode::kLocked, AxisMode::kLocked));
  for (std::size_t i = 2; i < 6; ++i)
    EXPECT_EQ(all[i].modes, pack_modes(AxisMode::kDriven, AxisMode::kFree, AxisMode::kFree));
}

TEST_F(AngularMotor, HasNoErrorWhereItWasBound) {
  joint_.bind(properties(3.0));
  const std::vector<Discrepancy> all = joint_.describe();
  EXPECT_LT((all[0].point1 - point1_).norm(), kMotorRounding);
  EXPECT_LT((all[1].point1 - point2_).norm(), kMotorRounding);
  for (const Discrepancy& d : all) EXPECT_LT((d.point2 - d.point1).norm(), kMotorRounding);
}

TEST_F(AngularMotor, ItsErrorIsHowFarABodyWasMoved) {
  joint_.bind(properties(3.0));
  const Vector3 shift(0.1, -0.2, 0.3);
  joint_.bodies[1].pose.position += shift;
  const std::vector<Discrepancy> all = joint_.describe();
  for (std::size_t i = 0; i < 2; ++i) {
    EXPECT_LT((all[i].point2 - all[i].point1 - shift).norm(), kMotorRounding);
    EXPECT_NEAR(joint_error(all[i], shift), shift.norm(), kMotorRounding);
  }
  // a drive holds velocities only
  for (std::size_t i = 2; i < 6; ++i) EXPECT_EQ(joint_error(all[i], all[i].point2 - all[i].point1), 0.0);
}

TEST_F(AngularMotor, TurningAboutTheAxisIsNoError) {
  joint_.bind(properties(3.0));
  const Quaternion turn = exp_rotation(2.0 * axis());
  Pose& pose = joint_.bodies[1].pose;
  pose = {middle() + turn * (pose.position - middle()), turn * pose.orientation};
  for (const Discrepancy& d : joint_.describe()) EXPECT_LT((d.point2 - d.point1).norm(), kMotorRounding);
}

TEST_F(AngularMotor, DrivesAlongTangentsOnly) {
  joint_.bind(properties(3.0));
  Vector3 sum = Vector3::Zero();
  for (const Discrepancy& d : joint_.describe()) {
    if (!is_drive(d)) continue;
    const Vector3 tangent = d.axes.toRotationMatrix().col(0);
    const Vector3 out = d.point1 - middle();
    sum += out;
    EXPECT_NEAR(out.norm(), lever(), kMotorRounding);
    EXPECT_NEAR(out.dot(axis()), 0.0, kMotorRounding);
    EXPECT_NEAR(tangent.dot(axis()), 0.0, kMotorRounding);
    EXPECT_NEAR(tangent.dot(out), 0.0, kMotorRounding);
    EXPECT_NEAR(tangent.norm(), 1.0, kMotorRounding);
    // right-handed about the axis, at the speed of a point so far out (2.85)
    EXPECT_LT((d.velocity - 3.0 * axis().cross(out)).norm(), 10 * kMotorRounding);
    EXPECT_NEAR(d.velocity.dot(tangent), 3.0 * lever(), 10 * kMotorRounding);
  }
  // the points lie opposite each other
  EXPECT_LT(sum.norm(), kMotorRounding);
}

TEST_F(AngularMotor, ARigidTurnAtTheSetSpeedIsWhatEveryRowWants) {
  for (const double speed : {3.0, -0.5, 0.0}) {
    joint_.bind(properties(speed));
    for (int i = 0; i < 20; ++i) {
      turn(speed);
      for (const Discrepancy& d : joint_.describe()) {
        const Matrix3 axes = d.axes.toRotationMatrix();
        for (int k = 0; k < 3; ++k) {
          if (axis_mode(d.modes, k) == AxisMode::kFree) continue;
          // sums of products below a hundred
          EXPECT_NEAR(joint_.row_velocity(d, axes.col(k)), d.velocity.dot(axes.col(k)), 1e-13);
        }
      }
    }
  }
}

TEST_F(AngularMotor, AnotherSpeedMissesOnTheDriveRowsAlone) {
  joint_.bind(properties(3.0));
  turn(2.0);
  for (const Discrepancy& d : joint_.describe()) {
    const Vector3 first = d.axes.toRotationMatrix().col(0);
    const double missing = d.velocity.dot(first) - joint_.row_velocity(d, first);
    EXPECT_NEAR(missing, is_drive(d) ? lever() : 0.0, 1e-13);
  }
}

// Six rows of anchors, of which one along the axis is redundant, and four of one drive.
TEST_F(AngularMotor, TenRowsTakeSixFreedoms) {
  joint_.bind(properties(3.0));
  const std::vector<Discrepancy> all = joint_.describe();
  const Eigen::MatrixXd rows = joint_.jacobian(all);
  EXPECT_EQ(rows.rows(), 10);
  EXPECT_EQ(rank(rows), 6);
  EXPECT_EQ(rank(joint_.jacobian({all[0], all[1]})), 5);
  // each drive row alone adds the one freedom
  for (std::size_t i = 2; i < 6; ++i) EXPECT_EQ(rank(joint_.jacobian({all[0], all[1], all[i]})), 6) << i;
}

TEST_F(AngularMotor, TheDriveStaysInBody1) {
  joint_.bind(properties(3.0));
  const std::vector<Discrepancy> before = joint_.describe();
  // both bodies moved as one
  const Pose moved = random_.pose(3.0);
  for (JointedBody& body : joint_.bodies) body.pose = compose(moved, body.pose);
  const std::vector<Discrepancy> after = joint_.describe();
  for (std::size_t i = 0; i < 6; ++i) {
    EXPECT_LT((after[i].point1 - transform_point(moved, before[i].point1)).norm(), 10 * kMotorRounding);
    EXPECT_LT((after[i].velocity - moved.orientation * before[i].velocity).norm(), 10 * kMotorRounding);
  }
}

TEST_F(AngularMotor, TheAxisStaysMidwayWhenTheBodiesDriftApart) {
  joint_.bind(properties(3.0));
  joint_.bodies[1].pose.position += Vector3(0.02, 0, 0);
  Vector3 centre = Vector3::Zero();
  for (const Discrepancy& d : joint_.describe())
    if (is_drive(d)) centre += 0.25 * d.point1;
  EXPECT_LT((centre - (middle() + Vector3(0.01, 0, 0))).norm(), kMotorRounding);
}

TEST_F(AngularMotor, SharesItsTorqueAmongTheDrivingPoints) {
  joint_.bind(properties(3.0, 8.0));
  double torque = 0.0;
  for (const Discrepancy& d : joint_.describe()) {
    if (is_drive(d)) {
      torque += d.maximum_force.x() * (d.point1 - middle()).norm();
    } else {
      EXPECT_EQ(d.maximum_force, Vector3::Constant(kUnlimited));
    }
  }
  EXPECT_NEAR(torque, 8.0, 10 * kMotorRounding);
}

TEST_F(AngularMotor, IsUnlimitedWithoutATorque) {
  joint_.bind(properties(3.0));
  for (const Discrepancy& d : joint_.describe()) EXPECT_EQ(d.maximum_force, Vector3::Constant(kUnlimited));
  // and a motor without torque is a hinge
  joint_.bind(properties(3.0, 0.0));
  for (const Discrepancy& d : joint_.describe()) EXPECT_EQ(d.maximum_force.x(), is_drive(d) ? 0.0 : kUnlimited);
}

TEST_F(AngularMotor, TurnsABodyAgainstTheWorld) {
  joint_.ends = {kNone, 1};
  joint_.bind(properties(3.0));
  joint_.bodies[1].twist.angular = 3.0 * axis();
  joint_.bodies[1].twist.linear = -joint_.bodies[1].twist.angular.cross(middle() - joint_.bodies[1].pose.position);
  for (const Discrepancy& d : joint_.describe()) {
    const Vector3 first = d.axes.toRotationMatrix().col(0);
    EXPECT_NEAR(joint_.row_velocity(d, first), d.velocity.dot(first), 1e-13);
  }
  EXPECT_EQ(joint_.describe().size(), 6U);
}

TEST_F(AngularMotor, BrokenHasNoDiscrepancy) {
  joint_.bind(properties(3.0));
  joint_.is_intact = false;
  EXPECT_TRUE(joint_.describe().empty());
}

TEST_F(AngularMotor, RefusesAnAxisOfOnePoint) {
  point2_ = point1_;
  EXPECT_EQ(plugin_.refusal(stage::Method::kConstraintBind, joint_.bind_request(properties(1.0))),
            "joint 0: AngularMotor: BindAxisPoint1 and BindAxisPoint2 are the same point");
}

TEST_F(AngularMotor, RefusesAJointOfAnotherType) {
  const JointProblem foreign(&plugin_, "Spherical");
  EXPECT_EQ(plugin_.refusal(stage::Method::kConstraintBind, foreign.bind_request(properties(1.0))),
            "joint 0: it is of a type that this plugin does not know");
}

}  // namespace
}  // namespace gravitas::test
