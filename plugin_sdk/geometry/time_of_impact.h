// When two moving convex solids first come close, never later than they do.
//
// Conservative advancement. At the time t the nearest points give a plane that parts the solids, with normal n (from a
// to b) and gap d. As long as a plane parts them by more than half the target they cannot touch. Planes that turn at the
// angular velocity w are tried for w = 0, w_a and w_b, so that a solid which another carries along does not seem to come
// nearer; then those of faces that lie along them, with exact normals, and that of two edges, which stays across both. With
// c(s) = c + s v the offset of the centres, w_a the angular velocity of a and x a point of it, in axes that turn along with
// the plane,
//
//   n . x(s) = n . x + s (n x r) . x + s^2/2 ((n x r) x w_a - (n x w) x r) . x + ...,   r = w_a - w
//
// whose third derivative is at most |r| (|w| + |w_a|)^2 |x| (of w = 0: |n x w_a| |w_a|^2 rho, rho the distance from the axis
// through the centre). The greatest over all x is the support of the solid in a direction that moves with s (B. Mirtich,
// "Timewarp rigid body simulation" (2000), bounds the first derivative alone: steps of first order, where these are of
// third). Curvature that leads away from the plane counts as none: then the bound of the gap is concave in s, each chord
// under it is a bound, too, and regula falsi climbs it from the safe side; it is followed for half a turn at most. A last
// bound, for solids that spin fast, holds for all angles at once: the support of what the solid sweeps in a whole turn.
//
// Steps repeat until the gap is at most the target (an impact), a bound reaches the end of the interval (none), or
// kMostSteps are spent: then the answer is an impact at the time that was reached, its depth showing that the gap is
// still wider. That takes a spin of many turns in grazing contact. It also ends so where features lie so nearly flush that
// rounding hides the plane between them: one vertex or edge against another in ten thousand, at gaps up to 1e-7 of the
// coordinates.
//
// Lengths in m, world axes. The answer depends on the arguments alone.
#pragma once

#include <array>
#include <optional>

#include "plugin_sdk/geometry/support_map.h"
#include "plugin_sdk/math/motion.h"

namespace gravitas {

// A solid of a body on its way: see plugin_sdk/math/motion.h.
struct MovingSolid {
  const SupportMap* map = nullptr;  // null: the half-space y <= 0 of its frame
  Pose geometry;                    // of the solid's frame in the body's
  Pose start;                       // of the body
  Motion motion;
};

struct Impact {
  double fraction = 0.0;              // of the motion's interval
  Vector3 normal = Vector3::UnitY();  // unit, from a to b
  Vector3 point = Vector3::Zero();    // midway between the two surface points
  double depth = 0.0;                 // minus the gap, at most the target; positive at `begin` if they overlap there
};

// Part of the interval, 0 <= begin <= end <= 1.
struct TimeSpan {
  double begin = 0.0;
  double end = 1.0;
};

inline constexpr int kMostSteps = 20000;

// The first time in the span at which the gap is at most `target_gap` (m), or a time before at which it is at most that
// and was always more than half of it. Nothing if the gap stays above half of it: an impact is never missed.
//
// A target below 1e-10 of the radii of the maps counts as that. Two half-spaces never meet. Preconditions: poses finite
// and unit, rotations at most 1e8 rad (where angles are rounded to 1e-8 rad).
std::optional<Impact> first_impact(const MovingSolid& a, const MovingSolid& b, double target_gap,
                                   const TimeSpan& span = {});

// A vertex, an edge or a triangle whose corners each go straight from start to end, as those of a body that deforms do.
struct MovingCorners {
  std::array<Vector3, 3> start;
  std::array<Vector3, 3> end;
  std::size_t count = 0;  // 1 to 3
};

// The same for two of these; the bound above is exact for them along its plane. A target below 1e-10 of the
// coordinates, taken from the first corner of a, counts as that.
std::optional<Impact> first_impact(const MovingCorners& a, const MovingCorners& b, double target_gap);

// m: no point of a solid moves farther over the whole interval, seen from the body frame of `other`.
double greatest_travel(const MovingSolid& solid, const MovingSolid& other);

}  // namespace gravitas
