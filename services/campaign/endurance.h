// A long run in which every slot's worker is killed once a second.
#pragma once

#include <cstdint>
#include <functional>
#include <string>

namespace gravitas::campaign {

struct EnduranceResult {
  std::uint64_t steps = 0, kills = 0, failures = 0;
  double seconds = 0.0, median_step_us = 0.0, p99_step_us = 0.0, max_step_us = 0.0;
  std::string problem;  // empty: the chain of hashes is that of the quiet run
};

// Steps of 1 ms, one each millisecond of wall time, for so long; a scene's name or file, empty: the one with all slots.
// Throws BadInput.
EnduranceResult endure(const std::string& scene, double seconds, const std::function<bool()>& interrupted,
                       const std::function<void(double)>& progress);

}  // namespace gravitas::campaign
