// In which order a sweep relaxes its blocks (§§ 2.6.6 and 2.6.7.1). Each sweep visits every block once.
//
//   Given           joints, then contacts, by their pairs of bodies. Each sees what those before it have done.
//   DeepestFirst    the block with the largest error of those not yet visited, errors being kept up to date as
//                   neighbours change. § 2.6.6 sorts once by depth, but relaxing one contact makes others wrong or
//                   right. What few sweeps leave no longer goes by how bodies are numbered, and what a deeper contact
//                   frees is never pushed; to the end it takes about as many sweeps (a few percent less on bodies that
//                   lie on many). Ties go by the given order. Costs a heap, and an error for each neighbour of what is
//                   relaxed; bodies with more than kMostNeighbours blocks do not tell theirs.
//   Simultaneous    (2.76): all blocks see the velocities that the sweep began with, and their changes are summed; so no
//                   numbering shows in the answer beyond rounding, and what is symmetric stays so even where sweeps run
//                   out, but for the contacts of one pair, which are one block and go in turn where they slide. As printed
//                   it solves 1/k of each error in k sweeps with impulses that were found once. Here the errors are those
//                   of now, and a block goes 1/n of its way, n the larger number of blocks at its two bodies. With
//                   A = J M^-1 J^T, D its blocks: (sum of n terms)^2 <= n (sum of squares) gives A <= n D, so that the
//                   sweeps converge. Some n times as many are needed.
#pragma once

#include <array>
#include <cstdint>
#include <vector>

#include "workers/solver/sequential/relaxation_blocks.h"

namespace gravitas {

enum class RelaxationOrder : std::uint32_t { kGiven = 0, kDeepestFirst = 1, kSimultaneous = 2 };

class RelaxationSweep {
 public:
  RelaxationSweep(RelaxationOrder order, double factor) : order_(order), factor_(factor) {}
  void set(RelaxationOrder order, double factor) { order_ = order, factor_ = factor; }

  // Sweeps are accelerated (nesterov_acceleration.h) where blocks go the whole of their way; here it may be switched off.
  void set_accelerated(bool is_accelerated) { is_accelerated_ = is_accelerated; }
  // The blocks of the sweeps that follow: joints, contacts.
  void begin(const SolverBodies& bodies, std::array<RelaxationBlocks*, 2> parts);
  // One sweep. Returns the largest change that a block asked for, m or m/s.
  double sweep(const SolverBodies& bodies, BodyMotion& x);
  // What blocks ask for has changed.
  void forget_acceleration() { acceleration_.forget(); }
  // Of all blocks.
  double largest_error(const BodyMotion& x) const;

 private:
  // Of a block among those of both parts.
  struct Place {
    RelaxationBlocks* part;
    std::size_t block;
  };
  struct Candidate {
    double error;
    std::uint32_t block;
    bool operator<(const Candidate& other) const {
      return error < other.error || (error == other.error && block > other.block);
    }
  };

  double sweep_once(const SolverBodies& bodies, BodyMotion& x);
  double sweep_given(const SolverBodies& bodies, BodyMotion& x) const;
  double sweep_deepest_first(const SolverBodies& bodies, BodyMotion& x);
  double sweep_simultaneously(const SolverBodies& bodies, BodyMotion& x);

  RelaxationOrder order_;
  double factor_;
  bool is_accelerated_ = true;
  NesterovAcceleration acceleration_;
  std::array<RelaxationBlocks*, 2> parts_{};
  std::vector<Place> places_;
  std::vector<std::vector<std::uint32_t>> at_body_;  // blocks at each body that can be pushed
  std::vector<double> error_;
  std::vector<Candidate> candidates_;  // a heap
  std::vector<std::uint8_t> visited_;
  BodyMotion start_;
};

}  // namespace gravitas
