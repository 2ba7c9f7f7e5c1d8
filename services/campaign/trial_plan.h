// What a trial is to do: drawn from its seed alone, so that a seed shows a failure again.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "kernel/description.h"
#include "services/campaign/scenes.h"

namespace gravitas::campaign {

enum class Tier { kReal, kSimulated };

// Where the fault comes from.
enum class Means {
  kOrder,        // the worker commits it in a call (plugin_sdk/host/fault_kinds.h)
  kKill,         // SIGKILL from outside between two steps
  kStop,         // SIGSTOP from outside between two steps
  kPause,        // the same, and SIGCONT a while later
  kKillStandby,  // SIGKILL to a worker that stands by or is being started
  kSwapKilled,   // a swap whose new worker is killed while it is being prepared
  kSwapFaulty,   // a swap whose new worker fails on probation
  kSwapRefused   // a swap to a library that is none, or to a worker that lies in its handshake
};

// What has to become of it.
enum class Duty {
  kRecover,  // masked, or recovered bit for bit
  kPoison,   // the same request fails twice: fallback, or a pause with a state that resumes
  kWrong,    // a wrong value that a re-run, or a check of the physics, has to find: recovered, or booked as not found
  kInTolerance  // the same, too small for any check but a re-run
};

struct PlannedFault {
  Means means = Means::kOrder;
  Duty duty = Duty::kRecover;
  Slot slot = Slot::kSolver;
  std::uint32_t step = 1;
  std::uint32_t times = 1;
  std::string order;  // of the worker; else what is done
  std::string group;
  bool rerun = false;  // another process is asked the same in this step
  double pause = 0.0;  // of kPause: SIGCONT after so many deadlines
  std::string lie;     // of kSwapRefused: what about (plugin_sdk/host/handshake_lie.h); empty: it is no library
};

// Whether it hits a process outside a call, and is noticed in the next one of whichever slot.
inline bool is_between_calls(const PlannedFault& fault) {
  return fault.means == Means::kKill || fault.means == Means::kStop || fault.means == Means::kPause ||
         fault.order.ends_with("at=reply");
}

// Whose failures it may count as: a wrong wrench may be noticed by what the integrator makes of it, and is charged to
// that; a worker that ends between two calls is missed by whoever of its process is asked next.
std::vector<Slot> slots_hit(const PlannedFault& fault, const Scene& scene);

// What the machine does to all of a trial.
enum class HostTrouble { kNone, kSignals, kSurroundings };

struct TrialPlan {
  std::uint64_t seed = 0;
  std::size_t scene = 0;
  kernel::Hosting hosting = kernel::Hosting::kSharedMemory;
  std::uint32_t steps = 0;
  bool has_fallbacks = false;
  bool has_neighbour = false;  // another environment in the same process, which nothing may reach
  HostTrouble trouble = HostTrouble::kNone;
  std::vector<PlannedFault> faults;  // by step
};

struct DrawOptions {
  Tier tier = Tier::kReal;
  std::vector<kernel::Hosting> hostings = {kernel::Hosting::kSharedMemory, kernel::Hosting::kGrpc};
  std::uint32_t faults_per_trial = 12;
};

// Seed of trial number `index` of a campaign.
std::uint64_t trial_seed(std::uint64_t campaign_seed, std::uint64_t index);

TrialPlan draw_trial(std::uint64_t seed, const std::vector<Scene>& scenes, const DrawOptions& options);

}  // namespace gravitas::campaign
