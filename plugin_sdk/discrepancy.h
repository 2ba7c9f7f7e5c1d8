// The discrepancy: the one form in which joints and contacts are described to every solver (§ 2.7.4, extended).
//
// The seed's discrepancy is the quadruple (x1, x2, v_r, beta): a point on either body that should coincide, the
// velocity x2 should have relative to x1, and the share of the error that a step removes. As printed it is
// always three bilateral rows, so four contact quadruples weld a box to the floor. Extended here by three
// orthonormal axes with a mode each, compliance, damping and a bound on the force, and by the angular twin.
//
//        body 1 --r1--.                       .--r2-- body 2
//                  x1 ~~~ m ~~~ x2     error x2 - x1, m the point midway
//
// Velocity of a row along the unit axis a (world):  J v = a.(v2 + w2 x r2) - a.(v1 + w1 x r1), r1 and r2 from the
// centres of mass to m, so J = [-a, -(r1 x a), a, r2 x a]; the angular twin has J = [0, -a, 0, a]. An impulse lambda
// along a pushes body 2 by +lambda a and body 1 by -lambda a, both at m: pushed at x1 and x2 they would turn by the
// couple (x2 - x1) x lambda a, out of nothing. J delta is the change of a.(x2 - x1) to first order in the error; so x1 is
// told along free axes where x2 is (held_point() of joint_rows.h), or half of a body's way along them would be an arm.
#pragma once

#include <cstdint>
#include <limits>
#include <span>

#include "plugin_sdk/math/pose.h"
#include "plugin_sdk/math/types.h"

namespace gravitas {

// What holds along one axis of a discrepancy.
enum class AxisMode : std::uint32_t {
  kFree = 0,        // nothing
  kLocked = 1,      // error and velocity difference vanish, multiplier of either sign
  kLimited = 2,     // error stays within lower … upper
  kUnilateral = 3,  // error a.(x2 - x1) >= 0, multiplier >= 0
  kFriction = 4,    // velocity only; the two friction axes share a cone about the unilateral axis
  kDriven = 5       // velocity only; reaches the desired velocity within maximum_force
};

// Modes of the three axes, four bits each from the lowest, and one of two flags at most: the angular twin, and the
// radial one, whose first axis points from x1 to x2 and turns with them, so that the error along it is |x2 - x1| (a rod or
// rope). All other axes turn with body 1.
inline constexpr std::uint32_t kAngularDiscrepancy = 1U << 12;
inline constexpr std::uint32_t kRadialDiscrepancy = 1U << 13;

// With kAngularDiscrepancy: the angle between a direction s fixed in body 1, the second axis, and a direction r fixed in
// body 2, the second axis turned by point2. The first axis is s x r/|s x r| and turns with both, which reactions.h must know.
inline constexpr std::uint32_t kSwingDiscrepancy = 1U << 14;

// With kAngularDiscrepancy: the twist of a shaft fixed in body 2 against one fixed in body 1, times the cosine of half the
// bend between the two. The first axis bisects them and turns with both; point1 is half their difference, across it.
inline constexpr std::uint32_t kTwistDiscrepancy = 1U << 16;

// With kAngularDiscrepancy: a component of the rotation vector x2 - x1 by which body 2 has turned against body 1, along x1, a
// unit direction fixed in body 1. The first axis is its gradient made unit, so the error along that is the component over the
// gradient's length. For what gives way: springs and dampers.
inline constexpr std::uint32_t kComponentDiscrepancy = 1U << 17;

// Beside these, in SolverSolveRequest alone: what of the discrepancy acts_as_force() (solver/joint_laws.h) acted among the
// wrenches while S* was integrated (simulator Smooth), and is not to be applied again. No mode that a constraint may answer.
inline constexpr std::uint32_t kForcesApplied = 1U << 15;

constexpr std::uint32_t pack_modes(AxisMode x, AxisMode y, AxisMode z, bool angular = false) {
  return static_cast<std::uint32_t>(x) | static_cast<std::uint32_t>(y) << 4 | static_cast<std::uint32_t>(z) << 8 |
         (angular ? kAngularDiscrepancy : 0U);
}

constexpr AxisMode axis_mode(std::uint32_t modes, int axis) {
  return static_cast<AxisMode>((modes >> (4 * axis)) & 0xFU);
}

// True for axes of velocities alone, which hold no error: driven and friction.
constexpr bool is_drive(AxisMode mode) { return mode == AxisMode::kDriven || mode == AxisMode::kFriction; }

// True if the value is one that pack_modes() makes.
constexpr bool is_valid_mode(std::uint32_t modes) {
  const std::uint32_t flags = modes & ~0xFFFU;
  return (flags <= kAngularDiscrepancy || flags == kRadialDiscrepancy ||
          flags == (kAngularDiscrepancy | kSwingDiscrepancy) || flags == (kAngularDiscrepancy | kTwistDiscrepancy) ||
          flags == (kAngularDiscrepancy | kComponentDiscrepancy)) &&
         (modes & 0xFU) <= 5 && ((modes >> 4) & 0xFU) <= 5 && ((modes >> 8) & 0xFU) <= 5;
}

// Stands for "no bound" in maximum_force, lower and upper (columns hold finite numbers only).
inline constexpr double kUnlimited = std::numeric_limits<double>::max();

struct Discrepancy {
  Vector3 point1 = Vector3::Zero();          // x1, world, m (angular: rotation vector, rad)
  Vector3 point2 = Vector3::Zero();          // x2
  Vector3 velocity = Vector3::Zero();        // desired velocity of x2 relative to x1, world, m/s or rad/s
  double correction = 1.0;                   // beta, 0 … 1
  Quaternion axes = Quaternion::Identity();  // columns of its matrix are the axes, world
  std::uint32_t modes = pack_modes(AxisMode::kLocked, AxisMode::kLocked, AxisMode::kLocked);
  Vector3 lower = Vector3::Zero();  // along the axes, m or rad
  Vector3 upper = Vector3::Zero();
  Vector3 compliance = Vector3::Zero();                   // m/N or rad/(N m)
  Vector3 damping = Vector3::Zero();                      // N s/m or N m s/rad
  Vector3 maximum_force = Vector3::Constant(kUnlimited);  // N or N m
  // e of limits and one-sided axes that nothing softens, 0 … 1: what meets them at a speed v leaves them at e v
  double restitution = 0.0;
  // What the desired velocity along each axis changes by, world, m/s^2 or rad/s^2; of an error that curves otherwise than the row does
  // (a rope that slants off its drum), less what velocities make of the difference. Simulator Smooth needs it.
  Vector3 acceleration = Vector3::Zero();

