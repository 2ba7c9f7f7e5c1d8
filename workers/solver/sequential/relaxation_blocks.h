// What a sweep goes over: rows in blocks, each of which is relaxed as one.
#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
#include <vector>

#include "plugin_sdk/solver/bodies.h"

namespace gravitas {

// Makes room for `count` numbers more; returns the first of them.
inline double* append(std::size_t count, std::vector<double>* to) {
  to->resize(to->size() + count);
  return to->data() + (to->size() - count);
}

// The rows of a joint, or of the contacts of one pair of bodies.
class RelaxationBlocks {
 public:
  virtual ~RelaxationBlocks() = default;

  virtual std::size_t block_count() const = 0;
  // Rows of SolverBodies.
  virtual std::array<std::uint32_t, 2> bodies_of(std::size_t block) const = 0;
  // How far x is from what the block asks for with its multipliers of now, m or m/s: what is missing where it may be
  // pushed, what a multiplier holds open, and slip that its friction does not oppose. Zero where the block is right.
  virtual double error_of(std::size_t block, const BodyMotion& x) const = 0;
  // Moves multipliers and x that share (0 ... 2) of the way to where the block is right, and projects onto what is
  // allowed. Returns the largest change of J x that would make it right, m or m/s.
  virtual double relax(std::size_t block, double share, const SolverBodies& bodies, BodyMotion& x) = 0;

  // All multipliers in one order: as they are, what J x changes by with one of each, and set anew (x is left to the caller;
  // returns what follows them).
  virtual void append_multipliers(std::vector<double>* to) const = 0;
  virtual void append_responses(std::vector<double>* to) const = 0;
  virtual const double* take_multipliers(const double* from) = 0;

 protected:
  RelaxationBlocks() = default;
  RelaxationBlocks(const RelaxationBlocks&) = default;
  RelaxationBlocks& operator=(const RelaxationBlocks&) = default;
};

}  // namespace gravitas
