// Bodies that push and are not pushed.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <cmath>
#include <string>

#include "tests/scenes/scene_run.h"

namespace gravitas {
namespace {

using harness::SceneRun;
using harness::set;

constexpr double kSpeed = 1.0, kFriction = 0.5;

class Kinematic : public ::testing::TestWithParam<const char*> {
 protected:
  SceneRun run_{"kinematic.gravitas", {set("Integrator", std::string(GetParam()))}};
};

INSTANTIATE_TEST_SUITE_P(EachIntegrator, Kinematic, ::testing::Values("Euler", "SemiImplicitEuler"),
                         [](const auto& which) { return std::string(which.param); });

TEST_P(Kinematic, APlatformCarriesABox) {
  double last_slip = 0.0, offset = 0.0;
  while (!run_.is_done()) {
    run_.step();
    const SceneRun::Motion box = run_.body("Box");
    const double caught_up = kSpeed / (kFriction * kG);
    const double expected = std::min(kSpeed, kFriction * kG * run_.time());
    ASSERT_NEAR(box.twist.linear.x(), expected, run_.time() < caught_up + run_.time_step() ? 1e-3 : 1e-9)
        << run_.time();
    ASSERT_NEAR(box.pose.position.y(), 0.2, 1e-9) << run_.time();
    if (run_.time() < caught_up + 2.0 * run_.time_step()) last_slip = box.pose.position.x() - kSpeed * run_.time();
    offset = box.pose.position.x() - kSpeed * run_.time();
    // from then on it stays where it is on the platform
    ASSERT_NEAR(offset, last_slip, 1e-9) << run_.time();
  }
  // it slid back by v^2/(2 mu g), timed to first order
  EXPECT_NEAR(offset, -0.5 * kSpeed * kSpeed / (kFriction * kG), 0.5 * kSpeed * run_.time_step() + 1e-4);
}

TEST_P(Kinematic, APlatformHitsABallAndDoesNotFeelIt) {
  while (!run_.is_done()) {
    run_.step();
    const SceneRun::Motion platform = run_.body("Platform");
    ASSERT_EQ(platform.twist.linear, Vector3(kSpeed, 0, 0));
    ASSERT_EQ(platform.twist.angular, Vector3::Zero());
    ASSERT_NEAR(platform.pose.position.x(), run_.time(), 1e-13);  // rounding of 600 additions
    ASSERT_EQ(platform.pose.position.y(), -0.25);
    ASSERT_EQ(platform.pose.orientation.coeffs(), Quaternion::Identity().coeffs());
  }
  // against an infinite mass: (1 + e) times its speed
  EXPECT_NEAR((run_.body("Target").twist.linear - Vector3(1.5, 0, 0)).norm(), 0.0, 1e-12);
}

TEST_P(Kinematic, AnImmovableBodyIsUnaffected) {
  const Pose wall = run_.body("Wall").pose;
  while (!run_.is_done()) {
    run_.step();
    const SceneRun::Motion now = run_.body("Wall");
    ASSERT_EQ(now.pose.position, wall.position);
    ASSERT_EQ(now.pose.orientation.coeffs(), wall.orientation.coeffs());
    ASSERT_EQ(now.twist.linear, Vector3::Zero());
    ASSERT_EQ(now.twist.angular, Vector3::Zero());
  }
  EXPECT_NEAR((run_.body("Loose").twist.linear - Vector3(-2, 0, 0)).norm(), 0.0, 1e-12);
}

}  // namespace
}  // namespace gravitas
