// From scene files and a command line to an environment.
#include <fmt/format.h>

#include <atomic>
#include <chrono>
#include <cmath>
#include <filesystem>
#include <memory>
#include <set>
#include <stop_token>
#include <utility>

#include "plugin_sdk/plugin.h"
#include "plugin_sdk/slots.h"
#include "services/catalog/catalog.h"
#include "services/run/session.h"
#include "services/scene/build.h"
#include "services/scene/overrides.h"
#include "services/scene/reader.h"
#include "services/scene/refusal.h"

namespace gravitas {
namespace {

std::string joined(const std::vector<scene::SceneError>& errors) {
  std::string text;
  for (const scene::SceneError& error : errors) text += (text.empty() ? "" : "\n") + scene::to_string(error);
  return text;
}

void require(const scene::Problems& problems) {
  if (!problems.ok()) throw BadInput(joined(problems.errors));
}

// What the command line moves elsewhere leaves its process; the scene itself hosts the slots of one process alike.
void warn_of_split_processes(const kernel::EnvironmentDescription& description, std::vector<std::string>* warnings) {
  std::set<std::string> split;
  for (const Slot one : kSlots)
    for (const Slot other : kSlots)
      if (description.slot(one).process == description.slot(other).process &&
          description.slot(one).hosting != description.slot(other).hosting)
        split.insert(description.slot(one).process);
  for (const std::string& process : split)
    if (!process.empty())
      warnings->push_back(
          fmt::format("the slots of Process \"{}\" are hosted in different ways; those that are hosted "
                      "alike share one",
                      process));
}

}  // namespace

void apply_hosting(const std::vector<HostingChoice>& choices, kernel::EnvironmentDescription* description) {
  for (const HostingChoice& choice : choices) {
    for (const Slot slot : kSlots)
      if (!choice.slot || *choice.slot == slot) {
        description->slot(slot).hosting = choice.hosting;
        description->slot(slot).attached = choice.attached;
        for (kernel::PluginChoice& plugin : description->slot(slot).plugins) plugin.address = choice.address;
      }
  }
}

std::string installed_worker() { return kernel::worker_program(); }

std::filesystem::path folder_above_with(const std::filesystem::path& what) {
  for (std::filesystem::path above = installed_worker(); above.has_relative_path(); above = above.parent_path())
    if (std::filesystem::exists(above.parent_path() / what)) return above.parent_path();
  return {};
}

std::string installed_plugins() {
  const std::filesystem::path bin = std::filesystem::path(kernel::worker_program()).parent_path();
  return (bin.parent_path() / "lib" / "gravitas").string();
}

kernel::EnvironmentDescription load(const RunOptions& options, std::vector<std::string>* warnings, Catalog* plugins,
                                    scene::v1::Scene* read) {
  const auto require_positive = [](const char* option, double value) {
    if (!std::isfinite(value) || value <= 0.0)
      throw BadInput(fmt::format("{} {:g}: it must be a finite number of seconds > 0", option, value));
  };
  if (options.time_step) require_positive("--dt", *options.time_step);
  if (options.sample_every) require_positive("--sample-every", *options.sample_every);
  if (options.ongoing_rate && !(std::isfinite(*options.ongoing_rate) && *options.ongoing_rate > 0.0))
    throw BadInput(fmt::format("--ongoing-rate {:g}: it must be a finite number of Hz > 0", *options.ongoing_rate));
  if (options.duration && !(std::isfinite(*options.duration) && *options.duration >= 0.0))
    throw BadInput(fmt::format("--duration {:g}: it must be a finite number of seconds >= 0", *options.duration));
  scene::Problems problems;
  scene::SceneDocument document;
  scene::read_files(options.scenes, &document, &problems);
  require(problems);
  for (const std::string& one : options.overrides) scene::apply_override(&document.scene(), one, &problems);
  const auto set = [&](const char* option, const char* property, std::optional<double> value) {
    if (value)
      scene::apply_override(&document.scene(), fmt::format("Simulator.{}={:.17g}", property, *value), &problems,
                            fmt::format("{} {:g}", option, *value));
  };
  set("--dt", "TimeStep", options.time_step);
  set("--duration", "Duration", options.duration);
  require(problems);
  // whatever the scene's Duration
  if (options.steps && document.scene().has_simulator()) {
    scene::v1::SimulatorProperties* simulator = document.scene().mutable_simulator()->mutable_custom_properties();
    simulator->set_duration(*options.steps * simulator->time_step());
  }
  for (const scene::SceneError& warning : problems.warnings) warnings->push_back(scene::to_string(warning));

  Catalog own;
  Catalog& catalog = plugins != nullptr ? *plugins : own;
  catalog = Catalog::installed(installed_worker(), installed_plugins());
  if (read != nullptr) *read = document.scene();
  return build_scene(options, document.scene(), &catalog, warnings);
}

kernel::EnvironmentDescription build_scene(const RunOptions& options, const scene::v1::Scene& scene, Catalog* catalog,
                                           std::vector<std::string>* warnings) {
  scene::Problems problems;
  std::optional<kernel::EnvironmentDescription> description = scene::build(scene, catalog, &problems);
  require(problems);
  for (const scene::SceneError& warning : problems.warnings) warnings->push_back(scene::to_string(warning));
  if (options.steps) {
    description->steps = *options.steps;
    description->last_time_step = description->time_step;
  }
  description->threads = options.threads;
  apply_hosting(options.hosting, &*description);
  warn_of_split_processes(*description, warnings);
  return std::move(*description);
}

namespace {

// A worker that is killed while it starts says nothing about its plugin: it is started once more, as long as `is_first`. What
// fails later the kernel repeats; what fails slowly is no accident.
kernel::HostStarter patient(kernel::HostStarter starter, std::shared_ptr<std::atomic<bool>> is_first) {
  return [starter = std::move(starter), is_first = std::move(is_first)](const kernel::SlotDescription& slot,
                                                                        std::uint32_t threads, std::stop_token stop) {
    constexpr auto kQuick = std::chrono::seconds(1);
    const auto begin = std::chrono::steady_clock::now();
    try {
      return starter(slot, threads, stop);
    } catch (const kernel::StageFault&) {
      const bool is_ours = slot.hosting != kernel::Hosting::kDirect && slot.plugins[0].address.empty();
      const bool is_quick = std::chrono::steady_clock::now() - begin < kQuick;
      if (!*is_first || !is_ours || !is_quick || stop.stop_requested()) throw;
      return starter(slot, threads, stop);
    }
  };
}

// Those that have a capability, `"Direct", "Newton"`.
std::string capable_plugins(const std::string& capability) {
  std::string names;
  const Catalog catalog = Catalog::installed(installed_worker(), installed_plugins());
  for (const InstalledPlugin& plugin : catalog.plugins())
    if (has_capability(plugin.declaration, capability))
      names += fmt::format("{}\"{}\"", names.empty() ? "" : ", ", plugin.declaration.name);
  return names.empty() ? "none that is installed" : names;
}

}  // namespace

std::unique_ptr<kernel::Environment> start(const kernel::EnvironmentDescription& description,
                                           const kernel::HostStarter& starter, const scene::v1::Scene* scene) {
  const auto is_first = std::make_shared<std::atomic<bool>>(true);
  const auto require_none = [](const std::optional<scene::SceneError>& refused) {
    if (refused) throw BadInput(scene::to_string(*refused));
  };
  try {
    auto environment = std::make_unique<kernel::Environment>(description, patient(starter, is_first));
    *is_first = false;
    for (const Slot slot : kConfirmed) environment->set_rerun_every(slot, description.check_physics_every);
    return environment;
  } catch (const kernel::StageFault& fault) {
    if (scene != nullptr) require_none(scene::find_refused(*scene, description, fault));
    throw BadInput(fmt::format("slot {}, plugin {}: {}", slot_name(fault.slot), fault.plugin,
                               scene::refusal_text(description, fault)));
  } catch (const std::invalid_argument& problem) {
    std::string why = problem.what();
    if (const auto* unfit = dynamic_cast<const kernel::UnfitPlugin*>(&problem))
      why += "; allowed: " + capable_plugins(unfit->capability);
    if (scene != nullptr) require_none(scene::find_refused(*scene, why));
    throw BadInput(why);
  }
}

}  // namespace gravitas