  bool is_angular() const { return (modes & kAngularDiscrepancy) != 0; }
  bool is_radial() const { return (modes & kRadialDiscrepancy) != 0; }
  bool is_swing() const { return (modes & kSwingDiscrepancy) != 0; }
  bool is_twist() const { return (modes & kTwistDiscrepancy) != 0; }
  bool is_component() const { return (modes & kComponentDiscrepancy) != 0; }
  bool has_forces_applied() const { return (modes & kForcesApplied) != 0; }
};

// One row of the constraint Jacobian, with the arms to the point midway between the discrepancy's two.
struct JacobianRow {
  Vector3 linear1, angular1, linear2, angular2;

  // J v for the velocities of the two bodies.
  double velocity(const Vector3& v1, const Vector3& w1, const Vector3& v2, const Vector3& w2) const {
    return linear1.dot(v1) + angular1.dot(w1) + linear2.dot(v2) + angular2.dot(w2);
  }
};

// Row along `axis` (unit, world) for bodies whose centres of mass are at com1 and com2 (world, m).
JacobianRow jacobian_row(const Discrepancy& discrepancy, const Vector3& axis, const Vector3& com1, const Vector3& com2);

// Point of a body given in the world while the body had pose `from` (of its centre of mass), where it is when
// the body has pose `to`.
Vector3 carried(const Vector3& point, const Pose& from, const Pose& to);

// How the second of two unit directions is turned from the first: angle (0 ... pi) and unit axis; any axis across where
// they are parallel.
struct Swing {
  double angle = 0.0;
  Vector3 axis = Vector3::Zero();
};
Swing swing_between(const Vector3& first, const Vector3& second);

// The two directions of a swing, and a swing as two others make it, held at the same angle.
struct SwingDirections {
  Vector3 first, second;
};
SwingDirections swing_directions(const Discrepancy& swing);
void set_swing(const SwingDirections& directions, double angle, Discrepancy* swing);
// The angle that a swing is held at.
double held_angle(const Discrepancy& swing);

// Twist of frame 2 about its first axis after the shortest turn that takes the first axis of frame 1 to it, -pi ... pi.
// Its rate is w.(a1 + a2)/(1 + a1.a2), w the turning of frame 2 relative to frame 1, a1 and a2 the first axes.
double twist_between(const Quaternion& frame1, const Quaternion& frame2);

// The unit shafts of a twist and its angle (rad), a twist as others make it, and as it is once either body has turned: its
// angle goes on from where it was, beyond half a turn, too. Undefined where the shafts point against each other.
struct Twisting {
  Vector3 first, second;
  double angle = 0.0;

