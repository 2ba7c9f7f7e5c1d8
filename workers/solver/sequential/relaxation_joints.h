// The joints' side of a relaxation: rows of discrepancies, block by block, for one of the two
// problems (pose change or velocity).
//
// Consecutive discrepancies between the same two bodies are one block, because they act through the
// six components of one relative motion: swept one by one, two points of a hinge that lie close
// together, or a drive beside the lock of its own axis, would converge at the pace of their overlap
// (0.9 a sweep and worse).
//
// First, the rigid rows of a block (equalities that nothing softens or bounds) are scaled to
// J M^-1 J^T = 1 on the diagonal and taken in the order of a diagonally pivoted Cholesky
// factorisation, until a pivot falls below 1e-10: at most six, the rest depend on them. So
// redundancy costs nothing (a hinge of two points has 6 rows of rank 5, a rigid joint of three
// points 9 of rank 6, the seed's motor 18 of rank 6): rows left out hold by themselves, or are
// inconsistent. A sweep solves the kept ones together. In the end what they bear is shared out: of all
// multipliers that move alike the shortest ones, scaled, so that four rods bear a plate alike.
//
// Then every other row (limits, drives, springs) is made M-orthogonal to the kept ones,
//   J' = J - K_rB K_BB^-1 J_B,
// so that its multiplier changes none of them. A row whose J' M^-1 J'^T is below 1e-10 of
// J M^-1 J^T is held by the lock already and left out.
//
// Arms. Where a point is all that holds two bodies together, each is pushed at its own, where the step
// leaves it: a ball joint on the axis of a rod then exerts no moment about it. At one point midway, which
// is off the axis by half of what the free step opened, it would: e lambda/2 over the rod's small moment,
// which makes slender rods spin and fly apart. Elsewhere both are pushed at the midpoint of x1 and x2: along
// what is not locked (a slider away from its origin) their own points are apart for good, and the pair of
// impulses would be a couple out of nothing; and the redundant rows of a hinge, two points, would
// contradict each other by the error.
#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <vector>

#include "plugin_sdk/solver/bodies.h"
#include "plugin_sdk/solver/joint_laws.h"
#include "workers/solver/sequential/relaxation_blocks.h"

namespace gravitas {

// A discrepancy with all that the two problems need of it. The poses are those at S*.
struct RelaxationDiscrepancy {
  std::uint32_t body1 = 0, body2 = 0;  // rows of SolverBodies
  bool is_only_point = false;          // joint_laws.h
  double beta = 1.0;                   // of the pose change
  double slop = 0.0;                   // of a limit, m or rad
  double length = 1.0;                 // of a unit of the error, m: 1 for points, an arm for angles
  std::array<ConstraintDirection, 3> directions;
  std::array<JointAxisState, 3> axes;
};

// `is_only_point` as of joint_laws.h. `correction_factor` multiplies the discrepancy's own.
RelaxationDiscrepancy relaxation_discrepancy(const Discrepancy& discrepancy, std::uint32_t body1, std::uint32_t body2,
                                             bool is_only_point, const SolverBodies& bodies, double correction_factor);

// Where a pose change leaves a joint (end_of_step_rows.h): its directions and its errors along the axes. `turned`: bodies with
// the inertia there.
struct JointEnd {
  std::array<ConstraintDirection, 3> directions;
  std::array<double, 3> errors;
  Vector3 arm1, arm2;     // where it pushes its bodies
  bool is_linear = true;  // it has arms
  bool is_radial = false;
  std::optional<double> angle = {};  // of a swing
};
JointEnd end_of(const Discrepancy& discrepancy, const RelaxationDiscrepancy& at_trial, const SolverBodies& turned,
                const BodyMotion& displacement);

class RelaxationJoints final : public RelaxationBlocks {
 public:
  // Multipliers along the axes of every discrepancy; 3 per row.
  using Multipliers = std::vector<double>;
  using Laws = std::vector<JointLaw>;

  // Rows of all active laws (3 per discrepancy), starting from `warm`.
  void build(const SolverBodies& bodies, const std::vector<RelaxationDiscrepancy>& discrepancies, const Laws& laws,
             const Multipliers& warm);

  bool is_empty() const { return rows_.empty(); }

  // x += M^-1 J^T lambda of all rows, or of the velocity-only ones times `factor`.
  void push_all(const SolverBodies& bodies, BodyMotion& x) const;
  void push_velocity_only(const SolverBodies& bodies, double factor, BodyMotion& x) const;
  bool has_velocity_only_impulse() const;

  // Largest violation of a row by x, and largest sum of the magnitudes that J x is made of: what
  // rounding goes by. m or m/s, angles times their length.
  double largest_violation(const BodyMotion& x, bool is_solved = false) const;
  double largest_motion(const BodyMotion& x) const;
  // The same of rigid rows that depend on others of their two bodies, and are therefore not asked for.
  double largest_left_out(const BodyMotion& x) const;
  bool leaves_out() const { return !left_out_.empty(); }
  void clear_multipliers();
  void scale(double share);

