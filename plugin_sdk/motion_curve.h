// The way of a kinematic body that follows a table of poses: a curve with continuous velocities (C1) through its rows. On
// it the body's surface may run along: a belt, whose velocity is more than its pose shows.
//
// Position: cubic Hermite between rows. Orientation, with s = (t - t_k)/h in a row's interval of length h,
//
//   q(s) = exp(b3 c3) exp(b2 c2) exp(b1 c1) q_k,    b1 = 1 - (1-s)^3,  b2 = 3 s^2 - 2 s^3,  b3 = s^3,
//   c1 = h w_k/3,  c3 = h w_{k+1}/3,  exp(c2) = exp(-c3) q_{k+1} q_k^-1 exp(-c1)
//
// (Kim, Kim, Shin, "A general construction scheme for unit quaternion curves with simple high order derivatives",
// SIGGRAPH 1995, cumulative Bezier basis, here with turns in world axes): unit without normalising, through both rows,
// with the angular velocities w_k and w_{k+1} there; at a constant angular velocity it is exact.
//
// Velocities at rows are those of math/hermite.h, turns taken as rotation vectors / time. So motion at constant velocities is
// exact, and so are positions at constant acceleration. A position or attitude that stands twice is a rest. Before the first
// row and after the last the body goes on with the velocities there. Between rows it turns by less than half a turn, the
// shorter way.
#pragma once

#include <array>
#include <span>
#include <string>
#include <vector>

#include "plugin_sdk/dynamics.h"
#include "plugin_sdk/math/pose.h"

namespace gravitas {

// Poses of a frame fixed in a body, and the velocity of its surface.
struct MotionTable {
  // Numbers of a row: time (s), position (m), orientation (w, x, y, z).
  static constexpr std::size_t kColumns = 8;
  std::vector<double> rows;           // one after the other
  Vector3 surface = Vector3::Zero();  // m/s, in that frame, added to the velocity of each point

  bool empty() const { return rows.empty(); }
};

class MotionCurve {
 public:
  // Says what is wrong with a table, empty if nothing: not whole rows, none, times that do not ascend, a number that is
  // not finite, a quaternion that is not unit.
  static std::string find_problem(const MotionTable& table);

  // The table is that of a frame X_GB^-1 fixed in the body, the curve's poses are those of the body: the geometry's
  // frame follows the table, the centre of mass goes where that takes it. Precondition: find_problem() finds none.
  MotionCurve(const MotionTable& table, const Pose& frame_in_body);

  struct State {
    Pose pose;     // of the body, world
    Twist twist;   // world, that of the surface in it
    Twist change;  // m/s^2, rad/s^2; at a row that of the interval that begins there
  };
  State at(double time) const;

 private:
  struct Row {
    double time = 0.0;
    Pose pose;
    Twist twist;
    std::array<Vector3, 3> turns;  // c1, c2, c3 of the interval that begins here
  };
  State frame_at(double time) const;

  std::vector<Row> rows_;
  Vector3 surface_;
  Pose frame_in_body_;
};

}  // namespace gravitas
