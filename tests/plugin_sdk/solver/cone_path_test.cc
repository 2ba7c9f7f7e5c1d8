// The way to a solution of contacts without friction, w = q + W l >= 0, l >= 0, w l = 0, where rows depend on each other, and of
// limits and bounded drives.
#include "plugin_sdk/solver/cone_path.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <vector>

#include "plugin_sdk/conformance/draw.h"
#include "plugin_sdk/solver/joint_laws.h"

namespace gravitas {
namespace {

constexpr double kInfinite = std::numeric_limits<double>::infinity();

// Four points of a plate that comes down with 1e-9 m/s and turns: three degrees of freedom, W of rank three.
TEST(ConePath, EndsAsNearAsAskedThoughRowsDependOnEachOther) {
  Eigen::Matrix<double, 4, 3> rows;
  rows << 1, 1, 1, 1, 1, -1, 1, -1, 1, 1, -1, -1;
  const Eigen::MatrixXd response = rows * Eigen::Vector3d(0.25, 0.5, 0.5).asDiagonal() * rows.transpose();
  // no motion closes all four: their gaps are not those of a plane
  const Eigen::VectorXd start = rows * Eigen::Vector3d(-1e-9, 2e-10, -3e-10) + Eigen::Vector4d(1e-10, 0, 0, 0);
  for (const double smallest : {1e-13, 1e-17}) {
    ConePath path(response, start);
    for (Eigen::Index i = 0; i < 4; ++i) path.add_scalar(i, 0.0, kInfinite, kInfinite);
    Eigen::VectorXd lambda(4), y(4);
    EXPECT_TRUE(path.has_next());
    EXPECT_LE(path.next(smallest, &lambda, &y), 60U);
    EXPECT_TRUE(y.isApprox(start + response * lambda));
    for (Eigen::Index i = 0; i < 4; ++i) EXPECT_LE(std::abs(std::min(lambda[i], y[i])), 2.0 * smallest) << i;
    // a second guess would be the first
    EXPECT_FALSE(path.has_next());
  }
}

TEST(ConePath, HasFurtherGuessesWhereFrictionIs) {
  const Eigen::MatrixXd response = Eigen::Matrix3d::Identity();
  const Eigen::VectorXd start = Eigen::Vector3d(-1.0, 0.3, 0.1);
  ConePath path(response, start);
  path.add_scalar(0, 0.0, kInfinite, kInfinite);
  path.add_disc(1, 2, 0, 0.5);
  Eigen::VectorXd lambda(3), y(3);
  path.next(1e-12, &lambda, &y);
  EXPECT_TRUE(path.has_next());
  // it sticks
  EXPECT_LE((lambda - Eigen::Vector3d(1.0, -0.3, -0.1)).norm(), 1e-4);
}

// Limits of one side and of two, and drives with a bound, in any mixture: convex, so that one guess is near the solution.
TEST(ConePath, EndsAtLimitsOfBothSidesAndAtBounds) {
  conformance::Draw draw(7);
  for (int problem = 0; problem < 1000; ++problem) {
    const Eigen::Index count = 1 + draw.below(12);
    Eigen::MatrixXd rows(count, count + 2);
    for (double& entry : rows.reshaped()) entry = draw.uniform(-1.0, 1.0);
    rows.rowwise().normalize();
    const Eigen::MatrixXd response = rows * rows.transpose();
    Eigen::VectorXd start(count);
    for (double& entry : start) entry = draw.uniform(-1.0, 1.0);
    ConePath path(response, start);
    std::vector<JointLaw> laws;
    for (Eigen::Index i = 0; i < count; ++i) {
      JointLaw& law = laws.emplace_back();
      const double at = draw.uniform(-1.0, 1.0), width = draw.below(3) == 0 ? 0.0 : draw.uniform(0.0, 1.0);
      const std::uint32_t sides = width == 0.0 ? 2 : draw.below(3);
      law.has_lower = sides != 1, law.has_upper = sides != 0;
      law.lower_target = at, law.upper_target = at + width;
      if (width == 0.0 || draw.below(3) == 0) law.bound = draw.uniform(1e-3, 2.0);
      path.add_scalar(i, law.has_lower ? at : -kInfinite, law.has_upper ? at + width : kInfinite, law.bound);
    }
    Eigen::VectorXd lambda(count), y(count);
    ASSERT_LE(path.next(1e-10, &lambda, &y), 40U) << problem;
    for (Eigen::Index i = 0; i < count; ++i) {
      const double put = relaxed_multiplier(laws[static_cast<std::size_t>(i)], lambda[i], y[i], 1.0);
      ASSERT_NEAR(lambda[i], put, 1e-9) << problem;
    }
    EXPECT_FALSE(path.has_next());
  }
}

}  // namespace
}  // namespace gravitas
