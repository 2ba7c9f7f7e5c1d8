// Constraint `Spherical`: one point of both bodies, three locked axes, and nothing else.
#include <gtest/gtest.h>

#include "plugin_sdk/conformance/draw.h"
#include "plugin_sdk/math/rotation.h"
#include "tests/workers/constraint/joint_problem.h"

namespace gravitas::test {
namespace {

// Rounding of transforms of points within ten metres.
constexpr double kSphericalRounding = 1e-14;

class Spherical : public testing::Test {
 protected:
  // conformance::Draw bodies, joined at a random point.
  explicit Spherical(std::uint64_t seed = 1) : random_(seed) {
    for (JointedBody& body : joint_.bodies) body = {random_.pose(3.0), {random_.vector(2.0), random_.vector(2.0)}};
    point_ = random_.vector(3.0);
  }
  void bind() { joint_.bind({point_.x(), point_.y(), point_.z()}); }
  Discrepancy only() const {
    const std::vector<Discrepancy> all = joint_.describe();
    EXPECT_EQ(all.size(), 1U);
    return all.at(0);
  }

  PluginUnderTest plugin_{"constraint_spherical"};
  JointProblem joint_{&plugin_, "Spherical"};
  conformance::Draw random_;
  Vector3 point_;
};

TEST_F(Spherical, HasNoErrorWhereItWasBound) {
  for (int i = 0; i < 100; ++i) {
    for (JointedBody& body : joint_.bodies) body.pose = random_.pose(3.0);
    bind();
    const Discrepancy d = only();
    EXPECT_LT((d.point1 - point_).norm(), kSphericalRounding);
    EXPECT_LT((d.point2 - point_).norm(), kSphericalRounding);
  }
}

TEST_F(Spherical, LocksThreeAxesRigidly) {
  bind();
  const Discrepancy d = only();
  EXPECT_EQ(d.modes, pack_modes(AxisMode::kLocked, AxisMode::kLocked, AxisMode::kLocked));
  EXPECT_TRUE(d.velocity.isZero(0.0));
  EXPECT_TRUE(d.compliance.isZero(0.0) && d.damping.isZero(0.0));
  EXPECT_EQ(d.correction, 1.0);
  EXPECT_EQ(d.maximum_force, Vector3::Constant(kUnlimited));
}

TEST_F(Spherical, ItsErrorIsHowFarABodyWasMoved) {
  bind();
  const Vector3 shift(0.1, -0.2, 0.3);
  joint_.bodies[1].pose.position += shift;
  Discrepancy d = only();
  EXPECT_LT((d.point2 - d.point1 - shift).norm(), kSphericalRounding);
  EXPECT_NEAR(joint_error(d, d.point2 - d.point1), shift.norm(), kSphericalRounding);
  // moved along, body 1 makes it right again
  joint_.bodies[0].pose.position += shift;
  d = only();
  EXPECT_LT((d.point2 - d.point1).norm(), kSphericalRounding);
}

TEST_F(Spherical, TurningAboutThePointIsNoError) {
  bind();
  const Quaternion turn = random_.rotation();
  Pose& pose = joint_.bodies[1].pose;
  pose = {point_ + turn * (pose.position - point_), turn * pose.orientation};
  const Discrepancy d = only();
  EXPECT_LT((d.point2 - d.point1).norm(), kSphericalRounding);
}

TEST_F(Spherical, TurningAboutTheCentreIsTheErrorOfTheArm) {
  bind();
  Pose& pose = joint_.bodies[0].pose;
  const Vector3 arm = point_ - pose.position;
  pose.orientation = rotate_by(pose.orientation, Vector3(0, 0, 0.3));
  const Discrepancy d = only();
  const Vector3 moved = exp_rotation(Vector3(0, 0, 0.3)) * arm - arm;
  EXPECT_LT((d.point1 - point_ - moved).norm(), kSphericalRounding);
  EXPECT_LT((d.point2 - d.point1 + moved).norm(), kSphericalRounding);
}

TEST_F(Spherical, TakesThreeFreedoms) {
  bind();
  const Eigen::MatrixXd rows = joint_.jacobian(joint_.describe());
  EXPECT_EQ(rows.rows(), 3);
  EXPECT_EQ(rank(rows), 3);
}

TEST_F(Spherical, ItsRowsAreTheRelativeVelocityOfThePoint) {
  bind();
  const Discrepancy d = only();
  const auto velocity = [&](const JointedBody& body) -> Vector3 {
    return body.twist.linear + body.twist.angular.cross(point_ - body.pose.position);
  };
  const Vector3 relative = velocity(joint_.bodies[1]) - velocity(joint_.bodies[0]);
  for (const Vector3& axis : {Vector3(1, 0, 0), Vector3(0, 1, 0), Vector3(0, 0, 1)})
    EXPECT_NEAR(joint_.row_velocity(d, axis), axis.dot(relative), 10 * kSphericalRounding);
}

TEST_F(Spherical, HangsFromTheWorld) {
  for (const std::vector<std::uint32_t>& ends : {std::vector<std::uint32_t>{kNone, 1}, {0, kNone}}) {
    joint_.ends = ends;
    bind();
    Discrepancy d = only();
    EXPECT_LT((d.point2 - d.point1).norm(), kSphericalRounding);
    const std::size_t moving = ends[0] == kNone ? 1 : 0;
    joint_.bodies[moving].pose.position += Vector3(0, 1, 0);
    d = only();
    const Vector3 error = d.point2 - d.point1;
    EXPECT_LT((error - Vector3(0, moving == 1 ? 1 : -1, 0)).norm(), kSphericalRounding);
    // the world's end stays where it was bound
    EXPECT_LT(((moving == 1 ? d.point1 : d.point2) - point_).norm(), kSphericalRounding);
  }
}

TEST_F(Spherical, BrokenHasNoDiscrepancy) {
  bind();
  joint_.is_intact = false;
  EXPECT_TRUE(joint_.describe().empty());
}

TEST_F(Spherical, RefusesABodyThatDoesNotExist) {
  joint_.ends = {0, 2};
  EXPECT_EQ(plugin_.refusal(stage::Method::kConstraintBind, joint_.bind_request({0, 0, 0})),
            "joint 0: it names body 2, which does not exist");
}

TEST_F(Spherical, RefusesAJointOfAnotherType) {
  const JointProblem foreign(&plugin_, "AngularMotor");
  EXPECT_EQ(plugin_.refusal(stage::Method::kConstraintBind, foreign.bind_request({0, 0, 0})),
            "joint 0: it is of a type that this plugin does not know");
}

}  // namespace
}  // namespace gravitas::test
