// The contacts' side of the velocity: restitution, friction in its cone, rolling and spinning
// friction, for the contacts that are closed at the end of the step.
//
//   0 <= lambda_N  _|_  n.v_{n+1} - e s >= 0
//   |lambda_T| <= mu lambda_N, against the slip; mu_s while it sticks, mu_d once it slides
//   |tau_T| <= mu_r lambda_N, against rolling (relative turning across n);  |tau_N| <= mu_sp
//   lambda_N, about n
//
// s is the arrival speed (arrival.h), mu_r and mu_sp are lengths (m), n, e s and the coefficients those of contact_law.h.
// Each body is pushed at its own surface point, where both meet at the end of the step: a ball that sinks in the trial has its
// whole radius for an arm.
//
// A visit to a pair of bodies first tries all their contacts at once, as sticking with n.v = e s
// (contact_patch.h); that is taken if every impulse lies in its cone, of a flat patch also with its
// friction spread like its normal impulses. Else each contact is solved exactly, normal and tangent
// together, with the others as they are (coulomb_contact.h). Solving the normal law and then
// friction, as § 2.6.2 does, breaks the normal law, because friction moves n.v.
//
// Static and dynamic friction. All contacts first stick within mu_s. Those that slip when the
// sweeps have converged (or half or three quarters of them are spent), by much more than the last
// sweep still changed, slide with mu_d from then on; nothing returns to mu_s within a solution, so
// it cannot chatter. A static coefficient below the dynamic is taken as equal to it.
#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "plugin_sdk/solver/bodies.h"
#include "plugin_sdk/solver/cone_problem.h"
#include "plugin_sdk/solver/contact_law.h"
#include "plugin_sdk/solver/reply.h"
#include "workers/solver/sequential/contact_patch.h"
#include "workers/solver/sequential/friction_disc.h"
#include "workers/solver/sequential/relaxation_blocks.h"

namespace gravitas {

class ContactImpulses final : public RelaxationBlocks {
 public:
  // Rows of the contacts with closed[i] != 0, starting from the impulses `warm` (world, on the
  // second body; three numbers per contact).
  void build(const SolverBodies& bodies, const stage::SolverSolveRequest& request,
             const std::vector<std::uint8_t>& closed, const std::vector<double>& warm);

  bool is_empty() const { return rows_.empty(); }
  void push_all(const SolverBodies& bodies, BodyMotion& x) const;
  // The same for friction (all three kinds) alone, times `factor` and a share of each contact of the request.
  void push_friction(const SolverBodies& bodies, double factor, const std::vector<double>& shares, BodyMotion& x) const;
  bool has_friction_impulse() const;

  // Largest violation of a normal law by velocities x, and largest sum of the speeds that meet at a
  // contact: what rounding goes by. m/s.
  double largest_violation(const BodyMotion& x) const;
  double largest_motion(const BodyMotion& x) const;
  void clear_multipliers();

  std::size_t block_count() const override { return patches_.size(); }
  std::array<std::uint32_t, 2> bodies_of(std::size_t block) const override {
    const Row& row = rows_[patches_[block].first];
    return {row.body1, row.body2};
  }
  // Without rolling and spinning.
  double error_of(std::size_t block, const BodyMotion& x) const override;
  double relax(std::size_t block, double share, const SolverBodies& bodies, BodyMotion& x) override;

  void append_multipliers(std::vector<double>* to) const override;
  void append_responses(std::vector<double>* to) const override;
  const double* take_multipliers(const double* from) override;

  // ---- shock propagation (shock_propagation.h), as for ContactGaps

  static bool holds(std::size_t) { return true; }
  double largest_push() const;
  void push_block(std::size_t block, const SolverBodies& bodies, BodyMotion& x) const;
  void take_block(std::size_t block, const ContactImpulses& from);
  void replace_body(std::size_t block, int side, std::uint32_t offset);
  void set_responses(const SolverBodies& bodies);

  // As rows of a problem, after those that it has, without rolling, spinning and restitution.
  void append_cones(const SolverBodies& bodies, ConeProblem* problem) const;

  // Makes contacts that slip faster than `slip` (m/s) slide with mu_d in the following sweeps;
  // returns whether any changed.
  bool let_slide(const BodyMotion& x, double slip);
  // All stick again, for a solution anew.
  void let_stick();

  // Writes impulses, turning (world, on the second body) and directions of the rows that are there; the others push
  // nothing, and their directions stay.
  void store(SolverSolution* solution) const;

  // ---- the bound on energy (sequential.h) ----

