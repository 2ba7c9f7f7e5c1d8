// Laws of what gives way: a force in the derivative, and the same at the end of a step, once.
#include "plugin_sdk/solver/joint_laws.h"

#include <gtest/gtest.h>

#include <cmath>

namespace gravitas {
namespace {

// Soft, one-sided, driven.
Discrepancy three_axes() {
  Discrepancy d;
  d.point2 = {0.3, -0.2, 0.1};
  d.velocity = {0.1, 0.2, 0.3};
  d.modes = pack_modes(AxisMode::kLocked, AxisMode::kUnilateral, AxisMode::kDriven);
  d.compliance = {0.01, 0.002, 0.0};
  d.damping = {3.0, 5.0, 7.0};
  return d;
}

JointAxisState state_of(const Discrepancy& d, int axis) {
  return joint_axis_state(d, axis, Matrix3::Identity().col(axis), d.point2 - d.point1);
}

TEST(JointLaws, OfAShortStepAreTheForceInTheDerivative) {
  constexpr double kStep = 1e-9, kVelocity = 0.7;
  for (int axis = 0; axis < 3; ++axis) {
    const JointAxisState state = state_of(three_axes(), axis);
    const JointLaw law = velocity_law(state, state.error_at_trial, 0.0, kStep);
    ASSERT_TRUE(law.has_lower);
    // J v + gamma lambda = target
    const double force = (law.lower_target - kVelocity) / law.gamma / kStep;
    EXPECT_NEAR(force_of(state, kVelocity), force, 1e-6 * std::fabs(force)) << axis;
    EXPECT_GT(std::fabs(force), 1.0);
  }
}

// One row with a response of its own: what a spring pushes in the pose change is theta h of its impulse.
TEST(JointLaws, OfSpringsAgreeWhereNothingStrikes) {
  constexpr double kStep = 0.01, kResponse = 0.7, kVelocity = -2.0;
  for (const double theta : {0.5, 1.0}) {
    JointAxisState state = state_of(three_axes(), 0);
    state.error_at_trial = state.error_at_start + kStep * kVelocity;
    const JointLaw velocity = velocity_law(state, state.error_at_trial, 0.0, kStep);
    const JointLaw pose = spring_pose_law(state, kVelocity, theta, kStep);
    ASSERT_TRUE(is_spring(state) && velocity.is_equality() && pose.is_equality());
    const double impulse = (velocity.lower_target - kVelocity) / (kResponse + velocity.gamma);
    const double push = pose.lower_target / (kResponse + pose.gamma);
    EXPECT_NEAR(push, theta * kStep * impulse, 1e-14 * std::fabs(push)) << theta;
    EXPECT_GT(std::fabs(push), 1e-3);
  }
  EXPECT_FALSE(spring_pose_law(state_of(three_axes(), 0), kVelocity, 0.0, kStep).is_active());
}

// Without compliance left, the error is gone at the end of the step, however far off S* is from where v* alone leads.
TEST(JointLaws, OfStiffSpringsAreThoseOfLocks) {
  Discrepancy d = three_axes();
  d.compliance[0] = 1e-300, d.damping[0] = 0.0, d.velocity.setZero();
  JointAxisState state = state_of(d, 0);
  state.error_at_trial = 0.9;
  const JointLaw law = spring_pose_law(state, 5.0, 1.0, 0.01);
  EXPECT_NEAR(state.error_at_trial + law.lower_target, 0.0, 1e-15);
  EXPECT_LT(law.gamma, 1e-290);
}

TEST(JointLaws, LeaveAloneWhatWasApplied) {
  Discrepancy d = three_axes();
  d.modes |= kForcesApplied;
  for (int axis = 0; axis < 3; ++axis) {
    EXPECT_FALSE(velocity_law(state_of(d, axis), 0.0, 0.0, 0.01).is_active()) << axis;
    EXPECT_FALSE(pose_law(state_of(d, axis), 1.0, 0.01).is_active()) << axis;
    EXPECT_FALSE(is_spring(state_of(d, axis))) << axis;
  }
  // what does not give way is held as ever
  d.compliance.setZero(), d.damping.setZero();
  for (int axis = 0; axis < 3; ++axis)
    EXPECT_TRUE(velocity_law(state_of(d, axis), state_of(d, axis).error_at_trial, 0.0, 0.01).is_active() || axis == 1);
  EXPECT_TRUE(pose_law(state_of(d, 0), 1.0, 0.01).is_rigid());
}

}  // namespace
}  // namespace gravitas
