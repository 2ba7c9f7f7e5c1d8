// Ways and angles where they degenerate; what the joints make of them is tested in tests/workers/constraint/.
#include "plugin_sdk/joint_coordinates.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>

#include "plugin_sdk/math/rotation.h"

namespace gravitas {
namespace {

TEST(JointCoordinates, AnglesAreAboveMinusPiUpToPi) {
  EXPECT_EQ(within_half_turn(kHalfTurn), kHalfTurn);
  EXPECT_EQ(within_half_turn(-kHalfTurn), kHalfTurn);
  EXPECT_EQ(within_half_turn(0.25), 0.25);
  EXPECT_NEAR(within_half_turn(3.5), 3.5 - kWholeTurn, 1e-15);
  EXPECT_NEAR(within_half_turn(-20.0), -20.0 + 3.0 * kWholeTurn, 1e-14);
  const auto turned = reversed(Coordinate{kHalfTurn, 2.0});
  EXPECT_EQ(turned->value, kHalfTurn);
  EXPECT_EQ(turned->rate, -2.0);
  EXPECT_FALSE(reversed(std::nullopt).has_value());
}

TEST(JointCoordinates, ADistanceBeginsToGrowAtTheSpeedOfItsPoints) {
  JointBodies bodies;
  bodies.velocity2 = {3.0, 0.0, 4.0};
  const Coordinate together = distance_between({1, 1, 1}, {1, 1, 1}, bodies);
  EXPECT_EQ(together.value, 0.0);
  EXPECT_EQ(together.rate, 5.0);
}

TEST(JointCoordinates, ASwingGrowsFromNoughtAndShrinksFromHalfATurn) {
  JointBodies bodies;
  bodies.spin1 = {1.0, 0.0, 5.0};
  bodies.spin2 = {1.0, 0.75, 9.0};
  const Coordinate alike = swing_of(Vector3::UnitZ(), Vector3::UnitZ(), bodies);
  EXPECT_EQ(alike.value, 0.0);
  EXPECT_EQ(alike.rate, 0.75);
  const Coordinate against = swing_of(Vector3::UnitZ(), -Vector3::UnitZ(), bodies);
  EXPECT_NEAR(against.value, kHalfTurn, 1e-15);
  EXPECT_EQ(against.rate, -0.75);
}

TEST(JointCoordinates, WhereAnAngleMeansNothingThereIsNone) {
  EXPECT_FALSE(azimuth_of(Vector3::UnitZ(), Vector3::UnitX(), Vector3::UnitZ(), {1, 2, 3}).has_value());
  EXPECT_FALSE(azimuth_of(Vector3::UnitZ(), Vector3::UnitX(), -Vector3::UnitZ(), {1, 2, 3}).has_value());
  const Pose frame1;
  const Pose against{Vector3::Zero(), Quaternion(0, 0, 0, 1)};  // half a turn about z
  EXPECT_FALSE(twist_of(frame1, against, {}, {}).has_value());
}

}  // namespace
}  // namespace gravitas
