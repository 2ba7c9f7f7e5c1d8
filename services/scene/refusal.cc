#include "services/scene/refusal.h"

#include <algorithm>
#include <cctype>
#include <charconv>
#include <string_view>
#include <tuple>
#include <utility>

#include "plugin_sdk/refused_row.h"
#include "plugin_sdk/slots.h"
#include "services/scene/place.h"

namespace gravitas::scene {
namespace {

constexpr std::string_view kItRefused = "it refused: ";  // kernel/slot.cc

// A refusal about one joint, or about one force on one body.
struct RefusedRow {
  const kernel::ConstraintDescription* joint = nullptr;
  const kernel::ForceDescription* force = nullptr;
  const kernel::BodyDescription* body = nullptr;
  std::string reason;
};

// "KIND ROW: reason": the row, and `text` becomes the reason.
std::optional<std::uint32_t> take_row(std::string_view kind, std::string_view* text) {
  if (!text->starts_with(kind)) return std::nullopt;
  const std::string_view rest = text->substr(kind.size());
  std::uint32_t row = 0;
  const auto [end, error] = std::from_chars(rest.data(), rest.data() + rest.size(), row);
  const std::string_view reason = rest.substr(static_cast<std::size_t>(end - rest.data()));
  if (error != std::errc() || !reason.starts_with(": ")) return std::nullopt;
  *text = reason.substr(2);
  return row;
}

std::uint32_t find_plugin(const kernel::SlotDescription& slot, const std::string& name) {
  const auto found =
      std::ranges::find_if(slot.plugins, [&](const kernel::PluginChoice& one) { return one.declaration.name == name; });
  return static_cast<std::uint32_t>(found - slot.plugins.begin());
}

// "body 3 turns": `Body "Id" turns`, of collision, whose rows of bodies are those of the scene.
std::string name_body(const kernel::EnvironmentDescription& description, const kernel::StageFault& fault) {
  const std::string kind = std::string(kItRefused) + "body ";
  const std::string& text = fault.text();
  std::uint32_t row = 0;
  if (fault.slot != Slot::kCollision || !text.starts_with(kind)) return text;
  const auto [end, error] = std::from_chars(text.data() + kind.size(), text.data() + text.size(), row);
  if (error != std::errc() || row >= description.bodies.size()) return text;
  return std::string(kItRefused) + "Body \"" + description.bodies[row].id + "\"" + end;
}

// Rows count what the plugin serves, in the order of the scene.
std::optional<RefusedRow> find_row(const kernel::EnvironmentDescription& description, const kernel::StageFault& fault) {
  std::string_view text = fault.text();
  if (!text.starts_with(kItRefused)) return std::nullopt;
  text.remove_prefix(kItRefused.size());
  const std::uint32_t plugin = find_plugin(description.slot(fault.slot), fault.plugin);
  if (fault.slot == Slot::kConstraint) {
    std::optional<std::uint32_t> left = take_row(kJointRow, &text);
    if (!left) return std::nullopt;
    for (const kernel::ConstraintDescription& joint : description.constraints)
      if (joint.plugin == plugin && (*left)-- == 0) return RefusedRow{.joint = &joint, .reason = std::string(text)};
  } else if (fault.slot == Slot::kForce) {
    std::optional<std::uint32_t> left = take_row(kApplicationRow, &text);
    if (!left) return std::nullopt;
    for (const kernel::BodyDescription& body : description.bodies)
      for (const std::uint32_t row : body.forces)
        if (const auto& force = description.forces[row]; force.plugin == plugin && (*left)-- == 0)
          return RefusedRow{.force = &force, .body = &body, .reason = std::string(text)};
  }
  return std::nullopt;
}

std::string who(const RefusedRow& row, const std::string& place_of_body = "") {
  if (row.joint != nullptr) return "Constraint \"" + row.joint->id + "\": ";
  return "Force \"" + row.force->id + "\" on Body \"" + row.body->id + "\"" + place_of_body + ": ";
}

// ---- places ------------------------------------------------------------------------------------------

template <typename Blocks>
auto* find_block(const Blocks& blocks, const std::string& id) {
  const auto found = std::ranges::find_if(blocks, [&](const auto& block) { return block.id() == id; });
  return found == blocks.end() ? nullptr : &*found;
}

bool has_word(std::string_view text, std::string_view word) {
  const auto is_part = [](char c) { return std::isalnum(static_cast<unsigned char>(c)) != 0; };
  for (std::size_t at = text.find(word); at != std::string_view::npos; at = text.find(word, at + 1)) {
    const std::size_t end = at + word.size();
    if ((at == 0 || !is_part(text[at - 1])) && (end == text.size() || !is_part(text[end]))) return true;
  }
  return false;
}

// Of what was written last among the properties that the reason names, else of the block.
TextPosition find_named(const v1::Properties& properties, const std::string& reason, const TextPosition& block) {
  const auto order = [](const TextPosition& one) { return std::tuple(one.known(), one.file, one.line, one.column); };
  TextPosition last;
  for (const v1::Property& property : properties.property())
    if (const TextPosition place = place_of(property.location());
        has_word(reason, property.name()) && order(last) < order(place))
      last = place;
  return last.known() ? last : block;
}

SceneError error_at(const v1::Scene& scene, const TextPosition& place, std::string text) {
  Problems problems;
  Diagnostics(scene, &problems).error(place, std::move(text));
  return problems.errors.at(0);
}

template <typename Block>
std::optional<SceneError> at_block(const v1::Scene& scene, const Block* block, const std::string& who,
                                   const std::string& reason) {
  if (block == nullptr) return std::nullopt;
  const TextPosition place = find_named(block->custom_properties(), reason, place_of(block->location()));
  if (!place.known()) return std::nullopt;
  return error_at(scene, place, who + reason);
}

// Where settings of the slot's plugin stand.
std::optional<SceneError> at_settings(const v1::Scene& scene, Slot slot, const std::string& plugin,
                                      const std::string& reason) {
  const v1::Environment& environment = scene.environment(0);
  const std::string who = plugin + ": ";
  if (slot == Slot::kIntegrator) return at_block(scene, &environment.kinetic_integrator(), who, reason);
  if (slot == Slot::kSolver) return at_block(scene, &environment.constraint_solver(), who, reason);
  if (slot == Slot::kSpace) return at_block(scene, &environment.space(), who, reason);
  for (const v1::Plugin& block : scene.plugins().plugin())
    if (block.slot() == slot_name(slot) && (block.name() == plugin || block.name().empty()))
      return at_block(scene, &block, who, reason);
  return std::nullopt;
}

// "NAME: reason" of a plugin that refuses its settings.
std::optional<SceneError> find_settings(const v1::Scene& scene, const kernel::EnvironmentDescription& description,
                                        const std::string& text) {
  for (const Slot slot : kSlots)
    for (const kernel::PluginChoice& plugin : description.slot(slot).plugins)
      if (const std::string who = plugin.declaration.name + ": "; text.starts_with(who))
        return at_settings(scene, slot, plugin.declaration.name, text.substr(who.size()));
  return std::nullopt;
}

}  // namespace

std::string refusal_text(const kernel::EnvironmentDescription& description, const kernel::StageFault& fault) {
  const std::optional<RefusedRow> row = find_row(description, fault);
  return row ? std::string(kItRefused) + who(*row) + row->reason : name_body(description, fault);
}

std::optional<SceneError> find_refused(const v1::Scene& scene, const kernel::EnvironmentDescription& description,
                                       const kernel::StageFault& fault) {
  if (scene.environment_size() == 0) return std::nullopt;
  if (fault.kind == kernel::FaultKind::kHandshake) return find_settings(scene, description, fault.text());
  const std::optional<RefusedRow> row = find_row(description, fault);
  if (!row) return std::nullopt;
  const v1::Environment& environment = scene.environment(0);
  if (row->joint != nullptr)
    return at_block(scene, find_block(environment.constraints().constraint(), row->joint->id), who(*row), row->reason);
  std::string place_of_body;
  Problems problems;
  if (const auto* body = find_block(environment.space().bodies().body(), row->body->id))
    place_of_body = " (" + Diagnostics(scene, &problems).place_text(place_of(body->location())) + ")";
  return at_block(scene, find_block(scene.forces().force(), row->force->id), who(*row, place_of_body), row->reason);
}

std::optional<SceneError> find_refused(const v1::Scene& scene, const std::string& why) {
  if (!why.starts_with("the simulator ")) return std::nullopt;
  return error_at(scene, place_of(scene.simulator(), v1::Simulator::kTypeFieldNumber), why);
}

}  // namespace gravitas::scene
