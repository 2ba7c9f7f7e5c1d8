// What one axis of a discrepancy asks of a solver: the right-hand side of its row, for the pose change and for the velocity.
//
// Every law is one form, with J x the displacement or velocity along the axis, lambda the
// multiplier and y = J x + gamma lambda:
//
//   y >= lower_target, lambda > 0 only where it is equal
//   y <= upper_target, lambda < 0 only where it is equal
//   |lambda| <= bound, which comes first
//
// An equality has both sides with the same target, a one-sided row has one.
//
// h is the time step, e* the error x2 - x1 along the axis at S*, e_n that of the same points
// carried back to S_n, beta = CorrectionFactor * correction, F = maximum_force, d the damping, c
// the compliance, v_d the desired velocity along the axis.
//
//   Pose change, bound F h^2:
//     locked            e* + J delta = (1 - beta) e_n
//     limited           e* + J delta >= lower + min(0, (1 - beta)(e_n - lower)), and so for upper
//     unilateral        as limited, from below at 0
//     with compliance   J delta + gamma mu = theta h (the velocity's target - J v*), that gamma, bound theta F h^2
//     others            none
//   Velocity, bound F h:
//     locked            J v = v_d
//     limited           J v >= v_d + b where closed below, J v <= v_d - b where closed above
//     unilateral        J v >= v_d + b where closed
//     driven, friction  J v + gamma lambda = v_d,  gamma = 1/(h d) for d > 0, else 0
//     with compliance   J v + gamma lambda = v_d - e/(c d + h),  gamma = c/(h (c d + h)),
//                       for locked, limited and unilateral axes
//
// A limit with lower = upper holds like a lock at that error (rods, coupler lengths).
//
// b = e s is what a stop gives back of the speed s at which it is arrived at (joint_bounce.h), on the side that is; 0 for
// all else, and where both sides are closed.
//
// A limit is closed where its error after the pose change is within the slop. The soft row is the
// spring and damper
//   lambda/h = -(e_{n+1}/c + d (J v - v_d)),  e_{n+1} = e_n + h (J v - v_d),
// at the end of the step (implicit Euler, order one, stable for every stiffness), e being e_n less
// the limit. A soft limit pushes only while its error is outside it at S_n or S*; where it is inside at S_n, the damper holds against
// the way beyond it alone: J v = v_d - e/h comes to the limit.
//
// In the derivative (reactions.h) the same axes are forces of the state, e being its error less the limit:
//   with compliance    f = -(e/c + d (J v - v_d)); of a limit while e is outside it, and never a pull back to it
//   driven, friction   f = d (v_d - J v), for d > 0
// both within maximum_force. Where they acted there (kForcesApplied), the axis is free at the end of the step. Limits, and drives
// and friction without damping, are rows there, where they hold (reaction_holdings.cc).
//
// A contact's friction cone comes with its material row; a joint's discrepancy has no coefficient,
// so its friction axes are bounded by maximum_force, each by itself. Compliance of free, driven and
// friction axes has no meaning and is not read.
#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <limits>
#include <optional>
#include <span>

#include "plugin_sdk/discrepancy.h"

namespace gravitas {

struct JointLaw {
  bool has_lower = false;
  bool has_upper = false;
  // Has no part in the pose change, which theta h of its impulse moves: drives and friction.
  bool is_velocity_only = false;
  bool is_guided = false;     // by a desired velocity: a guide that moves by itself
  bool yields = false;        // of a drive without bound: something is in its way (end_of_step.h)
  double lower_target = 0.0;  // of J x: m, m/s, rad or rad/s
  double upper_target = 0.0;
  double gamma = 0.0;
  double bound = std::numeric_limits<double>::infinity();  // of |lambda|
  // What a stop gives back, a part of the target of the side that does: above 0 the lower one, below 0 the upper.
  double bounce = 0.0;

