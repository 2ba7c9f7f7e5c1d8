// Checks of the physics in answers: laws that every honest method obeys, whatever its way. The kernel samples them, an
// author can test against them. Each looks at every row, in time linear in the rows (the pairs: n log n and what
// overlaps along one axis), and returns an empty string, or which row breaks which law, by how much, and what is
// allowed.
//
// Preconditions: the columns have passed structure and numbers (plugin_sdk/checks.h): lengths match, indices exist,
// numbers are finite, quaternions and normals are unit. Requests are those that the answer was made from.
//
// What no law tells is not looked at: wrenches of forces and discrepancies of joints, whose types are their plugins' (they
// are confirmed by another process instead), and where a method may choose (which of several normals of a deep overlap,
// how a load is shared among contacts).
#pragma once

#include <cstdint>
#include <span>
#include <string>
#include <vector>

#include "plugin_sdk/math/types.h"
#include "plugin_sdk/solver/bodies.h"
#include "schemas/stage_frames.h"

namespace gravitas {

// ---- integrator ----------------------------------------------------------------------------------------------------

// The wrenches that an integrator was told in one attempt: those of its first question, and how far others were from
// them.
class WrenchRange {
 public:
  void clear() { first_.clear(); }
  // Six numbers per body.
  void add(std::span<const double> wrench);

  bool is_empty() const { return first_.empty(); }
  std::span<const double> first() const { return first_; }
  double force_spread(std::size_t body) const { return spread_[2 * body]; }       // N
  double torque_spread(std::size_t body) const { return spread_[2 * body + 1]; }  // N m

 private:
  std::vector<double> first_, spread_;
};

struct IntegratedState {
  std::span<const double> position, orientation, linear_velocity, angular_velocity;
};

// S* against S_n, with h the time step, c the damping and a, alpha the accelerations at S_n (alpha with the gyroscopic
// term):
//   |v* - v_n - h a|     <= min(1, c h) (|v_n| + h |a|) + 3 h (change of a within the step)
//   |w* - w_n - h alpha| <= min(1, c h) (|w_n| + h |alpha|) + 3 h (change of the torque)/I + what a turn by h w makes
//   |x* - x_n - h (v_n + v*)/2| <= h/2 |v* - v_n| + 3 h^2 (change of a): x* moves with a velocity between the two
//   the turn from q_n to q*, as a rotation vector, so too, but for (h w)^3/12, by which Cayley's map turns less than the
//   exponential; and q* has the sign of q_n, while h |w| is below 1.5
// and slack of rounding's size. Kinematic bodies keep their velocities. `wrenches` is not read where the request's
// wrenches are constant; where it is empty else, accelerations are not looked at.
std::string check_integration(const stage::IntegratorIntegrateRequest& request, const IntegratedState& answer,
                              const WrenchRange& wrenches);

// ---- space ---------------------------------------------------------------------------------------------------------

// The pairs are all those that PairRule (pair_rule.h) wants, and no others.
class PairCheck {
 public:
  std::string check(const stage::SpacePairsRequest& request, std::span<const std::uint32_t> pair);

 private:
  std::vector<std::uint32_t> order_;  // scratch
};

// ---- collision -----------------------------------------------------------------------------------------------------

struct ContactColumns {
  std::span<const std::uint32_t> pair;
  std::span<const double> normal, point, depth, relative_velocity;
};

// With x_a = point + depth/2 normal and x_b = point - depth/2 normal, for the shapes known here (Sphere, Box, Cylinder,
// Halfspace):
//   x_a lies on the surface of a, and x_b on that of b; the normal of a sphere or a half-space is that of its surface
//   there, that of other shapes leads to the side on which the other's centre is (its direction is not looked at)
//   no point is deeper than the two shapes overlap along the normal
//   relative_velocity is that of the two bodies at the point
//   no two contacts of a pair are at the same point
//   a pair whose overlap has a closed form (a sphere or a half-space and anything, two boxes that overlap) has a
//   contact, the deepest of about that depth, and where a face of
//   a box lies on a half-space, as many as corners within, up to four; but need have none where one of the two touches a
//   third body and the other has a face along that contact's plane, no higher than it
std::string check_contacts(const stage::CollisionManifoldsRequest& request, const ContactColumns& answer);

// ---- solver --------------------------------------------------------------------------------------------------------

struct SolutionColumns {
  std::span<const double> linear_velocity, angular_velocity, pose_change;
  std::span<const double> discrepancy_impulse, discrepancy_correction;
  std::span<const double> contact_impulse, contact_correction, contact_direction, contact_turning;
  std::uint32_t stop_reason = 0;
};

// With J as in discrepancy.h and contacts that push each body at its own surface:
//   momentum   M (v_{n+1} - v*) = sum of J^T lambda, linear and angular, all directions at S*, or all at S* (+) delta
//              (linear axes turn with body 1). Arms at either: what that moves of them is allowed for
//   pose       M delta = sum of J^T mu + theta h J^T lambda of the rows on velocity alone (friction, drives, soft ones),
//              or of another lambda up to twice that large where the solver says that it stopped before it was done
//   energy     kinetic energy does not grow where nothing drives: no desired velocity, no compliance, no kinematic body
//   restitution  where the solver says that it converged, no contact that pushes separates faster than it can have
//              arrived
//   touching   then, too, no contact that corrects moves its two surfaces further apart than they overlap
//   closing    and what a joint locks is open at the end by something between nothing and what it was open at the start
class SolutionCheck {
 public:
  std::string check(const stage::SolverSolveRequest& request, const SolutionColumns& answer);

  // Impulse (N s, N m s) on a body, or the same of displacements (kg m, kg m^2), and the magnitudes it is made of.
  struct Push {
    Vector3 linear = Vector3::Zero(), angular = Vector3::Zero();
    double size = 0.0;        // sum of the linear magnitudes
    double moment = 0.0;      // sum of magnitudes times arms
    double unreported = 0.0;  // turning that depends on the point at which a joint pushes
    double turned = 0.0;      // linear part that depends on how far along its direction has turned
  };
  struct Pushes {
    Push velocity, pose;
    double coordinates = 0.0;  // m, of what acts on it
    bool is_joined = false;
    double loose = 0.0, loose_moment = 0.0;  // kg m, kg m^2: sizes of what rows on velocity alone displace
  };

 private:
  // scratch, a row per body, and per contact
  std::vector<Pushes> pushes_;
  SolverBodies bodies_;
  std::vector<double> displacing_;
};

}  // namespace gravitas
