// What the end-of-step solution keeps of bodies, joints and contacts, and the rows it makes of them.
#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "plugin_sdk/discrepancy.h"
#include "plugin_sdk/solver/bodies.h"
#include "plugin_sdk/solver/cone_problem.h"
#include "plugin_sdk/solver/contact_law.h"
#include "plugin_sdk/solver/joint_laws.h"

namespace gravitas {

// A body where the pose change leaves it.
struct EndBody {
  Pose pose;
  Matrix3 inverse_inertia;
  Matrix3 stiffened;                   // inverse of inertia and geometric stiffness, for a step of the pose change
  Matrix3 turn = Matrix3::Identity();  // from S*
};

// A joint's discrepancy and its laws.
struct EndJoint {
  std::uint32_t row = 0, body1 = 0, body2 = 0;
  Discrepancy discrepancy;
  Matrix3 axes;
  double slop = 0.0, length = 1.0;
  std::array<JointAxisState, 3> states;
  std::array<JointLaw, 3> pose_laws, velocity_laws;
  // at the end of the step
  std::array<ConstraintDirection, 3> directions;
  Vector3 arm1 = Vector3::Zero(), arm2 = Vector3::Zero();
  Vector3 errors;  // along the axes
};

struct EndContact {
  std::uint32_t row = 0, body1 = 0, body2 = 0;
  ConstraintDirection gap_row;
  double gap = 0.0, gap_target = 0.0, slop = 0.0;
  ContactLaw law;
  Vector3 arm1, arm2;                 // to the surface points
  Vector3 turning = Vector3::Zero();  // impulses of rolling and spinning friction in the law's frame, N m s
  bool is_closed = false, slides = false;
  std::uint32_t lowered = 0;
};

// True for modes that hold an error, of an axis or of any of a discrepancy's.
bool is_held(AxisMode mode);
bool holds_pose(const Discrepancy& d);

// Rows along an axis with the arms of either body, and about one; what they turn the bodies by comes with with_turns().
ConstraintDirection direction_at(const Vector3& axis, const Vector3& arm1, const Vector3& arm2);
ConstraintDirection turning_about(const Vector3& axis);
ConstraintDirection with_turns(ConstraintDirection d, const Matrix3& inverse1, const Matrix3& inverse2);

// The joint's directions, arms and errors with the bodies at their ends; `turn`: of body 2 against body 1, from S*.
void move_joint(const SolverBody& one, const SolverBody& two, const EndBody& end1, const EndBody& end2,
                const Vector3& turn, EndJoint* joint);

// By how much a pose law is missed where its row's value is 0, m or rad.
double missed_by(const JointLaw& law);
// From S_n to S*, and as far again as v* goes, m.
double way_of(const SolverBody& body, double gyration, double h);

// lambda (J before + J after)/2
void add_work(const ConeRow& row, const BodyMotion& before, const BodyMotion& after, Gain* gain);

// 0 where the inverse is.
Vector3 moments_of(const Vector3& inverse_moments);
// What a turn adds to the moment that a push at an arm exerts: (p.r) 1 - (p r^T + r p^T)/2.
Matrix3 geometric_stiffness(const Vector3& arm, const Vector3& push);
// (I + K)^-1 of a body with inverse moments D in its principal axes R: R D^1/2 (1 + D^1/2 R^T K R D^1/2)^-1 D^1/2 R^T.
// Directions in which K would take away more than half of the inertia count as half.
Matrix3 stiffened_inverse(const Quaternion& orientation, const Vector3& inverse_moments, const Matrix3& stiffness);

}  // namespace gravitas
