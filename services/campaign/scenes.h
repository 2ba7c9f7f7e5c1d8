// The scenes of a campaign: each with its quiet run, against which every faulty one is judged.
#pragma once

#include <string>
#include <vector>

#include "kernel/description.h"
#include "plugin_sdk/trajectory_hash.h"

namespace gravitas::campaign {

// Longest run of a trial.
inline constexpr std::uint32_t kMostSteps = 60;

struct Scene {
  std::string name;
  kernel::EnvironmentDescription description;
  std::vector<Slot> slots;   // that the plan does not leave out
  std::vector<Hash> chains;  // of the quiet run, hosted direct: [n] after n steps
  // Those with a worker that is a Command: it commits no orders, and is hit from outside alone.
  std::vector<Slot> commands;
};

// Slots of the scene that share a worker process with this one, itself among them.
std::vector<Slot> sharing(const Scene& scene, Slot slot);

// Scenes by name or file; the built-in ones (contacts, joints, all, shared) if there is none. Makes `steps` steps of each for
// its quiet run. Throws BadInput, also for workers at an Address, which nobody here could start again.
std::vector<Scene> load_scenes(const std::vector<std::string>& names, std::uint32_t steps = kMostSteps);

}  // namespace gravitas::campaign
