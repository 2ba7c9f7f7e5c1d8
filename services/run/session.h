// One run from scene files to a report: what `gravitas run` and `gravitas plan` do.
#pragma once

#include <filesystem>
#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "gravitas/edit/v1/edit.pb.h"
#include "gravitas/recorder/v1/capsule.pb.h"
#include "gravitas/report/v1/report.pb.h"
#include "gravitas/scene/v1/scene.pb.h"
#include "kernel/carrier/carrier.h"
#include "kernel/environment.h"
#include "services/catalog/catalog.h"
#include "services/listeners/pair_decisions.h"
#include "services/scene/problem.h"

namespace gravitas {

struct HostingChoice {
  std::optional<Slot> slot;  // none: all
  kernel::Hosting hosting;
  std::string address = {};  // with kGrpc: of a worker that somebody else started
  bool attached = false;     // that runs in a debugger, say: nothing has a deadline
};

struct RunOptions {
  std::vector<std::string> scenes;
  std::optional<double> duration;  // s
  std::optional<std::uint32_t> steps;
  std::optional<double> time_step;     // s
  std::vector<std::string> overrides;  // PATH=VALUE
  std::vector<HostingChoice> hosting;
  std::string trajectory, report, events, reactions, joints;
  std::string capsule;  // that `starter` writes: nothing else does, and it is none of what is read
  // What is looked for, written to `events` and, but for limits and samples, counted (services/events/event.h);
  // default_event_kinds() if absent.
  std::optional<std::vector<std::string>> event_kinds;
  std::optional<double> ongoing_rate;              // Hz, of collision_ongoing; kOngoingRate if absent
  std::string instrumentation;                     // file of debug geometry (services/survey/frame_file.h)
  std::vector<std::string> instrumentation_kinds;  // all if empty
  std::optional<double> sample_every;  // s, of trajectory, instrumentation, reactions and joints; every step if absent
  std::string checkpoint;              // file that is kept up to date; none if empty
  std::uint32_t checkpoint_every = 0;  // steps, counted from t = 0; 0: at the start and the end alone
  std::string resume;                  // checkpoint to go on from
  bool despite_journal = false;        // though its journal is missing or damaged
  std::uint32_t threads = 1;
  std::vector<std::string> faults, swaps, comparisons, reruns, edits;  // as on the command line
  kernel::HostStarter starter = kernel::start_host;
  std::shared_ptr<PairListener> listener;        // decides about pairs; then the run is not resumed
  double listener_deadline = kListenerDeadline;  // s
};

// The caller's mistake, with a text that says where and what: exit code 2.
class BadInput : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

enum class RunOutcome {
  kCompleted,
  kInterrupted,
  kPaused,  // by a plugin
  kFailed   // a file could not be written, or a step that a journal knows came out differently
};

struct RunResult {
  RunOutcome outcome = RunOutcome::kCompleted;
  report::v1::Report report;
  std::string summary;        // what happened, for a person
  std::string fault;          // why the run paused (slot, plugin, cause, step) or failed
  bool is_bad_input = false;  // it failed by an edit that could not be made
  // File with the state that the run ended in (after a failure: that of the last checkpoint), and its step; empty if
  // none was written.
  std::string checkpoint;
  std::uint32_t checkpoint_step = 0;
};

// The scene as the kernel's description. Throws BadInput. `warnings` gets the reader's warnings, `plugins` the plugins
// that there are, `read` the scene with its overrides.
kernel::EnvironmentDescription load(const RunOptions& options, std::vector<std::string>* warnings,
                                    Catalog* plugins = nullptr, scene::v1::Scene* read = nullptr);

// Its second half: the description of a scene that was read.
kernel::EnvironmentDescription build_scene(const RunOptions& options, const scene::v1::Scene& scene, Catalog* catalog,
                                           std::vector<std::string>* warnings);

// Where a command line has the slots.
void apply_hosting(const std::vector<HostingChoice>& choices, kernel::EnvironmentDescription* description);

// Slots whose answers no law of physics tells right from wrong (plugin_sdk/physics_checks.h): where the physics is checked
// (CheckPhysicsEvery), another process confirms them.
inline constexpr Slot kConfirmed[] = {Slot::kConstraint, Slot::kForce};

// Starts the environment of a description. A plugin that cannot be used, or refuses what is described, is BadInput: with
// the place of what it refuses where the scene is given.
std::unique_ptr<kernel::Environment> start(const kernel::EnvironmentDescription& description,
                                           const kernel::HostStarter& starter = kernel::start_host,
                                           const scene::v1::Scene* scene = nullptr);

// Called now and then while a run goes on.
struct Progress {
  double time, duration;  // s
  std::uint32_t step, steps;
};

// Runs to the end, until `interrupted` says so, until the environment pauses or a file cannot be written; writes the
// files asked for. A run that pauses and keeps no checkpoint writes one, SCENE.paused.checkpoint in the current folder.
// A resumed run's trajectory and events begin with the resumed state; its report counts from t = 0.
// Throws BadInput for input and files that cannot be used.
RunResult run(const RunOptions& options, const std::function<bool()>& interrupted,
              const std::function<void(const Progress&)>& progress);

// Where a run that pauses leaves its last commit if nobody asked for another place: SCENE.paused.checkpoint in the current
// folder. Throws BadInput if no file can be written there.
std::string paused_checkpoint(const RunOptions& options);

// Keeps a request that nobody may be asked again, in the current folder, so that its plugin can be asked it alone. Returns
// what is to be said of it.
std::string keep_poisoned_call(const RunOptions& options, std::uint32_t step, const kernel::PoisonedCall& poisoned);

// Of a capsule (services/capsule/capsule.h) of a run.
recorder::v1::CapsuleHeader capsule_header(const RunOptions& options, Slot slot);

// Folders of this installation.
std::string installed_worker();
std::string installed_plugins();
// The nearest folder above the program that holds `what`; empty where none does.
std::filesystem::path folder_above_with(const std::filesystem::path& what);

}  // namespace gravitas
