// For authors of joints: the rows that the shipped joints are made of, in the form of discrepancy.h.
//
// A joint keeps a frame in each body. The frames coincide at the start; what the joint holds is said by where a point of
// body 2's frame is in body 1's, and by angles between axes of the two frames (swings). These are exact for turns of any
// size, which a rotation vector is to first order only, and they weigh turns by themselves: points so far from the origin
// would weigh them against ways, which is right for bodies of about that size alone. An error of 1 rad counts as 1 m.
#pragma once

#include <algorithm>
#include <string_view>

#include "plugin_sdk/constraint.h"
#include "plugin_sdk/property.h"

namespace gravitas {

inline constexpr double kQuarterTurn = 1.57079632679489661923;

// Throws Refusal if a joint is not of the type.
void demand_type(std::uint64_t type, std::string_view name);

// The vector made unit. Throws Refusal naming the field if it has no direction.
Vector3 unit_axis(const Vector3& axis, std::string_view field);

// What a step has turned by so far, rad: by the rate that it has come to, as methods of order 1 move bodies, and by the
// mean of that and the one that it began with, as those of order 2 do.
struct StepTurn {
  double by_end = 0.0, by_mean = 0.0;

  static StepTurn of(double rate_at_start, double rate_at_end, double elapsed) {
    return {elapsed * rate_at_end, 0.5 * elapsed * (rate_at_start + rate_at_end)};
  }
};

// A spring and a damper on an axis, which yields as they let it (compliance, joint_laws.h): of torque or force -(k e + c e'),
// with a damper alone -c e'. As scenes give them: NaN or 0 where there is none.
struct JointSpring {
  double stiffness = 0.0, damping = 0.0;

  // The next two properties, refused if negative; a request that was recorded before a joint had them may end here.
  static JointSpring of(PropertyCursor* properties);
  bool is_none() const { return stiffness == 0.0 && damping == 0.0; }
  // As one of the axes (0 ... 2) of a discrepancy, whose error is counted from where the spring is at rest.
  void yield_on(int axis, Discrepancy* d) const;
};

// Refuses, with the field named, limits that cross, and limits without the 0 of the start between them. NaN: absent.
struct JointLimits {
  double lower = -kUnlimited, upper = kUnlimited;
  double restitution = 0.0;  // of both stops
  JointSpring spring;        // that holds what is beyond them; none: they stop dead

  static JointLimits of(double lower, double upper, std::string_view lower_field, std::string_view upper_field);
  // Of an angle that is known within one turn: two that span a whole one are refused, too.
  static JointLimits of_turn(double lower, double upper, std::string_view lower_field, std::string_view upper_field);
  bool is_none() const { return lower == -kUnlimited && upper == kUnlimited; }
  bool has_both() const { return lower > -kUnlimited && upper < kUnlimited; }
  // As the first axis of a discrepancy, whose error is `scale` times what they limit.
  void limit(double scale, Discrepancy* d) const;
  // The turn that is meant by an angle, among angle + k 2 pi; `way`: what the step turned by to get there. Without limits the
  // one within pi. With two the nearest to their middle, with one the nearest to half a turn on its free side; but where the step
  // began within the limits in another, that: what a step turns beyond a limit is beyond it, however little is between the two.
  double turn(double angle, double way) const;
  // The same where the way is known by two methods: with one limit what either says to have come to it from its free side has.
  double turn(double angle, const StepTurn& way) const {
    return at_limit(turn(angle, way.by_end), turn(angle, way.by_mean));
  }
  // That turn as the limits see it. A single limit is met again once a turn: what comes from behind it passes. What began beyond
  // it by 0.02 rad or half of the way, which is known to first order, or moves back by no more than rounding, is on it.
  double limited_turn(double angle, double way) const;
  double limited_turn(double angle, const StepTurn& way) const {
    return at_limit(limited_turn(angle, way.by_end), limited_turn(angle, way.by_mean));
  }

