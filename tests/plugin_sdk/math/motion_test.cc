#include "plugin_sdk/math/motion.h"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>
#include <random>

#include "plugin_sdk/math/rotation.h"

namespace gravitas {
namespace {

TEST(Motion, GoesStraightAndTurnsEvenly) {
  const Pose start{Vector3(1, 2, 3), exp_rotation(Vector3(0.3, -0.2, 0.9))};
  const Motion motion{Vector3(2, 0, -4), Vector3(0, 0, 6)};
  const Pose half = moved(start, motion, 0.5);
  EXPECT_EQ(half.position, Vector3(2, 2, 1));
  EXPECT_LE(log_rotation(half.orientation * (exp_rotation(Vector3(0, 0, 3)) * start.orientation).conjugate()).norm(),
            1e-15);
  const Pose none = moved(start, motion, 0.0);
  EXPECT_EQ(none.position, start.position);
  EXPECT_EQ(none.orientation.coeffs(), start.orientation.coeffs());
}

TEST(Motion, BetweenTwoPosesEndsAtTheSecondWhateverTheTurns) {
  std::mt19937_64 generator(5);
  std::uniform_real_distribution<double> uniform(-1.0, 1.0);
  const auto vector = [&](double reach) {
    return Vector3{reach * uniform(generator), reach * uniform(generator), reach * uniform(generator)};
  };
  for (int i = 0; i < 1000; ++i) {
    const Pose start{vector(5.0), exp_rotation(vector(4.0))};
    const Motion motion{vector(9.0), vector(20.0)};
    const Pose end = moved(start, motion, 1.0);
    // what is expected need not be exact: it only tells the turns
    const Motion found = motion_between(start, end, 1.02 * motion.rotation);
    EXPECT_LE((found.displacement - motion.displacement).norm(), 1e-14);
    EXPECT_LE(log_rotation(moved(start, found, 1.0).orientation * end.orientation.conjugate()).norm(), 1e-14);
    // the axis is known to a rounding over the arc that is left of the last turn
    EXPECT_LE((found.rotation - motion.rotation).norm(), 1e-10);
  }
}

TEST(Motion, WithoutExpectationIsTheShorterArc) {
  const Pose start{}, end{Vector3(1, 0, 0), exp_rotation(Vector3(0, 4, 0))};
  EXPECT_LE((motion_between(start, end, Vector3::Zero()).rotation - Vector3(0, 4 - 2 * std::numbers::pi, 0)).norm(),
            1e-15);
  EXPECT_EQ(motion_between(start, start, Vector3::Zero()).rotation, Vector3::Zero());
}

// A whole turn ends where it began: the axis can only be the expected one.
TEST(Motion, OfWholeTurnsIsAboutTheExpectedAxis) {
  const double turn = 2.0 * std::numbers::pi;
  const Motion found = motion_between({}, {}, Vector3(0.0, 3.01 * turn, 0.0));
  EXPECT_LE((found.rotation - Vector3(0.0, 3.0 * turn, 0.0)).norm(), 1e-14);
  EXPECT_EQ(motion_between({}, {}, Vector3(0.1, 0.0, 0.0)).rotation, Vector3::Zero());
}

}  // namespace
}  // namespace gravitas
