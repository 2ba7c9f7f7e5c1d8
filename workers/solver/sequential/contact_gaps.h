// The contacts' side of the pose change: no gap is negative at the end of the step.
//
//   0 <= mu_N  _|_  gap* + n.J delta - min(0, (1 - beta) gap_n) >= 0
//
// gap* = -depth at S*; gap_n that of the same two surface points x1 = p + d/2 n and x2 = p - d/2 n
// ((2.82) of § 2.7.5.1 exchanges them) carried back to S_n, along n; beta = CorrectionFactor. What
// one free step overlaps is removed whole, whatever beta; only overlap that was there before is
// left to be removed slowly. The rows of one pair of bodies are tried as a whole first
// (contact_patch.h). Frictionless: friction moves the pose through theta (sequential.h).
#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "plugin_sdk/solver/bodies.h"
#include "workers/solver/sequential/contact_patch.h"
#include "workers/solver/sequential/relaxation_blocks.h"

namespace gravitas {

class ContactGaps final : public RelaxationBlocks {
 public:
  // Rows of all contacts with a body that can be pushed, starting from `warm` (one per contact of
  // the request).
  void build(const SolverBodies& bodies, const stage::SolverSolveRequest& request, double correction_factor,
             const std::vector<double>& warm);

  bool is_empty() const { return rows_.empty(); }
  void push_all(const SolverBodies& bodies, BodyMotion& x) const;
  // Largest violation of a row by x, and largest sum of the magnitudes that J x is made of, m.
  double largest_violation(const BodyMotion& x) const;
  double largest_motion(const BodyMotion& x) const;
  void clear_multipliers();
  void scale(double share);

  std::size_t block_count() const override { return patches_.size(); }
  std::array<std::uint32_t, 2> bodies_of(std::size_t block) const override {
    const Row& row = rows_[patches_[block].first];
    return {row.body1, row.body2};
  }
  double error_of(std::size_t block, const BodyMotion& x) const override;
  double relax(std::size_t block, double share, const SolverBodies& bodies, BodyMotion& x) override;

  void append_multipliers(std::vector<double>* to) const override;
  void append_responses(std::vector<double>* to) const override;
  const double* take_multipliers(const double* from) override;

  // ---- shock propagation (shock_propagation.h)

  // Some contact of the block is closed at S*, or was pushed before.
  bool holds(std::size_t block) const;
  // Largest change of J x that one multiplier makes by itself, m: what rounding of x goes by.
  double largest_push() const;
  void push_block(std::size_t block, const SolverBodies& bodies, BodyMotion& x) const;
  void take_block(std::size_t block, const ContactGaps& from);
  // Puts twins, which nothing pushes, in the place of bodies: those of `bodies` that are `offset` rows further on.
  void replace_body(std::size_t block, int side, std::uint32_t offset);
  void set_responses(const SolverBodies& bodies);

  void store(std::vector<double>& multipliers) const;

  // Sets closed[i] to 1 for contacts that are pushed, or whose gap after the displacement x is within closing_slop(), else
  // to 0.
  void find_closed(const BodyMotion& x, std::vector<std::uint8_t>& closed) const;

  // Largest coordinate of a contact, m: the size that rounding of positions goes by.
  double coordinates() const { return coordinates_; }

 private:
  struct Row {
    ConstraintDirection direction;
    std::uint32_t body1 = 0, body2 = 0, contact = 0;
    double response = 0.0;
    double gap = 0.0;     // gap*
    double target = 0.0;  // of n.J delta
    double slop = 0.0;
    double multiplier = 0.0;
  };
  // Consecutive rows of one pair of bodies.
  struct Patch {
    std::uint32_t first = 0, end = 0;
    bool has_whole = false;
    ContactPatch whole;
  };

  void set_patches(const SolverBodies& bodies);
  bool relax_whole(const Patch& patch, double share, const SolverBodies& bodies, BodyMotion& x, double* change);
  double relax_row(Row& row, double share, const SolverBodies& bodies, BodyMotion& x);

  std::vector<Row> rows_;
  std::vector<Patch> patches_;
  double coordinates_ = 0.0;
};

}  // namespace gravitas
