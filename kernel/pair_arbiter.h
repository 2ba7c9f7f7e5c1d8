// Decides about pairs of bodies where the scene's rules would do it otherwise (§ 3.6.3, § 3.6.5): whether they collide, and
// what their materials make together. services/listeners/ has the one that asks somebody, and stands between.
//
// Asked in the middle of a step, again wherever a step is made again, and with each inner step: for a pair it must always
// say the same within a step, and throw nothing. Only what may touch by the scene's rules is asked about: a plan that
// leaves out space and collision asks nothing.
#pragma once

#include <cstddef>
#include <cstdint>
#include <span>

namespace gravitas::kernel {

class Environment;

class PairArbiter {
 public:
  virtual ~PairArbiter() = default;
  // Pairs whose bounds overlap, 2 numbers each, ascending: puts those that collide in front, in their order, and
  // returns how many numbers these are.
  virtual std::size_t keep_allowed(const Environment& environment, std::span<std::uint32_t> pairs) = 0;
  // As keep_allowed(), of what is known already: decides about nothing.
  virtual std::size_t leave_out_forbidden(std::span<std::uint32_t> pairs) const = 0;
  // Two bodies a contact, in their order, and its material row, the scene's (kMaterialColumns of plugin_sdk/solver.h).
  virtual void mix_materials(std::span<const std::uint32_t> bodies, std::span<double> rows) = 0;
};

}  // namespace gravitas::kernel
