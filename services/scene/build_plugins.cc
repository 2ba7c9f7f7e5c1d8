#include "services/scene/build_plugins.h"

#include <algorithm>
#include <filesystem>

#include "plugin_sdk/channel/address.h"
#include "plugin_sdk/shell_word.h"

namespace gravitas::scene {
namespace {

using v1::Plugin;

constexpr const char* kDefaultCollision = "Standard";

// Precondition: one of the choices of the grammar.
Slot slot_of(const std::string& name) {
  for (const Slot slot : {Slot::kSpace, Slot::kCollision, Slot::kConstraint, Slot::kForce, Slot::kSolver})
    if (name == slot_name(slot)) return slot;
  return Slot::kIntegrator;
}

bool is_list(Slot slot) { return slot == Slot::kForce || slot == Slot::kConstraint; }

// The block of the environment that names the slot's plugin.
const char* naming_block(Slot slot) {
  if (slot == Slot::kSpace) return "Space";
  return slot == Slot::kSolver ? "ConstraintSolver" : "KineticIntegrator";
}

std::string quoted(const std::string& name) { return '"' + name + '"'; }

// The command as one that runs in the folder.
std::string in_folder(const std::filesystem::path& folder, const std::string& command) {
  if (folder.empty()) return command;
  return "env -C " + shell_word(std::filesystem::absolute(folder).string()) + " " + command;
}

}  // namespace

PluginSelection::PluginSelection(BuildContext* context) : context_(*context) {
  for (const Plugin& message : context_.scene.plugins().plugin()) read_block(message);
  for (const Plugin& message : context_.scene.plugins().plugin()) read_hosting(message);
}

// ---- the Plugins blocks
// ------------------------------------------------------------------------------------------

void PluginSelection::read_block(const Plugin& message) {
  const Slot slot = slot_of(message.slot());
  std::vector<Block>& of_slot = blocks(slot);
  const bool has_name = is_written(message, Plugin::kNameFieldNumber);
  const bool has_settings = message.custom_properties().property_size() > 0;
  if (!of_slot.empty() && !is_list(slot)) {
    context_.diagnostics->error(place_of(message, Plugin::kSlotFieldNumber),
                                "the slot " + quoted(message.slot()) + " has a Plugin already, at " +
                                    context_.diagnostics->place_text(place_of(of_slot[0].message->location())) +
                                    "; allowed: one");
    return;
  }
  if ((has_name || has_settings) && !is_list(slot) && slot != Slot::kCollision) {
    context_.diagnostics->error(
        has_name ? place_of(message, Plugin::kNameFieldNumber) : place_of(message.custom_properties().location()),
        std::string(has_name ? "Name" : "CustomProperties") + " of the slot " + quoted(message.slot()) +
            " stands elsewhere; allowed: in " + naming_block(slot) + " { … }");
  }
  if (has_settings && is_list(slot) && !has_name && !is_written(message, Plugin::kLibraryFieldNumber)) {
    context_.diagnostics->error(place_of(message.custom_properties().location()),
                                "CustomProperties of an unnamed plugin; required: Name or Library, since the slot " +
                                    quoted(message.slot()) + " may hold several");
  }
  if (is_list(slot) && !has_name && is_written(message, Plugin::kFallbackFieldNumber) &&
      !is_written(message, Plugin::kLibraryFieldNumber) && !is_written(message, Plugin::kCommandFieldNumber)) {
    context_.diagnostics->error(place_of(message, Plugin::kFallbackFieldNumber),
                                "Fallback of an unnamed plugin; required: Name, Library or Command, since the slot " +
                                    quoted(message.slot()) + " may hold several");
  }
  if (is_list(slot) && !has_name && is_written(message, Plugin::kAddressFieldNumber) &&
      !is_written(message, Plugin::kLibraryFieldNumber)) {
    context_.diagnostics->error(place_of(message, Plugin::kAddressFieldNumber),
                                "Address of an unnamed plugin; required: Name or Library, since the slot " +
                                    quoted(message.slot()) + " may hold several");
  }
  read_process(slot, message);
  check_place(message);
  of_slot.push_back({&message, nullptr, false});
  read_library(slot, &of_slot.back());
}

void PluginSelection::read_process(Slot slot, const Plugin& message) {
  const std::string& process = context_.description.slot(slot).process;
  if (message.process().empty()) return;
  if (!process.empty() && process != message.process())
    context_.diagnostics->error(place_of(message, Plugin::kProcessFieldNumber),
                                "Process " + quoted(message.process()) + " differs from " + quoted(process) +
                                    "; allowed: one for the whole slot " + quoted(message.slot()));
  context_.description.slot(slot).process = message.process();
}

// The plugins of a list slot, and slots that share a process, have one place and one deadline, in whichever of their
// blocks it stands.
void PluginSelection::read_hosting(const Plugin& message) {
  const Slot slot = slot_of(message.slot());
  kernel::SlotDescription& description = context_.description.slot(slot);
  const std::string& process = description.process;
  bool is_before = true;
  for (const Plugin& other : context_.scene.plugins().plugin()) {
    is_before &= &other != &message;
    const bool is_here = other.slot() == message.slot();
    const bool shares = !process.empty() && process == context_.description.slot(slot_of(other.slot())).process;
    if (!is_here && !shares) continue;
    if (is_before)
      check_alike(message, other, is_here ? "slot " + quoted(message.slot()) : "process " + quoted(process));
    if (other.hosting() == "direct") description.hosting = kernel::Hosting::kDirect;
    if (other.hosting() == "shm") description.hosting = kernel::Hosting::kSharedMemory;
    if (other.hosting() == "grpc") description.hosting = kernel::Hosting::kGrpc;
    if (is_written(other, Plugin::kDeadlineFieldNumber)) description.deadline = other.deadline();
    // where it is not written it has the default
    if (is_written(other, Plugin::kStandbyFieldNumber)) description.standbys = other.standby();
    if (is_written(other, Plugin::kFailuresFieldNumber)) description.failures = other.failures();
  }
  if (message.hosting() == "direct" && !process.empty())
    context_.diagnostics->error(
        place_of(message, Plugin::kHostingFieldNumber),
        "Hosting \"direct\" of a slot with the Process " + quoted(process) + "; allowed: \"shm\", \"grpc\"");
}

void PluginSelection::check_alike(const Plugin& message, const Plugin& other, const std::string& whole) const {
  const auto differ = [&](int field, const char* name, bool differs) {
    if (differs)
      context_.diagnostics->error(place_of(message, field),
                                  std::string(name) + " differs from that at " +
                                      context_.diagnostics->place_text(place_of(other.location())) +
                                      "; allowed: one for the whole " + whole);
  };
  const auto both_write = [&](int field) { return is_written(message, field) && is_written(other, field); };
  differ(Plugin::kHostingFieldNumber, "Hosting",
         both_write(Plugin::kHostingFieldNumber) && other.hosting() != message.hosting());
  differ(Plugin::kDeadlineFieldNumber, "Deadline",
         both_write(Plugin::kDeadlineFieldNumber) && other.deadline() != message.deadline());
  differ(Plugin::kStandbyFieldNumber, "Standby",
         both_write(Plugin::kStandbyFieldNumber) && other.standby() != message.standby());
  differ(Plugin::kFailuresFieldNumber, "Failures",
         both_write(Plugin::kFailuresFieldNumber) && other.failures() != message.failures());
}

void PluginSelection::check_place(const Plugin& message) const {
  const bool has_command = is_written(message, Plugin::kCommandFieldNumber);
  const bool has_address = is_written(message, Plugin::kAddressFieldNumber);
  if (!has_command && !has_address) return;
  const std::string name = has_command ? "Command" : "Address";
  const auto error = [&](int field, const std::string& what) {
    context_.diagnostics->error(place_of(message, field), what);
  };
  if (has_command && has_address) error(Plugin::kAddressFieldNumber, "Address beside Command; allowed: one of them");
  if (has_command && is_written(message, Plugin::kLibraryFieldNumber))
    error(Plugin::kLibraryFieldNumber, "Library beside Command; allowed: one of them");
  if (is_written(message, Plugin::kProcessFieldNumber))
    error(Plugin::kProcessFieldNumber,
          "Process beside " + name + ", which is a worker of its own; allowed: one of them");
  if (is_written(message, Plugin::kHostingFieldNumber) && message.hosting() != "grpc")
    error(Plugin::kHostingFieldNumber,
          name + " is reached by gRPC, not by Hosting " + quoted(message.hosting()) + "; allowed: \"grpc\"");
  if (has_address && !channel::is_local_address(message.address()))
    error(Plugin::kAddressFieldNumber,
          "Address " + quoted(message.address()) +
              " is not of this machine; allowed, since the connection is not encrypted: 127.0.0.1:PORT, [::1]:PORT, "
              "unix:PATH");
}

void PluginSelection::read_library(Slot slot, Block* block) {
  const bool is_command = is_written(*block->message, Plugin::kCommandFieldNumber);
  if (!is_command && !is_written(*block->message, Plugin::kLibraryFieldNumber)) return;
  const TextPosition place =
      place_of(*block->message, is_command ? Plugin::kCommandFieldNumber : Plugin::kLibraryFieldNumber);
  const std::string& file = context_.scene.files(static_cast<int>(place.file));
  const std::filesystem::path folder =
      file.starts_with("--set ") ? std::filesystem::path() : std::filesystem::path(file).parent_path();
  const std::string written = is_command ? block->message->command() : block->message->library();
  std::string problem;
  block->library = is_command ? context_.catalog->add_command(in_folder(folder, written), &problem)
                              : context_.catalog->add_library((folder / written).string(), &problem);
  const std::string what = (is_command ? "Command " : "Library ") + quoted(written);
  if (block->library == nullptr) {
    context_.diagnostics->error(place, what + " cannot be used: " + problem +
                                           (is_command ? "; allowed: a command that starts a worker of one plugin and "
                                                         "knows --describe and --listen"
                                                       : "; allowed: the path of a plugin library, from the folder of "
                                                         "this file"));
  } else if (block->library->declaration.slot != slot) {
    context_.diagnostics->error(place, what + " is a plugin for the slot \"" +
                                           slot_name(block->library->declaration.slot) + "\", not " +
                                           quoted(block->message->slot()));
    block->library = nullptr;
  } else if (is_written(*block->message, Plugin::kNameFieldNumber) &&
             block->message->name() != block->library->declaration.name) {
    context_.diagnostics->error(place_of(*block->message, Plugin::kNameFieldNumber),
                                "Name is " + quoted(block->message->name()) + "; the plugin there is " +
                                    quoted(block->library->declaration.name));
  }
}

// ---- slots with one plugin
// ---------------------------------------------------------------------------------------

void PluginSelection::missing(Slot slot, const std::string& name, const TextPosition& position) {
  if (lacks_library(slot)) return;
  context_.diagnostics->error(
      position, std::string("no ") + slot_name(slot) + " plugin " + quoted(name) + " is installed; " +
                    allowed_names(name, context_.catalog->plugin_names(slot)) + context_.catalog->broken_text());
}

void PluginSelection::ambiguous(Slot slot, const std::string& what, const std::vector<const InstalledPlugin*>& found,
                                const TextPosition& position) {
  std::string files;
  for (const InstalledPlugin* plugin : found)
    files += (files.empty() ? "" : ", ") + quoted(plugin->declaration.name) + " (" + plugin->library + ')';
  const bool names_differ = found[0]->declaration.name != found[1]->declaration.name;
  context_.diagnostics->error(position,
                              std::to_string(found.size()) + " installed plugins " + what + ": " + files +
                                  "; required: which of them, as Plugins { Plugin { Slot = " + quoted(slot_name(slot)) +
                                  (names_differ ? " Name = …" : " Library = …") + " } }");
}

bool PluginSelection::lacks_library(Slot slot) {
  return std::ranges::any_of(blocks(slot), [](const Block& block) {
    return block.library == nullptr && (is_written(*block.message, Plugin::kLibraryFieldNumber) ||
                                        is_written(*block.message, Plugin::kCommandFieldNumber));
  });
}

const InstalledPlugin* PluginSelection::find_named(Slot slot, const std::string& name, const TextPosition& position) {
  const InstalledPlugin* plugin = context_.catalog->find_plugin(slot, name);
  if (plugin == nullptr) {
    missing(slot, name, position);
    return nullptr;
  }
  const std::vector<const InstalledPlugin*> namesakes = context_.catalog->installed_as(slot, name);
  if (!context_.catalog->is_of_folder(plugin) || namesakes.size() == 1) return plugin;
  ambiguous(slot, "of slot " + std::string(slot_name(slot)) + " are called " + quoted(name), namesakes, position);
  return nullptr;
}

void PluginSelection::choose_named(Slot slot, const std::string& name, bool is_named, const TextPosition& name_place,
                                   const TextPosition& block_place, const v1::Properties& settings, bool is_needed) {
  const InstalledPlugin* library = blocks(slot).empty() ? nullptr : blocks(slot)[0].library;
  // a library that the scene brings along is meant to be used, unless the scene names another
  // plugin
  const bool is_brought = library != nullptr && !is_named;
  if (!is_brought && !is_named && !is_needed && context_.catalog->find_plugin(slot, name) == nullptr) return;
  const InstalledPlugin* plugin = is_brought ? library : find_named(slot, name, name_place);
  if (plugin == nullptr) return;
  if (plugin == library) blocks(slot)[0].is_used = true;
  add_choice(*plugin, &settings, block_place);
}

const InstalledPlugin* PluginSelection::default_collision() const {
  const InstalledPlugin* standard = context_.catalog->find_plugin(Slot::kCollision, kDefaultCollision);
  if (standard != nullptr) return standard;
  const std::vector<std::string> names = context_.catalog->plugin_names(Slot::kCollision);
  return names.size() == 1 ? context_.catalog->find_plugin(Slot::kCollision, names[0]) : nullptr;
}

const InstalledPlugin* PluginSelection::choose_collision(bool is_needed) {
  Block* block = blocks(Slot::kCollision).empty() ? nullptr : blocks(Slot::kCollision).data();
  const bool is_named = block != nullptr && is_written(*block->message, Plugin::kNameFieldNumber);
  const TextPosition position =
      is_named ? place_of(*block->message, Plugin::kNameFieldNumber) : place_of(context_.environment.location());
  const InstalledPlugin* plugin = block != nullptr && !is_named ? block->library : nullptr;
  if (block != nullptr) block->is_used = true;
  if (plugin == nullptr) {
    const InstalledPlugin* standard = is_named ? nullptr : default_collision();
    if (!is_named && !is_needed && standard == nullptr) return nullptr;
    const std::string name = is_named              ? block->message->name()
                             : standard != nullptr ? standard->declaration.name
                                                   : kDefaultCollision;
    plugin = find_named(Slot::kCollision, name, position);
  }
  if (plugin == nullptr) return nullptr;
  add_choice(*plugin, nullptr, place_of(context_.environment.location()));
  return plugin;
}

// ---- slots with a list
// -------------------------------------------------------------------------------------------

// That of a Library goes before what is installed; of what is installed, the one that a block names.
const InstalledPlugin* PluginSelection::find_server(Slot slot, const std::string& type, const TextPosition& position) {
  const InstalledPlugin* plugin = context_.catalog->find_type(slot, type);
  if (plugin == nullptr) {
    if (!lacks_library(slot))
      context_.diagnostics->error(
          position, std::string("no installed ") + slot_name(slot) + " plugin knows the type " + quoted(type) + "; " +
                        allowed_names(type, context_.catalog->type_names(slot)) + context_.catalog->broken_text());
    return nullptr;
  }
  std::vector<const InstalledPlugin*> servers = context_.catalog->installed_for(slot, type);
  if (!context_.catalog->is_of_folder(plugin) || servers.size() == 1) return plugin;
  std::vector<const InstalledPlugin*> named;
  for (const InstalledPlugin* server : servers)
    if (std::ranges::any_of(blocks(slot),
                            [&](const Block& block) { return block.message->name() == server->declaration.name; }))
      named.push_back(server);
  if (named.size() == 1) return named[0];
  ambiguous(slot, "serve the " + std::string(slot_name(slot)) + " type " + quoted(type),
            named.empty() ? servers : named, position);
  return nullptr;
}

std::uint32_t PluginSelection::serve(Slot slot, const std::string& type, const TextPosition& position,
                                     const TypeDeclaration** declaration) {
  const InstalledPlugin* plugin = find_server(slot, type, position);
  if (plugin == nullptr) return kNone;
  *declaration = find_type(plugin->declaration, type);
  const std::size_t next = context_.description.slot(slot).plugins.size();
  const auto [row, is_new] =
      rows_.try_emplace({slot, plugin->library + plugin->command}, static_cast<std::uint32_t>(next));
  if (is_new) {
    for (Block& block : blocks(slot))
      if (block.library == plugin) block.is_used = true;
    add_choice(*plugin, nullptr, position);
  }
  return row->second;
}

// ---- both
// --------------------------------------------------------------------------------------------------------

void PluginSelection::add_choice(const InstalledPlugin& plugin, const v1::Properties* settings,
                                 const TextPosition& position) {
  const Slot slot = plugin.declaration.slot;
  TextPosition place = position;
  for (Block& block : blocks(slot)) {
    const bool is_meant = block.library == &plugin || block.message->name() == plugin.declaration.name ||
                          (slot == Slot::kCollision && block.library == nullptr);
    if (settings != nullptr || !is_meant) continue;
    settings = &block.message->custom_properties();
    place = place_of(block.message->location());
    block.is_used = true;
  }
  kernel::PluginChoice choice{plugin.declaration, plugin.library, {}, plugin.command};
  for (const Block& block : blocks(slot))
    if (is_written(*block.message, Plugin::kAddressFieldNumber) &&
        (block.library == &plugin || block.message->name() == plugin.declaration.name || !is_list(slot)))
      choice.address = block.message->address();
  const std::string what = std::string(slot_name(slot)) + " plugin " + quoted(plugin.declaration.name);
  context_.flatten_properties(plugin.declaration.properties,
                              settings == nullptr ? v1::Properties::default_instance() : *settings, place, what,
                              &choice.settings);
  for (const Block& block : blocks(slot))
    if (is_written(*block.message, Plugin::kFallbackFieldNumber) &&
        (!is_list(slot) || block.library == &plugin || block.message->name() == plugin.declaration.name))
      choice.fallback = find_fallback(slot, *block.message);
  context_.description.slot(slot).plugins.push_back(std::move(choice));
}

// What takes over when nothing else helps, with its default settings. That it serves the scene's types is judged when
// the environment is made.
std::shared_ptr<const kernel::PluginChoice> PluginSelection::find_fallback(Slot slot, const Plugin& message) {
  const TextPosition place = place_of(message, Plugin::kFallbackFieldNumber);
  const InstalledPlugin* plugin = context_.catalog->find_plugin(slot, message.fallback());
  if (plugin == nullptr) {
    missing(slot, message.fallback(), place);
    return nullptr;
  }
  kernel::PluginChoice choice{plugin->declaration, plugin->library, {}, plugin->command};
  context_.flatten_properties(plugin->declaration.properties, v1::Properties::default_instance(), place,
                              "fallback " + quoted(plugin->declaration.name), &choice.settings);
  return std::make_shared<const kernel::PluginChoice>(std::move(choice));
}

void PluginSelection::report_unused() const {
  for (const auto& [slot, of_slot] : blocks_) {
    for (const Block& block : of_slot) {
      if (block.is_used) continue;
      if (block.library != nullptr) {
        context_.diagnostics->warning(place_of(*block.message, Plugin::kLibraryFieldNumber),
                                      "the plugin " + quoted(block.library->declaration.name) +
                                          " of this Library is not used by anything in the scene");
      } else if (block.message->custom_properties().property_size() > 0) {
        context_.diagnostics->warning(place_of(block.message->custom_properties().location()),
                                      "these CustomProperties are for no plugin that the scene uses");
      }
    }
  }
}

}  // namespace gravitas::scene
