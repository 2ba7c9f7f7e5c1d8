// How accelerations change with the state of a body, against differences of the accelerations themselves.
#include "plugin_sdk/wrench_jacobian.h"

#include <gtest/gtest.h>

#include "plugin_sdk/conformance/draw.h"

namespace gravitas {
namespace {

using conformance::Draw;

using Accelerations = Eigen::Matrix<double, 6, 1>;
using Change = Eigen::Matrix<double, 12, 1>;

struct Body {
  Pose pose;
  Twist twist;
};

Body moved(const Body& body, const Change& by) {
  return {displaced(body.pose, by.segment<3>(0), by.segment<3>(3)),
          {body.twist.linear + by.segment<3>(6), body.twist.angular + by.segment<3>(9)}};
}

TEST(WrenchJacobian, OfAnAccelerationIsItsSlope) {
  constexpr double kMoved = 1e-5;
  Draw draw(5);
  for (int trial = 0; trial < 200; ++trial) {
    const Body body = {draw.pose(2.0), {draw.vector(3.0), draw.vector(3.0)}};
    const double mass = draw.uniform(0.5, 4.0);
    const Vector3 moments{draw.uniform(0.1, 3.0), draw.uniform(0.1, 3.0), draw.uniform(0.1, 3.0)};
    const Vector3 inverse = moments.cwiseInverse();
    // a wrench that is linear in the state near here
    const Accelerations wrench = Accelerations::NullaryExpr([&](Eigen::Index) { return draw.uniform(-5.0, 5.0); });
    const JacobianBlock slope =
        JacobianBlock::NullaryExpr([&](Eigen::Index, Eigen::Index) { return draw.uniform(-5.0, 5.0); });
    const auto accelerations = [&](const Change& by) {
      const Body there = moved(body, by);
      const Accelerations acts = wrench + slope * by;
      Accelerations all;
      all << acts.head<3>() / mass,
          angular_acceleration(there.pose.orientation, there.twist.angular, moments, inverse, acts.tail<3>());
      return all;
    };
    const JacobianBlock came =
        acceleration_jacobian(body.pose.orientation, body.twist.angular, moments, inverse, wrench.tail<3>()) +
        accelerated_block(body.pose.orientation, 1.0 / mass, inverse, slope);
    for (Eigen::Index k = 0; k < 12; ++k) {
      const Change by = kMoved * Change::Unit(k);
      const Accelerations right = (accelerations(by) - accelerations(-by)) / (2.0 * kMoved);
      EXPECT_LT((came.col(k) - right).cwiseAbs().maxCoeff(), 1e-7 * (1.0 + right.cwiseAbs().maxCoeff()))
          << "number " << k << " in trial " << trial;
    }
  }
}

// What nothing turns is not turned.
TEST(WrenchJacobian, OfAPointMassHasNoRotation) {
  const JacobianBlock block = accelerated_block(Quaternion::Identity(), 0.5, Vector3::Zero(), JacobianBlock::Ones()) +
                              acceleration_jacobian(Quaternion::Identity(), Vector3(1, 2, 3), Vector3::Zero(),
                                                    Vector3::Zero(), Vector3(1, 0, 0));
  EXPECT_EQ(block.topRows<3>(), (Eigen::Matrix<double, 3, 12>::Constant(0.5)));
  EXPECT_TRUE(block.bottomRows<3>().isZero(0.0));
}

}  // namespace
}  // namespace gravitas
