// Somebody who decides about two bodies that could collide: whether they do (§ 3.6.3), and what their materials make
// together (§ 3.6.5).
//
// A run asks about each pair once, when the scene's rules let it collide and the bounds of its bodies first overlap; the
// answer holds for the rest of the run, unless an edit changes what the scene says of the two materials. Decisions are an
// input of a run, as its scene is: the same ones give the same bits, in any hosting. They are no part of a checkpoint, so a
// run in which a listener decided is not resumed.
#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <string>

#include "plugin_sdk/solver.h"

namespace gravitas {

struct PairQuestion {
  std::uint32_t a, b;  // rows of the environment's bodies, a < b
  std::string id_a, id_b;
  // The answer; as the scene has it before.
  bool may_collide = true;
  std::array<double, kMaterialColumns> material;  // finite, >= 0; the restitution at most 1
};

class PairListener {
 public:
  virtual ~PairListener() = default;
  // In a thread that does nothing else. Who throws, answers impossible numbers or takes longer than the deadline is left
  // aside from then on: the scene's rules hold, and the run says so.
  virtual void on_pairs(std::span<PairQuestion> pairs) = 0;
};

}  // namespace gravitas
