#include "services/scene/overrides.h"

#include <algorithm>
#include <string>
#include <utility>
#include <vector>

#include "plugin_sdk/near_miss.h"
#include "services/scene/assign.h"
#include "services/scene/grammar.h"
#include "services/scene/parser.h"

namespace gravitas::scene {
namespace {

namespace pb = google::protobuf;

struct Refused {
  std::size_t offset;  // in the text, bytes
  std::string text;
};

// Words that a path begins with.
const std::vector<std::string> kRoots = {"Integrator", "Solver",      "Space",          "Collision", "Simulator",
                                         "Body",       "Geometry",    "Constraint",     "Force",     "Material",
                                         "Plugin",     "Environment", "CollisionFilter"};

bool is_space_or_tab(char c) { return c == ' ' || c == '\t'; }

// A part of the override and where it begins.
struct Part {
  std::string_view text;
  std::size_t offset = 0;

  Part from(std::size_t begin) const { return {text.substr(begin), offset + begin}; }
  Part until(std::size_t end) const { return {text.substr(0, end), offset}; }
};

Part trimmed(Part part) {
  while (!part.text.empty() && is_space_or_tab(part.text.front())) part = part.from(1);
  while (!part.text.empty() && is_space_or_tab(part.text.back())) part = part.until(part.text.size() - 1);
  return part;
}

class Override {
 public:
  Override(v1::Scene* scene, std::string_view text, std::uint32_t file, Diagnostics* diagnostics)
      : scene_(scene), text_(text), file_(file), diagnostics_(diagnostics) {}

  // Of a byte of the text.
  TextPosition position(std::size_t offset) const {
    std::uint32_t column = 1;
    for (const char c : text_.substr(0, offset)) column += (static_cast<unsigned char>(c) & 0xC0U) != 0x80U;
    return {file_, 1, column};
  }

  void apply() {
    const std::size_t equals = text_.find('=');
    if (equals == std::string_view::npos) throw Refused{0, "there is no \"=\"; allowed: PATH=VALUE"};
    const Part path = trimmed({text_.substr(0, equals), 0});
    value_ = trimmed({text_.substr(equals + 1), equals + 1});
    if (path.text.empty()) throw Refused{0, "the path is empty; allowed: PATH=VALUE"};
    if (value_.text.empty()) throw Refused{value_.offset, "the value is empty; allowed: a value, \"\" for no text"};
    const std::size_t dot = path.text.find('.');
    const Part root = path.until(std::min(dot, path.text.size()));
    const Part rest = dot == std::string_view::npos ? path.from(path.text.size()) : path.from(dot + 1);
    if (dot != std::string_view::npos && rest.text.empty())
      throw Refused{rest.offset, "the path ends with a dot; allowed: PATH=VALUE"};
    apply_at(root, rest);
  }

 private:
  // ---- the block that the path begins with

  void apply_at(const Part& root, const Part& rest) {
    const std::string_view word = root.text;
    if (word == "Simulator") return component(scene_->mutable_simulator(), "Type", rest);
    if (word == "Space") return component(environment(root)->mutable_space(), "Type", rest);
    if (word == "Integrator" || word == "KineticIntegrator")
      return component(environment(root)->mutable_kinetic_integrator(), "Type", rest);
    if (word == "Solver" || word == "ConstraintSolver")
      return component(environment(root)->mutable_constraint_solver(), "Type", rest);
    if (word == "Collision") return component(plugin({"collision", root.offset}), "Name", rest);
    if (word == "Environment") return property(environment(root), rest, root);
    if (word == "CollisionFilter")
      return property(environment(root),
                      {text_.substr(root.offset, rest.offset + rest.text.size() - root.offset), root.offset}, root);
    if (word == "Plugin") {
      const Part slot = rest.until(std::min(rest.text.find('.'), rest.text.size()));
      return property(plugin(slot), rest.from(std::min(slot.text.size() + 1, rest.text.size())), slot);
    }
    if (word == "Body")
      return with_id(environment(root)->mutable_space()->mutable_bodies()->mutable_body(), root, rest);
    if (word == "Constraint")
      return with_id(environment(root)->mutable_constraints()->mutable_constraint(), root, rest);
    if (word == "Geometry") return with_id(scene_->mutable_geometries()->mutable_geometry(), root, rest);
    if (word == "Material") return with_id(scene_->mutable_materials()->mutable_material(), root, rest);
    if (word == "Force") return with_id(scene_->mutable_forces()->mutable_force(), root, rest);
    const std::string meant = with_its_beginning(std::string(word));
    throw Refused{root.offset,
                  "the path begins with \"" + std::string(word) + "\"; " +
                      (meant.empty() ? allowed_names(word, kRoots)
                                     : "did you mean \"" + meant + "\"? Allowed: " + quoted_names(kRoots))};
  }

