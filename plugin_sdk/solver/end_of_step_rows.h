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
#include "plugin_sdk/solver/reply.h"

namespace gravitas {

// A body where the pose change leaves it.
struct EndBody {
  Pose pose;
  Matrix3 inverse_inertia;
  Matrix3 stiffened;                   // inverse of inertia and geometric stiffness, for a step of the pose change
  Matrix3 turn = Matrix3::Identity();  // from S*
  bool is_stiffened = false;
};

// A joint's discrepancy and its laws.
struct EndJoint {
  std::uint32_t row = 0, body1 = 0, body2 = 0;
  Discrepancy discrepancy;
  Matrix3 axes;
  bool is_only_point = false;  // joint_laws.h
  double slop = 0.0, length = 1.0;
  std::array<JointAxisState, 3> states;
  std::array<JointLaw, 3> pose_laws, velocity_laws;
  // at the end of the step
  std::array<ConstraintDirection, 3> directions;
  Vector3 arm1 = Vector3::Zero(), arm2 = Vector3::Zero();
  Vector3 errors;                  // along the axes
  std::size_t turns = 0;           // rows that follow its own: two for a rod that pulls, one for a swing that is held
  std::array<double, 3> driven{};  // impulses of drives without bound by which these move the pose, N s, N m s
  std::array<double, 3> whole_bounces{};  // of which SharedRestitution takes a share
  std::array<bool, 3> shares{};           // it does

  // Of a rod, to its ends: the arms above are to its middle.
  Vector3 own_arm1() const { return arm1 - 0.5 * errors[0] * directions[0].linear; }
  Vector3 own_arm2() const { return arm2 + 0.5 * errors[0] * directions[0].linear; }
};

struct EndContact {
  std::uint32_t row = 0, body1 = 0, body2 = 0;
  ConstraintDirection gap_row;
  double gap = 0.0, gap_target = 0.0, slop = 0.0;
  ContactLaw law;
  Vector3 arm1, arm2;                 // to the surface points
  Vector3 turning = Vector3::Zero();  // impulses of rolling and spinning friction in the law's frame, N m s
  bool is_closed = false, slides = false;
  double displacing_friction = 1.0;  // contact_law.h
  double softness = 0.0;             // ConeRow's
  double whole_target = 0.0;         // of which SharedRestitution takes a share
  bool shares = false;               // it does

  bool is_of_pair(const EndContact& other) const { return body1 == other.body1 && body2 == other.body2; }
};

// True for modes that hold an error, of an axis or of any of a discrepancy's.
bool is_held(AxisMode mode);
bool holds_pose(const Discrepancy& d);

// Rows along an axis with the arms of either body, and about one; what they turn the bodies by comes with with_turns().
inline ConstraintDirection direction_at(const Vector3& axis, const Vector3& arm1, const Vector3& arm2) {
  ConstraintDirection d;
  d.linear = axis;
  d.angular1 = axis.cross(arm1);
  d.angular2 = arm2.cross(axis);
  return d;
}

inline ConstraintDirection turning_about(const Vector3& axis) {
  ConstraintDirection d;
  d.angular1 = -axis;
  d.angular2 = axis;
  return d;
}

inline ConstraintDirection with_turns(ConstraintDirection d, const Matrix3& inverse1, const Matrix3& inverse2) {
  d.turn1 = inverse1 * d.angular1;
  d.turn2 = inverse2 * d.angular2;
  return d;
}

// The joint's directions, arms and errors with the bodies at their ends; `turn`: of body 2 against body 1, from S*.
void move_joint(const SolverBody& one, const SolverBody& two, const EndBody& end1, const EndBody& end2,
                const Vector3& turn, EndJoint* joint);

// A swing by the angle a resists to being turned round while it is held. With u and w the ways that its two directions go across
// it, a grows by (u - w)^2 cot(a/2)/4 - (u + w)^2 tan(a/2)/4: held back with mu it resists to u - w with mu cot(a/2)/2, pushed on
// to u + w with mu tan(a/2)/2. The row of that way, and its stiffness; 0: none.
struct TurnOfSwing {
  ConstraintDirection direction;
  double stiffness = 0.0;
};
// About `axis` from `first`, both unit, world; `push` is the multiplier of the angle's row.
TurnOfSwing turn_of_swing(const Vector3& axis, const Vector3& first, double angle, double push);

// The contact's cone, with rows from `first` on.
ConeContact cone_contact(const EndContact& contact, std::uint32_t first, bool has_turning);

// When steps of Newton's method have come to their end.
class ShrinkingSteps {
 public:
  // True if, after a step that changed ways of at most `size` by `change` (m), the next would change them by rounding alone:
  // by this change times the rate of the last two, and a part of it where the rate fell as fast as that method's does.
  bool end_with(double change, double size, double rounding);
  std::size_t count() const { return count_; }

 private:
  std::size_t count_ = 0;
  double last_ = 0.0, last_but_one_ = 0.0;  // changes
};

// Of all islands.
SolverOutcome outcome_of(const std::vector<ConeSummary>& summaries);

// What is overlapped or missed at S*, m.
double sum_of_overlaps(const std::vector<EndJoint>& joints, const std::vector<EndContact>& contacts);
// From S_n to S*, and as far again as v* goes, m.
double way_of(const SolverBody& body, double gyration, double h);
// Of two bodies against each other at a point, from S_n to S*, m.
double way_of(const Vector3& point, const SolverBody& one, const SolverBody& two);

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
