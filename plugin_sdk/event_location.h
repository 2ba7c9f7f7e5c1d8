// Where a simulator that stops at events ends its next inner step: decisions from numbers of one pair of bodies, whose
// separation along the contact's normal changes with the acceleration a = (end_speed - start_speed) / length. Speeds in
// m/s, positive when the bodies part; times in s.
#pragma once

#include <limits>

#include "plugin_sdk/dynamics.h"
#include "plugin_sdk/math/pose.h"
#include "plugin_sdk/math/types.h"

namespace gravitas {

struct Encounter {
  double fraction = 0.0;     // of the trial motion, 0 … 1: when the pair first comes to `target_gap`; 0: it starts so
  double gap = 0.0;          // then, m; beyond target_gap: what comes later is not known
  double start_speed = 0.0;  // at the start of the trial
  double end_speed = 0.0;    // at its end
  double slop = 0.0;         // gap at which a solver may take the pair for closed, m
  bool is_touching = false;  // since the step before: what closes it is the solver's
  double left_gap = 0.0;     // that the solver left a touching pair with, m: lower flights are its roundings
  // Of a pair that starts closed: how fast it bounced off, how fast turning may bring other parts of it together, and how
  // deep these may come unseen, m. Without such parts 0.
  double bounce_speed = 0.0, turning_speed = 0.0, harmless_depth = 0.0;
  // How deep the trial may press a pair that starts closed together, m: beyond, what is thin may be pushed out on its other side.
  double most_pressed = std::numeric_limits<double>::infinity();
};

struct NextStop {
  double length = 0.0;    // of the next inner step
  bool is_trial = false;  // look again at a trial of this length, rather than commit it
  bool meets = false;     // it ends with the pair closed
};

// The longest inner step, up to `length` (that of the trial), that an encounter allows.
//
// A pair that starts closed and bounced off, and of which other parts may meet within the trial, leaves each other first: what
// is apart has a time of impact. Another that starts closed and parts, to come back within the trial, is followed to the top
// of its flight; so is one that the straight motion lets meet before, if a trial of that length meets no more (what turns
// may come back sooner). Flights shorter than `shortest_flight`, or lower than the target gap or what the solver left open,
// are none: the pair rests. What starts closed and is pressed together ends its trial at `most_pressed`, but for trials shorter than a
// thousand of the shortest flights. One that starts so near that the collision slot calls it met, but no nearer than target_gap,
// flies on until it is. One that comes from afar is met where the trial, taken for the straight motion between its ends,
// deviates from it by less than half the target (by |a| t (length - t) / 2 at the time t). Until then trials are shortened
// to twice the time of the meeting, and steps end before it, each squaring the distance. The step that meets is short, as
// friction acts from its start to its end: where the way is straight, one that ends before, where no solver sees it closed
// yet, comes first. It ends a little after the meeting, two target gaps deep, so that the contact is closed; a pair that
// comes so near without touching goes on so far, too, and deeper each time while no contact is found.
NextStop stop_before(const Encounter& encounter, double length, double target_gap, double shortest_flight);

// A body in a trial: where it starts and ends, and how fast it starts.
struct TrialMotion {
  Pose start, end;
  Twist velocity;
};

// Velocity (m/s) of body 2 relative to body 1 across the normal, where they touched when the trial began, in directions of
// its end: `point1` and `point2`, of their surfaces, and the unit normal are those of the contact then. What slides is taken
// with the arms it has then. What sticks or rolls does not: it would slip as fast as it turns within the trial. Where its
// contact was before depends on the shapes: at a corner or edge of the one it moves with the material of the one and its normal
// with the other, under something round it keeps its place, seen from the other, or from the line of the centres.
Vector3 start_slip(const Vector3& point1, const Vector3& point2, const Vector3& normal, const TrialMotion& one,
                   const TrialMotion& two);

// Two bodies whose surfaces slide on each other, in a trial with its solution: sums over their contacts, each weighted
// with the largest friction that it bears, mu lambda_N.
class Slide {
 public:
  // A contact with a unit normal, the coefficient of dynamic friction, velocities of body 2 relative to body 1 (m/s) at
  // the contact when the trial begins and ends, and the impulse (N s) on body 2.
  void add(const Vector3& normal, double friction, const Vector3& start_velocity, const Vector3& end_velocity,
           const Vector3& impulse);

  // Speed of the slide at its start, m/s; 0 without friction.
  double start_speed() const { return weight_ > 0.0 ? start_ / weight_ : 0.0; }
  // The trial ends with it stuck.
  bool has_stuck() const;
  // When it comes to its end, s, if friction is the same throughout a trial of `length`: beyond that while the surfaces
  // slide on, before it where they slide back, or where sticking took less than the friction of all that time.
  // Infinite for a slide that does not slow down.
  double end(double length) const;

 private:
  double weight_ = 0.0, start_ = 0.0, end_ = 0.0, used_ = 0.0;
};

}  // namespace gravitas