  // What a path lacks that begins with a property of the simulator or an id: "Simulator.Duration", "Body.Ball01"; empty: it
  // begins with neither.
  std::string with_its_beginning(const std::string& word) const {
    const auto has_it = [&](const auto& blocks) {
      return std::ranges::any_of(blocks, [&](const auto& block) { return block.id() == word; });
    };
    if (scene_->environment_size() > 0 && has_it(scene_->environment(0).space().bodies().body())) return "Body." + word;
    if (scene_->environment_size() > 0 && has_it(scene_->environment(0).constraints().constraint()))
      return "Constraint." + word;
    if (has_it(scene_->geometries().geometry())) return "Geometry." + word;
    if (has_it(scene_->materials().material())) return "Material." + word;
    if (has_it(scene_->forces().force())) return "Force." + word;
    if (!nearest_name(word, kRoots).empty()) return {};
    const std::string property = nearest_name(word, grammar_of(*v1::SimulatorProperties::descriptor()).names);
    return property.empty() ? "" : "Simulator." + property;
  }

  v1::Environment* environment(const Part& root) {
    if (scene_->environment_size() == 0) throw Refused{root.offset, "the scene has no Environment; add one"};
    return scene_->mutable_environment(0);
  }

  // The entry of a slot in Plugins; made if there is none.
  v1::Plugin* plugin(const Part& slot) {
    v1::Plugins* plugins = scene_->mutable_plugins();
    for (v1::Plugin& plugin : *plugins->mutable_plugin())
      if (plugin.slot() == slot.text) return &plugin;
    const BlockRule& rule = grammar_of(*v1::Plugin::descriptor());
    const Entry& entry = *rule.find("Slot");
    if (std::find(entry.choices.begin(), entry.choices.end(), slot.text) == entry.choices.end())
      throw Refused{slot.offset,
                    "no slot \"" + std::string(slot.text) + "\"; " + allowed_names(slot.text, entry.choices)};
    v1::Plugin* plugin = plugins->add_plugin();
    set_location(position(slot.offset), plugin->mutable_location());
    plugin->set_slot(std::string(slot.text));
    fill_defaults(rule, std::uint64_t{1} << entry.index, plugin, diagnostics_);
    return plugin;
  }

  // `Solver=…` or `Solver.Iterations=…`.
  void component(pb::Message* block, std::string_view name, const Part& rest) {
    property(block, rest.text.empty() ? Part{name, 0} : rest, rest);
  }

  // `Body.Ball01.Position=…`: the longest id that the path begins with.
  template <typename Blocks>
  void with_id(Blocks* blocks, const Part& root, const Part& rest) {
    for (std::size_t end = rest.text.size(); end != std::string_view::npos && end > 0;
         end = rest.text.rfind('.', end - 1)) {
      const Part id = rest.until(end);
      for (auto& block : *blocks)
        if (block.id() == id.text) return property(&block, rest.from(std::min(end + 1, rest.text.size())), id);
    }
    std::vector<std::string> ids;
    for (const auto& block : *blocks) ids.push_back(block.id());
    const std::string_view id = rest.text.substr(0, rest.text.rfind('.'));
    throw Refused{rest.offset,
                  "no " + std::string(root.text) + " \"" + std::string(id) + "\"; " + allowed_names(id, ids)};
  }

  // ---- the property that it ends with

  void property(pb::Message* block, const Part& path, const Part& before) {
    const BlockRule& rule = grammar_of(*block->GetDescriptor());
    if (path.text.empty())
      throw Refused{before.offset,
                    "a property must follow \"" + std::string(before.text) + "\"; " + allowed_names("", rule.names)};
    const Part first = path.until(std::min(path.text.find('.'), path.text.size()));
    const Part rest = path.from(std::min(first.text.size() + 1, path.text.size()));
    const Entry* entry = rule.find(first.text);
    if (entry == nullptr) return indirect(rule, block, path);
    const bool is_single_block = entry->is_block() && !entry->field->is_repeated() && !entry->is_joined;
    if (is_single_block && !rest.text.empty()) {
      if (entry->form == Form::kProperties) return free_property(*entry, block, rest);
      return property(inner(*entry, block), rest, first);
    }
    if (is_single_block && entry->shorthand != nullptr)
      return set(*entry->block, *entry->shorthand, inner(*entry, block));
    if (entry->is_block() || !rest.text.empty())
      throw Refused{first.offset, '"' + std::string(path.text) + "\" is no property; " + allowed_names("", rule.names)};
    set(rule, *entry, block);
  }

