#include "services/run/session.h"

#include <fmt/format.h>
#include <unistd.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <filesystem>
#include <system_error>

#include "kernel/carrier/carrier.h"
#include "services/catalog/catalog.h"
#include "services/recorder/event_log.h"
#include "services/recorder/json.h"
#include "services/recorder/trajectory.h"
#include "services/run/figures.h"
#include "services/run/summary.h"
#include "services/scene/build.h"
#include "services/scene/overrides.h"
#include "services/scene/reader.h"

namespace gravitas {
namespace {

using Clock = std::chrono::steady_clock;

std::string joined(const std::vector<scene::SceneError>& errors) {
  std::string text;
  for (const scene::SceneError& error : errors) text += (text.empty() ? "" : "\n") + scene::to_string(error);
  return text;
}

void require(const scene::Problems& problems) {
  if (!problems.ok()) throw BadInput(joined(problems.errors));
}

void apply_hosting(const std::vector<HostingChoice>& choices, kernel::EnvironmentDescription* description) {
  for (const HostingChoice& choice : choices) {
    for (const Slot slot :
         {Slot::kSpace, Slot::kCollision, Slot::kConstraint, Slot::kForce, Slot::kSolver, Slot::kIntegrator})
      if (!choice.slot || *choice.slot == slot) description->slot(slot).hosting = choice.hosting;
  }
}

void write_stages(const kernel::Environment& environment, report::v1::Report* report) {
  for (std::uint32_t i = 0; i < static_cast<std::uint32_t>(kernel::Stage::kCount); ++i) {
    const auto stage = static_cast<kernel::Stage>(i);
    const kernel::DurationHistogram& time = environment.stage_time(stage);
    if (time.count() == 0) continue;
    report::v1::StageTiming* timing = report->add_stages();
    timing->set_stage(kernel::stage_name(stage));
    timing->set_calls(static_cast<std::uint32_t>(time.count()));
    timing->set_median_us(time.quantile_us(0.5));
    timing->set_p99_us(time.quantile_us(0.99));
    timing->set_transport_median_us(environment.transport_time(stage).quantile_us(0.5));
  }
  const kernel::DurationHistogram& steps = environment.step_time();
  report::v1::Durations* durations = report->mutable_microseconds_per_step();
  durations->set_mean(steps.mean_us());
  durations->set_median(steps.quantile_us(0.5));
  durations->set_p99(steps.quantile_us(0.99));
  durations->set_max(steps.max_us());
}

void write_fault(const kernel::FaultRecord& record, report::v1::Report* report) {
  report::v1::FaultRecord* fault = report->add_faults();
  fault->set_step(record.step);
  fault->set_slot(slot_name(record.fault.slot));
  fault->set_kind(kernel::fault_kind_name(record.fault.kind));
  fault->set_detected_by(record.fault.detected_by);
  fault->set_recovered_by("none: paused");
  fault->set_text(record.fault.text);
}

std::string fault_text(std::uint32_t step, const kernel::StageFault& fault) {
  return fmt::format("paused at step {}: slot {}, plugin {}: {} ({})", step, slot_name(fault.slot), fault.plugin,
                     fault.text, kernel::fault_kind_name(fault.kind));
}

void write_report_file(const std::string& path, const report::v1::Report& report) {
  std::FILE* file = std::fopen(path.c_str(), "we");
  const std::string text = to_json(report, JsonForm::kPage);
  const bool written = file != nullptr && std::fwrite(text.data(), 1, text.size(), file) == text.size();
  const bool closed = file != nullptr && std::fclose(file) == 0;
  if (!written || !closed) throw std::system_error(errno, std::generic_category(), "report '" + path + "'");
}

}  // namespace

std::string installed_worker() { return kernel::worker_program(); }

std::string installed_plugins() {
  const std::filesystem::path bin = std::filesystem::path(kernel::worker_program()).parent_path();
  return (bin.parent_path() / "lib" / "gravitas").string();
}

kernel::EnvironmentDescription load(const RunOptions& options, std::vector<std::string>* warnings) {
  const auto require_positive = [](const char* option, double value) {
    if (!std::isfinite(value) || value <= 0.0)
      throw BadInput(fmt::format("{} {:g}: it must be a finite number of seconds > 0", option, value));
  };
  if (options.time_step) require_positive("--dt", *options.time_step);
  if (options.sample_every) require_positive("--sample-every", *options.sample_every);
  if (options.duration && !(std::isfinite(*options.duration) && *options.duration >= 0.0))
    throw BadInput(fmt::format("--duration {:g}: it must be a finite number of seconds >= 0", *options.duration));
  scene::Problems problems;
  scene::SceneDocument document;
  scene::read_files(options.scenes, &document, &problems);
  require(problems);
  std::vector<std::string> overrides = options.overrides;
  if (options.time_step) overrides.push_back(fmt::format("Simulator.TimeStep={:.17g}", *options.time_step));
  if (options.duration) overrides.push_back(fmt::format("Simulator.Duration={:.17g}", *options.duration));
  for (const std::string& one : overrides) scene::apply_override(&document.scene(), one, &problems);
  require(problems);

  Catalog catalog = Catalog::installed(installed_worker(), installed_plugins());
  std::optional<kernel::EnvironmentDescription> description = scene::build(document.scene(), &catalog, &problems);
  require(problems);
  for (const scene::SceneError& warning : problems.warnings) warnings->push_back(scene::to_string(warning));
  if (options.steps) {
    description->steps = *options.steps;
    description->last_time_step = description->time_step;
  }
  description->threads = options.threads;
  apply_hosting(options.hosting, &*description);
  return std::move(*description);
}

std::unique_ptr<kernel::Environment> start(const kernel::EnvironmentDescription& description) {
  try {
    return std::make_unique<kernel::Environment>(description);
  } catch (const kernel::StageFault& fault) {
    throw BadInput(fmt::format("slot {}, plugin {}: {}", slot_name(fault.slot), fault.plugin, fault.text));
  } catch (const std::invalid_argument& problem) {
    throw BadInput(problem.what());
  }
}

report::v1::Plan plan_message(const kernel::Environment& environment) {
  report::v1::Plan message;
  for (const kernel::PlannedSlot& planned : environment.plan().slots) {
    for (const std::string& plugin : planned.plugins) {
      report::v1::PlannedSlot* slot = message.add_slots();
      slot->set_slot(slot_name(planned.slot));
      slot->set_plugin(plugin);
      slot->set_hosting(kernel::hosting_name(planned.hosting));
      slot->set_pid(planned.process_id);
    }
  }
  for (const kernel::LeftOut& left_out : environment.plan().left_out) {
    report::v1::LeftOut* out = message.add_left_out();
    out->set_what(left_out.what);
    out->set_why(left_out.why);
  }
  return message;
}

RunResult run(const RunOptions& options, const std::function<bool()>& interrupted,
              const std::function<void(const Progress&)>& progress) {
  RunResult result;
  std::vector<std::string> warnings;
  const kernel::EnvironmentDescription description = load(options, &warnings);
  std::unique_ptr<TrajectoryWriter> trajectory;
  std::unique_ptr<EventLog> events;
  try {
    if (!options.trajectory.empty())
      trajectory =
          std::make_unique<TrajectoryWriter>(options.trajectory, description, options.sample_every.value_or(0.0));
    events = std::make_unique<EventLog>(options.events, description);
  } catch (const std::system_error& error) {
    throw BadInput(error.what());
  }

  const std::unique_ptr<kernel::Environment> environment = start(description);
  environment->set_listener(events.get());
  Figures figures(description);
  const Clock::time_point begin = Clock::now();
  try {
    figures.follow(environment.get());
    if (trajectory) trajectory->offer(*environment, environment->total_steps() == 0);
    while (environment->step_count() < environment->total_steps()) {
      if (interrupted()) {
        result.outcome = RunOutcome::kInterrupted;
        break;
      }
      if (environment->step() == kernel::StepOutcome::kPaused) {
        result.outcome = RunOutcome::kPaused;
        result.fault = fault_text(environment->fault()->step, environment->fault()->fault);
        write_fault(*environment->fault(), &result.report);
        break;
      }
      figures.follow(environment.get());
      if (trajectory) trajectory->offer(*environment, environment->step_count() == environment->total_steps());
      progress({environment->time(), environment->time_step() * description.steps, environment->step_count(),
                environment->total_steps()});
    }
  } catch (const kernel::StageFault& fault) {
    // a force that was asked for its potential failed
    result.outcome = RunOutcome::kPaused;
    result.fault = fault_text(environment->step_count(), fault);
    write_fault({environment->step_count(), fault}, &result.report);
  }
  const double wall = std::chrono::duration<double>(Clock::now() - begin).count();
  if (trajectory) trajectory->offer(*environment, true);

  report::v1::Report& report = result.report;
  for (const std::string& path : options.scenes)
    report.set_scene(report.scene() + (report.scene().empty() ? "" : " ") + path);
  report.set_simulated_seconds(environment->time());
  report.set_steps(environment->step_count());
  report.set_time_step(environment->time_step());
  report.set_bodies(environment->model().body_count);
  report.set_wall_seconds(wall);
  report.set_outcome(result.outcome == RunOutcome::kCompleted     ? "completed"
                     : result.outcome == RunOutcome::kInterrupted ? "interrupted"
                                                                  : "paused");
  report.set_state_hash(environment->state_hash().text());
  report.set_chain_hash(environment->chain_hash().text());
  *report.mutable_plan() = plan_message(*environment);
  *report.mutable_events() = events->counts();
  for (std::string& warning : warnings) report.add_warnings(std::move(warning));
  for (std::string& warning : environment->warnings()) report.add_warnings(std::move(warning));
  figures.write(&report);
  write_stages(*environment, &report);
  if (trajectory) trajectory->close();
  events->close();
  if (!options.report.empty()) write_report_file(options.report, report);
  result.summary = summarize(report, events->meetings());
  return result;
}

}  // namespace gravitas
