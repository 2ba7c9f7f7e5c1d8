// Joints that hold by locks alone: what counts as such, and what they are off by.
#include "plugin_sdk/joint_locks.h"

#include <gtest/gtest.h>

#include <cstdint>
#include <numbers>
#include <vector>

#include "plugin_sdk/body.h"
#include "plugin_sdk/discrepancy.h"
#include "plugin_sdk/math/rotation.h"
#include "tests/plugin_sdk/solver/reaction_problem.h"

namespace gravitas {
namespace {

using harness::ReactionProblem;

DiscrepancyColumns columns_of(const ReactionProblem& p) {
  return {p.point1, p.point2, p.velocity,   p.correction, p.axes,         p.mode,
          p.lower,  p.upper,  p.compliance, p.damping,    p.maximum_force};
}

bool is_lock(const Discrepancy& d) {
  ReactionProblem problem;
  problem.add_body(1.0, Vector3::Zero(), Vector3::Zero(), Vector3::Zero());
  problem.add_joint(kNone, 0, d);
  return are_locks(columns_of(problem));
}

Discrepancy about(const Vector3& error, const Quaternion& axes, std::uint32_t modes) {
  Discrepancy d;
  d.point1 = Vector3(1, 2, 3), d.point2 = d.point1 + error, d.axes = axes, d.modes = modes;
  return d;
}

constexpr std::uint32_t kSlider = pack_modes(AxisMode::kFree, AxisMode::kLocked, AxisMode::kLocked);

TEST(JointLocks, AreRigidAxesWhateverForceTheyTake) {
  Discrepancy lock;
  EXPECT_TRUE(is_lock(lock));
  lock.modes = kSlider;
  EXPECT_TRUE(is_lock(lock));
  lock.modes = pack_modes(AxisMode::kFree, AxisMode::kFree, AxisMode::kFree);
  EXPECT_TRUE(is_lock(lock));

  Discrepancy rod;
  rod.modes = pack_modes(AxisMode::kLimited, AxisMode::kFree, AxisMode::kFree) | kRadialDiscrepancy;
  rod.lower.x() = rod.upper.x() = 2.0;
  EXPECT_TRUE(is_lock(rod));
  rod.lower.x() = 1.0;
  EXPECT_FALSE(is_lock(rod)) << "a rope";

  Discrepancy weak;
  weak.maximum_force.y() = 1e3;
  EXPECT_FALSE(is_lock(weak));
  Discrepancy spring;
  spring.compliance.z() = 1e-3;
  EXPECT_FALSE(is_lock(spring));
  for (const AxisMode mode : {AxisMode::kUnilateral, AxisMode::kFriction, AxisMode::kDriven}) {
    Discrepancy other;
    other.modes = pack_modes(AxisMode::kLocked, mode, AxisMode::kLocked);
    EXPECT_FALSE(is_lock(other));
  }
}

// A slider that has gone 2 m along its axis, which has turned by a right angle since: what it is off by across counts, in axes as
// they were.
TEST(JointLocks, AreOffAlongTheirOwnAxes) {
  const Quaternion turned = exp_rotation(0.5 * std::numbers::pi * Vector3::UnitZ());
  ReactionProblem here, there;
  for (ReactionProblem* problem : {&here, &there}) problem->add_body(1.0, {}, {}, {});
  here.add_joint(kNone, 0, about(Vector3::Zero(), Quaternion::Identity(), kSlider));
  // along y, which x has become; -0.1 along x, which is minus what y has become; 0.2 along z
  there.add_joint(kNone, 0, about({-0.1, 2.0, 0.2}, turned, kSlider));
  std::vector<double> errors(3);
  ASSERT_TRUE(find_lock_errors(columns_of(here), columns_of(there), errors));
  EXPECT_LT((vector_at(errors, 0) - Vector3(0, 0.1, 0.2)).norm(), 1e-15);

  ReactionProblem other;
  other.add_body(1.0, {}, {}, {});
  other.add_joint(kNone, 0,
                  about({-0.1, 2.0, 0.2}, turned, pack_modes(AxisMode::kLocked, AxisMode::kLocked, AxisMode::kLocked)));
  EXPECT_FALSE(find_lock_errors(columns_of(here), columns_of(other), errors)) << "another joint";
}

TEST(JointLocks, OfARodCountFromItsLength) {
  Discrepancy rod;
  rod.modes = pack_modes(AxisMode::kLimited, AxisMode::kFree, AxisMode::kFree) | kRadialDiscrepancy;
  rod.lower.x() = rod.upper.x() = 2.0;
  rod.point2 = Vector3(2, 0, 0);
  ReactionProblem here, there;
  for (ReactionProblem* problem : {&here, &there}) problem->add_body(1.0, {}, {}, {});
  here.add_joint(kNone, 0, rod);
  rod.point2 = Vector3(0, 2.5, 0), rod.axes = exp_rotation(0.5 * std::numbers::pi * Vector3::UnitZ());
  there.add_joint(kNone, 0, rod);
  std::vector<double> errors(3);
  ASSERT_TRUE(find_lock_errors(columns_of(here), columns_of(there), errors));
  EXPECT_LT((vector_at(errors, 0) - Vector3(0.5, 0, 0)).norm(), 1e-15);
}

// A body that turns about a point it is locked to a metre from its centre: off by what its centre misses.
TEST(JointLocks, KnowTheVelocitiesTheyWant) {
  ReactionProblem problem;
  problem.add_body(1.0, Vector3(1, 0, 0), Vector3(0, 3, 0.5), Vector3::Zero());
  set_vector(problem.angular_velocity, 0, Vector3(0, 0, 2));
  Discrepancy lock;
  lock.velocity = Vector3(0.25, 0, 0);
  problem.add_joint(kNone, 0, lock);
  std::vector<double> errors(3);
  find_lock_velocity_errors(columns_of(problem), problem.discrepancy_body,
                            {problem.position, problem.linear_velocity, problem.angular_velocity}, errors);
  EXPECT_LT((vector_at(errors, 0) - Vector3(-0.25, 1.0, 0.5)).norm(), 1e-15);
}

}  // namespace
}  // namespace gravitas
