// One run from scene files to a report: what `gravitas run` and `gravitas plan` do.
#pragma once

#include <functional>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "gravitas/report/v1/report.pb.h"
#include "kernel/environment.h"
#include "services/scene/problem.h"

namespace gravitas {

struct HostingChoice {
  std::optional<Slot> slot;  // none: all
  kernel::Hosting hosting;
};

struct RunOptions {
  std::vector<std::string> scenes;
  std::optional<double> duration;  // s
  std::optional<std::uint32_t> steps;
  std::optional<double> time_step;     // s
  std::vector<std::string> overrides;  // PATH=VALUE
  std::vector<HostingChoice> hosting;
  std::string trajectory, report, events;
  std::optional<double> sample_every;  // s; every step if absent
  std::uint32_t threads = 1;
};

// The caller's mistake, with a text that says where and what: exit code 2.
class BadInput : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

enum class RunOutcome { kCompleted, kInterrupted, kPaused };

struct RunResult {
  RunOutcome outcome = RunOutcome::kCompleted;
  report::v1::Report report;
  std::string summary;  // what happened, for a person
  std::string fault;    // why the run paused: slot, plugin, cause, step
};

// The scene as the kernel's description. Throws BadInput. `warnings` gets the reader's warnings.
kernel::EnvironmentDescription load(const RunOptions& options, std::vector<std::string>* warnings);

// Starts the environment of a description. A plugin that cannot be used is BadInput.
std::unique_ptr<kernel::Environment> start(const kernel::EnvironmentDescription& description);

// The plan as the report shows it; process ids are those of the workers.
report::v1::Plan plan_message(const kernel::Environment& environment);

// Called now and then while a run goes on.
struct Progress {
  double time, duration;  // s
  std::uint32_t step, steps;
};

// Runs to the end, until `interrupted` says so, or until the environment pauses; writes the files asked for.
// Throws BadInput for input and files that cannot be used, std::system_error if a result cannot be written.
RunResult run(const RunOptions& options, const std::function<bool()>& interrupted,
              const std::function<void(const Progress&)>& progress);

// Folders of this installation.
std::string installed_worker();
std::string installed_plugins();

}  // namespace gravitas
