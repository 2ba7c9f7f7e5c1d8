// For authors of joints: a course that a drive follows, the property `Motion`, and the rows that keep it.
//
//   declaration     motion_property("rad", "Angle of the crank", "MaximumTorque")
//   bind            JointDrive drive = JointDrive::of(&properties);
//                   drive.follow(&properties, "Crank", "AngularSpeed", "MaximumTorque");
//                   write_drive(drive, &out);
//   discrepancies   const JointDrive drive = read_drive(&bound);
//                   if (!limits.is_none() && !drive.is_course_alone()) emit(limited_twist_row(q1, q2, bodies, limits));
//                   if (!drive.motion.is_none())
//                     emit(followed_twist(one, two, bodies, limits, drive.motion.at(bodies.time).within(limits),
//                                         drive.force));
//
// The course is a curve through rows {t, value} (math/hermite.h), continuous with its rate (C1); before the first row and after
// the last it goes on with the rates there. The time is that of the state: the end of the step while one is made, so that
// nothing has to be remembered, and a state of the past is driven as it was.
//
// Without a bound on its force the drive is a locked row, whose error is counted from the course: value and rate are met where
// the step ends. With simulator Smooth its acceleration is, too (Discrepancy::acceleration).
//
// With a bound F it is a driven row, which asks for the course's rate and for a speed u at which it comes nearer by e, what it
// is behind by (half of what the free bodies' speed is off by is its own to make, as a method of order 2 moves bodies):
//
//   u = 2 e/T / (1 + sqrt(1 + 2 e/(a T^2))),   T = 2 h,  a = F/4m
//
// u = e/T near the course, u^2 = 2 a e far from it: a speed that a quarter of F takes away again on the way that is left. m is
// what moves if the other end and what else hangs on the bodies stay: where that is four times as much and more, or loads
// take three quarters of F, it may overshoot. It is behind by some h^2 of what loads accelerate by.
#pragma once

#include <cmath>
#include <limits>
#include <span>
#include <string_view>
#include <vector>

#include "plugin_sdk/constraint.h"
#include "plugin_sdk/joint_rows.h"
#include "plugin_sdk/property.h"

namespace gravitas {

// The course at a time: m or rad, and by s and s^2.
struct CourseState {
  double value = 0.0, rate = 0.0, change = 0.0;

  // As far as limits let it go: where they stop it, it is at rest, those that give way too.
  CourseState within(const JointLimits& limits) const;
};

class JointMotion {
 public:
  // Rows {t, value}; none where the property is absent. Refuses, with the field named, times that do not ascend, and
  // numbers that are not finite.
  static JointMotion of(std::span<const double> rows, std::string_view field);

  bool is_none() const { return rows().empty(); }
  CourseState at(double time) const;

  void write(BoundWriter* out) const;
  // A view of the bound numbers.
  static JointMotion read(PropertyCursor* bound);

 private:
  // Three numbers each: time, value, rate.
  std::span<const double> rows() const { return made_.empty() ? bound_ : made_; }

  std::vector<double> made_;
  std::span<const double> bound_;
};

// A drive of one axis: to a speed or along a course, or none.
struct JointDrive {
  JointMotion motion;
  double speed = std::numeric_limits<double>::quiet_NaN();  // NaN: to none
  double force = kUnlimited;                                // N or N m

  // The next two properties, speed and largest force; a request that was recorded before a joint had them may end before.
  static JointDrive of(PropertyCursor* properties);
  // And `Motion`, further on. Refuses both, and a force without either, by the names of the fields.
  void follow(PropertyCursor* properties, std::string_view type, std::string_view speed_field,
              std::string_view force_field);

  bool is_none() const { return motion.is_none() && std::isnan(speed); }
  // It is met whatever is in its way, and its course ends at the limits: rows of limits would contradict it.
  bool is_course_alone() const { return !motion.is_none() && force >= kUnlimited; }
};
void write_drive(const JointDrive& drive, BoundWriter* out);
JointDrive read_drive(PropertyCursor* bound);

// `Motion` of a type, a table over time whose values have the unit ("rad"): "Angle ..." is what follows it, `bound` the
// property of the largest force.
Property motion_property(std::string_view unit, std::string_view what, std::string_view bound);

// The row that keeps the twist of two frames about their first axes, which meet at a point of the hinge, on a course with at
// most a torque (kUnlimited: whatever it takes). The twist is known within half a turn of the course, so that courses may turn
// for ever; what falls behind by more goes on with another turn. With limits it is the turn that they tell.
Discrepancy followed_twist(const Pose& frame1, const Pose& frame2, const JointBodies& bodies, const JointLimits& limits,
                           const CourseState& course, double torque);

// The row that keeps a point of body 2 on a course along a unit axis of body 1, counted from point1, with at most a force.
Discrepancy followed_way(const Vector3& axis, const Vector3& point1, const Vector3& point2, const JointBodies& bodies,
                         const CourseState& course, double force);

}  // namespace gravitas