  Twisting turned(const Quaternion& turn1, const Quaternion& turn2) const;
  double cosine() const { return 0.5 * (first + second).norm(); }  // of half the bend
  Vector3 bisector() const;
};
Twisting twisting_of(const Discrepancy& twist);
void set_twisting(const Twisting& twisting, Discrepancy* twist);

// The rotation vector of a turn of body 2 against body 1 (world, rad, of up to a turn and more) once either has turned on.
Vector3 turn_after(const Vector3& turn, const Quaternion& turn1, const Quaternion& turn2);

// A component of that, and as it is once either body has turned on; what body 2 turns by against body 1, by a little, changes
// it by gradient() times as much: dexp_t^-T of the direction. Of turns beyond 3/4 of a whole one, where it grows without bound,
// the gradient is that there.
struct TurnComponent {
  Vector3 turn;       // t
  Vector3 direction;  // unit, world, fixed in body 1

  TurnComponent turned(const Quaternion& turn1, const Quaternion& turn2) const;
  double value() const { return direction.dot(turn); }
  Vector3 gradient() const;
};
TurnComponent turn_component_of(const Discrepancy& component);
void set_turn_component(const TurnComponent& component, Discrepancy* d);

// Error x2 - x1 (world) when the bodies are at `then` poses, for a discrepancy that was written at `now` poses.
// Exact for points, and along the first axis for swings, twists (times the cosine that the twist was written with) and
// components (over the length of the gradient that they were written with); other angular errors are carried to first order
// in the rotation between the two.
Vector3 error_at(const Discrepancy& discrepancy, const Pose& now1, const Pose& now2, const Pose& then1,
                 const Pose& then2);

// The same as the discrepancy's axes see it, which turn with body 1 from `now` to `then` (an angular discrepancy's stay).
Vector3 error_in_axes_at(const Discrepancy& discrepancy, const Pose& now1, const Pose& now2, const Pose& then1,
                         const Pose& then2);

// Joint error of a discrepancy with error vector `error`, as its axes see it: its norm over the axes that are locked, and
// over the limits where they are exceeded; what gives way (compliance) is no error. m, or rad for the angular twin.
double joint_error(const Discrepancy& discrepancy, const Vector3& error);

// How far the error is from the nearer limit of each axis, m or rad, negative beyond it; kUnlimited where there is none, or
// where it gives way.
Vector3 limit_gaps(const Discrepancy& discrepancy);

// A contact as a discrepancy (§ 2.7.5.1, with x1 and x2 as they must be: x2 - x1 along the normal is minus the
// depth): first axis the normal (unit, from body 1 to body 2), unilateral; the others friction.
Discrepancy contact_discrepancy(const Vector3& point, const Vector3& normal, double depth);

// The columns of a message as discrepancies: the same names in ConstraintDiscrepanciesReply and SolverSolveRequest.
struct DiscrepancyColumns {
  std::span<const double> point1, point2, velocity, correction, axes;
  std::span<const std::uint32_t> mode;
  std::span<const double> lower, upper, compliance, damping, maximum_force;
  std::span<const double> restitution = {}, desired_acceleration = {};  // empty: none has any

  std::size_t size() const { return mode.size(); }
  Discrepancy at(std::size_t row) const;
};

}  // namespace gravitas
