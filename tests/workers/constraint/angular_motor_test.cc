// Constraint `AngularMotor`: a hinge and a drive about its axis.
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
    middle_ = point1_ + axis().dot(joint_.bodies[1].pose.position - point1_) * axis();
  }
  std::vector<double> properties(double speed, double torque = kAbsent) const {
    return {point1_.x(), point1_.y(), point1_.z(), point2_.x(), point2_.y(), point2_.z(), speed, torque};
  }
  Vector3 axis() const { return (point2_ - point1_).normalized(); }
  // The axis' point next to body 2 at the start.
  const Vector3& middle() const { return middle_; }

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
  Vector3 point1_, point2_, middle_;
};

TEST_F(AngularMotor, IsAHingeAndADrive) {
  joint_.bind(properties(3.0));
  const std::vector<Discrepancy> all = joint_.describe();
  ASSERT_EQ(all.size(), 4U);
  EXPECT_EQ(all[0].modes, pack_modes(AxisMode::kLocked, AxisMode::kLocked, AxisMode::kLocked));
  EXPECT_TRUE(all[1].is_swing() && all[2].is_swing());
  EXPECT_EQ(all[3].modes, pack_modes(AxisMode::kDriven, AxisMode::kFree, AxisMode::kFree) | kAngularDiscrepancy);
}

TEST_F(AngularMotor, HasNoErrorWhereItWasBound) {
  joint_.bind(properties(3.0));
  const std::vector<Discrepancy> all = joint_.describe();
  EXPECT_LT((all[0].point1 - middle()).norm(), kMotorRounding);
  for (const Discrepancy& d : all) EXPECT_LT(joint_error(d, d.point2 - d.point1), kMotorRounding);
}

TEST_F(AngularMotor, ItsErrorIsHowFarABodyWasMoved) {
  joint_.bind(properties(3.0));
  const Vector3 shift(0.1, -0.2, 0.3);
  joint_.bodies[1].pose.position += shift;
  const std::vector<Discrepancy> all = joint_.describe();
  EXPECT_LT((all[0].point2 - all[0].point1 - shift).norm(), kMotorRounding);
  EXPECT_NEAR(joint_error(all[0], shift), shift.norm(), kMotorRounding);
  // a drive holds velocities only
  EXPECT_EQ(joint_error(all[3], all[3].point2 - all[3].point1), 0.0);
}

TEST_F(AngularMotor, TurningAboutTheAxisIsNoError) {
  joint_.bind(properties(3.0));
  const Quaternion turn = exp_rotation(2.0 * axis());
  Pose& pose = joint_.bodies[1].pose;
  pose = {middle() + turn * (pose.position - middle()), turn * pose.orientation};
  for (const Discrepancy& d : joint_.describe()) EXPECT_LT(joint_error(d, d.point2 - d.point1), kMotorRounding);
}

// The seed's driving points: their rows along the tangents are this one, where the bodies' points on the axis do not part.
TEST_F(AngularMotor, DrivesAsPointsAboutTheAxisWould) {
  joint_.bind(properties(3.0));
  const Discrepancy drive = joint_.describe().back();
  turn(2.0);
  for (const double lever : {0.1, 1.0, 7.0}) {
    const Vector3 out = lever * axis().cross(random_.direction()).normalized();
    Discrepancy point;
    point.point1 = point.point2 = middle() + out;
    const Vector3 tangent = axis().cross(out);
    EXPECT_NEAR(joint_.row_velocity(point, tangent), lever * lever * joint_.row_velocity(drive, axis()), 1e-12);
  }
  EXPECT_LT((drive.velocity - 3.0 * axis()).norm(), 10 * kMotorRounding);
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
    EXPECT_NEAR(missing, is_drive(d) ? 1.0 : 0.0, 1e-13);
  }
}

TEST_F(AngularMotor, ItsSixRowsTakeSixFreedoms) {
  joint_.bind(properties(3.0));
  const std::vector<Discrepancy> all = joint_.describe();
  const Eigen::MatrixXd rows = joint_.jacobian(all);
  EXPECT_EQ(rows.rows(), 6);
  EXPECT_EQ(rank(rows), 6);
}

// With both bodies moved as one, and one against the other: the axis stays midway.
TEST_F(AngularMotor, ItsAxisMovesWithTheBodies) {
  joint_.bind(properties(3.0));
  const Pose moved = random_.pose(3.0);
  for (JointedBody& body : joint_.bodies) body.pose = compose(moved, body.pose);
  const Vector3 at = moved.orientation * axis();
  EXPECT_LT((joint_.describe().back().velocity - 3.0 * at).norm(), 10 * kMotorRounding);
  const Vector3 across = orthonormal_basis(at).first;
  joint_.bodies[1].pose.orientation = exp_rotation(0.02 * across) * joint_.bodies[1].pose.orientation;
  EXPECT_LT((joint_.describe().back().velocity - 3.0 * (exp_rotation(0.01 * across) * at)).norm(), 10 * kMotorRounding);
}

TEST_F(AngularMotor, BoundsItsTorque) {
  joint_.bind(properties(3.0, 8.0));
  for (const Discrepancy& d : joint_.describe()) EXPECT_EQ(d.maximum_force.x(), is_drive(d) ? 8.0 : kUnlimited);
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
  EXPECT_EQ(joint_.describe().size(), 4U);
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
