// What a scene without a known answer is measured against: itself, by a far finer method. It knows nothing of errors that
// all settings of that method share.
#pragma once

#include <cstdint>
#include <memory>
#include <string>

#include "services/study/rung.h"

namespace gravitas::study {

struct SelfReference {
  std::shared_ptr<const Samples> samples;  // at the looks of every ladder
  std::string text;                        // which run it is
  double uncertainty;                      // its distance from the same at a coarser setting, as errors are measured
};

// The first that suits the scene and stays within `limits` (of which it may take eightfold): DormandPrince853 or Radau with
// Smooth, Continuous with an Accuracy, Basic with 64 times as many steps as the finest rung of a usual ladder. Looks
// at the ends of every `look_every`-th of `steps` steps. Throws BadInput where none of them comes to its end.
SelfReference find_self_reference(const Subject& subject, std::uint32_t steps, std::uint32_t look_every,
                                  const RunLimits& limits);

}  // namespace gravitas::study
