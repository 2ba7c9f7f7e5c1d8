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

#include <cstdint>
#include <vector>

#include "plugin_sdk/solver/bodies.h"
#include "workers/solver/sequential/contact_patch.h"

namespace gravitas {

class ContactGaps {
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
  // One sweep. Returns the largest change of a gap, m.
  double sweep(const SolverBodies& bodies, BodyMotion& x);
  void store(std::vector<double>& multipliers) const;

  // Sets closed[i] to 1 for contacts whose gap after the displacement x is within closing_slop(),
  // else to 0.
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
  bool sweep_whole(const Patch& patch, const SolverBodies& bodies, BodyMotion& x, double* change);
  double sweep_row(Row& row, const SolverBodies& bodies, BodyMotion& x);

  std::vector<Row> rows_;
  std::vector<Patch> patches_;
  double coordinates_ = 0.0;
};

}  // namespace gravitas
