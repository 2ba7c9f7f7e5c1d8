#include "plugin_sdk/stop_location.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>

#include "plugin_sdk/joint_rows.h"
#include "plugin_sdk/math/rotation.h"

namespace gravitas {
namespace {

constexpr double kNever = std::numeric_limits<double>::infinity();

Discrepancy limited(const Vector3& point1, const Vector3& point2, double lower, double upper) {
  Discrepancy d;
  d.point1 = point1, d.point2 = point2;
  d.axes = Quaternion::Identity();
  d.modes = pack_modes(AxisMode::kLimited, AxisMode::kFree, AxisMode::kFree);
  d.lower.x() = lower, d.upper.x() = upper;
  return d;
}

StopGap gap(double gap, double rate, double slop = 1e-8) { return {gap, rate, slop, 1.0, 1e-10}; }

TEST(StopGaps, AreTheWaysToBothSides) {
  StopBody moves;
  moves.centre = {2.1, 0, 0};
  moves.velocity.linear = {3, 7, 0};
  moves.is_pushed = true;
  const auto stops = stop_gaps(limited({2, 0, 0}, {2.1, 0, 0}, -0.3, 0.25), {}, moves);
  EXPECT_NEAR(stops[0].gap, 0.4, 1e-15);
  EXPECT_DOUBLE_EQ(stops[0].rate, 3.0);
  EXPECT_NEAR(stops[1].gap, 0.15, 1e-15);
  EXPECT_DOUBLE_EQ(stops[1].rate, -3.0);
  for (std::size_t k = 2; k < kStopsOfRow; ++k) EXPECT_FALSE(stops[k].exists()) << k;
}

TEST(StopGaps, OfARopeGrowAlongIt) {
  Discrepancy rope = limited({0, 0, 0}, {3, 4, 0}, 0.0, 6.0);
  rope.modes |= kRadialDiscrepancy;
  StopBody end;
  end.centre = {3, 4, 0};
  end.velocity.linear = {1, 0, 0};
  end.is_pushed = true;
  const auto stops = stop_gaps(rope, {}, end);
  EXPECT_NEAR(stops[1].gap, 1.0, 1e-15);
  EXPECT_NEAR(stops[1].rate, -0.6, 1e-15);
}

TEST(StopGaps, OfABoundedDriveThatSlipsAreOfItsVelocity) {
  StopBody turns;
  turns.velocity.angular = {0, 0, 3};
  turns.is_pushed = true;
  const Discrepancy drive = driven_row(Vector3::UnitZ(), 5.0, 2.0);
  const auto stops = stop_gaps(drive, {}, turns);
  EXPECT_NEAR(stops[0].gap, -2.0, 1e-15);
  EXPECT_NEAR(stops[1].gap, 2.0, 1e-15);
  EXPECT_FALSE(stops[0].is_open());
  EXPECT_TRUE(stops[1].is_open());
  StopBody later = turns;
  later.velocity.angular = {0, 0, 6};
  const auto passed = stop_gaps(drive, {}, later);
  EXPECT_NEAR(closing_time(stops[1], passed[1], 0.3), 0.2, 1e-15);
  EXPECT_FALSE(passed[0].is_pressed_again(stops[0], false));
  EXPECT_TRUE(passed[1].asks_the_same(stops[1]));
  EXPECT_FALSE(stop_gaps(driven_row(Vector3::UnitZ(), 5.01, 2.0), {}, later)[1].asks_the_same(stops[1]));
  // at its velocity neither is open, and one without a bound, or with none at all, never slips
  later.velocity.angular = {0, 0, 5};
  for (const StopGap& stop : stop_gaps(drive, {}, later)) EXPECT_FALSE(stop.is_open());
  for (const double torque : {0.0, kUnlimited})
    EXPECT_FALSE(stop_gaps(driven_row(Vector3::UnitZ(), 5.0, torque), {}, turns)[1].exists()) << torque;
}

TEST(StopGaps, AreOfRigidStopsWithRoomAlone) {
  Discrepancy d = limited({0, 0, 0}, {0.1, 0, 0}, 0.2, 0.2);
  EXPECT_FALSE(stop_gaps(d, {}, {})[0].exists());  // a rod
  d = limited({0, 0, 0}, {0.1, 0, 0}, -0.2, 0.2);
  d.compliance.x() = 1e-4;
  EXPECT_FALSE(stop_gaps(d, {}, {})[0].exists());
  d = limited({0, 0, 0}, {0.1, 0, 0}, -kUnlimited, 0.2);
  EXPECT_FALSE(stop_gaps(d, {}, {})[0].exists());
  EXPECT_TRUE(stop_gaps(d, {}, {})[1].exists());
  d.modes = pack_modes(AxisMode::kUnilateral, AxisMode::kFree, AxisMode::kFree);
  EXPECT_DOUBLE_EQ(stop_gaps(d, {}, {})[0].gap, 0.1);
  EXPECT_FALSE(stop_gaps(d, {}, {})[1].exists());
}

// A damper pushes from where it is met on, however little the spring does.
TEST(StopGaps, AreOfDampedStopsThatGiveWay) {
  Discrepancy d = limited({0, 0, 0}, {0.15, 0, 0}, -0.2, 0.2);
  d.compliance.x() = 1e-4, d.damping.x() = 3.0;
  for (const std::uint32_t applied : {0U, kForcesApplied}) {
    d.modes |= applied;
    EXPECT_NEAR(stop_gaps(d, {}, {})[1].gap, 0.05, 1e-15);
  }
  EXPECT_TRUE(stop_gaps(d, {}, {})[1].is_open());
  d.point2.x() = 0.25;
  StopBody leaves;
  leaves.centre = d.point2, leaves.velocity.linear = {-3, 0, 0}, leaves.is_pushed = true;
  const StopGap pressed = stop_gaps(d, {}, leaves)[1];
  EXPECT_NEAR(pressed.gap, -0.05, 1e-15);
  EXPECT_FALSE(pressed.is_open());  // pushes on while it leaves
}

TEST(StopGaps, GoAlongWithWhatTheJointMoves) {
  Discrepancy guided = limited({0, 0, 0}, {0.1, 0, 0}, -0.2, 0.2);
  guided.velocity = {2, 0, 0};
  EXPECT_DOUBLE_EQ(stop_gaps(guided, {}, {})[0].rate, -2.0);
}

TEST(StopGap, IsOpenWhereItIsAwayOrLeft) {
  EXPECT_TRUE(gap(1e-3, -1.0).is_open());
  EXPECT_TRUE(gap(-1e-12, 1e-3).is_open());
  EXPECT_FALSE(gap(1e-9, -1.0).is_open());
  EXPECT_FALSE(gap(-1e-3, 0.0).is_open());
  EXPECT_FALSE(StopGap{}.is_open());
}

TEST(StopGap, MayHaveClosedIfItIsBeyondOrComesBack) {
  EXPECT_TRUE(gap(-1e-3, -1.0).may_have_closed(1.0));
  EXPECT_FALSE(gap(1e-3, -1.0).may_have_closed(1.0));
  EXPECT_TRUE(gap(0.4, 1.0).may_have_closed(1.0));
  EXPECT_FALSE(gap(0.4, 1.0).may_have_closed(0.1));
  EXPECT_FALSE(StopGap{}.may_have_closed(1.0));
}

TEST(StopGap, IsPressedAgainBeyondItselfOrOnItsWayOff) {
  const StopGap bore = gap(1e-10, 0.0), was_open = gap(1e-3, -1.0);
  for (const bool bears : {false, true}) {
    EXPECT_TRUE(gap(-1e-6, -1.0).is_pressed_again(bore, bears));
    EXPECT_TRUE(gap(-1e-6, 1.0).is_pressed_again(bore, bears));
    EXPECT_FALSE(gap(-1e-9, -1.0).is_pressed_again(bore, bears));
    EXPECT_EQ(gap(1e-3, 1.0).is_pressed_again(bore, bears), bears);
    EXPECT_FALSE(gap(1e-3, -1.0).is_pressed_again(bore, bears));
    EXPECT_FALSE(gap(-1e-6, -1.0).is_pressed_again(was_open, bears));  // this is a closing
    EXPECT_FALSE(gap(-1e-6, -1.0).is_pressed_again(StopGap{}, bears));
  }
}

// A cubic tells motions under constant loads exactly.
TEST(ClosingTime, OfAFallIsThatOfTheParabola) {
  constexpr double kHeight = 0.3, kSpeed = -0.2, kLoad = 4.0;
  const auto at = [&](double t) { return gap(kHeight + kSpeed * t - 0.5 * kLoad * t * t, kSpeed - kLoad * t); };
  const double meets = (kSpeed + std::sqrt(kSpeed * kSpeed + 2.0 * kLoad * kHeight)) / kLoad;
  for (const double length : {0.4, 1.0, 50.0})
    EXPECT_NEAR(closing_time(at(0.0), at(length), length), meets, 1e-12 * length);
  EXPECT_EQ(closing_time(at(0.0), at(0.3), 0.3), kNever);
}

TEST(ClosingTime, OfAFlightIsWhereItComesDown) {
  constexpr double kSpeed = 0.5, kLoad = 4.0;
  const auto at = [&](double t) { return gap(kSpeed * t - 0.5 * kLoad * t * t, kSpeed - kLoad * t); };
  EXPECT_NEAR(closing_time(at(0.0), at(1.0), 1.0), 2.0 * kSpeed / kLoad, 1e-12);
  EXPECT_EQ(closing_time(at(0.0), at(0.2), 0.2), kNever);
}

TEST(ClosingTime, OfWhatDipsAndReturnsIsFound) {
  // 1 - 8 t + 15 t^2: below nought from 1/5 to 1/3
  const auto at = [&](double t) { return gap(1.0 - 8.0 * t + 15.0 * t * t, -8.0 + 30.0 * t); };
  EXPECT_NEAR(closing_time(at(0.0), at(0.7), 0.7), 0.2, 1e-12);
  // less than the slop is none
  const auto grazes = [&](double t) { return gap(1e-9 * (1.0 - 8.0 * t + 15.0 * t * t), 1e-9 * (-8.0 + 30.0 * t)); };
  EXPECT_EQ(closing_time(grazes(0.0), grazes(0.7), 0.7), kNever);
}

}  // namespace
}  // namespace gravitas
