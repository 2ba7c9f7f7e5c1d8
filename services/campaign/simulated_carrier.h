// Workers without processes, for the simulated tier: the same plugin libraries, the same frames, digests and checks, in
// this process and in virtual time. A worker that is ordered to die is gone, one that hangs has used up its deadline at
// once, and starts fail as the seed says. Nothing sleeps.
#pragma once

#include <array>
#include <atomic>
#include <cstdint>
#include <memory>
#include <string>
#include <vector>

#include "kernel/carrier/carrier.h"

namespace gravitas::campaign {

// The hosts of one environment.
class SimulatedHosts {
 public:
  // In some slots one start fails: never the first of a slot, so that the environment comes to be.
  explicit SimulatedHosts(std::uint64_t seed);

  // For kernel::Environment.
  kernel::HostStarter starter() const;

  // The starts that failed, and how.
  struct FailedStart {
    Slot slot;
    bool dies;  // after its handshake; else refused
  };
  std::vector<FailedStart> failed_starts() const;

 private:
  struct Starts {
    std::uint32_t fails = 0;  // which start, from 1; 0: none
    bool dies = false;        // after its handshake; else refused
    std::atomic<std::uint32_t> made{0};
  };
  static constexpr std::size_t kSlotCount = 7;  // by Slot, which counts from 1
  std::shared_ptr<std::array<Starts, kSlotCount>> starts_;
};

}  // namespace gravitas::campaign
