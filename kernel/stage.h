// The lines of a step. These words name the rows of the profiler and the report, and stand in error messages.
#pragma once

#include <cstdint>

namespace gravitas::kernel {

enum class Stage : std::uint32_t {
  kIntegrate,    // free trial state S* (asks for forces)
  kForce,        // wrenches of a trial state, inside kIntegrate
  kBound,        // world bounds of the bodies at S*
  kBroadPhase,   // pairs whose bounds overlap (slot space)
  kNarrowPhase,  // manifolds at S* (slot collision)
  kConstrain,    // discrepancies of the joints at S*
  kSolve,        // reactions: velocities and pose changes
  kCommit,       // S_{n+1}, hashes, events
  kCount
};

inline constexpr const char* kStageNames[] = {"integrate",    "force",     "bound", "broad_phase",
                                              "narrow_phase", "constrain", "solve", "commit"};

constexpr const char* stage_name(Stage stage) { return kStageNames[static_cast<std::uint32_t>(stage)]; }

}  // namespace gravitas::kernel
