// Which plugins an environment needs, with their settings, and where they run.
#pragma once

#include <map>
#include <string>
#include <vector>

#include "services/scene/build_context.h"

namespace gravitas::scene {

class PluginSelection {
 public:
  // Reads the Plugins blocks: hosting and deadlines of the slots, and libraries, which go into the
  // catalogue.
  explicit PluginSelection(BuildContext* context);

  // Chooses the plugin of the slot that a block of the environment names, unless nothing needs it
  // and it is not installed. `Block` is Space or Component.
  template <typename Block>
  void choose(Slot slot, const Block& block, bool is_needed) {
    choose_named(slot, block.type(), is_written(block, Block::kTypeFieldNumber),
                 place_of(block, Block::kTypeFieldNumber), place_of(block.location()), block.custom_properties(),
                 is_needed);
  }

  // Chooses the collision plugin; null if there is none.
  const InstalledPlugin* choose_collision(bool is_needed);

  // The row, in a list slot, of the plugin that serves a type; kNone after an error. Rows are in
  // the order of their first use. *declaration is that of the type.
  std::uint32_t serve(Slot slot, const std::string& type, const TextPosition& position,
                      const TypeDeclaration** declaration);

  // Says which parts of the Plugins blocks were of no use. Call it last.
  void report_unused() const;

 private:
  struct Block {
    const v1::Plugin* message = nullptr;
    const InstalledPlugin* library = nullptr;  // of its Library or Command
    bool is_used = false;
  };

  void read_block(const v1::Plugin& message);
  void read_process(Slot slot, const v1::Plugin& message);
  void read_hosting(const v1::Plugin& message);
  void check_alike(const v1::Plugin& message, const v1::Plugin& other, const std::string& whole) const;
  void check_place(const v1::Plugin& message) const;
  void read_library(Slot slot, Block* block);
  void choose_named(Slot slot, const std::string& name, bool is_named, const TextPosition& name_place,
                    const TextPosition& block_place, const v1::Properties& settings, bool is_needed);
  const InstalledPlugin* default_collision() const;
  // The plugin of a name, or that serves a type, and null after an error.
  const InstalledPlugin* find_named(Slot slot, const std::string& name, const TextPosition& position);
  const InstalledPlugin* find_server(Slot slot, const std::string& type, const TextPosition& position);
  void missing(Slot slot, const std::string& name, const TextPosition& position);
  void ambiguous(Slot slot, const std::string& what, const std::vector<const InstalledPlugin*>& found,
                 const TextPosition& position);
  // A Library or Command of the slot's blocks could not be used, which an error says.
  bool lacks_library(Slot slot);
  // Appends the plugin to its slot. `settings` may be null: then they are looked up in the Plugins
  // blocks.
  void add_choice(const InstalledPlugin& plugin, const v1::Properties* settings, const TextPosition& position);
  std::shared_ptr<const kernel::PluginChoice> find_fallback(Slot slot, const v1::Plugin& message);
  std::vector<Block>& blocks(Slot slot) { return blocks_[slot]; }

  BuildContext& context_;
  std::map<Slot, std::vector<Block>> blocks_;
  std::map<std::pair<Slot, std::string>, std::uint32_t> rows_;  // of list slots, by plugin library
};

}  // namespace gravitas::scene
