// For authors of joints whose types declare coordinates: the loop over the joints of Constraint.Coordinates, and the ways and
// angles that the shipped joints tell.
//
// Ways and angles are those of body 2 relative to body 1. A rate is the derivative of its value by the velocities of the
// bodies, whatever error the joint has: with w = w2 - w1, and v the velocity of a point of body 2 as body 1 sees it,
//   v = v2 + w2 x (p - c2) - v1 - w1 x (p - c1).
#pragma once

#include <optional>

#include "plugin_sdk/constraint.h"
#include "plugin_sdk/joint_rows.h"

namespace gravitas {

struct Coordinate {
  double value = 0.0;  // m or rad
  double rate = 0.0;   // m/s or rad/s
};

namespace detail {
void push_coordinate(const stage::ConstraintCoordinatesReply& reply, std::size_t joint, std::uint32_t index,
                     const Coordinate& coordinate);
}  // namespace detail

// Calls measure(type id, bound numbers, bodies, emit) for every joint that holds; emit(index, coordinate) adds the one that
// the type declares at this place, in their order; an empty std::optional adds nothing. Throws Refusal for numbers that are not
// finite.
template <typename Measure>
void measure_each(const stage::ConstraintDiscrepanciesRequest& request, const stage::ConstraintCoordinatesReply& reply,
                  Measure&& measure) {
  for (std::size_t i = 0; i < request.constraint_type().size(); ++i) {
    if (request.intact()[i] == 0) continue;
    name_refused_row(kJointRow, i, [&] {
      measure(request.constraint_type()[i], PropertyCursor(detail::slice(request.bound(), request.bound_begin(), i)),
              detail::bodies_of(request, i), [&](std::uint32_t index, const std::optional<Coordinate>& coordinate) {
                if (coordinate) detail::push_coordinate(reply, i, index, *coordinate);
              });
    });
  }
}

// How far a point of body 2 is from one of body 1 along a unit axis of body 1.
Coordinate way_along(const Vector3& axis, const Vector3& point1, const Vector3& point2, const JointBodies& bodies);

// How far it is in all. Where the points meet, its rate is that at which they part.
Coordinate distance_between(const Vector3& point1, const Vector3& point2, const JointBodies& bodies);

// The twist of frame 2 against frame 1 about their first axes (twist_between() of discrepancy.h): with limits the turn that
// JointLimits::turn() compares with them, else above -pi up to pi. None where the axes point against each other.
std::optional<Coordinate> twist_of(const Pose& frame1, const Pose& frame2, const JointLimits& limits,
                                   const JointBodies& bodies);

// The angle, 0 ... pi, between a unit direction of body 1 and one of body 2. Where they are parallel, its rate is that at which
// it grows from 0, or shrinks from pi.
Coordinate swing_of(const Vector3& first, const Vector3& second, const JointBodies& bodies);

// The angle about a unit axis, above -pi up to pi, from `zero`, across it and fixed in the same body, to a unit direction of the
// other body, which turns by `turning` (rad/s) against the first. None where the direction is along the axis.
std::optional<Coordinate> azimuth_of(const Vector3& axis, const Vector3& zero, const Vector3& direction,
                                     const Vector3& turning);

// The same the other way about.
std::optional<Coordinate> reversed(const std::optional<Coordinate>& angle);

// The angle above -pi up to pi that is this one but for whole turns.
double within_half_turn(double angle);

}  // namespace gravitas
