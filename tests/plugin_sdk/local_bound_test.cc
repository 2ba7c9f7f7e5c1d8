#include "plugin_sdk/local_bound.h"

#include <gtest/gtest.h>

#include <array>
#include <cmath>

#include "plugin_sdk/math/motion.h"

namespace gravitas {
namespace {

constexpr LocalBound* kNothing = nullptr;

LocalBound box(const Vector3& half_extents) {
  LocalBound bound = {BoundKind::kBox, Vector3::Zero(), Quaternion::Identity(), half_extents};
  measure(half_extents, &bound);
  return bound;
}

TEST(LocalBound, TheMarginIsAHundredthOfTheSmallest) {
  const LocalBound ground;
  LocalBound ball = {BoundKind::kSphere, Vector3::Zero(), Quaternion::Identity(), Vector3::Constant(2)};
  measure(Vector3::Constant(2), &ball);
  EXPECT_EQ(contact_margin({kNothing, 0}), 0.0);
  EXPECT_EQ(contact_margin(std::array{ground}), 0.0);
  EXPECT_DOUBLE_EQ(contact_margin(std::array{ground, ball, box(Vector3(3, 0.5, 1))}), 0.005);
  for (const double thickness : {0.0, 1e-15, 1e-3})
    EXPECT_DOUBLE_EQ(contact_margin(std::array{ball, box(Vector3(3, thickness, 1))}), 3e-5) << thickness;
  // whatever bounds it
  LocalBound unbounded;
  measure(Vector3(3, 0.5, 1), &unbounded);
  EXPECT_DOUBLE_EQ(contact_margin(std::array{ball, unbounded}), 0.005);
}

TEST(LocalBound, ThicknessIsToldAsItIs) {
  EXPECT_EQ(box(Vector3(3, 1e-4, 1)).half_thickness, 1e-4);
  EXPECT_EQ(box(Vector3(3, 1e-4, 1)).least_half_extent, 3e-3);
  for (const double flat : {0.0, 1e-12}) EXPECT_EQ(box(Vector3(3, flat, 1)).half_thickness, 3e-3);
  EXPECT_EQ(LocalBound{}.half_thickness, 0.0);
}

TEST(LocalBound, WithoutOneABodyIsEverywhere) {
  const Bounds bounds = bounds_of(LocalBound{}, Pose{});
  EXPECT_TRUE(std::isinf(bounds.lower.x()) && std::isinf(bounds.upper.z()));
}

// Every corner on its way stays inside.
TEST(LocalBound, AMotionStaysInItsSweptBounds) {
  const LocalBound bound = box(Vector3(1.0, 0.2, 0.5));
  const Pose from{Vector3(1, 2, 3), Quaternion::Identity()};
  for (const double angle : {0.1, 1.0, 3.0}) {
    const Motion motion{Vector3(4, -1, 0), angle * Vector3(0.6, 0, 0.8)};
    const Bounds swept = swept_bounds(bound, from, moved(from, motion, 1.0), motion.rotation);
    for (int i = 0; i <= 40; ++i) {
      const Bounds now = bounds_of(bound, moved(from, motion, i / 40.0));
      EXPECT_TRUE((swept.lower.array() <= now.lower.array() + 1e-12).all()) << angle << ' ' << i;
      EXPECT_TRUE((swept.upper.array() >= now.upper.array() - 1e-12).all()) << angle << ' ' << i;
    }
  }
}

}  // namespace
}  // namespace gravitas
