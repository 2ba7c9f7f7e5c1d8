// What a scene without a known answer is measured against: itself, by a far finer method. It knows nothing of errors that
// all settings of that method share.
#pragma once

#include <cstdint>
#include <memory>
#include <string>

#include "services/study/rung.h"

namespace gravitas::study {

// CPU that a run of a reference may take, s.
inline constexpr double kReferenceSeconds = 10.0;

struct SelfReference {
  std::shared_ptr<const Samples> samples;  // at the looks of every ladder
  std::string text;                        // which run it is
  double uncertainty = 0.0;                // its distance from the same at a coarser setting, as errors are measured
};

// The first that suits the scene and comes to its end: DormandPrince853 or Radau with Smooth, Continuous with an Accuracy,
// Continuous with 512, Basic with 512 or 32 times as many steps as the coarsest rung. Each run may take eight times the CPU
// of `limits`, and kReferenceSeconds at least. Looks at the ends of every `look_every`-th of `steps` steps. Throws BadInput,
// with the reasons, where none does.
SelfReference find_self_reference(const Subject& subject, std::uint32_t steps, std::uint32_t look_every,
                                  const RunLimits& limits);

}  // namespace gravitas::study
