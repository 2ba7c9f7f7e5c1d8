// `gravitas plugins` and `gravitas describe`.
#include <fmt/format.h>
#include <unistd.h>

#include <cmath>
#include <iostream>
#include <memory>

#include "plugin_sdk/host/description_message.h"
#include "plugin_sdk/near_miss.h"
#include "services/catalog/catalog.h"
#include "services/check/describe.h"
#include "services/cli/commands.h"
#include "services/recorder/json.h"
#include "services/run/session.h"
#include "services/scene/reference.h"

namespace gravitas::cli {
namespace {

std::string kind_name(PropertyKind kind) {
  switch (kind) {
    case PropertyKind::kNumber:
      return "number";
    case PropertyKind::kInteger:
      return "integer";
    case PropertyKind::kFlag:
      return "true or false";
    case PropertyKind::kChoice:
      return "text";
    case PropertyKind::kVector:
      return "{x, y, z}";
    case PropertyKind::kQuaternion:
      return "{w, x, y, z}";
    case PropertyKind::kTable:
      return "table";
    case PropertyKind::kBody:
      return "text";
  }
  return "?";
}

std::string range_text(const Property& p) {
  if (p.kind == PropertyKind::kChoice) return fmt::format("{}", fmt::join(p.choices, " | "));
  std::string text;
  if (std::isfinite(p.minimum)) text += fmt::format("{} {:g}", p.exclusive_minimum ? ">" : ">=", p.minimum);
  if (std::isfinite(p.maximum)) text += fmt::format("{}<= {:g}", text.empty() ? "" : ", ", p.maximum);
  return text;
}

std::string default_text(const Property& p) {
  if (p.is_required) return "required";
  if (p.default_numbers.empty()) return "absent";
  if (p.kind == PropertyKind::kFlag) return p.default_numbers[0] != 0.0 ? "true" : "false";
  if (p.kind == PropertyKind::kChoice) return p.choices[static_cast<std::size_t>(p.default_numbers[0])];
  return fmt::format("{}", fmt::join(p.default_numbers, ", "));
}

// `change`: how one of them may be changed while the simulation runs.
template <typename Change>
void print_properties(const std::vector<Property>& properties, const Change& change) {
  for (const Property& p : properties) {
    std::cout << fmt::format("    {:<18} {:<14} {:<8} {:<14} {:<12} {:<9} {}\n", p.name, kind_name(p.kind), p.unit,
                             range_text(p), default_text(p), change(p), p.meaning);
  }
}

void print_declaration(const InstalledPlugin& plugin) {
  const PluginDeclaration& d = plugin.declaration;
  std::cout << fmt::format(
      "{} {}: slot {}\n  {}\n  {:<12}  {}\n  capabilities  {}\n", d.name, d.version, slot_name(d.slot), d.meaning,
      plugin.command.empty() ? "library" : "command", plugin.command.empty() ? plugin.library : plugin.command,
      d.capabilities.empty() ? std::string("none") : fmt::format("{}", fmt::join(d.capabilities, ", ")));
  if (d.slot == Slot::kIntegrator) std::cout << fmt::format("  theta         {:g}\n", d.theta);
  if (!d.properties.empty()) {
    std::cout << "  properties (name, type, unit, range, default, live: `ctl set` may change it, meaning)\n";
    print_properties(d.properties, [](const Property& p) { return p.is_live ? "live" : "init-only"; });
  }
  for (const TypeDeclaration& type : d.types) {
    std::cout << fmt::format("  type {}: {}\n", type.name, type.meaning);
    print_properties(type.properties, [](const Property&) { return "ctl edit"; });
    for (const CoordinateDeclaration& c : type.coordinates)
      std::cout << fmt::format("    {:<18} {:<14} {:<8} {}\n", c.name, "coordinate", c.unit, c.meaning);
  }
}

Catalog installed_catalog() { return Catalog::installed(installed_worker(), installed_plugins()); }

int list_plugins(bool json) {
  const Catalog catalog = installed_catalog();
  if (json) {
    plugin::v1::Catalog message;
    for (const InstalledPlugin& plugin : catalog.plugins()) {
      plugin::v1::Catalog::Entry* entry = message.add_entries();
      entry->set_library(plugin.library);
      *entry->mutable_description() = host::to_message(plugin.declaration);
    }
    std::cout << to_json(message, JsonForm::kPage);
  } else {
    std::cout << fmt::format("{:<12} {:<20} {:<8} {:<34} {}\n", "slot", "plugin", "version", "types", "meaning");
    for (const InstalledPlugin& plugin : catalog.plugins()) {
      const PluginDeclaration& d = plugin.declaration;
      std::string types;
      for (const TypeDeclaration& type : d.types) types += (types.empty() ? "" : " ") + type.name;
      std::cout << fmt::format("{:<12} {:<20} {:<8} {:<34} {}\n", slot_name(d.slot), d.name, d.version, types,
                               d.meaning);
    }
  }
  for (const BrokenLibrary& broken : catalog.broken()) {
    const bool is_named = broken.problem.find(broken.library) != std::string::npos;
    std::cerr << (is_named ? "" : "'" + broken.library + "': ") << broken.problem << '\n';
  }
  return kDone;
}

int describe(const std::string& name, bool json) {
  Catalog catalog = installed_catalog();
  std::vector<InstalledPlugin> found;
  std::string problem;
  if (name.find_first_of("/ ") != std::string::npos || name.ends_with(".so")) {
    const check::Examinee examinee = check::find_examinee(name);
    const InstalledPlugin* plugin = examinee.is_command() ? catalog.add_command(examinee.command, &problem)
                                                          : catalog.add_library(examinee.library, &problem);
    if (plugin != nullptr) found.push_back(*plugin);
    problem = fmt::format("'{}': {}", name, problem);
  } else {
    // names are unique inside a slot only; a type's name stands for the plugin that serves it
    for (const InstalledPlugin& plugin : catalog.plugins())
      if (plugin.declaration.name == name || find_type(plugin.declaration, name) != nullptr) found.push_back(plugin);
    if (found.empty()) {
      std::vector<std::string> names;
      for (const InstalledPlugin& plugin : catalog.plugins()) names.push_back(plugin.declaration.name);
      const std::string nearest = nearest_name(name, names);
      problem =
          fmt::format("there is no plugin '{}'{} installed: {}", name,
                      nearest.empty() ? ";" : fmt::format(": did you mean '{}'?", nearest), fmt::join(names, " "));
    }
  }
  if (found.empty()) throw BadInput(problem);
  if (!json) {
    for (const InstalledPlugin& plugin : found) print_declaration(plugin);
    return kDone;
  }
  // several make a list
  std::vector<std::string> pages;
  for (const InstalledPlugin& plugin : found)
    pages.push_back(to_json(host::to_message(plugin.declaration), JsonForm::kPage));
  std::cout << (pages.size() == 1 ? pages[0] : fmt::format("[{}]\n", fmt::join(pages, ",\n")));
  return kDone;
}

struct PluginsArguments {
  std::string name;
  bool json = false;
  bool reference = false;
};

}  // namespace

void add_plugins(CLI::App* app, Action* action) {
  const auto arguments = std::make_shared<PluginsArguments>();
  CLI::App* command = app->add_subcommand("plugins", "List the installed plugins");
  command->footer("Example: gravitas plugins --json");
  command->add_flag("--json", arguments->json, "Print JSON");
  command->callback([=] { *action = [=] { return list_plugins(arguments->json); }; });
}

void add_describe(CLI::App* app, Action* action) {
  const auto arguments = std::make_shared<PluginsArguments>();
  CLI::App* command = app->add_subcommand("describe", "A plugin's kind, version, capabilities and properties");
  command->footer(
      "Example: gravitas describe Sequential\n"
      "         gravitas describe 'python3 my_worker.py'");
  CLI::Option* reference = command->add_flag("--reference", arguments->reference,
                                             "Print the reference page of the scene language instead (Markdown)");
  command
      ->add_option("PLUGIN", arguments->name,
                   "Name of a plugin or of a type it serves, path of a library, or a command that starts a worker")
      ->excludes(reference);
  command->add_flag("--json", arguments->json, "Print JSON");
  command->callback([=] {
    if (arguments->name.empty() && !arguments->reference) throw CLI::RequiredError("PLUGIN or --reference");
    *action = [=] {
      if (!arguments->reference) return describe(arguments->name, arguments->json);
      std::cout << scene::reference_page(installed_catalog());
      return static_cast<int>(kDone);
    };
  });
}

}  // namespace gravitas::cli
