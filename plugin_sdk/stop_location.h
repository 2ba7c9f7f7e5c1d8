// Where a stop of a joint closes on the way between two states, or a bounded drive or friction reaches its velocity: decisions from
// the gap of one stop and its rate in both.
#pragma once

#include <array>
#include <cstddef>

#include "plugin_sdk/discrepancy.h"
#include "plugin_sdk/dynamics.h"
#include "plugin_sdk/math/types.h"

namespace gravitas {

// A stop of a joint in a state: one side of an axis that limits its error and leaves it room, rigidly without a bound on its force,
// or by a spring with a damper, whose force jumps where it is met; or a bounded drive or friction that slips, as seen from one side
// of its velocity: its force jumps where it comes to hold.
struct StopGap {
  // of the error to it, m or rad, or of a drive's velocity to its own, m/s or rad/s; below 0 beyond it
  double gap = kUnlimited;
  double rate = 0.0;   // of the gap, m/s or rad/s
  double slop = 0.0;   // gap that is none
  double reach = 1.0;  // m that a rad counts as: arms and coordinates; 1 of turns
  double still = 0.0;  // rate that is none
  bool gives_way = false;
  bool is_drive = false;  // whose gap has no rate that is known
  double asked = 0.0;     // of a drive: its velocity

  bool exists() const { return gap < kUnlimited; }
  // Bears nothing from here on: it is away, or goes away; one that gives way bears until it is away.
  bool is_open() const { return exists() && (gap > slop || (rate > still && !gives_way)); }
  // Of one that bore where the way here began, and was let go of since: it has come back beyond itself, or bears on its way off.
  bool is_pressed_again(const StopGap& from, bool bears) const;
  // Of a drive: it asks for the same as there. One along a course goes by where it is.
  bool asks_the_same(const StopGap& there) const;
  // May have closed in a time that ends here, as far as this state alone tells.
  bool may_have_closed(double time) const;
};

// Lower and upper stop of each axis, in turn. Bodies as they are in the state for which the discrepancy was told; of the world
// all is zero.
struct StopBody {
  Vector3 centre = Vector3::Zero();
  Twist velocity = {};
  bool is_pushed = false;
};
constexpr std::size_t kStopsOfRow = 6;
std::array<StopGap, kStopsOfRow> stop_gaps(const Discrepancy& discrepancy, const StopBody& body1,
                                           const StopBody& body2);

// The time (s) from the first state on at which an open stop closes, on the cubic through both gaps with their rates; infinite
// where that does not come beyond the slop of the second state in `length`; of a drive on the straight line. Precondition: the first
// gap is at least 0.
double closing_time(const StopGap& from, const StopGap& to, double length);

}  // namespace gravitas
