// The way to a solution of contacts without friction: w = q + W l >= 0, l >= 0, w l = 0, where rows depend on each other.
#include "plugin_sdk/solver/cone_path.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

namespace gravitas {
namespace {

// Four points of a plate that comes down with 1e-9 m/s and turns: three degrees of freedom, W of rank three.
TEST(ConePath, EndsAsNearAsAskedThoughRowsDependOnEachOther) {
  Eigen::Matrix<double, 4, 3> rows;
  rows << 1, 1, 1, 1, 1, -1, 1, -1, 1, 1, -1, -1;
  const Eigen::MatrixXd response = rows * Eigen::Vector3d(0.25, 0.5, 0.5).asDiagonal() * rows.transpose();
  // no motion closes all four: their gaps are not those of a plane
  const Eigen::VectorXd start = rows * Eigen::Vector3d(-1e-9, 2e-10, -3e-10) + Eigen::Vector4d(1e-10, 0, 0, 0);
  for (const double smallest : {1e-13, 1e-17}) {
    ConePath path(response, start);
    for (Eigen::Index i = 0; i < 4; ++i) path.add_normal(i, 0.0);
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
  path.add_normal(0, 0.0);
  path.add_disc(1, 2, 0, 0.5);
  Eigen::VectorXd lambda(3), y(3);
  path.next(1e-12, &lambda, &y);
  EXPECT_TRUE(path.has_next());
  // it sticks
  EXPECT_LE((lambda - Eigen::Vector3d(1.0, -0.3, -0.1)).norm(), 1e-4);
}

}  // namespace
}  // namespace gravitas
