// Turns and what limits and springs make of them; what the joints make of the rows is tested in tests/workers/constraint/.
#include "plugin_sdk/joint_rows.h"

#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <limits>

#include "plugin_sdk/math/rotation.h"

namespace gravitas {
namespace {

double error_about_first(const Discrepancy& row) { return (row.axes * Vector3::UnitX()).dot(row.point2 - row.point1); }

// A hinge about x that was pushed beyond its single limit and comes back: the limit lets it pass, as a turn less, and the
// spring knows that it has not turned.
TEST(JointRows, ASpringStaysOnItsSideOfASingleLimit) {
  constexpr double kLimit = 0.7, kRest = 0.2, kRounding = 1e-14;
  for (const double side : {1.0, -1.0}) {
    JointLimits limits;
    (side > 0.0 ? limits.upper : limits.lower) = side * kLimit;
    JointBodies bodies;
    bodies.time_step = bodies.elapsed = 0.01;
    for (const double beyond : {-0.1, 1e-4, 5e-3}) {
      const double angle = side * (kLimit + beyond);
      bodies.spin2 = bodies.start_spin2 = -side * 0.5 * std::fabs(beyond) / bodies.time_step * Vector3::UnitX();
      const Quaternion turned = exp_rotation(angle * Vector3::UnitX());
      const Discrepancy spring =
          sprung_twist_row(Quaternion::Identity(), turned, bodies, limits, side * kRest, {50.0, 1.0});
      EXPECT_NEAR(error_about_first(spring), angle - side * kRest, kRounding) << side << ' ' << beyond;
      const Discrepancy limit = limited_twist_row(Quaternion::Identity(), turned, bodies, limits);
      EXPECT_NEAR(error_about_first(limit), beyond > 0.0 ? angle - side * kWholeTurn : angle, kRounding)
          << side << ' ' << beyond;
    }
  }
}

// What has no bound has none at any rate, though rounding may make that of square axes 1 + 2^-52; a bound keeps its power.
TEST(JointRows, ADriveWithoutABoundHasNoneAtAnyRate) {
  constexpr double kSpeed = 3.0, kUlp = std::numeric_limits<double>::epsilon();
  const auto row_of = [](double rate, double torque) {
    const std::array<double, 2> numbers = {kSpeed, torque};
    PropertyCursor bound(numbers);
    Discrepancy row;
    drive_about(Vector3::UnitY(), rate, &bound, [&](const Discrepancy& emitted) { row = emitted; });
    return row;
  };
  for (const double rate : {1.0 + kUlp, 1.0, 1.0 - 0.5 * kUlp, 0.25, 1e-6}) {
    EXPECT_EQ(row_of(rate, kUnlimited).maximum_force.x(), kUnlimited) << rate;
    EXPECT_EQ(row_of(rate, 2.0).maximum_force.x(), 2.0 / rate) << rate;
    EXPECT_DOUBLE_EQ(row_of(rate, 2.0).velocity.norm(), rate * kSpeed) << rate;
  }
  EXPECT_EQ(row_of(0.25, 0.5 * kUnlimited).maximum_force.x(), kUnlimited);
}

}  // namespace
}  // namespace gravitas