  // Of the rows, locks go a share of their way, others at most the whole.
  std::size_t block_count() const override { return blocks_.size(); }
  std::array<std::uint32_t, 2> bodies_of(std::size_t block) const override {
    return {blocks_[block].body1, blocks_[block].body2};
  }
  double error_of(std::size_t block, const BodyMotion& x) const override;
  double relax(std::size_t block, double share, const SolverBodies& bodies, BodyMotion& x) override;

  void append_multipliers(std::vector<double>* to) const override;
  void append_responses(std::vector<double>* to) const override;
  const double* take_multipliers(const double* from) override;

  // Overwrites the multipliers of all discrepancies; those of rows that are not there with zero.
  void store(Multipliers& multipliers) const;

  // Multipliers of drives without bound.
  void take_drives(const Multipliers& multipliers);

  // ---- the bound on energy (sequential.h) ----

  bool has_bounces() const;
  // What stops give back, by what the joints alone make of v*.
  void find_bounces(const std::vector<RelaxationDiscrepancy>& discrepancies, const BodyMotion& before,
                    double time_step);
  void drop_bounces();
  // Rows that bounce hold nothing.
  void leave_out_bounces();
  // As those of ContactImpulses, of what stops give back.
  std::uint32_t lower_to_arrival(const BodyMotion& before, const BodyMotion& after);
  void mark_sharing(const SolverBodies& bodies, const BodyMotion& before, const BodyMotion& after,
                    const std::vector<std::uint32_t>& group, std::vector<bool>* is_some);
  void share_all(const std::vector<std::uint32_t>& group, const std::vector<bool>& which);
  std::uint32_t share_restitution(const std::vector<std::uint32_t>& group, const std::vector<double>& share);

  // Work of the rows that neither drive nor soften, lambda (J before + J after)/2, J, added to that
  // of body2, or of body1 where body2 is not pushed.
  void add_work(const SolverBodies& bodies, const BodyMotion& before, const BodyMotion& after,
                const std::vector<std::uint32_t>& group, std::vector<Gain>& gains) const;
  // Sets factor to 1 for the groups of bodies (by the number of their first) that a drive or a
  // spring acts on.
  void exempt_driven(const SolverBodies& bodies, const std::vector<std::uint32_t>& group,
                     std::vector<double>& factor) const;
  // Multiplies all multipliers by the factor of their bodies' group.
  void scale(const SolverBodies& bodies, const std::vector<std::uint32_t>& group, const std::vector<double>& factor);

 private:
  static constexpr int kBlock = 6;

  struct Row {
    ConstraintDirection own;     // J
    ConstraintDirection solved;  // J', for rows outside the block
    JointLaw law;
    double response = 0.0;  // J' M^-1 J'^T + gamma
    double length = 1.0;
    double multiplier = 0.0;
    std::uint32_t place = 0;             // 3 * discrepancy + axis
    std::array<double, kBlock> share{};  // K_BB^-1 K_Br
  };
  struct LeftOut {
    std::uint32_t body1, body2;
    ConstraintDirection own;
    double target, length;
    std::uint32_t place;
    std::array<double, kBlock> share;  // of the kept rows, all scaled: it is their combination
    double scale;                      // root of J M^-1 J^T
  };
  // Of a row that bounces: its target is a share of the whole, if it shares.
  struct Bounce {
    std::uint32_t row, body;  // the latter: whose group it is of
    bool shares;
    double whole;
  };
  struct Block {
    std::uint32_t body1 = 0, body2 = 0;
    std::uint32_t first = 0, end = 0;  // rows
    int rigid = 0;                     // how many of them, from the first, are solved together
    std::uint32_t first_left_out = 0, end_left_out = 0;
    Eigen::Matrix<double, kBlock, kBlock> inverse;
  };

  static std::uint32_t owner_of(const Block& block, const SolverBodies& bodies) {
    return bodies[block.body2].is_pushed() ? block.body2 : block.body1;
  }
  void collect(const std::vector<RelaxationDiscrepancy>& discrepancies, const Laws& laws, std::size_t first,
               std::size_t end, const Multipliers& warm);
  void factorise(Block& block, double inverse_masses);
  void leave_out(const std::array<std::size_t, kBlock>& kept, double inverse_masses, Block* block);
  void orthogonalise(Block& block, double inverse_masses);
  void share_out(const Block& block, Multipliers* multipliers) const;
  // Of a row of the block, added to the gain.
  static void add_work(const Block& block, const Row& row, const BodyMotion& before, const BodyMotion& after,
                       Gain* gain);
  template <class Use>
  void for_bounces(Use&& use);
  double relax_rigid(const Block& block, double share, double w1, double w2, Twist& x1, Twist& x2);
  double relax_others(const Block& block, double share, double w1, double w2, Twist& x1, Twist& x2);

  std::vector<Row> rows_;
  std::vector<Block> blocks_;
  std::vector<LeftOut> left_out_;
  std::vector<Bounce> bounces_;
  std::vector<Row> rigid_, others_;                 // of the block that is being built
  std::vector<std::array<double, kBlock>> factor_;  // of its rigid rows
  std::vector<double> pivot_;
};

}  // namespace gravitas