 private:
  // Of two turns the one at the only limit; the first where there are two.
  double at_limit(double one, double other) const;
};

// What the twist of two frames (twist_between()) changed by in the step.
StepTurn twisted_way(const Quaternion& frame1, const Quaternion& frame2, const JointBodies& bodies);

void write_limits(const JointLimits& limits, BoundWriter* out);
JointLimits read_limits(PropertyCursor* bound);

// `Restitution` of a joint's stops, the next property; a request that was recorded before it had that may end before.
// Refuses what is outside 0 ... 1, and more than 0 where the joint has no stop, or one that gives way; `stops` says what would
// make one.
Property restitution_property();
double read_restitution(PropertyCursor* properties, std::string_view type, bool has_stops, std::string_view stops);

// `LimitStiffness` and `LimitDamping`, or these behind the name of `whose` limits, the next two properties: limits that give way. A
// request that was recorded before a joint had them may end before. Beyond a limit by e they push with k e + c e', and never
// pull. Refused are both without stops, or with stops that leave no room; the damper without the spring; and a Restitution beside
// them: what gives way throws back what its damper leaves.
Property limit_stiffness_property(std::string_view unit, std::string_view whose = {}, std::string_view needs = {});
Property limit_damping_property(std::string_view unit, std::string_view whose = {});
JointSpring read_limit_spring(PropertyCursor* properties, std::string_view type, const JointLimits& limits,
                              bool has_stops, std::string_view stops, std::string_view whose = {});

void write_spring(const JointSpring& spring, BoundWriter* out);
JointSpring read_spring(PropertyCursor* bound);
// Limits with the spring that they give way by.
void write_soft_limits(const JointLimits& limits, BoundWriter* out);
JointLimits read_soft_limits(PropertyCursor* bound);
// A row (its first axis) that the spring holds, as far as it does.
Discrepancy sprung(Discrepancy row, const JointSpring& spring);

// A spring against the angle by which a direction has turned about an axis, from across it: as one on the swing of the direction
// from there, asin(sine sin(angle)), where direction and axis keep an angle of that sine. The torque is that of the angle at the
// state; within a right angle of it, beyond which it pulls on.
JointSpring on_swing(const JointSpring& spring, double sine, double swing);

// A drive about an axis, from the next two properties, AngularSpeed and MaximumTorque, or `which` behind either; a request that was
// recorded before a joint had them may end before. Bound are its speed and torque, and nothing where there is none. Refuses a torque
// without a speed.
void write_drive(PropertyCursor* properties, std::string_view type, BoundWriter* out, std::string_view which = {});
// Calls emit with its row, if there is one, about a unit axis about which the bodies turn by `rate` times what is driven.
template <typename Emit>
void drive_about(const Vector3& axis, double rate, PropertyCursor* bound, Emit&& emit);
// The same about first x second: of a unit direction of body 1 and one of body 2, across each other, with which it turns.
template <typename Emit>
void drive_across(const Vector3& first, const Vector3& second, double rate, PropertyCursor* bound, Emit&& emit);

// A frame with its origin at `origin` and its first axis along a unit vector (world).
Pose frame_along(const Vector3& origin, const Vector3& first);

// One whose second axis is where azimuths are counted from: the world's x as seen along the first, and where that is along x,
// to 1e-3, -z.
Pose azimuth_frame(const Vector3& origin, const Vector3& first);

// Numbers of a frame in its body, and back; the orientation is made unit.
void write_frame(const Pose& body, const Pose& frame, BoundWriter* out);
Pose read_frame(PropertyCursor* bound, const Pose& body);

// Point of body 2 held in the axes of a frame of body 1 that are marked: the marked components of (point - origin) are
// `rest`. x2 is the point, x1 its projection along the unmarked axes, so that a long way along them is no error and the
// rows are exact there.
struct HeldAxes {
  bool x = false, y = false, z = false;
};
Discrepancy held_point(const Pose& frame1, const Vector3& point2, HeldAxes held, const Vector3& rest = Vector3::Zero());

// One row along a unit axis through two points, x and the others free; the error is axis.(x2 - x1).
Discrepancy row_along(const Vector3& axis, const Vector3& point1, const Vector3& point2, AxisMode mode);
// The same with limits of that error.
Discrepancy limited_way_row(const Vector3& axis, const Vector3& point1, const Vector3& point2,
                            const JointLimits& limits);

// One row along a unit axis through a point, for what meshes: its error is known but for whole periods (m), as those of teeth
// and turns of a thread. Of error + k period that is taken which the step made, by the bodies' velocities at its end: all of
// what they make of it in its time, or half or none, as methods put the loads of a step into its ways. `ahead` of the error is
// by how much body 2's point is ahead of the point: speeds are right to the second order of the turns that close the error where
// only body 1 turns, with 0, and where only body 2 does, with 1/2.
Discrepancy meshing_row(const Vector3& axis, const Vector3& point, double ahead, double error, double period,
                        const JointBodies& bodies);

// One row about a unit axis, with the angle (rad) as its error.
Discrepancy row_about(const Vector3& axis, double angle, AxisMode mode);

// The row about a unit axis that a drive keeps at a speed (rad/s) with at most a torque (N m).
Discrepancy driven_row(const Vector3& axis, double speed, double torque);
// A row whose first axis is kDriven, at a velocity (rad/s, along that axis) with at most a torque.
Discrepancy driven(const Discrepancy& row, const Vector3& velocity, double torque);

// The row of the angle between a unit direction of body 1 and one of body 2, which is held at `angle` (rad, 0 ... pi);
// its error is counted from there.
Discrepancy swing_row(const Vector3& first, const Vector3& second, double angle, AxisMode mode = AxisMode::kLocked);
// The same where that angle is at most `most`: a regular cone.
Discrepancy cone_row(const Vector3& first, const Vector3& second, double most, double restitution = 0.0);

// A frame of a cross of two bars (unit vectors, not parallel): its first axis along the one, the third across both.
Pose cross_frame(const Vector3& origin, const Vector3& first, const Vector3& other);

// The turn of frame 2 against frame 1, a rotation vector in the axes of frame 1, as an angular discrepancy whose axes are all
// free, or which a spring turns back about whatever axis. Exact to first order in the step's turn.
Discrepancy turn_between(const Quaternion& frame1, const Quaternion& frame2);
Discrepancy sprung_turn(const Quaternion& frame1, const Quaternion& frame2, const JointSpring& spring);

// The component of that turn along an axis (0 ... 2) of frame 1, which a spring and a damper turn back along its gradient: a
// torque -(k t + c t') grad t. With unequal springs about several axes these have a potential, what acts along the axes has none.
Discrepancy sprung_component(const Quaternion& frame1, const Quaternion& frame2, int axis, const JointSpring& spring);

// The frame of a hinge about the axis from one point to another (world): the first axis along it, the origin at its point next
// to bodies.centre(), since with one far out ways and turns could not be told apart. Refuses points that name no axis.
Pose hinge_frame(const Vector3& point1, const Vector3& point2, const JointBodies& bodies, std::string_view type);

// The unit axis midway between the first ones of two frames, so that drift moves both alike.
Vector3 axis_between(const Pose& frame1, const Pose& frame2);

template <typename Emit>
void drive_along(const Discrepancy& row, const Vector3& axis, double rate, PropertyCursor* bound, Emit&& emit) {
  if (bound->at_end() || !(rate > 0.0)) return;
  const double speed = bound->number(), torque = bound->number();
  // The power is that of the torque about what is driven. No bound stays none: a rate of axes that are square may be
  // 1 + 2^-52, and a quotient by it a bound, of 1.8e308 N m, that nothing tells from one that may be reached.
  emit(driven(row, rate * speed * axis, torque < kUnlimited ? std::min(torque / rate, kUnlimited) : kUnlimited));
}
template <typename Emit>
void drive_about(const Vector3& axis, double rate, PropertyCursor* bound, Emit&& emit) {
  drive_along(row_about(axis, 0.0, AxisMode::kDriven), axis, rate, bound, emit);
}
template <typename Emit>
void drive_across(const Vector3& first, const Vector3& second, double rate, PropertyCursor* bound, Emit&& emit) {
  const Discrepancy row = swing_row(first, second, kQuarterTurn, AxisMode::kDriven);
  drive_along(row, row.axes * Vector3::UnitX(), rate, bound, emit);
}

// Calls emit with the rows that keep axes of two frames across each other: the first of frame 2 across the second and
// third of frame 1, so that frame 2 turns about it only; and its second across the third of frame 1, which leaves no turn.
template <typename Emit>
void hold_axis(const Pose& frame1, const Pose& frame2, Emit&& emit) {
  const Vector3 axis = frame2.orientation * Vector3::UnitX();
  emit(swing_row(frame1.orientation * Vector3::UnitY(), axis, kQuarterTurn));
  emit(swing_row(frame1.orientation * Vector3::UnitZ(), axis, kQuarterTurn));
}
// These two, and that the origins coincide.
template <typename Emit>
void hold_hinge(const Pose& frame1, const Pose& frame2, Emit&& emit) {
  Discrepancy anchor;
  anchor.point1 = frame1.position;
  anchor.point2 = frame2.position;
  emit(anchor);
  hold_axis(frame1, frame2, emit);
}
template <typename Emit>
void hold_orientation(const Pose& frame1, const Pose& frame2, Emit&& emit) {
  hold_axis(frame1, frame2, emit);
  emit(swing_row(frame1.orientation * Vector3::UnitZ(), frame2.orientation * Vector3::UnitY(), kQuarterTurn));
}

// The row whose error is the twist times cos(swing/2), about the unit bisector of the first axes (kTwistDiscrepancy):
// w.bisector is the rate of just that while the twist is small. `scale` receives the cosine.
Discrepancy twist_row(const Quaternion& frame1, const Quaternion& frame2, AxisMode mode, double* scale);
// A spring against the twist's way from `rest`, known within half a turn of the middle of the limits, else of rest.
Discrepancy sprung_twist_row(const Quaternion& frame1, const Quaternion& frame2, const JointBodies& bodies,
                             const JointLimits& limits, double rest, const JointSpring& spring);
// The same row with limits of the twist, which is the turn that JointLimits::limited_turn() tells.
Discrepancy limited_twist_row(const Quaternion& frame1, const Quaternion& frame2, const JointBodies& bodies,
                              const JointLimits& limits);

}  // namespace gravitas
