#include "services/run/exchange_spec.h"

#include <fmt/format.h>

#include <algorithm>
#include <bit>
#include <charconv>

#include "plugin_sdk/near_miss.h"
#include "plugin_sdk/property_value.h"
#include "plugin_sdk/slots.h"
#include "services/run/session.h"

namespace gravitas {
namespace {

[[noreturn]] void refuse(const std::string& option, const std::string& text, const std::string& why) {
  throw BadInput(fmt::format("{} {}: {}", option, text, why));
}

std::uint32_t parse_count(const std::string& option, const std::string& text, const std::string& word,
                          const std::string& what) {
  std::uint32_t number = 0;
  const auto [end, error] = std::from_chars(word.data(), word.data() + word.size(), number);
  if (error != std::errc() || end != word.data() + word.size() || number == 0)
    refuse(option, text, fmt::format("'{}' is no {}; allowed: a whole number from 1", word, what));
  return number;
}

// Whether a step is part of a specification.
enum class StepWord : std::uint8_t { kNone, kOptional, kRequired };

// SLOT=PLUGIN, then `@step=N` and `,hosting=MODE`.
SwapSpec parse(const std::string& option, const std::string& text, StepWord step_word) {
  static constexpr const char* kForms[] = {"SLOT=PLUGIN[,hosting=direct|shm|grpc]",
                                           "SLOT=PLUGIN[@step=N][,hosting=direct|shm|grpc]",
                                           "SLOT=PLUGIN@step=N[,hosting=direct|shm|grpc]"};
  const std::string form = kForms[static_cast<std::size_t>(step_word)];
  const auto wrong_form = [&] { refuse(option, text, "allowed: " + form); };
  const std::size_t equals = text.find('=');
  const bool has_step =
      step_word == StepWord::kRequired || (step_word == StepWord::kOptional && text.rfind('@') != std::string::npos);
  const std::size_t at = has_step ? text.rfind('@') : std::min(text.find(','), text.size());
  if (equals == std::string::npos || at == std::string::npos || at < equals + 2 || text.ends_with(',')) wrong_form();
  SwapSpec spec;
  spec.text = option + " " + text;
  spec.slot = parse_slot(option, text, text.substr(0, equals));
  spec.plugin = text.substr(equals + 1, at - equals - 1);
  bool step_known = false;
  for (std::size_t begin = at + 1; begin < text.size();) {
    const std::size_t end = std::min(text.find(',', begin), text.size());
    const std::string word = text.substr(begin, end - begin);
    if (has_step && !step_known && word.starts_with("step=")) {
      spec.step = parse_count(option, text, word.substr(5), "step");
      step_known = true;
    } else if (word.starts_with("hosting=") && !spec.hosting) {
      spec.hosting = parse_hosting_mode(option, text, word.substr(8));
    } else {
      refuse(option, text, fmt::format("'{}' is unknown, or there twice; allowed: {}", word, form));
    }
    begin = end + 1;
  }
  if (has_step && !step_known) wrong_form();
  return spec;
}

// Of a plugin that the scene says nothing about.
std::vector<double> default_settings(const SwapSpec& spec, const PluginDeclaration& declaration) {
  std::vector<double> settings;
  std::vector<PropertyProblem> problems;
  if (!flatten(declaration.properties, {}, &settings, &problems))
    throw BadInput(fmt::format("{}: {}", spec.text, problems[0].text));
  return settings;
}

}  // namespace

Slot parse_slot(const std::string& option, const std::string& text, const std::string& name) {
  if (const std::optional<Slot> slot = find_slot(name)) return *slot;
  refuse(option, text,
         fmt::format("unknown slot '{}'; allowed: space, collision, constraint, force, solver, integrator", name));
}

kernel::Hosting parse_hosting_mode(const std::string& option, const std::string& text, const std::string& mode) {
  if (mode == "direct") return kernel::Hosting::kDirect;
  if (mode == "shm") return kernel::Hosting::kSharedMemory;
  if (mode == "grpc") return kernel::Hosting::kGrpc;
  refuse(option, text,
         fmt::format("unknown mode '{}'; allowed: direct, shm, grpc{}", mode,
                     option == "--hosting" ? ", grpc:ADDRESS" : ""));
}

SwapSpec parse_swap(const std::string& text) { return parse("--swap", text, StepWord::kRequired); }

SwapSpec parse_swap_order(const std::string& text) { return parse("swap", text, StepWord::kOptional); }

SwapSpec parse_compare(const std::string& option, const std::string& text) {
  return parse(option, text, StepWord::kNone);
}

RerunSpec parse_rerun(const std::string& text) {
  const std::size_t equals = text.find('=');
  if (equals == std::string::npos) refuse("--rerun", text, "allowed: SLOT=N, every N-th step");
  return {parse_slot("--rerun", text, text.substr(0, equals)),
          parse_count("--rerun", text, text.substr(equals + 1), "number of steps")};
}

void require_rerun(const RerunSpec& spec, const kernel::Environment& environment) {
  const kernel::Plan plan = environment.plan();
  if (std::ranges::find(plan.slots, spec.slot, &kernel::PlannedSlot::slot) == plan.slots.end())
    refuse("--rerun", fmt::format("{}={}", slot_name(spec.slot), spec.every), environment.why_left_out(spec.slot));
}

bool has_same_properties(const PluginDeclaration& one, const PluginDeclaration& other) {
  return one.name == other.name &&
         std::ranges::equal(one.properties, other.properties, {}, &Property::name, &Property::name);
}

bool have_same_settings(const kernel::PluginChoice& one, const kernel::PluginChoice& other) {
  const auto bits = [](double setting) { return std::bit_cast<std::uint64_t>(setting); };
  return std::ranges::equal(one.settings, other.settings, {}, bits, bits);
}

kernel::SwapOrder resolve_swap(const SwapSpec& spec, const kernel::EnvironmentDescription& scene, Catalog* catalog) {
  std::string problem;
  const bool is_path = spec.plugin.find('/') != std::string::npos || spec.plugin.ends_with(".so");
  const InstalledPlugin* plugin =
      is_path ? catalog->add_library(spec.plugin, &problem) : catalog->find_plugin(spec.slot, spec.plugin);
  if (plugin == nullptr && is_path)
    throw BadInput(
        fmt::format("{}: it cannot be used: {}; allowed: the name of a plugin that is installed or that the "
                    "scene names, or the path of a library",
                    spec.text, problem));
  if (plugin == nullptr) {
    throw BadInput(fmt::format("{}: no {} plugin '{}' is installed; {}, or the path of a library", spec.text,
                               slot_name(spec.slot), spec.plugin,
                               allowed_names(spec.plugin, catalog->plugin_names(spec.slot))));
  }
  kernel::SwapOrder order;
  order.slot = spec.slot;
  order.step = spec.step;
  order.hosting = spec.hosting;
  order.plugin = {plugin->declaration, plugin->library, {}, plugin->command};
  const std::vector<kernel::PluginChoice>& own = scene.slot(spec.slot).plugins;
  const auto same = std::ranges::find_if(
      own, [&](const kernel::PluginChoice& one) { return has_same_properties(one.declaration, plugin->declaration); });
  order.plugin.settings = same != own.end() ? same->settings : default_settings(spec, plugin->declaration);
  return order;
}

}  // namespace gravitas
