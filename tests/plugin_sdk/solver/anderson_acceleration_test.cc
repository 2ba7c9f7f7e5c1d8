#include "plugin_sdk/solver/anderson_acceleration.h"

#include <gtest/gtest.h>

#include <limits>

namespace gravitas {
namespace {

// Of an iteration x' = M x + b with three slow or growing directions: as many steps as there are, and one.
TEST(AndersonAcceleration, EndsInAsManyStepsAsThereAreSlowDirections) {
  for (const double rate : {0.5, 0.99, 1.4, -1.2}) {
    const Eigen::VectorXd rates = Eigen::Vector4d(rate, 0.9 * rate, -0.7 * rate, 0.0);
    const Eigen::VectorXd b = Eigen::Vector4d(1.0, -2.0, 0.5, 3.0);
    const Eigen::VectorXd right = b.cwiseQuotient((1.0 - rates.array()).matrix());
    AndersonAcceleration acceleration;
    Eigen::VectorXd x = Eigen::VectorXd::Zero(4);
    for (int step = 0; step < 5; ++step) x = acceleration.next(x, rates.cwiseProduct(x) + b);
    EXPECT_LE((x - right).norm(), 1e-9 * right.norm()) << rate;
  }
}

TEST(AndersonAcceleration, TakesTheImageWhereTheOthersTellNothing) {
  AndersonAcceleration acceleration;
  const Eigen::VectorXd x = Eigen::Vector2d(1.0, 2.0), image = Eigen::Vector2d(3.0, 4.0);
  EXPECT_EQ(acceleration.next(x, image), image);
  // the same again
  EXPECT_EQ(acceleration.next(x, image), image);
  EXPECT_EQ(acceleration.next(image, image), image);
  const Eigen::VectorXd beyond = Eigen::Vector2d(std::numeric_limits<double>::infinity(), 0.0);
  EXPECT_EQ(acceleration.next(image, beyond), beyond);
}

}  // namespace
}  // namespace gravitas