  // A name that the block does not have itself: of a block inside it, or of its plugin.
  void indirect(const BlockRule& rule, pb::Message* block, const Part& path) {
    for (const Entry& entry : rule.entries) {
      const bool is_single = entry.form == Form::kBlock && !entry.field->is_repeated() && !entry.is_joined;
      if (!is_single || entry.block->find(path.text) == nullptr) continue;
      if (entry.shorthand == nullptr) return property(inner(entry, block), path, path);
    }
    for (const Entry& entry : rule.entries)
      if (entry.form == Form::kProperties && path.text.find('.') == std::string_view::npos)
        return free_property(entry, block, path);
    std::vector<std::string> names;
    for (const std::string& name : rule.names) {
      const Entry& entry = *rule.find(name);
      if (entry.form == Form::kBlock && !entry.is_joined && !entry.field->is_repeated())
        names.insert(names.end(), entry.block->names.begin(), entry.block->names.end());
      else
        names.push_back(name);
    }
    throw Refused{path.offset, "no property \"" + std::string(path.text) + "\"; " + allowed_names(path.text, names)};
  }

  static pb::Message* inner(const Entry& entry, pb::Message* block) {
    return block->GetReflection()->MutableMessage(block, entry.field);
  }

  void set(const BlockRule& rule, const Entry& entry, pb::Message* block) {
    if (entry.name == "Type" || entry.name == "Name") drop_old_properties(rule, entry, block);
    assign(rule, entry, entry.form == Form::kText ? text_value() : any_value(), block, diagnostics_);
    if (auto* body = pb::DynamicCastToGenerated<v1::Body>(block)) replace_mass(entry.field->number(), body);
  }

  // A body has one of both: the one that is set takes the place of the other. Moments that are written go with a Mass.
  static void replace_mass(int field, v1::Body* body) {
    if (field == v1::Body::kMassFieldNumber) body->clear_mass_density();
    if (field == v1::Body::kMassDensityFieldNumber && body->principal_moments_size() == 0) body->clear_mass();
  }

  void free_property(const Entry& entry, pb::Message* block, const Part& name) {
    auto* properties = static_cast<v1::Properties*>(inner(entry, block));
    if (properties->location().line() == 0) set_location(position(name.offset), properties->mutable_location());
    assign_property(name.text, position(name.offset), any_value(), properties);
  }

  // Another type has other properties.
  void drop_old_properties(const BlockRule& rule, const Entry& type, pb::Message* block) {
    const std::string old = block->GetReflection()->GetString(*block, type.field);
    if (old == text_value().text) return;
    for (const Entry& entry : rule.entries) {
      if (entry.form != Form::kProperties) continue;
      auto* properties = static_cast<v1::Properties*>(inner(entry, block));
      if (properties->property_size() == 0) continue;
      diagnostics_->warning(position(value_.offset), "the " + entry.name + " written for \"" + old + "\" are dropped");
      properties->clear_property();
    }
  }

  // ---- the value

  PropertyValue text_value() const {
    if (value_.text.starts_with('"')) return any_value();
    PropertyValue value = PropertyValue::of(std::string(value_.text));
    value.position = position(value_.offset);
    return value;
  }

  PropertyValue any_value() const {
    constexpr std::string_view kValueStarts = "\"{+-.0123456789";
    const bool is_word = kValueStarts.find(value_.text.front()) == std::string_view::npos;
    if (is_word && value_.text != "true" && value_.text != "false") {
      PropertyValue value = PropertyValue::of(std::string(value_.text));
      value.position = position(value_.offset);
      return value;
    }
    try {
      Parser parser(value_.text, file_, Parser::Words::kBare);
      PropertyValue value = parser.value(0);
      if (parser.current().kind != TokenKind::kEnd)
        throw SyntaxError{parser.current().position,
                          "after the value comes " + shown(parser.current()) + "; allowed: one value"};
      shift(position(value_.offset).column - 1, &value);
      return value;
    } catch (SyntaxError& error) {
      error.position.column += position(value_.offset).column - 1;
      throw;
    }
  }

  static void shift(std::uint32_t columns, PropertyValue* value) {
    value->position.column += columns;
    for (PropertyValue& element : value->list) shift(columns, &element);
  }

  v1::Scene* scene_;
  std::string_view text_;
  std::uint32_t file_;
  Diagnostics* diagnostics_;
  Part value_;
};

}  // namespace

bool apply_override(v1::Scene* scene, std::string_view override_text, Problems* problems, std::string_view name) {
  const auto file = static_cast<std::uint32_t>(scene->files_size());
  scene->add_files(name.empty() ? "--set " + std::string(override_text) : std::string(name));
  Diagnostics diagnostics(*scene, problems);
  Override override_of_scene(scene, override_text, file, &diagnostics);
  try {
    override_of_scene.apply();
  } catch (const Refused& refused) {
    diagnostics.error(override_of_scene.position(refused.offset), refused.text);
  } catch (const SyntaxError& error) {
    diagnostics.error(error.position, error.text);
  }
  return diagnostics.ok();
}

}  // namespace gravitas::scene