  // Work that it does is real: of a drive, friction or a spring, or of a guide that moves by itself.
  bool may_do_work() const { return is_velocity_only || gamma > 0.0 || is_guided; }
  // Of what the row misses, what it moves the bodies by where they respond by so much; the rest stays in the spring.
  double share_of_bodies(double response) const { return gamma > 0.0 ? response / (response + gamma) : 1.0; }
  bool is_active() const { return has_lower || has_upper; }
  bool is_equality() const { return has_lower && has_upper && lower_target == upper_target; }
  // An equality that nothing softens or bounds.
  bool is_rigid() const { return is_equality() && gamma == 0.0 && bound == std::numeric_limits<double>::infinity(); }
  // A drive that asks for its velocity whatever stands against it.
  bool is_unbounded_drive() const { return is_velocity_only && is_rigid(); }
  void shift(double amount) { lower_target += amount, upper_target += amount; }
  bool bounces() const { return bounce > 0.0 ? has_lower : bounce < 0.0 && has_upper; }
  // Between two stops that are closed there is no room to leave either.
  void set_bounce(double next) {
    if (has_lower && has_upper) next = 0.0;
    if (next == bounce) return;
    lower_target = lower_target - std::max(0.0, bounce) + std::max(0.0, next);
    upper_target = upper_target - std::min(0.0, bounce) + std::min(0.0, next);
    bounce = next;
  }
  // Sides beside those that are.
  void close(bool lower, bool upper) {
    has_lower = has_lower || lower, has_upper = has_upper || upper;
    set_bounce(bounce);
  }
  // By how much a change of the error misses the targets.
  double missed_by(double change) const {
    return std::max({0.0, has_lower ? lower_target - change : 0.0, has_upper ? change - upper_target : 0.0});
  }
};

// What the laws of one axis are made from.
struct JointAxisState {
  AxisMode mode = AxisMode::kFree;
  double lower = 0.0, upper = 0.0, compliance = 0.0, damping = 0.0, maximum_force = kUnlimited;
  double desired_velocity = 0.0;
  double error_at_start = 0.0;  // e_n
  double error_at_trial = 0.0;  // e*
  // Of a stop towards which the bodies move at S_n (joint_bounce.h):
  double restitution = 0.0, start_rate = 0.0;  // e and J_n v_n - v_d
  double bounce = 0.0;                         // JointLaw's, where it closes
};

// A rate that reactions take for none, m/s or rad/s, of speeds whose difference it is (ConstraintDirection::size_along()).
inline double still_rate(double size) { return 1e-8 * size + 1e-10; }

// Share of the velocities that joints have to take from bodies at most, where these have followed them: taken more, a mechanism
// has come to another branch than its own.
inline constexpr double kMuchOfVelocities = 0.05;

// A side of an axis, as errors that grow away from it see it: its gap is sign (error - limit).
struct JointStop {
  double sign = 1.0;  // -1: the upper
  double limit = 0.0;
};
// The stop that the axis has on a side, with room beside it: rigid, or one that gives way; none for others.
std::optional<JointStop> stop_of(const JointAxisState& axis, double sign);
std::optional<JointStop> soft_stop_of(const JointAxisState& axis, double sign);

// True for an axis whose law is a force of the state: with compliance, or driven or friction with damping.
bool acts_as_force(const Discrepancy& discrepancy, int axis);

// That force on body 2, N or N m, at error_at_trial and the velocity J v. Precondition: acts_as_force().
double force_of(const JointAxisState& axis, double velocity);

// All the axes of a discrepancy with error vector `start_error` (world) at S_n.
JointAxisState joint_axis_state(const Discrepancy& discrepancy, int axis, const Vector3& direction,
                                const Vector3& start_error);

// Turns (rad) that bring a twist next to its single limit; 0 where it has none. Such a limit is met again once a turn, and what
// passes it is told as a turn less (JointLimits::limited_turn()), which states between those of steps may look like.
double turns_to_limit(const Discrepancy& discrepancy);
void add_turns(double turns, Discrepancy* twist);

// A limit that bore `force` while the trial state was integrated holds like a lock: what the integrator is off by to its free
// side is put right as well, or it would count as open in the next step. Not one that is arrived at and bounces.
void hold_what_bears(double force, JointAxisState* axis);

// True for a discrepancy of points that is all which holds its two bodies, among the rows next to it. Each may then be pushed
// at its own: two points of a hinge would contradict each other by what they are open.
bool is_only_point(std::span<const std::uint32_t> bodies, std::span<const std::uint32_t> modes, std::size_t row);

// From the middle between the points to body 2's, along what is rigidly locked and closes, with errors along the axes.
// Along a radial axis pushes go through both.
Vector3 half_of_locked(const Discrepancy& discrepancy, const Matrix3& axes, const Vector3& errors);

// An angular velocity w* that goes along with the part of a pose change's turn that joints make: their moment turns with the
// body in the step, and so does the axis about which it has none (that of a slender rod between ball joints). A contact's
// stays where it is. What joints and contacts push against each other turns nothing: of the joints' turn it is what lies along
// the whole, and no more than that.
Vector3 turned_by_joints(const Vector3& turn, const Vector3& whole_turn, const Vector3& angular_velocity);

JointLaw pose_law(const JointAxisState& axis, double beta, double time_step);

// True for a spring: an axis that would be held, with compliance.
bool is_spring(const JointAxisState& axis);

// A spring's part in the pose change, J delta + gamma mu = theta h (target of its velocity law - J v*): mu is theta h lambda
// where nothing strikes in the step. `approach` is J v*; for theta = 1, where v* has moved bodies to S*, the errors tell it,
// however far that turned. None for theta = 0.
JointLaw spring_pose_law(const JointAxisState& axis, double approach, double theta, double time_step);

// `error_after` is e* + J delta, `slop` how far from a limit it still counts as closed.
JointLaw velocity_law(const JointAxisState& axis, double error_after, double slop, double time_step);

// The multiplier that makes a row right when its value is now J x + gamma lambda = value, and a
// unit of multiplier changes that by `response` > 0.
double relaxed_multiplier(const JointLaw& law, double multiplier, double value, double response);

}  // namespace gravitas