  // Work of each contact's impulse, added to that of its second body, or of the first where the
  // second is not pushed.
  void add_work(const SolverBodies& bodies, const BodyMotion& before, const BodyMotion& after,
                const std::vector<std::uint32_t>& group, std::vector<Gain>& gains) const;
  // Lowers e s of contacts that arrive and whose impulse does positive work to the speed of arrival (contact_law.h). Returns
  // how many were lowered.
  std::uint32_t lower_to_arrival(const BodyMotion& before, const BodyMotion& after);
  // Marks the contacts whose e s is to be shared, those to blame, and by group (the number of its first body) whether there are
  // some.
  void mark_sharing(const SolverBodies& bodies, const BodyMotion& before, const BodyMotion& after,
                    const std::vector<std::uint32_t>& group, std::vector<bool>* is_some);
  // All of some groups share, from what their e s are now.
  void share_all(const SolverBodies& bodies, const std::vector<std::uint32_t>& group, const std::vector<bool>& which);
  // Sets e s of the contacts that share to their group's share of the whole; NaN: it stays. Returns how many there are.
  std::uint32_t share_restitution(const SolverBodies& bodies, const std::vector<std::uint32_t>& group,
                                  const std::vector<double>& share);
  // Of all, to nothing.
  void drop_restitution();
  // Multiplies all impulses by the factor of their bodies' group.
  void scale(const SolverBodies& bodies, const std::vector<std::uint32_t>& group, const std::vector<double>& factor);
  bool has_restitution() const;

  // Pairs of the rows, for grouping bodies.
  template <typename Visit>
  void each_pair(Visit visit) const {
    for (const Row& row : rows_) visit(row.body1, row.body2);
  }

 private:
  struct Row {
    std::uint32_t body1 = 0, body2 = 0, contact = 0;
    std::int32_t rolling = -1;  // its place in rolling_
    bool has_inverse = false;   // `inverse` is there
    bool slides = false;
    bool has_friction = false;
    bool shares = false;
    Vector3 arm1, arm2;  // from the centres of mass to the contact, m
    Matrix3 frame;       // columns: direction of the normal law and two tangents, world
    Matrix3 response;    // W, in the frame
    Matrix3 inverse;     // W^-1
    FrictionDisc disc;
    double target = 0.0;        // e s, m/s
    double whole_target = 0.0;  // of which it is a share, if it shares
    double static_friction = 0.0, dynamic_friction = 0.0;
    Vector3 impulse = Vector3::Zero();  // in the frame
  };
  struct Rolling {
    double normal_response = 0.0;
    FrictionDisc disc;
    double rolling_friction = 0.0, spinning_friction = 0.0, length = 0.0;  // m
    Vector3 impulse = Vector3::Zero();  // torque impulses in the frame: about the normal, and two tangents
  };

  // Consecutive rows of one pair of bodies.
  struct Patch {
    std::uint32_t first = 0, end = 0;
    bool has_whole = false;
    bool is_flat = false;  // one normal, points in a plane across it
    ContactPatch whole;
  };
  using PatchImpulses = std::array<Vector3, ContactPatch::kRows>;

  static std::uint32_t owner_of(const Row& row, const SolverBodies& bodies) {
    return bodies[row.body2].is_pushed() ? row.body2 : row.body1;
  }
  Vector3 velocity_of(const Row& row, const BodyMotion& x) const;
  Vector3 turning_of(const Row& row, const BodyMotion& x) const;
  void push(const Row& row, const Vector3& impulse, const SolverBodies& bodies, BodyMotion& x) const;
  void push_row(const Row& row, const SolverBodies& bodies, BodyMotion& x) const;
  void push_turning(const Row& row, const Vector3& impulse, const SolverBodies& bodies, BodyMotion& x) const;
  void set_response(Row& row, const SolverBodies& bodies);
  void set_rolling(Row& row, const SolverBodies& bodies, double rolling_friction, double spinning_friction);
  static void set_response(const Row& row, const SolverBodies& bodies, Rolling* rolling);
  void set_patches(const SolverBodies& bodies);
  ContactPatch whole_of(const Patch& patch, const SolverBodies& bodies) const;
  bool relax_whole(const Patch& patch, double share, const SolverBodies& bodies, BodyMotion& x, double* change);
  bool is_flat(const Patch& patch) const;
  bool is_in_cones(const Patch& patch, const PatchImpulses& impulses) const;
  bool spread_friction(const Patch& patch, PatchImpulses* impulses) const;
  double relax_row(Row& row, double share, const SolverBodies& bodies, BodyMotion& x);
  double relax_rolling(const Row& row, double share, const SolverBodies& bodies, BodyMotion& x);
  Vector3 relaxed(const Row& row, const Vector3& velocity) const;
  double work_of(const Row& row, const BodyMotion& before, const BodyMotion& after, double* size) const;

  std::vector<Row> rows_;
  std::vector<Rolling> rolling_;
  std::vector<Patch> patches_;
};

}  // namespace gravitas
