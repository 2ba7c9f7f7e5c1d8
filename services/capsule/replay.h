// Asks plugins again what a capsule holds, each call alone, and compares the answers.
#pragma once

#include <functional>
#include <optional>
#include <string>

#include "gravitas/report/v1/replay.pb.h"
#include "kernel/description.h"

namespace gravitas::capsule {

struct ReplayOptions {
  std::string file;
  // A library, a command, or the name of an installed plugin; none: those that answered in the run.
  std::optional<std::string> plugin;
  // Direct: in this process, for a debugger; what kills the plugin then ends it, too.
  kernel::Hosting hosting = kernel::Hosting::kSharedMemory;
  double deadline = 2.0;    // s
  std::uint32_t only = 0;   // that call, from 1; 0: all
  std::uint32_t times = 1;  // each call so often, for a profiler
  double tolerance = 0.0;   // answers so close are the same: Comparison::tolerance
  // Answers are held against laws of physics, too, as in a run with CheckPhysicsEvery; a request that was kept because
  // its answer broke one is in any case.
  bool with_physics = false;
};

// Against what was answered in the run. `progress` gets the number of calls so far and may end it by returning false.
// A derivative that a call asks for is answered as in the run; one that the run did not ask for makes a difference. A
// poisoned request has no derivatives: they are zero. Of solvers it says how each problem ended. Throws BadInput for what cannot be used.
report::v1::ReplayReport replay(const ReplayOptions& options, const std::function<bool(std::uint32_t)>& progress);

// The first call that two plugins answer differently: `options.plugin` is the first.
report::v1::ReplayReport bisect(const ReplayOptions& options, const std::string& other,
                                const std::function<bool(std::uint32_t)>& progress);

}  // namespace gravitas::capsule
