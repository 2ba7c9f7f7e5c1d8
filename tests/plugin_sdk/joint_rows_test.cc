// Turns and what limits and springs make of them; what the joints make of the rows is tested in tests/workers/constraint/.
#include "plugin_sdk/joint_rows.h"

#include <gtest/gtest.h>

#include <cmath>

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
    bodies.time_step = 0.01;
    for (const double beyond : {-0.1, 1e-4, 5e-3}) {
      const double angle = side * (kLimit + beyond);
      bodies.spin2 = -side * 0.5 * std::fabs(beyond) / bodies.time_step * Vector3::UnitX();
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

}  // namespace
}  // namespace gravitas
